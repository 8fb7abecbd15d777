import { BufferAttribute } from "three";
import { useEffect, useState } from "preact/hooks";
import type { Subject, Take } from "../../api/types";
import { place, refine } from "../../router";
import { useStore } from "../../state/store";
import { distancesFrom, divergingColors, summary, type DistanceSummary } from "../../three/distances";
import { linearColors } from "../../three/meshes";
import { useMesh, useSurface } from "../../three/shown";
import { Stage } from "../../three/stage";
import type { Viewer } from "../../three/viewer";
import { bytesText, timeText } from "../../ui/words";
import type { TabProps } from "./subject";

const RANGES_MM = [5, 20, 50, 150];

interface Show {
  colors: boolean;
  body: boolean;
  distances: boolean;
  rangeMm: number;
}

/** The scan of a take: its colours, the body in it, and how far the two are apart. */
export function ScanTab({ subject, layout }: TabProps) {
  const query = useStore(place).query;
  const chosen = Number(query.get("take") ?? 0);
  const take = subject.takes.find((t) => t.index === chosen) ?? subject.takes[0];
  const [show, setShow] = useState<Show>({ colors: true, body: query.get("body") === "1", distances: false, rangeMm: 20 });
  const [found, setFound] = useState<DistanceSummary | null>(null);
  if (take === undefined) return layout(<p class="page dim">Nothing was recorded yet.</p>, null);
  const scanned = subject.files.includes(`build/${take.folder}/scan.ply`);
  const picture = (
    <Stage label={`Scan of ${take.name}`} over={<>
      {!scanned && <p class="stage-note">This take is not fused yet. “Process” makes its scan.</p>}
      {show.distances && <Legend rangeMm={show.rangeMm} found={found} />}
    </>}>
      {(viewer) => <ScanPicture key={take.folder} viewer={viewer} subject={subject} take={take} show={show} onFound={setFound} />}
    </Stage>
  );
  const set = (part: Partial<Show>) => setShow({ ...show, ...part });
  const panel = (
    <div class="controls">
      <TakeList takes={subject.takes} chosen={take.index} />
      <label class="row"><input type="checkbox" checked={show.colors} onChange={(e) => set({ colors: e.currentTarget.checked })} />Colours of the scan</label>
      <label class="row"><input type="checkbox" checked={show.body} onChange={(e) => set({ body: e.currentTarget.checked })} />Body over the scan</label>
      <label class="row"><input type="checkbox" checked={show.distances} onChange={(e) => set({ distances: e.currentTarget.checked })} />Distances from the body as colours</label>
      {show.distances && (
        <label class="row">Scale
          <select value={show.rangeMm} onChange={(e) => set({ rangeMm: Number(e.currentTarget.value) })}>
            {RANGES_MM.map((mm) => <option key={mm} value={mm}>± {mm} mm</option>)}
          </select>
        </label>
      )}
      <TakeFacts take={take} />
    </div>
  );
  return layout(picture, panel);
}

export function TakeList({ takes, chosen }: { takes: Take[]; chosen: number }) {
  return (
    <fieldset class="choices">
      <legend>Take</legend>
      {takes.map((take) => (
        <label key={take.folder} class="row">
          <input type="radio" name="take" checked={take.index === chosen} onChange={() => refine({ take: take.index })} />
          {take.name}<span class="dim">{take.index === 0 ? "body" : take.type ?? ""}</span>
          {take.state !== "ok" && take.state !== "scan" && <span class="state torn">{take.state}</span>}
        </label>
      ))}
    </fieldset>
  );
}

function TakeFacts({ take }: { take: Take }) {
  const facts: [string, string][] = [
    ["Recording", `${bytesText(take.bytes)}, ${take.frames} frames in ${timeText(take.seconds)}`],
    ["Sensors", take.sensors.join(", ")],
    ["Turn", take.full_turn === null ? "not known" : take.full_turn ? "full" : "not full"],
    ["Dropped frames", String(take.dropped)],
    ["Depth noise", take.noise_mm === null ? "not measured" : `${take.noise_mm.toFixed(1)} mm`],
  ];
  return (
    <dl class="facts">
      {facts.map(([name, value]) => <div key={name}><dt>{name}</dt><dd>{value}</dd></div>)}
      {take.problem !== null && <div><dt>Problem</dt><dd class="bad">{take.problem}</dd></div>}
    </dl>
  );
}

interface PictureProps {
  viewer: Viewer;
  subject: Subject;
  take: Take;
  show: Show;
  onFound: (found: DistanceSummary | null) => void;
}

function ScanPicture({ viewer, subject, take, show, onFound }: PictureProps) {
  const scan = useMesh(subject, `build/${take.folder}/scan.ply`);
  const bodyFile = take.index === 0 ? "build/body/body.ply" : `build/${take.folder}/body.ply`;
  const body = useMesh(subject, show.body || show.distances ? bodyFile : null);
  const made = useSurface(viewer, scan.value, { index: 7, visible: true, ownColors: show.colors || show.distances, opacity: 1, shift: 0 });
  useSurface(viewer, show.body ? body.value : null, { index: 1, visible: true, ownColors: false, opacity: 0.55, shift: 0 });
  const [distances, setDistances] = useState<Float32Array | null>(null);
  useEffect(() => {
    setDistances(null);
    if (!show.distances || scan.value === null || body.value === null) return;
    const stopper = new AbortController();
    const task = { points: scan.value.positions, positions: body.value.positions, triangles: body.value.triangles };
    void distancesFrom(task, stopper.signal).then((found) => stopper.signal.aborted || setDistances(found));
    return () => stopper.abort();
  }, [show.distances, scan.value, body.value]);
  useEffect(() => {
    if (made === null || scan.value === null) return;
    const colors = show.distances && distances !== null ? divergingColors(distances, show.rangeMm / 1000)
      : scan.value.colors === null ? null : linearColors(scan.value.colors);
    if (colors !== null) made.geometry.setAttribute("color", new BufferAttribute(colors, 3));
    onFound(distances === null ? null : summary(distances));
    viewer.draw();
  }, [made, scan.value, distances, show.distances, show.rangeMm]);
  const error = scan.error ?? body.error;
  if (error !== null) return <p class="stage-note bad" role="alert">{error}</p>;
  const busy = scan.busy || body.busy || (show.distances && distances === null && body.value !== null);
  return busy ? <p class="stage-busy" role="status">{scan.busy ? "Reading the scan …" : "Measuring distances …"}</p> : null;
}

function Legend({ rangeMm, found }: { rangeMm: number; found: DistanceSummary | null }) {
  return (
    <div class="legend">
      <div class="legend-bar" aria-hidden="true" />
      <div class="legend-ticks"><span>−{rangeMm} mm inside</span><span>0</span><span>outside +{rangeMm} mm</span></div>
      {found !== null && <p>mean {found.mean_mm.toFixed(1)} mm, 95 of 100 within {found.p95_mm.toFixed(1)} mm</p>}
    </div>
  );
}
