import type { ScanGraph } from "./scan_graph";

/** Colour difference (of 255) and bend at which an edge is as strong as it gets. */
const FULL_COLOR = 60;
const FULL_BEND = 0.5;
/** An edge of full strength makes its way so much cheaper. */
const PULL = 0.12;

/** How much each vertex is an edge in colour or shape, 0 to 1: what a hem line snaps to. */
export function edgeStrength(graph: ScanGraph, colors: Uint8Array | null, normals: Float32Array | null): Float32Array {
  const out = new Float32Array(graph.count);
  for (let v = 0; v < graph.count; v += 1) {
    let strongest = 0;
    for (let k = graph.starts[v]; k < graph.starts[v + 1]; k += 1) {
      const n = graph.neighbors[k];
      const step = colors === null ? 0 : Math.hypot(colors[3 * v] - colors[3 * n], colors[3 * v + 1] - colors[3 * n + 1], colors[3 * v + 2] - colors[3 * n + 2]);
      const turn = normals === null ? 0 : 1 - (normals[3 * v] * normals[3 * n] + normals[3 * v + 1] * normals[3 * n + 1] + normals[3 * v + 2] * normals[3 * n + 2]);
      strongest = Math.max(strongest, step / FULL_COLOR, turn / FULL_BEND);
    }
    out[v] = Math.min(1, strongest);
  }
  return out;
}

/** The strongest edge near a point of the surface, the nearer one where two are as strong. */
export function snapped(strength: Float32Array, near: ReadonlyMap<number, number>): number | null {
  let best: number | null = null;
  let most = -Infinity;
  for (const [vertex, distance] of near) {
    const value = strength[vertex] - 15 * distance;
    if (value > most) {
      most = value;
      best = vertex;
    }
  }
  return best;
}

/** Cost factor of a way along edges. */
export function wayFactor(strength: Float32Array): (vertex: number) => number {
  return (vertex) => 1 - (1 - PULL) * strength[vertex];
}
