import { useState } from "preact/hooks";
import { api } from "../../api/client";
import { go } from "../../router";
import { Dialog } from "../../ui/dialog";
import { idFor } from "../../ui/words";

export function NewSubject({ taken, onClose }: { taken: string[]; onClose: () => void }) {
  const [name, setName] = useState("");
  const [ownId, setOwnId] = useState<string | null>(null);
  const [wrong, setWrong] = useState<string | null>(null);
  const id = ownId ?? idFor(name);
  const fault = wrong ?? (taken.includes(id) ? `There is a subject with the folder “${id}” already.` : null);
  const submit = async (event: SubmitEvent) => {
    event.preventDefault();
    try {
      const subject = await api.addSubject(id, name);
      go(["scan", subject.id ?? id]);
    } catch (e) {
      setWrong(e instanceof Error ? e.message : String(e));
    }
  };
  return (
    <Dialog title="New subject" onClose={onClose}>
      <form class="stack" onSubmit={submit}>
        <label class="field">Name
          <input name="name" required autofocus value={name} onInput={(e) => { setName(e.currentTarget.value); setWrong(null); }} />
        </label>
        <label class="field">Folder
          <input name="id" required pattern="[A-Za-z0-9][A-Za-z0-9._\-]*" value={id} aria-describedby="new-fault"
            onInput={(e) => { setOwnId(e.currentTarget.value); setWrong(null); }} />
        </label>
        <p id="new-fault" class="bad" role="alert">{fault}</p>
        <div class="actions">
          <button type="button" class="plain" onClick={onClose}>Cancel</button>
          <button type="submit" class="main" disabled={fault !== null || id === ""}>Create and scan</button>
        </div>
      </form>
    </Dialog>
  );
}
