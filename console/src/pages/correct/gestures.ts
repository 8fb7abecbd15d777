import { Vector3, type Intersection } from "three";
import type { HemLine, Point, Stroke } from "../../api/types";
import { snapped, wayFactor } from "../../brush/edges";
import { strokesFor, type Gesture } from "../../brush/strokes";
import type { Viewer } from "../../three/viewer";
import type { Canvas } from "./stage_data";
import type { Painter } from "./painter";

export type Tool = "belongs" | "does-not-belong" | "hem" | "look";

export interface ToolState {
  tool: Tool;
  radius: number;
  reach: number;
  symmetric: boolean;
}

export interface GestureHost {
  state: () => ToolState;
  add: (gesture: Gesture) => void;
  setRadius: (radius: number) => void;
  /** The points of the hem line that is being drawn, for the picture. */
  showHem: (points: Point[]) => void;
  /** Where the brush is, or null away from the scan. */
  showBrush: (hit: Intersection | null) => void;
}

/** Between two looks along a quick stroke, pixels. */
const STEP_PX = 6;
const WHEEL_STEP = 1.12;
/** A hem's click snaps to an edge within this distance along the surface, metres. */
const SNAP = 0.012;
/** A click this near the first point closes the hem line, metres. */
const CLOSE = 0.015;
const LONGEST_PIECE = 1.5;

/** Turns what a pointer does on the scan into gestures. Beside the scan, dragging turns the picture. */
export class Gestures {
  private path: Point[] = [];
  private region = new Map<number, number>();
  private last: [number, number] | null = null;
  private hem: number[] = [];
  private corners: number[] = [];
  private readonly stops: (() => void)[] = [];

  constructor(private readonly viewer: Viewer, private readonly canvas: Canvas, private readonly painter: Painter, private readonly host: GestureHost) {
    const box = viewer.canvas.parentElement!;
    this.listen(box, "pointerdown", (e) => this.down(e as PointerEvent));
    this.listen(box, "pointermove", (e) => this.move(e as PointerEvent));
    this.listen(box, "pointerup", (e) => this.up(e as PointerEvent));
    this.listen(box, "pointercancel", (e) => this.up(e as PointerEvent));
    this.listen(box, "wheel", (e) => this.wheel(e as WheelEvent));
  }

  private listen(target: HTMLElement, type: string, run: (event: Event) => void): void {
    target.addEventListener(type, run, { capture: true, passive: false });
    this.stops.push(() => target.removeEventListener(type, run, { capture: true }));
  }

  dispose(): void {
    for (const stop of this.stops) stop();
    this.host.showBrush(null);
  }

  private isBrush(): boolean {
    const { tool } = this.host.state();
    return tool === "belongs" || tool === "does-not-belong";
  }

  private hit(event: MouseEvent): Intersection | null {
    return this.viewer.pick(event.clientX, event.clientY, [this.canvas.surface]);
  }

  private down(event: PointerEvent): void {
    if (event.target !== this.viewer.canvas || event.button !== 0 || this.host.state().tool === "look") return;
    const hit = this.hit(event);
    if (hit === null) return;
    event.stopPropagation();
    event.preventDefault();
    this.viewer.canvas.focus();
    if (this.host.state().tool === "hem") return this.hemClick(hit);
    this.viewer.canvas.setPointerCapture(event.pointerId);
    this.path = [];
    this.region = new Map();
    this.last = [event.clientX, event.clientY];
    this.dab(hit);
  }

  private move(event: PointerEvent): void {
    if (this.last !== null) {
      event.stopPropagation();
      return this.drag(event);
    }
    if (event.buttons === 0 && event.target === this.viewer.canvas) this.host.showBrush(this.isBrush() ? this.hit(event) : null);
  }

  private drag(event: PointerEvent): void {
    const [x, y] = this.last!;
    const steps = Math.max(1, Math.ceil(Math.hypot(event.clientX - x, event.clientY - y) / STEP_PX));
    for (let k = 1; k <= steps; k += 1) {
      const hit = this.viewer.pick(x + ((event.clientX - x) * k) / steps, y + ((event.clientY - y) * k) / steps, [this.canvas.surface]);
      if (hit !== null) this.dab(hit);
      if (k === steps) this.host.showBrush(hit);
    }
    this.last = [event.clientX, event.clientY];
  }

  private dab(hit: Intersection): void {
    const { radius, tool } = this.host.state();
    const point: Point = [hit.point.x, hit.point.y, hit.point.z];
    const before = this.path[this.path.length - 1];
    if (before !== undefined && new Vector3(...before).distanceTo(hit.point) < Math.max(0.002, radius / 5)) return;
    this.path.push(point);
    const fresh = this.canvas.graph.within(point, [hit.face!.a, hit.face!.b, hit.face!.c], radius);
    for (const [vertex, distance] of fresh) this.region.set(vertex, Math.min(distance, this.region.get(vertex) ?? Infinity));
    this.painter.mark(fresh.keys(), tool as Stroke["mark"]);
    this.viewer.draw();
  }

  private up(event: PointerEvent): void {
    if (this.last === null) return;
    event.stopPropagation();
    this.last = null;
    if (event.type === "pointerup" && this.path.length > 0) this.host.add(this.strokeGesture());
    else this.host.add({ strokes: [], hems: [] });
  }

  private strokeGesture(): Gesture {
    const { tool, radius, symmetric } = this.host.state();
    const stroke: Stroke = { mark: tool as Stroke["mark"], points: this.path, radius };
    const strokes = strokesFor(this.canvas.graph, this.region, stroke);
    const mirror = symmetric ? this.canvas.mirror : null;
    const images = mirror === null ? [] : strokes.flatMap((s) => mirroredStroke(s, (point) => mirror.image(point)));
    return { strokes: [...strokes, ...images], hems: [] };
  }

  private wheel(event: WheelEvent): void {
    if (!this.isBrush() || event.ctrlKey || event.target !== this.viewer.canvas || this.hit(event) === null) return;
    event.stopPropagation();
    event.preventDefault();
    this.host.setRadius(this.host.state().radius * (event.deltaY < 0 ? WHEEL_STEP : 1 / WHEEL_STEP));
    this.host.showBrush(this.hit(event));
  }

  private hemClick(hit: Intersection): void {
    const { graph, edges } = this.canvas;
    const point: Point = [hit.point.x, hit.point.y, hit.point.z];
    const face = [hit.face!.a, hit.face!.b, hit.face!.c];
    const first = this.corners[0];
    const closes = this.corners.length > 2 && graph.distanceTo(first, point) < CLOSE;
    const vertex = closes ? first : snapped(edges, graph.within(point, face, SNAP)) ?? face[0];
    if (this.corners.length > 0) {
      const way = graph.path(this.corners[this.corners.length - 1], vertex, wayFactor(edges), LONGEST_PIECE);
      if (way === null) return;
      this.hem.push(...way.slice(1));
    } else {
      this.hem = [vertex];
    }
    this.corners.push(vertex);
    if (closes) return this.finishHem();
    this.host.showHem(this.hemPoints());
  }

  private hemPoints(): Point[] {
    const p = this.canvas.graph.positions;
    return this.hem.map((v) => [p[3 * v], p[3 * v + 1], p[3 * v + 2]]);
  }

  /** Ends the hem line that is being drawn and keeps it. */
  finishHem(): void {
    const points = this.hemPoints();
    const { reach, symmetric } = this.host.state();
    this.dropHem();
    if (points.length < 2) return;
    const line: HemLine = { points, reach };
    const mirror = symmetric ? this.canvas.mirror : null;
    const image = mirror === null ? null : points.map((point) => mirror.image(point)).filter((point) => point !== null);
    this.host.add({ strokes: [], hems: image === null || image.length < 2 ? [line] : [line, { points: image, reach }] });
  }

  dropHem(): void {
    this.hem = [];
    this.corners = [];
    this.host.showHem([]);
  }
}

/** A stroke on the other side; where parts of its image are missing, it is parted there. */
export function mirroredStroke(stroke: Stroke, image: (point: Point) => Point | null): Stroke[] {
  const pieces: Point[][] = [[]];
  for (const point of stroke.points) {
    const other = image(point);
    const piece = pieces[pieces.length - 1];
    const before = piece[piece.length - 1];
    const jumps = other !== null && before !== undefined && Math.hypot(...other.map((x, k) => x - before[k])) > 4 * stroke.radius;
    if (other === null || jumps) pieces.push([]);
    if (other !== null) pieces[pieces.length - 1].push(other);
  }
  return pieces.filter((points) => points.length > 0).map((points) => ({ ...stroke, points }));
}
