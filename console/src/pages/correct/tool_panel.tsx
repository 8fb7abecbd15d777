import type { History } from "../../brush/strokes";
import { Icon } from "../../ui/icons";
import { countText } from "../../ui/words";
import type { Tool, ToolState } from "./gestures";
import type { Keeper } from "./rebuild";

const TOOLS: [Tool, string, string][] = [
  ["belongs", "Belongs", "B"], ["does-not-belong", "Does not belong", "N"], ["hem", "Hem line", "H"], ["look", "Turn only", "V"],
];

const HINTS: Record<Tool, string> = {
  belongs: "Paint what is the garment. The wheel changes the radius over the scan; beside it dragging turns the picture, and so does the right button.",
  "does-not-belong": "Paint what is not the garment. The wheel changes the radius over the scan.",
  hem: "Click along the hem; each click snaps to an edge in colour or shape. Enter ends the line, a click on its start closes it, Escape drops it.",
  look: "Dragging turns the picture everywhere.",
};

interface Props {
  state: ToolState;
  onState: (part: Partial<ToolState>) => void;
  history: History;
  actions: { undo: () => unknown; redo: () => unknown; clear: () => unknown; finishHem: () => void; dropHem: () => void; rebuild: () => void };
  drawing: boolean;
  auto: boolean;
  onAuto: (auto: boolean) => void;
  keeper: Keeper;
  mirrored: boolean;
}

export function ToolPanel({ state, onState, history, actions, drawing, auto, onAuto, keeper, mirrored }: Props) {
  const isHem = state.tool === "hem";
  const size = isHem ? state.reach : state.radius;
  return (
    <div class="controls">
      <div class="tool-grid" role="group" aria-label="Tool">
        {TOOLS.map(([tool, label, key]) => (
          <button key={tool} type="button" class={`plain tool ${tool}`} aria-pressed={state.tool === tool} aria-keyshortcuts={key} onClick={() => onState({ tool })}>
            {label}<kbd>{key}</kbd>
          </button>
        ))}
      </div>
      <p class="dim">{HINTS[state.tool]}</p>
      <label class="row wide">{isHem ? "Reach" : "Radius"}
        <input type="range" min={0.003} max={0.1} step={0.001} value={size} onInput={(e) => onState(isHem ? { reach: Number(e.currentTarget.value) } : { radius: Number(e.currentTarget.value) })} />
        <output>{Math.round(1000 * size)} mm</output>
      </label>
      <label class="row"><input type="checkbox" checked={state.symmetric} disabled={!mirrored} onChange={(e) => onState({ symmetric: e.currentTarget.checked })} />On both sides of the body</label>
      {drawing && (
        <div class="row">
          <button type="button" class="main" onClick={actions.finishHem}>End the hem line</button>
          <button type="button" class="plain" onClick={actions.dropHem}>Drop it</button>
        </div>
      )}
      <div class="row">
        <button type="button" class="plain" disabled={!history.canUndo} aria-keyshortcuts="Control+Z" onClick={() => actions.undo()}><Icon name="undo" />Undo</button>
        <button type="button" class="plain" disabled={!history.canRedo} aria-keyshortcuts="Control+Shift+Z" onClick={() => actions.redo()}><Icon name="redo" />Redo</button>
        <button type="button" class="plain" disabled={!history.canUndo} onClick={() => actions.clear()}>Clear</button>
      </div>
      <label class="row"><input type="checkbox" checked={auto} onChange={(e) => onAuto(e.currentTarget.checked)} />Rebuild after each change</label>
      {!auto && <button type="button" class="main" onClick={actions.rebuild}>Rebuild the layer</button>}
      <ul class="legend-list">
        <li><span class="swatch old-border" />border before</li>
        <li><span class="swatch new-border" />border of the last rebuild</li>
        <li><span class="swatch hem-border" />hem lines</li>
      </ul>
      <p class="dim" role="status" data-keeper={keeper.state}>{statusText(keeper, history)}</p>
    </div>
  );
}

function statusText(keeper: Keeper, history: History): string {
  const { strokes, hems } = history.file();
  const what = `${countText(strokes.length, "stroke")}, ${countText(hems.length, "hem line")}`;
  const took = keeper.seconds === null ? "" : ` · rebuilt in ${keeper.seconds.toFixed(1)} s`;
  return keeper.state === "failed" ? `Not kept: ${keeper.error ?? ""}` : `${what}${took}`;
}
