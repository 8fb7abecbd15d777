import { createStore } from "../state/store";

/** Whether the service answers: `locked` means that it wants its token. */
export type Link = "opening" | "live" | "lost" | "locked";

export const link = createStore<Link>("opening");

export function setLink(state: Link): void {
  if (link.get() !== state) link.set(state);
}
