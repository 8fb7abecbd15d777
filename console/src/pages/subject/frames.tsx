import { useEffect, useState } from "preact/hooks";
import { frameAddress } from "../../api/client";
import type { Subject, Take } from "../../api/types";
import { Icon } from "../../ui/icons";
import { timeText } from "../../ui/words";
import type { TabProps } from "./subject";

type What = "depth" | "colour";
const CHOICES: [string, What[]][] = [["Depth", ["depth"]], ["Colour", ["colour"]], ["Both", ["depth", "colour"]]];
const PLAY_MS = 100;

/** All takes side by side at the same share of their turn. */
export function FramesTab({ subject, layout }: TabProps) {
  const takes = subject.takes.filter((take) => take.frames > 0);
  const [hidden, setHidden] = useState<ReadonlySet<number>>(new Set());
  const [share, setShare] = useState(0);
  const [what, setWhat] = useState<What[]>(["depth", "colour"]);
  const [playing, setPlaying] = useState(false);
  const longest = Math.max(1, ...takes.map((take) => take.frames));
  useEffect(() => {
    if (!playing) return;
    const timer = setInterval(() => setShare((old) => (old + 1 / longest) % 1), PLAY_MS);
    return () => clearInterval(timer);
  }, [playing, longest]);
  const shown = takes.filter((take) => !hidden.has(take.index));
  const picture = (
    <div class="frames">
      <div class="frames-grid" data-count={shown.length}>
        {shown.map((take) => <TakeFrames key={take.folder} subject={subject} take={take} share={share} what={what} />)}
        {takes.length === 0 && <p class="pad dim">No take of this subject has frames to look through.</p>}
      </div>
      <div class="scrub">
        <button type="button" class="icon" aria-label={playing ? "Pause" : "Play"} onClick={() => setPlaying(!playing)}><Icon name={playing ? "pause" : "play"} /></button>
        <input type="range" aria-label="Place in the turn" min={0} max={1} step={1 / longest} value={share} onInput={(e) => setShare(Math.min(0.9999, Number(e.currentTarget.value)))} />
        <output>{Math.round(360 * share)}°</output>
      </div>
    </div>
  );
  const panel = (
    <div class="controls">
      <fieldset class="choices">
        <legend>Pictures</legend>
        {CHOICES.map(([label, kinds]) => (
          <label key={label} class="row">
            <input type="radio" name="what" checked={kinds.join() === what.join()} onChange={() => setWhat(kinds)} />{label}
          </label>
        ))}
      </fieldset>
      <fieldset class="choices">
        <legend>Takes side by side</legend>
        {takes.map((take) => (
          <label key={take.folder} class="row">
            <input type="checkbox" checked={!hidden.has(take.index)} onChange={() => setHidden((old) => toggle(old, take.index))} />
            {take.name}<span class="dim">{take.frames} frames, {timeText(take.seconds)}</span>
          </label>
        ))}
      </fieldset>
      <p class="dim">The slider goes through each take from its first frame to its last; takes of one turn each face the same way at the same place.</p>
    </div>
  );
  return layout(picture, panel);
}

function toggle(old: ReadonlySet<number>, index: number): ReadonlySet<number> {
  const next = new Set(old);
  if (!next.delete(index)) next.add(index);
  return next;
}

function TakeFrames({ subject, take, share, what }: { subject: Subject; take: Take; share: number; what: What[] }) {
  const frame = Math.min(take.frames - 1, Math.floor(share * take.frames));
  return (
    <figure>
      <div class="frame-pair">{what.map((kind) => <Frame key={kind} subject={subject} take={take} frame={frame} kind={kind} />)}</div>
      <figcaption>{take.name}<span class="dim">frame {frame + 1} of {take.frames}</span></figcaption>
    </figure>
  );
}

/** A picture that is loaded before it takes the place of the last one, so that scrubbing does not flicker. */
function Frame({ subject, take, frame, kind }: { subject: Subject; take: Take; frame: number; kind: What }) {
  const wanted = frameAddress(subject.id, take.index, frame, kind);
  const [shown, setShown] = useState<string | null>(null);
  const [missing, setMissing] = useState(false);
  useEffect(() => {
    const picture = new Image();
    let current = true;
    picture.onload = () => {
      if (!current) return;
      setShown(wanted);
      setMissing(false);
    };
    picture.onerror = () => current && setMissing(true);
    picture.src = wanted;
    return () => {
      current = false;
    };
  }, [wanted]);
  if (missing) return <div class="frame-gap dim">no {kind} in this frame</div>;
  if (shown === null) return <div class="frame-gap dim">…</div>;
  return <img src={shown} alt={`${kind} of ${take.name}, frame ${frame + 1}`} />;
}
