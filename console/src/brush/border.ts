/** Ends of the edges that have one triangle, xyz each: the borders of a mesh. */
export function borderSegments(positions: Float32Array, triangles: Uint32Array): Float32Array {
  const count = positions.length / 3;
  const edges = new Map<number, boolean>();
  for (let t = 0; t < triangles.length; t += 3) {
    for (let corner = 0; corner < 3; corner += 1) {
      const [a, b] = [triangles[t + corner], triangles[t + ((corner + 1) % 3)]];
      const key = Math.min(a, b) * count + Math.max(a, b);
      edges.set(key, !edges.has(key));
    }
  }
  const border = [...edges].filter(([, isOpen]) => isOpen).map(([key]) => key);
  const out = new Float32Array(6 * border.length);
  border.forEach((key, k) => {
    [Math.floor(key / count), key % count].forEach((vertex, end) => out.set(positions.subarray(3 * vertex, 3 * vertex + 3), 6 * k + 3 * end));
  });
  return out;
}
