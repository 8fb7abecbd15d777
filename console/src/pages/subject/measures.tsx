import { Color, Vector2 } from "three";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { useEffect, useRef, useState } from "preact/hooks";
import { api } from "../../api/client";
import type { Measure, Subject } from "../../api/types";
import { useRemote } from "../../state/remote";
import { cssColor, theme } from "../../state/theme";
import { useStore } from "../../state/store";
import { useMesh, useSurface } from "../../three/shown";
import { Stage } from "../../three/stage";
import type { Viewer } from "../../three/viewer";
import type { TabProps } from "./subject";
import { segments } from "./tapes";

const FILE = "build/body/measurements.json";

/** The tapes of all measurements on the standing body, and their values. */
export function MeasuresTab({ subject, layout }: TabProps) {
  const there = subject.files.includes(FILE);
  const read = useRemote(there ? `${subject.id} ${subject.modified}` : null, () => api.file<{ measures: Measure[] }>(subject.id, FILE));
  const [chosen, setChosen] = useState<string | null>(null);
  const measures = read.value?.measures ?? [];
  const picture = (
    <Stage label={`Measurements of ${subject.name}`} over={there ? null : <p class="stage-note">The body is not fitted yet. “Process” fits and measures it.</p>}>
      {(viewer) => <Tapes viewer={viewer} subject={subject} measures={measures} chosen={chosen} />}
    </Stage>
  );
  const panel = (
    <div class="controls">
      {read.error !== null && <p class="bad" role="alert">{read.error}</p>}
      {there && <p class="dim">After ISO 8559-1, on the body stood straight; ± holds the true value in 95 of 100 cases.</p>}
      <MeasureTable measures={measures} chosen={chosen} onChoose={setChosen} />
    </div>
  );
  return layout(picture, panel);
}

function MeasureTable({ measures, chosen, onChoose }: { measures: Measure[]; chosen: string | null; onChoose: (name: string | null) => void }) {
  if (measures.length === 0) return null;
  return (
    <table class="measures">
      <thead><tr><th scope="col">Measurement</th><th scope="col">cm</th><th scope="col">±</th></tr></thead>
      <tbody>
        {measures.map((m) => (
          <tr key={m.name} class={m.name === chosen ? "chosen" : ""} onMouseEnter={() => onChoose(m.name)}>
            <th scope="row">
              <button type="button" title={m.definition} aria-pressed={m.name === chosen} onFocus={() => onChoose(m.name)} onClick={() => onChoose(m.name)}>{m.name}</button>
            </th>
            <td>{(100 * m.value_m).toFixed(1)}{m.doubt != null && <span class="warnmark" title={m.doubt}> (?)</span>}</td>
            <td class="dim">{m.uncertainty_m === undefined ? "" : (100 * m.uncertainty_m).toFixed(1)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

function Tapes({ viewer, subject, measures, chosen }: { viewer: Viewer; subject: Subject; measures: Measure[]; chosen: string | null }) {
  const body = useMesh(subject, "build/body/standing.ply");
  const colours = useStore(theme);
  useSurface(viewer, body.value, { index: 0, visible: true, ownColors: false, opacity: 1, shift: 0 });
  const lines = useRef<{ all: LineSegments2; one: LineSegments2 } | null>(null);
  useEffect(() => {
    const all = tape(measures, cssColor("--tape") || "#246", 1.6);
    const one = tape([], cssColor("--tape-chosen") || "#d40", 5);
    one.material.depthTest = false;
    one.renderOrder = 2;
    const hides = [viewer.show(all), viewer.show(one)];
    lines.current = { all, one };
    return () => {
      for (const hide of hides) hide();
      for (const line of [all, one]) {
        line.geometry.dispose();
        line.material.dispose();
      }
    };
  }, [viewer, measures, colours]);
  useEffect(() => {
    const one = lines.current?.one;
    const measure = measures.find((m) => m.name === chosen);
    if (one === undefined) return;
    one.visible = measure !== undefined;
    if (measure !== undefined) {
      one.geometry.dispose();
      one.geometry = new LineSegmentsGeometry().setPositions(segments(measure));
    }
    viewer.draw();
  }, [chosen, measures, colours]);
  return body.busy ? <p class="stage-busy" role="status">Reading the body …</p> : null;
}

function tape(measures: Measure[], color: string, width: number): LineSegments2 {
  const material = new LineMaterial({ color: new Color(color).getHex(), linewidth: width, resolution: new Vector2(innerWidth, innerHeight) });
  const girths = measures.filter((m) => m.kind === "girth" || m.kind === "length");
  const line = new LineSegments2(new LineSegmentsGeometry().setPositions(girths.flatMap(segments)), material);
  line.frustumCulled = false;
  return line;
}
