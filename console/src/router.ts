import { parsePlace, placeText, type Place } from "./place_text";
import { createStore } from "./state/store";

export { placeText, type Place };

export const place = createStore<Place>(parsePlace(location.hash));

window.addEventListener("hashchange", () => place.set(parsePlace(location.hash)));

export function go(path: string[], query: Record<string, string | number | null> = {}): void {
  location.hash = placeText(path, query);
}

/** Changes the query of the present place without a new entry in the history. */
export function refine(query: Record<string, string | number | null>): void {
  const { path, query: old } = place.get();
  const text = placeText(path, { ...Object.fromEntries(old), ...query });
  history.replaceState(null, "", text);
  place.set(parsePlace(text));
}
