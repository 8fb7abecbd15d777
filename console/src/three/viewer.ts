import {
  Box3, Color, DirectionalLight, Group, HemisphereLight, Mesh, type Object3D, PerspectiveCamera, Raycaster, RingGeometry,
  MeshBasicMaterial, Scene, Vector2, Vector3, WebGLRenderer, type Intersection,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { cssColor, onThemeChange } from "../state/theme";

/** Looks by name, from where the camera stands. */
export const LOOKS = {
  front: new Vector3(0, 0.12, 1), back: new Vector3(0, 0.12, -1),
  left: new Vector3(1, 0.12, 0), right: new Vector3(-1, 0.12, 0), top: new Vector3(0.001, 1, 0.2),
};
export type Look = keyof typeof LOOKS;

const DISK_RADIUS = 0.4;
const KEY_TURN = Math.PI / 24;

/** A scene that is drawn when something changes, with a camera that orbits. Units are metres, +Y is up. */
export class Viewer {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(32, 1, 0.02, 60);
  readonly controls: OrbitControls;
  readonly content = new Group();
  private readonly renderer: WebGLRenderer;
  private readonly disk: Mesh<RingGeometry, MeshBasicMaterial>;
  private readonly stops: (() => void)[] = [];
  private pending = 0;
  private animate: ((seconds: number) => void) | null = null;
  private last = 0;
  private touched = false;

  constructor(private readonly box: HTMLElement, readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.disk = new Mesh(new RingGeometry(DISK_RADIUS - 0.006, DISK_RADIUS, 96), new MeshBasicMaterial());
    this.disk.rotation.x = -Math.PI / 2;
    const key = new DirectionalLight(0xffffff, 1.9);
    key.position.set(0.6, 1.1, 1);
    this.camera.add(key);
    this.scene.add(this.camera, new HemisphereLight(0xffffff, 0x6b6660, 1.5), this.disk, this.content);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.draw());
    this.controls.addEventListener("start", () => (this.touched = true));
    this.controls.minDistance = 0.15;
    this.controls.maxDistance = 15;
    this.look("front");
    this.watch();
    // For tests in a browser and the developer's console.
    Object.assign(canvas, { viewer: this });
  }

  private watch(): void {
    const resize = new ResizeObserver(() => this.resize());
    resize.observe(this.box);
    const onKey = (event: KeyboardEvent) => this.key(event);
    this.canvas.addEventListener("keydown", onKey);
    this.stops.push(() => resize.disconnect(), onThemeChange(() => this.paint()));
    this.stops.push(() => this.canvas.removeEventListener("keydown", onKey));
    this.paint();
    this.resize();
  }

  private paint(): void {
    this.scene.background = new Color(cssColor("--stage-solid") || "#888");
    this.disk.material.color = new Color(cssColor("--disk") || "#777");
    this.draw();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.box;
    if (width === 0 || height === 0) return;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.renderer.setSize(width, height, false);
    this.draw();
  }

  private key(event: KeyboardEvent): void {
    const turns: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const turn = turns[event.key];
    if (turn !== undefined) this.orbit(turn[0] * KEY_TURN, turn[1] * KEY_TURN);
    else if (event.key === "+" || event.key === "=") this.dolly(1 / 1.15);
    else if (event.key === "-") this.dolly(1.15);
    else return;
    this.touched = true;
    event.preventDefault();
  }

  private orbit(azimuth: number, polar: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target);
    offset.applyAxisAngle(new Vector3(0, 1, 0), azimuth);
    const side = new Vector3(offset.z, 0, -offset.x).normalize();
    const tilted = offset.clone().applyAxisAngle(side, polar);
    if (Math.abs(tilted.y) < 0.98 * tilted.length()) offset.copy(tilted);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.draw();
  }

  private dolly(factor: number): void {
    this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
    this.controls.update();
    this.draw();
  }

  /** Turns the camera to a look, at the distance at which the content fits. */
  look(look: Look): void {
    const bounds = new Box3().setFromObject(this.content);
    if (bounds.isEmpty()) bounds.set(new Vector3(-0.5, 0, -0.3), new Vector3(0.5, 1.8, 0.3));
    this.lookAt(bounds, LOOKS[look]);
  }

  /** Comes nearer or goes away until everything fits, seen from where the camera is. */
  fit(): void {
    const bounds = new Box3().setFromObject(this.content);
    if (!bounds.isEmpty()) this.lookAt(bounds, this.camera.position.clone().sub(this.controls.target));
  }

  lookAt(bounds: Box3, from: Vector3): void {
    const size = bounds.getSize(new Vector3());
    const half = Math.tan((this.camera.fov * Math.PI) / 360);
    const wide = Math.max(size.y, Math.max(size.x, size.z) / this.camera.aspect);
    bounds.getCenter(this.controls.target);
    const distance = (0.58 * wide) / half + 0.3 * size.z;
    this.camera.position.copy(this.controls.target).addScaledVector(from.clone().normalize(), distance);
    this.controls.update();
    this.draw();
  }

  /** Adds an object; until somebody turns the picture, all of it is looked at. Gives the function that takes it away. */
  show(object: Object3D): () => void {
    this.content.add(object);
    if (!this.touched) this.look("front");
    this.draw();
    return () => {
      this.content.remove(object);
      this.draw();
    };
  }

  /** Draws once before the next frame of the screen. */
  draw(): void {
    if (this.pending === 0) this.pending = requestAnimationFrame((now) => this.render(now));
  }

  /** Calls a function with the seconds since the last call, before every frame, until null is given. */
  setAnimation(animate: ((seconds: number) => void) | null): void {
    this.animate = animate;
    this.last = 0;
    this.draw();
  }

  private render(now: number): void {
    this.pending = 0;
    if (this.animate !== null) {
      this.animate(this.last === 0 ? 0 : Math.min(0.25, (now - this.last) / 1000));
      this.last = now;
      this.draw();
    }
    this.renderer.render(this.scene, this.camera);
  }

  /** What lies under a place of the window, nearest first. */
  pick(clientX: number, clientY: number, objects: Object3D[]): Intersection | null {
    const caster = new Raycaster();
    caster.firstHitOnly = true;
    caster.setFromCamera(this.pointer(clientX, clientY), this.camera);
    return caster.intersectObjects(objects, false)[0] ?? null;
  }

  /** Where in the window a point is drawn. */
  windowPlace(point: readonly [number, number, number]): [number, number] {
    const at = new Vector3(...point).project(this.camera);
    const box = this.canvas.getBoundingClientRect();
    return [box.left + (box.width * (1 + at.x)) / 2, box.top + (box.height * (1 - at.y)) / 2];
  }

  private pointer(clientX: number, clientY: number): Vector2 {
    const box = this.canvas.getBoundingClientRect();
    return new Vector2((2 * (clientX - box.left)) / box.width - 1, 1 - (2 * (clientY - box.top)) / box.height);
  }

  dispose(): void {
    cancelAnimationFrame(this.pending);
    this.pending = -1;
    for (const stop of this.stops) stop();
    this.controls.dispose();
    this.disk.geometry.dispose();
    this.disk.material.dispose();
    this.renderer.dispose();
  }
}
