import { api } from "../api/client";
import { onEvent } from "../api/events";
import type { Capture } from "../api/types";
import { createStore } from "./store";

/** How the running capture stands; null until the service has told it. */
export const capture = createStore<Capture | null>(null);

/** How often an event has told it. */
let told = 0;

export function tellCapture(now: Capture): void {
  told += 1;
  capture.set(now);
}

/** Asks the service for a step. What an event has told meanwhile stays: the answer, on a line of its own, may be older and come later. */
export async function askCapture(step: () => Promise<Capture>): Promise<void> {
  const before = told;
  const answer = await step();
  if (told === before) capture.set(answer);
}

export async function readCapture(): Promise<void> {
  try {
    await askCapture(api.capture);
  } catch {
    // Told by the banner; the next hello reads again.
  }
}

onEvent((event) => {
  if (event.hello !== undefined) void readCapture();
  if (event.capture !== undefined) tellCapture(event.capture);
});
