import { BufferGeometry, Color, DoubleSide, Mesh, MeshBasicMaterial, RingGeometry, Vector2, Vector3, type Intersection } from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import type { Point } from "../../api/types";
import type { Viewer } from "../../three/viewer";

/** How long the new border takes to appear, seconds. */
const FADE_S = 0.7;

/** A set of line segments in the picture, of one colour. */
export class Lines {
  readonly object: LineSegments2;

  constructor(color: string, width: number, private readonly viewer: Viewer, isOver = false) {
    const material = new LineMaterial({ color: new Color(color).getHex(), linewidth: width, resolution: new Vector2(innerWidth, innerHeight), transparent: true });
    material.polygonOffset = true;
    material.polygonOffsetFactor = -4;
    material.polygonOffsetUnits = -60;
    material.depthTest = !isOver;
    this.object = new LineSegments2(new LineSegmentsGeometry(), material);
    this.object.visible = false;
    this.object.frustumCulled = false;
    this.object.renderOrder = 3;
    viewer.scene.add(this.object);
  }

  set(segments: ArrayLike<number>): void {
    this.object.geometry.dispose();
    this.object.geometry = new LineSegmentsGeometry();
    this.object.visible = segments.length > 0;
    if (segments.length > 0) this.object.geometry.setPositions(Float32Array.from(segments));
    this.viewer.draw();
  }

  setPath(points: readonly Point[]): void {
    this.set(points.slice(1).flatMap((point, k) => [...points[k], ...point]));
  }

  set opacity(value: number) {
    (this.object.material as LineMaterial).opacity = value;
    this.viewer.draw();
  }

  dispose(): void {
    this.viewer.scene.remove(this.object);
    this.object.geometry.dispose();
    this.object.material.dispose();
    this.viewer.draw();
  }
}

/** The border that was there and the one that a rebuild made. */
export class Borders {
  private readonly before: Lines;
  private readonly after: Lines;
  private first: Float32Array | null = null;
  private timer = 0;

  constructor(viewer: Viewer) {
    this.before = new Lines("#d98a1f", 2.5, viewer);
    this.after = new Lines("#0fb39c", 4, viewer);
  }

  /** The first border is the old one; each later one fades in beside it. */
  show(segments: Float32Array): void {
    if (this.first === null) {
      this.first = segments;
      this.before.set(segments);
      return;
    }
    this.after.set(segments);
    const start = performance.now();
    cancelAnimationFrame(this.timer);
    const fade = () => {
      const share = Math.min(1, (performance.now() - start) / (1000 * FADE_S));
      this.after.opacity = share;
      if (share < 1) this.timer = requestAnimationFrame(fade);
    };
    fade();
  }

  dispose(): void {
    cancelAnimationFrame(this.timer);
    this.before.dispose();
    this.after.dispose();
  }
}

/** A ring on the surface that shows how far the brush reaches. */
export class BrushRing {
  private readonly ring: Mesh<BufferGeometry, MeshBasicMaterial>;

  constructor(private readonly viewer: Viewer) {
    this.ring = new Mesh(new RingGeometry(0.94, 1, 64), new MeshBasicMaterial({ color: 0xffffff, side: DoubleSide, depthTest: false, transparent: true }));
    this.ring.renderOrder = 4;
    this.ring.visible = false;
    viewer.scene.add(this.ring);
  }

  show(hit: Intersection | null, radius: number): void {
    if (hit === null && !this.ring.visible) return;
    this.ring.visible = hit !== null;
    if (hit !== null) {
      const normal = hit.face?.normal ?? new Vector3(0, 0, 1);
      this.ring.position.copy(hit.point).addScaledVector(normal, 0.002);
      this.ring.lookAt(this.ring.position.clone().add(normal));
      this.ring.scale.setScalar(radius);
    }
    this.viewer.draw();
  }

  dispose(): void {
    this.viewer.scene.remove(this.ring);
    this.ring.geometry.dispose();
    this.ring.material.dispose();
  }
}
