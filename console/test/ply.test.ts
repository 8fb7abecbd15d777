import { describe, expect, it } from "vitest";
import { parsePly } from "../src/three/ply";

function ply(vertices: [number, number, number, number, number][], faces: number[][], header?: (text: string) => string): ArrayBuffer {
  const text = [
    "ply", "format binary_little_endian 1.0", `element vertex ${vertices.length}`, "property float x", "property float y", "property float z",
    "property uchar red", "property uchar green", "property uchar blue", "property float filled",
    `element face ${faces.length}`, "property list uchar int vertex_indices", "end_header\n",
  ].join("\n");
  const head = new TextEncoder().encode(header?.(text) ?? text);
  const bytes = new ArrayBuffer(head.length + 19 * vertices.length + 13 * faces.length);
  new Uint8Array(bytes).set(head);
  const view = new DataView(bytes);
  let at = head.length;
  for (const [x, y, z, red, filled] of vertices) {
    [x, y, z].forEach((value, k) => view.setFloat32(at + 4 * k, value, true));
    view.setUint8(at + 12, red);
    view.setFloat32(at + 15, filled, true);
    at += 19;
  }
  for (const face of faces) {
    view.setUint8(at, 3);
    face.forEach((index, k) => view.setInt32(at + 1 + 4 * k, index, true));
    at += 13;
  }
  return bytes;
}

const CORNERS: [number, number, number, number, number][] = [[0, 0, 0, 10, 0], [1, 0, 0, 20, 0], [0, 1, 0.5, 255, 1]];

describe("PLY", () => {
  it("gives positions, colours, other values and triangles", () => {
    const mesh = parsePly(ply(CORNERS, [[0, 1, 2]]));
    expect([...mesh.positions]).toEqual([0, 0, 0, 1, 0, 0, 0, 1, 0.5]);
    expect([...mesh.colors!]).toEqual([10, 0, 0, 20, 0, 0, 255, 0, 0]);
    expect([...mesh.values.get("filled")!]).toEqual([0, 0, 1]);
    expect([...mesh.triangles]).toEqual([0, 1, 2]);
    expect(mesh.normals).toBeNull();
  });

  it("refuses other files with a sentence", () => {
    expect(() => parsePly(new ArrayBuffer(10))).toThrow("not a PLY file");
    expect(() => parsePly(ply(CORNERS, [[0, 1, 3]]))).toThrow("vertex that it does not have");
    expect(() => parsePly(ply(CORNERS, [[0, 1, 2]]).slice(0, -1))).toThrow("cut short");
    const ascii = (text: string) => text.replace("binary_little_endian", "ascii");
    expect(() => parsePly(ply(CORNERS, [], ascii))).toThrow("Only binary");
  });
});
