import { Mesh, MeshBasicMaterial, SphereGeometry, Vector3 } from "three";
import { useEffect, useRef, useState } from "preact/hooks";
import { api } from "../../api/client";
import type { BodyEdits, Landmark, Layer, Point, Subject } from "../../api/types";
import { useRemote } from "../../state/remote";
import { linearColors } from "../../three/meshes";
import { Stage } from "../../three/stage";
import type { Viewer } from "../../three/viewer";
import { tell } from "../../ui/toasts";
import { loadCanvas, type Canvas } from "./stage_data";

const FOUND = 0x2f7fd0;
const BY_HAND = 0xe0801c;
const CHOSEN = 0x12b39c;
/** A landmark is grabbed within so many pixels. */
const GRAB_PX = 14;

interface Bench {
  canvas: Canvas;
  found: Landmark[];
  edits: BodyEdits;
}

/** Landmarks of the body on the first scan, moved by dragging; they are kept in `edits/body.json`. */
export function LandmarksTool({ subject, layer }: { subject: Subject; layer: Layer }) {
  const bench = useRemote<Bench>(subject.id, async (signal) => {
    const [canvas, body, edits] = await Promise.all([
      loadCanvas(subject, layer, signal),
      api.file<{ landmarks: Landmark[] }>(subject.id, "build/body/body.json"),
      api.bodyEdits(subject.id),
    ]);
    return { canvas, found: body.landmarks, edits };
  });
  if (bench.error !== null) return <p class="bad pad" role="alert">{bench.error}</p>;
  if (bench.value === null) return <p class="pad dim" role="status">Reading the scan …</p>;
  return <LandmarksBench subject={subject} bench={bench.value} />;
}

function LandmarksBench({ subject, bench }: { subject: Subject; bench: Bench }) {
  const [set, setSet] = useState<Record<string, Point>>(bench.edits.landmarks ?? {});
  const [chosen, setChosen] = useState<string | null>(null);
  const [error, setError] = useState<string | null>(null);
  const [dirty, setDirty] = useState(false);
  const keep = async (next: Record<string, Point>) => {
    setSet(next);
    setDirty(true);
    try {
      await api.keepEdits(subject.id, 0, { ...bench.edits, landmarks: next });
      setError(null);
    } catch (e) {
      setError(e instanceof Error ? e.message : String(e));
    }
  };
  const forget = (name: string) => {
    const { [name]: _, ...rest } = set;
    void keep(rest);
  };
  const fit = () => void api.addJob("process", subject.id).then(() => tell("The body is fitted again with these landmarks."), (e: Error) => setError(e.message));
  return (
    <div class="subject-body">
      <div class="subject-picture">
        <Stage label="Scan with landmarks">
          {(viewer) => <Points viewer={viewer} bench={bench} set={set} chosen={chosen} onChoose={setChosen} onMove={(name, point) => void keep({ ...set, [name]: point })} />}
        </Stage>
      </div>
      <div class="subject-panel">
        <div class="controls">
          <p class="dim">Drag a landmark to its place on the scan. The fit of the body goes through the ones that were set by hand; all others are found again.</p>
          {error !== null && <p class="bad" role="alert">{error}</p>}
          <button type="button" class="main" disabled={!dirty} onClick={fit}>Fit the body again</button>
          <ul class="landmarks">
            {bench.found.map((landmark) => (
              <li key={landmark.name} class={landmark.name === chosen ? "chosen" : ""}>
                <button type="button" aria-pressed={landmark.name === chosen} onClick={() => setChosen(landmark.name)}>{landmark.name}</button>
                {set[landmark.name] !== undefined
                  ? <button type="button" class="plain" onClick={() => forget(landmark.name)}>Forget</button>
                  : <span class="dim">{landmark.seen < 0.3 ? "not seen" : `${landmark.moved_mm.toFixed(1)} mm`}</span>}
              </li>
            ))}
          </ul>
        </div>
      </div>
    </div>
  );
}

interface PointsProps {
  viewer: Viewer;
  bench: Bench;
  set: Record<string, Point>;
  chosen: string | null;
  onChoose: (name: string) => void;
  onMove: (name: string, point: Point) => void;
}

function Points(props: PointsProps) {
  const { viewer, bench, set, chosen } = props;
  const latest = useRef(props);
  latest.current = props;
  const balls = useRef(new Map<string, Mesh<SphereGeometry, MeshBasicMaterial>>());
  useEffect(() => {
    const { surface, scan } = bench.canvas;
    if (scan.colors !== null) (surface.geometry.getAttribute("color").array as Float32Array).set(linearColors(scan.colors));
    const sphere = new SphereGeometry(0.009, 16, 12);
    const hides = [viewer.show(surface)];
    for (const landmark of bench.found) {
      const ball = new Mesh(sphere, new MeshBasicMaterial({ depthTest: false, transparent: true, opacity: 0.9 }));
      ball.renderOrder = 2;
      balls.current.set(landmark.name, ball);
      hides.push(viewer.show(ball));
    }
    const stop = dragging(viewer, bench.canvas, balls.current, latest);
    return () => {
      stop();
      for (const hide of hides) hide();
      for (const ball of balls.current.values()) ball.material.dispose();
      balls.current.clear();
      sphere.dispose();
    };
  }, [viewer, bench]);
  useEffect(() => {
    for (const landmark of bench.found) {
      const ball = balls.current.get(landmark.name);
      if (ball === undefined) continue;
      ball.position.set(...(set[landmark.name] ?? landmark.position));
      ball.material.color.setHex(landmark.name === chosen ? CHOSEN : set[landmark.name] !== undefined ? BY_HAND : FOUND);
      ball.scale.setScalar(landmark.name === chosen ? 1.6 : 1);
    }
    viewer.draw();
  }, [viewer, bench, set, chosen]);
  return null;
}

type Balls = Map<string, Mesh<SphereGeometry, MeshBasicMaterial>>;

/** Grabs the landmark under the pointer and draws it along the scan. */
function dragging(viewer: Viewer, canvas: Canvas, balls: Balls, latest: { current: PointsProps }): () => void {
  const box = viewer.canvas.parentElement!;
  let held: string | null = null;
  const under = (event: PointerEvent): string | null => {
    let best: string | null = null;
    let least = GRAB_PX;
    for (const [name, ball] of balls) {
      const [x, y] = viewer.windowPlace(ball.position.toArray());
      const far = Math.hypot(x - event.clientX, y - event.clientY) + (facesAway(viewer, canvas, ball.position) ? GRAB_PX : 0);
      if (far < least) [best, least] = [name, far];
    }
    return best;
  };
  const down = (event: PointerEvent) => {
    if (event.button !== 0 || event.target !== viewer.canvas) return;
    held = under(event);
    if (held === null) return;
    event.stopPropagation();
    viewer.canvas.setPointerCapture(event.pointerId);
    latest.current.onChoose(held);
  };
  const move = (event: PointerEvent) => {
    if (held === null) return;
    event.stopPropagation();
    const hit = viewer.pick(event.clientX, event.clientY, [canvas.surface]);
    if (hit === null) return;
    balls.get(held)?.position.copy(hit.point);
    viewer.draw();
  };
  const up = (event: PointerEvent) => {
    if (held === null) return;
    event.stopPropagation();
    const at = balls.get(held)?.position;
    const before = latest.current.set[held] ?? latest.current.bench.found.find((l) => l.name === held)?.position;
    if (at !== undefined && before !== undefined && at.distanceTo(new Vector3(...before)) > 0.0005) latest.current.onMove(held, at.toArray());
    held = null;
  };
  const listeners: [string, (event: PointerEvent) => void][] = [["pointerdown", down], ["pointermove", move], ["pointerup", up]];
  for (const [type, run] of listeners) box.addEventListener(type, run as EventListener, { capture: true });
  return () => {
    for (const [type, run] of listeners) box.removeEventListener(type, run as EventListener, { capture: true });
  };
}

/** Whether the scan stands between the camera and a point. */
function facesAway(viewer: Viewer, canvas: Canvas, point: Vector3): boolean {
  const hit = viewer.pick(...viewer.windowPlace(point.toArray()), [canvas.surface]);
  return hit !== null && hit.distance < viewer.camera.position.distanceTo(point) - 0.02;
}
