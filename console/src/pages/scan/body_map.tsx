import type { Unseen } from "../../api/types";

/** A figure of 100 by 220 with arms away from the body. */
const FIGURE = "M50 4c8 0 13 6 13 15 0 6-2 10-5 13v5l17 5c5 2 8 5 9 11l12 52-7 4-15-40 1 42 3 46 1 50H66l-9-52-7-26-7 26-9 52H21l1-50 3-46 1-42-15 40-7-4 12-52c1-6 4-9 9-11l17-5v-5c-3-3-5-7-5-13 0-9 5-15 13-15";

interface Cell {
  x: number;
  width: number;
  y: number;
  height: number;
  /** 0 seen, 1 not seen. */
  unseen: number;
}

/** The directions that one side of a figure shows: column 0 is the front, columns go on to the subject's left. */
export function cellsOf(unseen: Unseen, side: "front" | "back"): Cell[] {
  const cells: Cell[] = [];
  const height = 220 / unseen.rows;
  for (let column = 0; column < unseen.columns; column += 1) {
    const ends = [column, column + 1].map((k) => (2 * Math.PI * k) / unseen.columns);
    const isFront = Math.cos((ends[0] + ends[1]) / 2) > 0;
    if (isFront !== (side === "front")) continue;
    // Who faces us has the left side at our right; from behind it is at our left.
    const across = ends.map((angle) => 50 + 50 * Math.sin(angle) * (side === "front" ? 1 : -1));
    const x = Math.min(...across);
    for (let row = 0; row < unseen.rows; row += 1) {
      cells.push({ x, width: Math.abs(across[1] - across[0]), y: row * height, height, unseen: unseen.directions[row * unseen.columns + column] ?? 1 });
    }
  }
  return cells;
}

export function seenShare(unseen: Unseen): number {
  const sum = unseen.directions.reduce((total, value) => total + value, 0);
  return unseen.directions.length === 0 ? 0 : 1 - sum / unseen.directions.length;
}

/** What the cameras have not seen yet, on a figure from the front and from the back. */
export function BodyMap({ unseen }: { unseen: Unseen }) {
  const percent = Math.round(100 * seenShare(unseen));
  return (
    <figure class="body-map" role="img" aria-label={`${percent} percent of the body were seen`}>
      {(["front", "back"] as const).map((side) => (
        <svg key={side} viewBox="0 0 100 236" aria-hidden="true">
          <clipPath id={`figure-${side}`}><path d={FIGURE} /></clipPath>
          <g clip-path={`url(#figure-${side})`}>
            <rect class="map-seen" width="100" height="220" />
            {cellsOf(unseen, side).map((cell, k) => (
              <rect key={k} class="map-unseen" x={cell.x - 0.1} y={cell.y - 0.1} width={cell.width + 0.2} height={cell.height + 0.2} opacity={cell.unseen} />
            ))}
          </g>
          <path class="map-line" d={FIGURE} />
          <text x="50" y="233" text-anchor="middle">{side}</text>
        </svg>
      ))}
      <figcaption>{percent} % seen</figcaption>
    </figure>
  );
}
