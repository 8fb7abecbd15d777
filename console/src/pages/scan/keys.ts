import { useEffect } from "preact/hooks";

/** Keys that foot pedals and presenters send, beside the one that was taught. */
const USUAL = ["Space", "Enter", "PageDown", "F13"];
const KEY = "toile.pedal";

export function pedalKey(): string | null {
  return localStorage.getItem(KEY);
}

/** Remembers the next key that is pressed as the pedal's; resolves with its code, or null after Escape. */
export function teachPedal(): Promise<string | null> {
  return new Promise((resolve) => {
    const listen = (event: KeyboardEvent) => {
      event.preventDefault();
      event.stopPropagation();
      window.removeEventListener("keydown", listen, true);
      if (event.code === "Escape") return resolve(null);
      localStorage.setItem(KEY, event.code);
      resolve(event.code);
    };
    window.addEventListener("keydown", listen, true);
  });
}

function isTyping(target: EventTarget | null): boolean {
  return target instanceof HTMLElement && target.closest("input, select, textarea, button, a, dialog, summary, [contenteditable]") !== null;
}

/** Calls back at the one key. Where something is focused that the key would work, it works that instead, but for a taught pedal. */
export function useActionKey(run: () => void): void {
  useEffect(() => {
    const listen = (event: KeyboardEvent) => {
      if (event.repeat || event.ctrlKey || event.metaKey || event.altKey) return;
      const taught = event.code === pedalKey();
      if (!taught && (!USUAL.includes(event.code) || isTyping(event.target))) return;
      event.preventDefault();
      run();
    };
    window.addEventListener("keydown", listen);
    return () => window.removeEventListener("keydown", listen);
  }, [run]);
}
