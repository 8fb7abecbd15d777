import { useEffect, useRef, useState } from "preact/hooks";
import { fileAddress } from "../../api/client";
import type { Motion, Subject } from "../../api/types";
import { place, refine } from "../../router";
import { useRemote } from "../../state/remote";
import { useStore } from "../../state/store";
import { cached, loadGltf, skinned, type Moving } from "../../three/avatar";
import { openPointCache, type PointCache } from "../../three/pc2";
import { Stage } from "../../three/stage";
import type { Viewer } from "../../three/viewer";
import { Icon } from "../../ui/icons";
import type { TabProps } from "./subject";

/** What can be played: a motion's cloth, a motion by skinning, or the clip of the avatar file. */
interface Choice {
  id: string;
  label: string;
  glb: string;
  motion: Motion | null;
  cloth: boolean;
}

export function choicesOf(subject: Subject): Choice[] {
  const choices: Choice[] = [];
  for (const motion of subject.motions) {
    const glb = motion.glb ?? "avatar.glb";
    if (motion.files.length > 0) choices.push({ id: `${motion.name} cloth`, label: `${motion.name}, cloth`, glb, motion, cloth: true });
    if (motion.glb !== null) choices.push({ id: `${motion.name} skin`, label: `${motion.name}, skin alone`, glb, motion, cloth: false });
  }
  if (subject.files.includes("avatar.glb")) choices.push({ id: "avatar", label: "clip of avatar.glb, skin alone", glb: "avatar.glb", motion: null, cloth: false });
  return choices;
}

async function openChoice(subject: Subject, choice: Choice, signal: AbortSignal): Promise<Moving> {
  const gltf = loadGltf(fileAddress(subject.id, choice.glb), signal);
  if (!choice.cloth || choice.motion === null) return skinned(await gltf);
  const open = async (file: string): Promise<[string, PointCache]> => [file.split("/").pop()!.replace(/\.pc2$/, ""), await openPointCache(fileAddress(subject.id, file))];
  const caches = new Map(await Promise.all(choice.motion.files.map(open)));
  return cached(await gltf, caches, choice.motion.fps);
}

export function MotionTab({ subject, layout }: TabProps) {
  const choices = choicesOf(subject);
  const query = useStore(place).query;
  const chosen = choices.find((choice) => choice.id === query.get("motion")) ?? choices[0] ?? null;
  const moving = useRemote(chosen === null ? null : `${subject.id} ${subject.modified} ${chosen.id}`, (signal) => openChoice(subject, chosen!, signal));
  const [playing, setPlaying] = useState(true);
  const [moment, setMoment] = useState(0);
  const [hidden, setHidden] = useState<ReadonlySet<string>>(new Set());
  const names = [...(moving.value?.layers.keys() ?? [])];
  const over = (
    <>
      {chosen === null && <p class="stage-note">There is no avatar yet. “Process” makes it, “Animate” lets its garments move as cloth.</p>}
      {moving.error !== null && <p class="stage-note bad" role="alert">{moving.error}</p>}
      {moving.busy && <p class="stage-busy" role="status">Reading the motion …</p>}
      <div class="scrub over">
        <button type="button" class="icon" disabled={chosen === null} aria-label={playing ? "Pause" : "Play"} onClick={() => setPlaying(!playing)}><Icon name={playing ? "pause" : "play"} /></button>
        <input type="range" aria-label="Moment of the motion" min={0} max={moving.value?.seconds ?? 1} step={1 / 30} value={moment}
          onInput={(e) => { setPlaying(false); setMoment(Number(e.currentTarget.value)); }} />
        <output>{moment.toFixed(1)} s</output>
      </div>
    </>
  );
  const picture = (
    <Stage label={`Avatar of ${subject.name}`} over={over}>
      {(viewer) => <Player key={chosen?.id ?? ""} viewer={viewer} moving={moving.value} playing={playing} moment={moment} hidden={hidden} onMoment={setMoment} />}
    </Stage>
  );
  const panel = (
    <div class="controls">
      <fieldset class="choices">
        <legend>Motion</legend>
        {choices.map((choice) => (
          <label key={choice.id} class="row"><input type="radio" name="motion" checked={choice === chosen || choice.id === chosen?.id} onChange={() => refine({ motion: choice.id })} />{choice.label}</label>
        ))}
      </fieldset>
      <fieldset class="choices">
        <legend>Layers</legend>
        {names.map((name) => (
          <label key={name} class="row"><input type="checkbox" checked={!hidden.has(name)} onChange={() => setHidden((old) => toggle(old, name))} />{name}</label>
        ))}
      </fieldset>
      <p class="dim">Cloth is played from the point caches of the motion; they are fetched while it plays.</p>
    </div>
  );
  return layout(picture, panel);
}

function toggle(old: ReadonlySet<string>, name: string): ReadonlySet<string> {
  const next = new Set(old);
  if (!next.delete(name)) next.add(name);
  return next;
}

interface PlayerProps {
  viewer: Viewer;
  moving: Moving | null;
  playing: boolean;
  moment: number;
  hidden: ReadonlySet<string>;
  onMoment: (seconds: number) => void;
}

function Player({ viewer, moving, playing, moment, hidden, onMoment }: PlayerProps) {
  const clock = useRef(0);
  useEffect(() => {
    if (moving === null) return;
    clock.current = 0;
    moving.show(0);
    const hide = viewer.show(moving.object);
    return () => {
      hide();
      moving.dispose();
    };
  }, [viewer, moving]);
  useEffect(() => {
    if (moving === null) return;
    for (const [name, object] of moving.layers) object.visible = !hidden.has(name);
    viewer.draw();
  }, [viewer, moving, hidden]);
  useEffect(() => {
    if (moving === null || playing) return;
    clock.current = moment;
    let tries = 0;
    const look = () => {
      if (!moving.show(moment) && tries < 100) {
        tries += 1;
        timer = setTimeout(look, 50);
      }
      viewer.draw();
    };
    let timer = setTimeout(look, 0);
    return () => clearTimeout(timer);
  }, [viewer, moving, playing, moment]);
  useEffect(() => {
    if (moving === null || !playing || moving.seconds === 0) return;
    viewer.setAnimation((seconds) => {
      const next = (clock.current + seconds) % moving.seconds;
      if (!moving.show(next)) return;
      clock.current = next;
      onMoment(next);
    });
    return () => viewer.setAnimation(null);
  }, [viewer, moving, playing]);
  return null;
}
