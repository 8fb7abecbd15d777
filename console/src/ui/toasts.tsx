import { createStore, useStore } from "../state/store";

interface Toast {
  id: number;
  text: string;
  bad: boolean;
  action: { label: string; run: () => void } | null;
}

const toasts = createStore<Toast[]>([]);
const STAY_MS = 9_000;
let count = 0;

function drop(id: number): void {
  toasts.set(toasts.get().filter((toast) => toast.id !== id));
}

/** Tells something at the foot of the page for a while; an error stays until it is closed. */
export function tell(text: string, action: Toast["action"] = null): void {
  add(text, false, action);
}

export function tellError(error: unknown): void {
  add(error instanceof Error ? error.message : String(error), true, null);
}

function add(text: string, bad: boolean, action: Toast["action"]): void {
  if (toasts.get().some((toast) => toast.text === text && toast.action === null && action === null)) return;
  count += 1;
  const id = count;
  toasts.set([...toasts.get().slice(-3), { id, text, bad, action }]);
  if (!bad) setTimeout(() => drop(id), STAY_MS);
}

export function Toasts() {
  const list = useStore(toasts);
  return (
    <div class="toasts" role="status" aria-live="polite">
      {list.map((toast) => (
        <div key={toast.id} class={toast.bad ? "toast bad" : "toast"}>
          <span>{toast.text}</span>
          {toast.action !== null && (
            <button type="button" class="plain" onClick={() => { toast.action?.run(); drop(toast.id); }}>{toast.action.label}</button>
          )}
          <button type="button" class="plain" aria-label="Close this message" onClick={() => drop(toast.id)}>×</button>
        </div>
      ))}
    </div>
  );
}
