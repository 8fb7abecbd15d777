import { createStore } from "./store";

export type Theme = "system" | "light" | "dark";

const KEY = "toile.theme";

function kept(): Theme {
  const value = localStorage.getItem(KEY);
  return value === "light" || value === "dark" ? value : "system";
}

export const theme = createStore<Theme>(kept());

/** Sets the theme on the document; without one, the system's setting decides. */
export function applyTheme(next: Theme = theme.get()): void {
  if (next === "system") {
    localStorage.removeItem(KEY);
    delete document.documentElement.dataset["theme"];
  } else {
    localStorage.setItem(KEY, next);
    document.documentElement.dataset["theme"] = next;
  }
  theme.set(next);
}

/** A colour of the style sheet, for what is drawn by the graphics card. */
export function cssColor(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

export function onThemeChange(reader: () => void): () => void {
  const media = matchMedia("(prefers-color-scheme: dark)");
  media.addEventListener("change", reader);
  const stop = theme.subscribe(reader);
  return () => {
    media.removeEventListener("change", reader);
    stop();
  };
}
