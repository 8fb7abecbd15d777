import { useState } from "preact/hooks";
import { api } from "../../api/client";
import type { Subject } from "../../api/types";
import { useRemote } from "../../state/remote";
import { Dialog } from "../../ui/dialog";
import { tell } from "../../ui/toasts";

export function AnimateDialog({ subject, onClose }: { subject: Subject; onClose: () => void }) {
  const clips = useRemote("clips", () => api.motions());
  const [wrong, setWrong] = useState<string | null>(null);
  const submit = async (event: SubmitEvent) => {
    event.preventDefault();
    const form = new FormData(event.currentTarget as HTMLFormElement);
    try {
      await api.addJob("animate", subject.id, { motion: String(form.get("motion")), blend: String(form.get("blend")) });
      tell(`${subject.name} will be animated; the motion appears here when it is done.`);
      onClose();
    } catch (e) {
      setWrong(e instanceof Error ? e.message : String(e));
    }
  };
  return (
    <Dialog title={`Animate ${subject.name}`} onClose={onClose}>
      <form class="stack" onSubmit={submit}>
        <label class="field">Motion
          <select name="motion">
            {(clips.value ?? []).map((clip) => <option key={clip.name} value={clip.name}>{clip.name} ({clip.seconds.toFixed(1)} s)</option>)}
          </select>
        </label>
        <label class="field">Garments move
          <select name="blend">
            <option value="anchored">as cloth, held by the skin (slower)</option>
            <option value="skinning">with the skin alone (fast)</option>
          </select>
        </label>
        <p class="bad" role="alert">{wrong ?? clips.error}</p>
        <div class="actions">
          <button type="button" class="plain" onClick={onClose}>Cancel</button>
          <button type="submit" class="main" disabled={clips.value === null}>Animate</button>
        </div>
      </form>
    </Dialog>
  );
}
