import { useState } from "preact/hooks";
import { api } from "../../api/client";
import type { Subject } from "../../api/types";
import { tell } from "../../ui/toasts";

const JOINT_NAMES = [["vrm", "VRM"], ["hanim", "H-Anim"], ["mixamo", "Mixamo"]];

/** Writes the avatar anew with other names of its joints, or without what no layer shows. */
export function ExportForm({ subject }: { subject: Subject }) {
  const [wrong, setWrong] = useState<string | null>(null);
  const submit = async (event: SubmitEvent) => {
    event.preventDefault();
    const form = new FormData(event.currentTarget as HTMLFormElement);
    try {
      await api.addJob("export", subject.id, { joint_names: String(form.get("names")), cull_hidden: form.get("cull") !== null });
      setWrong(null);
      tell(`The avatar of ${subject.name} is written again.`);
    } catch (e) {
      setWrong(e instanceof Error ? e.message : String(e));
    }
  };
  return (
    <details>
      <summary>Export with other settings</summary>
      <form class="stack export" onSubmit={submit}>
        <label class="row">Names of joints
          <select name="names">{JOINT_NAMES.map(([value, label]) => <option key={value} value={value}>{label}</option>)}</select>
        </label>
        <label class="row"><input type="checkbox" name="cull" />Leave out what layers above hide</label>
        <p class="bad" role="alert">{wrong}</p>
        <div><button type="submit" class="plain">Export</button></div>
      </form>
    </details>
  );
}
