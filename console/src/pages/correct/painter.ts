import type { BufferAttribute } from "three";
import type { Stroke } from "../../api/types";
import { touched } from "../../brush/strokes";
import { linearColors } from "../../three/meshes";
import type { Canvas } from "./stage_data";

/** A scan's vertex lies on the garment where the garment's mesh is this near, metres: less than the edge of a triangle. */
const ON_GARMENT = 0.003;
/** What is no garment is drawn this much paler. */
const PALE = 0.72;
const PALE_TO = [0.55, 0.54, 0.52];
const MARK_COLORS = { belongs: [0.02, 0.5, 0.4], "does-not-belong": [0.7, 0.06, 0.05] };
const MARK_SHARE = 0.62;

/** Colours of the scan: the garment in its own, the rest pale, strokes over both. */
export class Painter {
  private readonly own: Float32Array;
  private base: Float32Array;

  constructor(private readonly canvas: Canvas) {
    const { scan } = canvas;
    this.own = scan.colors === null ? new Float32Array(scan.positions.length).fill(0.6) : linearColors(scan.colors);
    this.base = this.own.slice();
  }

  /** Takes the distance of each vertex from the garment's mesh, metres; null where there is no garment yet. */
  setGarment(distances: Float32Array | null): void {
    this.base = this.own.slice();
    if (distances === null) return;
    for (let v = 0; v < distances.length; v += 1) {
      if (Math.abs(distances[v]) <= ON_GARMENT) continue;
      for (let k = 0; k < 3; k += 1) this.base[3 * v + k] += PALE * (PALE_TO[k] - this.base[3 * v + k]);
    }
  }

  /** Draws everything anew: the base, then strokes in their order. */
  draw(strokes: readonly Stroke[]): void {
    const attribute = this.attribute();
    (attribute.array as Float32Array).set(this.base);
    for (const stroke of strokes) this.blend(touched(this.canvas.graph, stroke), stroke.mark);
    attribute.needsUpdate = true;
  }

  /** Draws the vertices of a stroke that is being made. */
  mark(vertices: Iterable<number>, mark: Stroke["mark"]): void {
    this.blend(vertices, mark);
    this.attribute().needsUpdate = true;
  }

  private blend(vertices: Iterable<number>, mark: Stroke["mark"]): void {
    const colors = this.attribute().array as Float32Array;
    for (const v of vertices) {
      for (let k = 0; k < 3; k += 1) colors[3 * v + k] = this.base[3 * v + k] + MARK_SHARE * (MARK_COLORS[mark][k] - this.base[3 * v + k]);
    }
  }

  private attribute(): BufferAttribute {
    return this.canvas.surface.geometry.getAttribute("color") as BufferAttribute;
  }
}
