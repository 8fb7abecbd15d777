import { Heap } from "./heap";

/** The vertices of a scan and the edges between them, for distances along the surface. */
export class ScanGraph {
  /** Neighbours of vertex v: `neighbors[starts[v]]` to `neighbors[starts[v + 1] - 1]`. */
  readonly starts: Uint32Array;
  readonly neighbors: Uint32Array;

  constructor(readonly positions: Float32Array, readonly triangles: Uint32Array) {
    const count = positions.length / 3;
    const edges = directedEdges(triangles);
    this.starts = new Uint32Array(count + 1);
    for (const edge of edges) this.starts[Math.floor(edge / count) + 1] += 1;
    for (let v = 0; v < count; v += 1) this.starts[v + 1] += this.starts[v];
    this.neighbors = Uint32Array.from(edges, (edge) => edge % count);
    function directedEdges(list: Uint32Array): Float64Array {
      const all = new Float64Array(2 * list.length);
      for (let t = 0, k = 0; t < list.length; t += 3) {
        for (let corner = 0; corner < 3; corner += 1) {
          const [a, b] = [list[t + corner], list[t + ((corner + 1) % 3)]];
          all[k++] = a * count + b;
          all[k++] = b * count + a;
        }
      }
      all.sort();
      return all.filter((edge, k) => k === 0 || edge !== all[k - 1]);
    }
  }

  get count(): number {
    return this.positions.length / 3;
  }

  distance(a: number, b: number): number {
    const p = this.positions;
    return Math.hypot(p[3 * a] - p[3 * b], p[3 * a + 1] - p[3 * b + 1], p[3 * a + 2] - p[3 * b + 2]);
  }

  distanceTo(vertex: number, [x, y, z]: readonly number[]): number {
    const p = this.positions;
    return Math.hypot(p[3 * vertex] - x, p[3 * vertex + 1] - y, p[3 * vertex + 2] - z);
  }

  /** Vertices within a distance along the edges of the surface from a point on a triangle, with that distance. */
  within(point: readonly number[], corners: readonly number[], radius: number): Map<number, number> {
    const reached = new Map<number, number>();
    const heap = new Heap();
    for (const corner of corners) {
      const start = this.distanceTo(corner, point);
      if (start <= radius) heap.push(corner, start);
    }
    while (heap.size > 0) {
      const [vertex, distance] = heap.pop();
      if (reached.has(vertex)) continue;
      reached.set(vertex, distance);
      for (let k = this.starts[vertex]; k < this.starts[vertex + 1]; k += 1) {
        const next = this.neighbors[k];
        if (reached.has(next)) continue;
        const along = distance + this.distance(vertex, next);
        // A path along edges is longer than one across triangles; straight ahead it is the straight distance that counts.
        const cost = Math.max(this.distanceTo(next, point), along / ZIGZAG);
        if (cost <= radius) heap.push(next, cost);
      }
    }
    return reached;
  }

  /** The cheapest way from one vertex to another; each edge costs its length times `factor` at its far end. */
  path(from: number, to: number, factor: (vertex: number) => number, farthest: number): number[] | null {
    const before = new Map<number, number>([[from, from]]);
    const done = new Set<number>();
    const best = new Map<number, number>([[from, 0]]);
    const heap = new Heap();
    heap.push(from, 0);
    while (heap.size > 0) {
      const [vertex, cost] = heap.pop();
      if (vertex === to) return this.unwound(before, from, to);
      if (done.has(vertex)) continue;
      done.add(vertex);
      if (cost > farthest) return null;
      for (let k = this.starts[vertex]; k < this.starts[vertex + 1]; k += 1) {
        const next = this.neighbors[k];
        const through = cost + this.distance(vertex, next) * factor(next);
        if (through >= (best.get(next) ?? Infinity)) continue;
        best.set(next, through);
        before.set(next, vertex);
        heap.push(next, through);
      }
    }
    return null;
  }

  private unwound(before: Map<number, number>, from: number, to: number): number[] {
    const way = [to];
    while (way[way.length - 1] !== from) way.push(before.get(way[way.length - 1])!);
    return way.reverse();
  }
}

/** Edges of a mesh of even triangles go at most 60° beside a straight line: by at most 2/√3, some 8 % in the mean of directions. */
const ZIGZAG = 1.08;
