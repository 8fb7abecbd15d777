import { BufferAttribute, BufferGeometry } from "three";
import { MeshBVH } from "three-mesh-bvh";
import { describe, expect, it } from "vitest";
import type { Point, Stroke } from "../src/api/types";
import { borderSegments } from "../src/brush/border";
import { edgeStrength, snapped, wayFactor } from "../src/brush/edges";
import { Heap } from "../src/brush/heap";
import { ScanGraph } from "../src/brush/scan_graph";
import { History, strokesFor, touched } from "../src/brush/strokes";
import { Mirror } from "../src/brush/symmetry";
import type { PlyMesh } from "../src/three/ply";

const SIDE = 41;
const STEP = 0.005;

/** Square sheets of 0.2 m, facing +Z, at these depths. */
function sheets(depths: number[], x0 = 0): { positions: Float32Array; triangles: Uint32Array } {
  const positions: number[] = [];
  const triangles: number[] = [];
  for (const [k, z] of depths.entries()) {
    const first = k * SIDE * SIDE;
    for (let j = 0; j < SIDE; j += 1) for (let i = 0; i < SIDE; i += 1) positions.push(x0 + i * STEP, j * STEP, z);
    for (let j = 0; j + 1 < SIDE; j += 1) {
      for (let i = 0; i + 1 < SIDE; i += 1) {
        const v = first + j * SIDE + i;
        triangles.push(v, v + 1, v + SIDE, v + 1, v + SIDE + 1, v + SIDE);
      }
    }
  }
  return { positions: Float32Array.from(positions), triangles: Uint32Array.from(triangles) };
}

const MIDDLE = 20 * SIDE + 20;
const CENTER: Point = [0.1, 0.1, 0];

function graphOf(depths: number[]): ScanGraph {
  const { positions, triangles } = sheets(depths);
  return new ScanGraph(positions, triangles);
}

describe("the brush", () => {
  it("reaches along the surface and not through the air", () => {
    const graph = graphOf([0, 0.01]);
    const region = graph.within(CENTER, [MIDDLE], 0.03);
    expect([...region.keys()].every((v) => v < SIDE * SIDE)).toBe(true);
    const round = [...Array(SIDE * SIDE).keys()].filter((v) => graph.distanceTo(v, CENTER) <= 0.03);
    expect(region.size).toBeGreaterThan(0.93 * round.length);
    expect(region.size).toBeLessThanOrEqual(round.length);
  });

  it("goes round a fold, however near its other side is", () => {
    const { positions, triangles } = sheets([0]);
    // Folded over at the middle column: the halves lie 4 mm apart.
    const folded = positions.map((value, k) => {
      const i = Math.floor(k / 3) % SIDE;
      if (k % 3 === 0) return Math.min(i, SIDE - 1 - i) * STEP;
      return k % 3 === 2 && i > SIDE / 2 ? 0.004 : value;
    });
    const graph = new ScanGraph(folded, triangles);
    const start = 20 * SIDE + 16;
    const region = graph.within([0.08, 0.1, 0], [start], 0.03);
    expect(Math.max(...[...region.keys()].map((v) => v % SIDE))).toBeLessThanOrEqual(23);
  });

  it("is one stroke in the file where the ball touches nothing else", () => {
    const graph = graphOf([0]);
    const stroke: Stroke = { mark: "belongs", points: [CENTER, [0.12, 0.1, 0]], radius: 0.03 };
    const region = new Map([...graph.within(CENTER, [MIDDLE], 0.03), ...graph.within([0.12, 0.1, 0], [MIDDLE + 4], 0.03)]);
    expect(strokesFor(graph, region, stroke)).toEqual([stroke]);
  });

  it("becomes dabs where the ball would touch the sheet behind", () => {
    const graph = graphOf([0, 0.01]);
    const stroke: Stroke = { mark: "belongs", points: [CENTER], radius: 0.03 };
    const region = graph.within(CENTER, [MIDDLE], 0.03);
    const strokes = strokesFor(graph, region, stroke);
    const marked = new Set(strokes.flatMap((s) => touched(graph, s)));
    expect(strokes.length).toBeGreaterThan(1);
    expect([...marked].filter((v) => v >= SIDE * SIDE)).toEqual([]);
    expect([...region.keys()].filter((v) => !marked.has(v))).toEqual([]);
  });

  it("writes strokes and hem lines as the command line reads them, with undo and redo", () => {
    const stroke = (mark: Stroke["mark"]): Stroke => ({ mark, points: [CENTER], radius: 0.02 });
    const history = new History({ version: 1, strokes: [stroke("belongs")], hems: [] });
    history.add({ strokes: [stroke("does-not-belong"), stroke("does-not-belong")], hems: [] });
    history.add({ strokes: [], hems: [{ points: [CENTER, [0.2, 0.1, 0]], reach: 0.02 }] });
    expect(history.file()).toMatchObject({ version: 1, strokes: [{ mark: "belongs" }, { mark: "does-not-belong" }, { mark: "does-not-belong" }], hems: [{ reach: 0.02 }] });
    history.undo();
    history.undo();
    expect(history.file()).toMatchObject({ strokes: [{ mark: "belongs" }], hems: [] });
    history.redo();
    expect(history.file().strokes).toHaveLength(3);
    history.add({ strokes: [stroke("belongs")], hems: [] });
    expect(history.canRedo).toBe(false);
    history.clear();
    expect(history.file()).toEqual({ version: 1, strokes: [], hems: [] });
    expect(history.canRedo).toBe(true);
  });
});

describe("hem lines", () => {
  it("follow an edge in colour where a straight way would leave it", () => {
    const { positions, triangles } = sheets([0]);
    const graph = new ScanGraph(positions, triangles);
    // A dark field whose border bends: y < 0.1 on the left half, y < 0.12 on the right half.
    const colors = new Uint8Array(positions.length).map((_, k) => (positions[3 * Math.floor(k / 3) + 1] < (positions[3 * Math.floor(k / 3)] < 0.1 ? 0.1 : 0.12) ? 20 : 220));
    const strength = edgeStrength(graph, colors, null);
    const from = snapped(strength, graph.within([0, 0.105, 0], [21 * SIDE], 0.012))!;
    const to = snapped(strength, graph.within([0.2, 0.115, 0], [23 * SIDE + 40], 0.012))!;
    const way = graph.path(from, to, wayFactor(strength), 1)!;
    expect(strength[from]).toBe(1);
    expect(way.filter((v) => strength[v] === 1).length / way.length).toBeGreaterThan(0.95);
  });

  it("end where there is no way", () => {
    const graph = graphOf([0, 0.5]);
    expect(graph.path(0, SIDE * SIDE, () => 1, 10)).toBeNull();
  });
});

describe("meshes", () => {
  it("have borders where an edge has one triangle", () => {
    const { positions, triangles } = sheets([0]);
    expect(borderSegments(positions, triangles).length / 6).toBe(4 * (SIDE - 1));
  });

  it("are mirrored over the body's own middle", () => {
    const [right, left] = [sheets([0], -0.3), sheets([0], 0.1)];
    const joined: PlyMesh = {
      positions: Float32Array.from([...right.positions, ...left.positions]),
      triangles: Uint32Array.from([...right.triangles, ...[...left.triangles].map((v) => v + SIDE * SIDE)]),
      normals: null, colors: null, values: new Map(),
    };
    // In the take the left sheet is 0.05 m higher than at rest.
    const posed = { ...joined, positions: joined.positions.map((x, k) => (k % 3 === 1 && k >= right.positions.length ? x + 0.05 : x)) };
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(posed.positions.slice(), 3));
    geometry.setIndex(new BufferAttribute(posed.triangles.slice(), 1));
    const mirror = new Mirror(posed, joined, new MeshBVH(geometry));
    const image = mirror.image([-0.2, 0.1, 0.004])!;
    expect(image[0]).toBeCloseTo(0.2, 4);
    expect(image[1]).toBeCloseTo(0.15, 4);
    expect(mirror.image([5, 5, 5])).toBeNull();
  });
});

describe("the heap", () => {
  it("gives the least first", () => {
    const heap = new Heap();
    for (const cost of [5, 1, 4, 1.5, 9, 0.2]) heap.push(Math.round(10 * cost), cost);
    const order: number[] = [];
    while (heap.size > 0) order.push(heap.pop()[1]);
    expect(order).toEqual([0.2, 1, 1.5, 4, 5, 9]);
  });
});
