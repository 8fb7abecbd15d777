import { useState } from "preact/hooks";
import { api } from "../../api/client";
import type { Binned } from "../../api/types";
import { useRemote } from "../../state/remote";
import { Dialog } from "../../ui/dialog";
import { momentText } from "../../ui/words";

/** Subjects that were taken out of the archive; each can be put back. */
export function BinDialog({ onRestored, onClose }: { onRestored: () => void; onClose: () => void }) {
  const [asked, setAsked] = useState(0);
  const [wrong, setWrong] = useState<string | null>(null);
  const bin = useRemote(`bin ${asked}`, () => api.bin());
  const restore = async (subject: Binned) => {
    try {
      await api.restore(subject.undo);
      setWrong(null);
      onRestored();
    } catch (e) {
      setWrong(e instanceof Error ? e.message : String(e));
    }
    setAsked(asked + 1);
  };
  return (
    <Dialog title="Bin" onClose={onClose}>
      {bin.value?.length === 0 && <p class="dim">The bin is empty.</p>}
      <ul class="bin-list">
        {(bin.value ?? []).map((subject) => (
          <li key={subject.undo}>
            <span><strong>{subject.name}</strong> <span class="dim">{momentText(subject.removed)}</span></span>
            <button type="button" class="plain" onClick={() => void restore(subject)}>Put back</button>
          </li>
        ))}
      </ul>
      <p class="bad" role="alert">{wrong ?? bin.error}</p>
      <div class="actions"><button type="button" class="plain" onClick={onClose}>Close</button></div>
    </Dialog>
  );
}
