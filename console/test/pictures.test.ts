import { describe, expect, it } from "vitest";
import type { Measure } from "../src/api/types";
import { segments } from "../src/pages/subject/tapes";
import { divergingColor, summary } from "../src/three/distances";
import { vertexNormals } from "../src/three/normals";
import { parsePc2Header } from "../src/three/pc2";

describe("pictures", () => {
  it("reads the header of a point cache", () => {
    const bytes = new ArrayBuffer(32);
    new Uint8Array(bytes).set(new TextEncoder().encode("POINTCACHE2"));
    new DataView(bytes).setInt32(16, 13_380, true);
    new DataView(bytes).setInt32(28, 129, true);
    expect(parsePc2Header(bytes)).toEqual({ points: 13_380, frames: 129 });
    expect(() => parsePc2Header(new ArrayBuffer(32))).toThrow("not a point cache");
  });

  it("gives normals of unit length, weighted by area", () => {
    const normals = new Float32Array(12);
    vertexNormals(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 3]), [0, 1, 2, 0, 2, 3], normals);
    const [x, y, z] = normals;
    expect(Math.hypot(x, y, z)).toBeCloseTo(1);
    expect(x / z).toBeCloseTo(3);
    expect([...normals.slice(3, 6)]).toEqual([0, 0, 1]);
  });

  it("colours distances: blue inside, red outside, the ends beyond the scale", () => {
    const [inside, outside] = [divergingColor(-1), divergingColor(1)];
    expect(inside[2]).toBeGreaterThan(inside[0]);
    expect(outside[0]).toBeGreaterThan(outside[2]);
    expect(divergingColor(-7)).toEqual(inside);
    expect(divergingColor(7)).toEqual(outside);
    expect(summary(new Float32Array([-0.001, 0.003])).mean_mm).toBeCloseTo(2);
  });

  it("closes girths and leaves lengths open", () => {
    const measure: Measure = { name: "waist girth", kind: "girth", value_m: 4, definition: "", path: [[0, 0, 0], [1, 0, 0], [1, 1, 0]] };
    expect(segments(measure)).toHaveLength(18);
    expect(segments({ ...measure, kind: "length" })).toHaveLength(12);
  });
});
