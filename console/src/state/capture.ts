import { api } from "../api/client";
import { onEvent } from "../api/events";
import type { Capture } from "../api/types";
import { createStore } from "./store";

/** How the running capture stands; null until the service has told it. */
export const capture = createStore<Capture | null>(null);

export async function readCapture(): Promise<void> {
  try {
    capture.set(await api.capture());
  } catch {
    // Told by the banner; the next hello reads again.
  }
}

onEvent((event) => {
  if (event.hello !== undefined) void readCapture();
  if (event.capture !== undefined) capture.set(event.capture);
});
