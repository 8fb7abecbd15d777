import type { ComponentChildren } from "preact";
import { useEffect, useState } from "preact/hooks";
import type { Layer, Subject } from "../../api/types";
import { place } from "../../router";
import { useStore } from "../../state/store";
import { tint } from "../../three/meshes";
import { useMesh, useSurface } from "../../three/shown";
import { Stage } from "../../three/stage";
import type { Viewer } from "../../three/viewer";
import type { TabProps } from "./subject";

/** Metres between neighbours when layers are pulled wholly apart: a little more than a person with arms away is wide. */
const APART = 0.95;

/** Body and garments in the common frame: switched, tinted and pulled apart. */
export function LayersTab({ subject, layout, panel }: TabProps & { panel: ComponentChildren }) {
  const wanted = useStore(place).query.get("layer");
  const [hidden, setHidden] = useState<ReadonlySet<number>>(new Set());
  const [ownColors, setOwnColors] = useState(true);
  const [apart, setApart] = useState(0);
  useEffect(() => {
    const only = wanted === null || wanted === "" ? null : Number(wanted);
    setHidden(new Set(only === null ? [] : subject.layers.map((l) => l.index).filter((k) => k > only)));
  }, [wanted, subject.id]);
  const built = subject.layers.filter((layer) => subject.files.includes(meshFile(layer)));
  const toggle = (index: number) => setHidden((old) => toggled(old, index));
  const picture = (
    <Stage label={`Layers of ${subject.name}`} over={built.length === 0 ? <p class="stage-note">{emptyText(subject)}</p> : null}>
      {(viewer) => built.map((layer) => (
        <LayerSurface key={layer.folder} viewer={viewer} subject={subject} layer={layer} hidden={hidden.has(layer.index)}
          ownColors={ownColors} shift={apart * APART * (layer.index - (subject.layers.length - 1) / 2)} />
      ))}
    </Stage>
  );
  const controls = (
    <div class="controls">
      <ul class="layer-list">
        {[...subject.layers].reverse().map((layer) => <LayerLine key={layer.index} layer={layer} built={built.includes(layer)} shown={!hidden.has(layer.index)} onToggle={toggle} />)}
      </ul>
      <label class="row wide">Pull apart
        <input type="range" min={0} max={1} step={0.01} value={apart} onInput={(e) => setApart(Number(e.currentTarget.value))} />
      </label>
      <label class="row"><input type="checkbox" checked={ownColors} onChange={(e) => setOwnColors(e.currentTarget.checked)} />Colours of the person</label>
    </div>
  );
  return layout(picture, <>{controls}{panel}</>);
}

export function meshFile(layer: Layer): string {
  return layer.index === 0 ? "build/body/body.ply" : `build/${layer.folder}/garment.ply`;
}

function toggled(old: ReadonlySet<number>, index: number): ReadonlySet<number> {
  const next = new Set(old);
  if (!next.delete(index)) next.add(index);
  return next;
}

function emptyText(subject: Subject): string {
  if (subject.takes.length === 0) return "Nothing was recorded yet. “Scan” records the body first, then each garment over it.";
  return "The takes are not processed yet. “Process” makes body, garments and avatar of them.";
}

interface SurfaceProps {
  viewer: Viewer;
  subject: Subject;
  layer: Layer;
  hidden: boolean;
  ownColors: boolean;
  shift: number;
}

function LayerSurface({ viewer, subject, layer, hidden, ownColors, shift }: SurfaceProps) {
  const mesh = useMesh(subject, meshFile(layer));
  useSurface(viewer, mesh.value, { index: layer.index, visible: !hidden, ownColors, opacity: 1, shift });
  useEffect(() => viewer.fit(), [shift]);
  if (mesh.error !== null) return <p class="stage-note bad" role="alert">{layer.name}: {mesh.error}</p>;
  return mesh.busy ? <p class="stage-busy" role="status">Reading {layer.name} …</p> : null;
}

function LayerLine({ layer, built, shown, onToggle }: { layer: Layer; built: boolean; shown: boolean; onToggle: (k: number) => void }) {
  return (
    <li>
      <label class="row">
        <input type="checkbox" checked={shown && built} disabled={!built} onChange={() => onToggle(layer.index)} />
        <span class="swatch" style={{ background: tint(layer.index) }} />
        <span>{layer.name}</span>
        <span class="dim">{built ? (layer.index === 0 ? "body" : layer.type ?? "type unknown") : "not built"}</span>
        {layer.edits !== null && layer.edits.strokes + layer.edits.hems > 0 && <span class="chip">corrected</span>}
      </label>
    </li>
  );
}
