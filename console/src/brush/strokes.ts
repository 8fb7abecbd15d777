import type { HemLine, LayerEdits, Point, Stroke } from "../api/types";
import type { ScanGraph } from "./scan_graph";

/** What one gesture made: a stroke, its mirror image, or a hem line. */
export interface Gesture {
  strokes: Stroke[];
  hems: HemLine[];
}

/** The edits of a layer with undo and redo. What was in the file before is the first gesture of each kind. */
export class History {
  private readonly done: Gesture[];
  private readonly undone: Gesture[] = [];

  constructor(file: LayerEdits) {
    this.done = [
      ...file.strokes.map((stroke) => ({ strokes: [stroke], hems: [] })),
      ...file.hems.map((hem) => ({ strokes: [], hems: [hem] })),
    ];
  }

  get canUndo(): boolean {
    return this.done.length > 0;
  }

  get canRedo(): boolean {
    return this.undone.length > 0;
  }

  get gestures(): readonly Gesture[] {
    return this.done;
  }

  add(gesture: Gesture): void {
    this.done.push(gesture);
    this.undone.length = 0;
  }

  undo(): void {
    const last = this.done.pop();
    if (last !== undefined) this.undone.push(last);
  }

  redo(): void {
    const next = this.undone.pop();
    if (next !== undefined) this.done.push(next);
  }

  /** Takes all away as one step each, so that undo brings them back one by one. */
  clear(): void {
    while (this.done.length > 0) this.undo();
  }

  /** The file: strokes in their order, then hem lines, as the command line reads it. */
  file(): LayerEdits {
    return { version: 1, strokes: this.done.flatMap((g) => g.strokes), hems: this.done.flatMap((g) => g.hems) };
  }
}

/** Least radius of a stroke in the file, metres. */
const LEAST_RADIUS = 0.002;
const LARGEST_RADIUS = 0.2;

export function clampRadius(radius: number): number {
  return Math.min(LARGEST_RADIUS, Math.max(LEAST_RADIUS, radius));
}

/** Square of the distance of a place from the segment between two points. */
function squareFrom(x: number, y: number, z: number, a: Point, b: Point): number {
  const [ux, uy, uz] = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
  const [vx, vy, vz] = [x - a[0], y - a[1], z - a[2]];
  const square = ux * ux + uy * uy + uz * uz;
  const t = square === 0 ? 0 : Math.min(1, Math.max(0, (vx * ux + vy * uy + vz * uz) / square));
  return (vx - t * ux) ** 2 + (vy - t * uy) ** 2 + (vz - t * uz) ** 2;
}

/** All vertices that a stroke touches as the program reads it: within the radius of the path, straight through the air. */
export function touched(graph: ScanGraph, { points, radius }: Stroke): number[] {
  const low = [0, 1, 2].map((k) => Math.min(...points.map((p) => p[k])) - radius);
  const high = [0, 1, 2].map((k) => Math.max(...points.map((p) => p[k])) + radius);
  const out: number[] = [];
  const limit = radius * radius;
  for (let v = 0; v < graph.count; v += 1) {
    const [x, y, z] = [graph.positions[3 * v], graph.positions[3 * v + 1], graph.positions[3 * v + 2]];
    if (x < low[0] || x > high[0] || y < low[1] || y > high[1] || z < low[2] || z > high[2]) continue;
    const near = points.some((point, k) => squareFrom(x, y, z, points[Math.max(0, k - 1)], point) <= limit);
    if (near) out.push(v);
  }
  return out;
}

/** A few vertices under a fold or a hem's step are no other part of the body; every stroke costs the program a rebuild of its labels. */
const LEDGE_SHARE = 0.1;

/**
 * The strokes that mark a region of the surface and nothing else. The file's brush is a ball: where it reaches another part of the
 * body through the air, such as the trunk from the arm, the stroke is written as dabs that stay on the region.
 */
export function strokesFor(graph: ScanGraph, region: ReadonlyMap<number, number>, stroke: Stroke): Stroke[] {
  const isElsewhere = (v: number) => !region.has(v) && !touchesRegion(graph, region, v);
  if (touched(graph, stroke).filter(isElsewhere).length <= LEDGE_SHARE * region.size) return [stroke];
  // A dab at the rim reaches a third of the radius further.
  const elsewhere = touched(graph, { ...stroke, radius: 1.5 * stroke.radius }).filter(isElsewhere);
  return dabs(graph, region, stroke, elsewhere);
}

/** Vertices of the seam around the region are touched by any ball; they are no other part of the body. */
function touchesRegion(graph: ScanGraph, region: ReadonlyMap<number, number>, vertex: number): boolean {
  const near = [vertex];
  const seen = new Set(near);
  for (let step = 0; step < 3; step += 1) {
    for (const v of [...seen]) {
      for (let k = graph.starts[v]; k < graph.starts[v + 1]; k += 1) {
        if (region.has(graph.neighbors[k])) return true;
        seen.add(graph.neighbors[k]);
      }
    }
  }
  return false;
}

function dabs(graph: ScanGraph, region: ReadonlyMap<number, number>, stroke: Stroke, elsewhere: readonly number[]): Stroke[] {
  const open = new Set(region.keys());
  const out: Stroke[] = [];
  for (const [vertex] of [...region].sort((a, b) => a[1] - b[1] || a[0] - b[0])) {
    if (!open.has(vertex)) continue;
    const p = graph.positions;
    const point: Point = [p[3 * vertex], p[3 * vertex + 1], p[3 * vertex + 2]];
    const room = elsewhere.reduce((least, v) => Math.min(least, graph.distanceTo(v, point)), Infinity);
    const radius = Math.max(LEAST_RADIUS, Math.min(stroke.radius / 3, 0.9 * room));
    out.push({ mark: stroke.mark, points: [point], radius });
    for (const other of [...open]) if (graph.distanceTo(other, point) <= radius) open.delete(other);
    open.delete(vertex);
  }
  return out;
}
