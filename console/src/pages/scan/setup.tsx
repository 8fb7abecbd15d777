import { useEffect, useState } from "preact/hooks";
import { api } from "../../api/client";
import type { NextLayer, SubjectLine } from "../../api/types";
import { go } from "../../router";
import { useRemote } from "../../state/remote";
import { GARMENT_TYPES } from "../../ui/words";

export interface Choice {
  device: string;
  name: string;
  type: string;
}

interface Props {
  subject: string | null;
  next: NextLayer | null;
  choice: Choice;
  error: string | null;
  onChoice: (part: Partial<Choice>) => void;
  onOpen: () => void;
}

/** Before a take: who, by which camera, and which layer. */
export function Setup({ subject, next, choice, error, onChoice, onOpen }: Props) {
  const archive = useRemote("archive", () => api.archive());
  const [asked, setAsked] = useState(0);
  const devices = useRemote(`devices ${asked}`, () => api.devices());
  const list = devices.value?.devices ?? [];
  useEffect(() => {
    if (choice.device !== "" && list.some((d) => d.id === choice.device)) return;
    const first = list.find((d) => d.usable);
    if (first !== undefined) onChoice({ device: first.id });
  }, [devices.value]);
  const submit = (event: SubmitEvent) => {
    event.preventDefault();
    onOpen();
  };
  return (
    <form class="scan-setup" onSubmit={submit}>
      <section class="stack">
        <h2>Subject</h2>
        <label class="field"><span class="sr">Subject</span>
          <select required value={subject ?? ""} onChange={(e) => go(["scan", e.currentTarget.value])}>
            <option value="" disabled>Choose a subject</option>
            {(archive.value?.subjects ?? []).map((s: SubjectLine) => <option key={s.id} value={s.id}>{s.name}</option>)}
          </select>
        </label>
        <p class="dim">A new subject is added on the <a href="#/">archive’s page</a>.</p>
        <h2>Layer {next?.layer ?? ""}</h2>
        {next !== null && <p class="say">{next.say}</p>}
        <div class="row layer-fields">
          <label class="field">Name
            <input required value={choice.name} pattern="[A-Za-z0-9][A-Za-z0-9_\-]*" onInput={(e) => onChoice({ name: e.currentTarget.value })} />
          </label>
          {next?.layer !== 0 && (
            <label class="field">Type
              <select value={choice.type} onChange={(e) => onChoice({ type: e.currentTarget.value })}>
                <option value="">guess it</option>
                {GARMENT_TYPES.map((type) => <option key={type} value={type}>{type}</option>)}
              </select>
            </label>
          )}
        </div>
      </section>
      <section class="stack">
        <div class="row spread"><h2>Camera</h2><button type="button" class="plain" onClick={() => setAsked(asked + 1)}>Look again</button></div>
        <fieldset class="devices">
          <legend class="sr">Camera or rig</legend>
          {list.map((device) => (
            <label key={device.id} class={device.id === choice.device ? "device chosen" : "device"}>
              <input type="radio" name="device" disabled={!device.usable} checked={device.id === choice.device} onChange={() => onChoice({ device: device.id })} />
              <span><strong>{device.name}</strong><span class="dim">{device.detail || device.kind}</span>{device.problem !== null && <span class="bad">{device.problem}</span>}</span>
            </label>
          ))}
          {devices.value !== null && list.length === 0 && <p class="dim">No camera is plugged in.</p>}
        </fieldset>
        {(devices.value?.warnings ?? []).map((warning) => <p key={warning} class="dim">{warning}</p>)}
        {devices.error !== null && <p class="bad" role="alert">{devices.error}</p>}
      </section>
      <div class="scan-open">
        {error !== null && <p class="bad" role="alert">{error}</p>}
        <button type="submit" class="main large" disabled={subject === null || choice.device === "" || choice.name === ""}>Open the camera</button>
      </div>
    </form>
  );
}
