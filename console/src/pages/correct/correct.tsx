import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { api, fileAddress } from "../../api/client";
import type { Layer, LayerEdits, Point, Subject } from "../../api/types";
import { clampRadius, History, type Gesture } from "../../brush/strokes";
import { borderSegments } from "../../brush/border";
import { placeText, refine, type Place } from "../../router";
import { useRemote } from "../../state/remote";
import { distancesFrom } from "../../three/distances";
import { loadPly } from "../../three/meshes";
import { Stage } from "../../three/stage";
import type { Viewer } from "../../three/viewer";
import { useSubject } from "../subject/use_subject";
import { Gestures, type GestureHost, type ToolState } from "./gestures";
import { LandmarksTool } from "./landmarks";
import { Painter } from "./painter";
import { Borders, BrushRing, Lines } from "./picture";
import { useKeeper, type Keeper } from "./rebuild";
import { cutFile, loadCanvas, scanFile, type Canvas } from "./stage_data";
import { ToolPanel } from "./tool_panel";

export function CorrectPage({ id, here }: { id: string; here: Place }) {
  const { subject, error } = useSubject(id);
  if (subject === null) return <div class="page narrow">{error === null ? <p class="dim" role="status">Reading the subject …</p> : <p class="bad" role="alert">{error}</p>}</div>;
  const usable = subject.layers.filter((layer) => subject.files.includes(scanFile(layer)));
  const layer = usable.find((l) => l.index === Number(here.query.get("layer"))) ?? usable[1] ?? usable[0];
  if (layer === undefined) {
    return <div class="page narrow stack"><h1>{subject.name}</h1><p>There is no scan to correct yet; process the subject first.</p><p><a href={placeText(["subjects", id])}>Back to {subject.name}</a></p></div>;
  }
  return (
    <div class="subject">
      <div class="subject-head">
        <div class="subject-name">
          <a class="back" href={placeText(["subjects", id], { view: "layers" })} aria-label={`Back to ${subject.name}`}>‹</a>
          <h1>Correct {subject.name}</h1>
        </div>
        <label class="sort">Layer
          <select value={layer.index} onChange={(e) => refine({ layer: e.currentTarget.value })}>
            {usable.map((l) => <option key={l.index} value={l.index}>{l.index === 0 ? `${l.name} (landmarks)` : l.name}</option>)}
          </select>
        </label>
      </div>
      {layer.index === 0 ? <LandmarksTool key="0" subject={subject} layer={layer} /> : <LayerTool key={layer.folder} subject={subject} layer={layer} />}
    </div>
  );
}

/** The edits of a layer in the page; `version` counts their changes. */
function LayerTool({ subject, layer }: { subject: Subject; layer: Layer }) {
  const file = useRemote(layer.folder, () => api.layerEdits(subject.id, layer.index));
  const canvas = useRemote(layer.folder, (signal) => loadCanvas(subject, layer, signal));
  if (file.error !== null || canvas.error !== null) return <p class="bad pad" role="alert">{file.error ?? canvas.error}</p>;
  if (file.value === null || canvas.value === null) return <p class="pad dim" role="status">Reading the scan …</p>;
  return <Workbench subject={subject} layer={layer} file={file.value} canvas={canvas.value} />;
}

interface WorkbenchProps {
  subject: Subject;
  layer: Layer;
  file: LayerEdits;
  canvas: Canvas;
}

function Workbench({ subject, layer, file, canvas }: WorkbenchProps) {
  const history = useMemo(() => new History(file), [file]);
  const [version, setVersion] = useState(0);
  const [state, setState] = useState<ToolState>({ tool: "belongs", radius: 0.02, reach: 0.02, symmetric: false });
  const [auto, setAuto] = useState(true);
  const [built, setBuilt] = useState(0);
  const [drawing, setDrawing] = useState(false);
  const gestures = useRef<Gestures | null>(null);
  const keeper = useKeeper(subject.id, layer.index, () => setBuilt((n) => n + 1));
  const change = (run: () => void) => {
    run();
    setVersion((n) => n + 1);
    keeper.keep(history.file(), auto);
  };
  const add = (gesture: Gesture) => {
    if (gesture.strokes.length + gesture.hems.length === 0) return setVersion((n) => n + 1);
    change(() => history.add(gesture));
  };
  const actions = {
    undo: () => history.canUndo && change(() => history.undo()),
    redo: () => history.canRedo && change(() => history.redo()),
    clear: () => history.canUndo && change(() => history.clear()),
    finishHem: () => gestures.current?.finishHem(),
    dropHem: () => gestures.current?.dropHem(),
    rebuild: () => keeper.keep(history.file(), true),
  };
  useKeys(state, setState, actions);
  return (
    <div class="subject-body">
      <div class="subject-picture">
        <Stage label={`Scan of ${layer.name}`} over={<Told keeper={keeper} />}>
          {(viewer) => (
            <Board viewer={viewer} subject={subject} layer={layer} canvas={canvas} history={history} version={version} built={built}
              state={state} onRadius={(radius) => setState((old) => ({ ...old, radius: clampRadius(radius) }))} onAdd={add}
              onDrawing={setDrawing} gesturesRef={gestures} />
          )}
        </Stage>
      </div>
      <div class="subject-panel">
        <ToolPanel state={state} onState={(part) => setState((old) => ({ ...old, ...part }))} history={history} actions={actions} drawing={drawing}
          auto={auto} onAuto={setAuto} keeper={keeper} mirrored={canvas.mirror !== null} />
      </div>
    </div>
  );
}

function Told({ keeper }: { keeper: Keeper }) {
  const text = { kept: null, keeping: "Keeping the edits …", rebuilding: "Rebuilding the layer …", failed: keeper.error }[keeper.state];
  return text === null ? null : <p class={keeper.state === "failed" ? "stage-busy bad" : "stage-busy"} role="status">{text}</p>;
}

interface Actions {
  undo: () => unknown;
  redo: () => unknown;
  finishHem: () => void;
  dropHem: () => void;
}

function useKeys(state: ToolState, setState: (state: ToolState) => void, actions: Actions): void {
  useEffect(() => {
    const listen = (event: KeyboardEvent) => {
      if (event.target instanceof HTMLElement && event.target.closest("input, select, dialog") !== null && !(event.ctrlKey || event.metaKey)) return;
      const key = event.key.toLowerCase();
      const tool = ({ b: "belongs", n: "does-not-belong", h: "hem", v: "look" } as const)[key as "b"];
      if ((event.ctrlKey || event.metaKey) && (key === "z" || key === "y")) void (key === "y" || event.shiftKey ? actions.redo() : actions.undo());
      else if (event.ctrlKey || event.metaKey || event.altKey) return;
      else if (tool !== undefined) setState({ ...state, tool });
      else if (key === "[" || key === "]") setState({ ...state, radius: clampRadius(state.radius * (key === "]" ? 1.12 : 1 / 1.12)) });
      else if (key === "enter" && state.tool === "hem") actions.finishHem();
      else if (key === "escape") actions.dropHem();
      else return;
      event.preventDefault();
    };
    window.addEventListener("keydown", listen);
    return () => window.removeEventListener("keydown", listen);
  });
}

interface BoardProps {
  viewer: Viewer;
  subject: Subject;
  layer: Layer;
  canvas: Canvas;
  history: History;
  version: number;
  built: number;
  state: ToolState;
  onRadius: (radius: number) => void;
  onAdd: (gesture: Gesture) => void;
  onDrawing: (drawing: boolean) => void;
  gesturesRef: { current: Gestures | null };
}

/** The scan, its borders and the brush, in the viewer. */
function Board(props: BoardProps) {
  const { viewer, subject, layer, canvas, history, version, built, state } = props;
  const painter = useMemo(() => new Painter(canvas), [canvas]);
  const borders = useRef<Borders | null>(null);
  const hems = useRef<Lines | null>(null);
  const ring = useRef<BrushRing | null>(null);
  const latest = useRef(props);
  latest.current = props;
  useEffect(() => {
    const hide = viewer.show(canvas.surface);
    const parts = { borders: new Borders(viewer), hems: new Lines("#7a4ff0", 4, viewer), draft: new Lines("#b69cff", 4, viewer, true), ring: new BrushRing(viewer) };
    [borders.current, hems.current, ring.current] = [parts.borders, parts.hems, parts.ring];
    const host: GestureHost = {
      state: () => latest.current.state,
      add: (gesture) => latest.current.onAdd(gesture),
      setRadius: (radius) => latest.current.onRadius(radius),
      showHem: (points: Point[]) => {
        parts.draft.setPath(points.length === 1 ? [points[0], [points[0][0], points[0][1] + 0.004, points[0][2]]] : points);
        latest.current.onDrawing(points.length > 0);
      },
      showBrush: (hit) => parts.ring.show(hit, latest.current.state.radius),
    };
    const gestures = new Gestures(viewer, canvas, painter, host);
    props.gesturesRef.current = gestures;
    return () => {
      props.gesturesRef.current = null;
      gestures.dispose();
      for (const part of Object.values(parts)) part.dispose();
      hide();
    };
  }, [viewer, canvas]);
  useEffect(() => {
    painter.draw(history.gestures.flatMap((g) => g.strokes));
    hems.current?.set(history.gestures.flatMap((g) => g.hems).flatMap((h) => h.points.slice(1).flatMap((p, k) => [...h.points[k], ...p])));
    viewer.draw();
  }, [viewer, painter, version]);
  useGarment({ viewer, subject, layer, canvas, built }, (segments, distances) => {
    if (segments !== null) borders.current?.show(segments);
    painter.setGarment(distances);
    painter.draw(latest.current.history.gestures.flatMap((g) => g.strokes));
    viewer.draw();
  });
  useEffect(() => {
    viewer.canvas.dataset["tool"] = state.tool;
  }, [state.tool]);
  return null;
}

type GarmentProps = Pick<BoardProps, "viewer" | "subject" | "layer" | "canvas" | "built">;

/** Reads the cut garment, first and after each rebuild: its border, and which vertices of the scan lie on it. */
function useGarment({ subject, layer, canvas, built }: GarmentProps, onGarment: (segments: Float32Array | null, distances: Float32Array | null) => void): void {
  useEffect(() => {
    const stopper = new AbortController();
    if (!subject.files.includes(cutFile(layer)) && built === 0) {
      onGarment(null, null);
      return;
    }
    const read = async () => {
      const cut = await loadPly(fileAddress(subject.id, cutFile(layer)), stopper.signal);
      const segments = borderSegments(cut.positions, cut.triangles);
      const distances = await distancesFrom({ points: canvas.scan.positions, positions: cut.positions, triangles: cut.triangles }, stopper.signal);
      if (!stopper.signal.aborted) onGarment(segments, distances);
    };
    read().catch(() => undefined);
    return () => stopper.abort();
  }, [canvas, built]);
}
