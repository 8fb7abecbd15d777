import { address } from "./client";
import { setLink } from "./link";
import type { Capture, Job } from "./types";

/** What the service tells by itself. Each message has one of the keys. */
export interface ServiceEvent {
  job?: Job;
  capture?: Capture;
  archive?: unknown;
  hello?: unknown;
}

type Reader = (event: ServiceEvent) => void;

const readers = new Set<Reader>();
const PROBE_MS = 5_000;
const LONGEST_WAIT_MS = 5_000;

export function onEvent(reader: Reader): () => void {
  readers.add(reader);
  return () => readers.delete(reader);
}

/** Keeps a line to the service open for as long as the page lives; after a gap, readers get `{hello}` and read anew. */
export function keepListening(): void {
  let wait = 500;
  const open = () => {
    const source = new EventSource(address("api/events"));
    source.onopen = () => {
      wait = 500;
      setLink("live");
      tell({ hello: true });
    };
    source.onmessage = (message) => read(String(message.data));
    source.onerror = () => {
      source.close();
      void probe();
      setTimeout(open, wait);
      wait = Math.min(2 * wait, LONGEST_WAIT_MS);
    };
  };
  open();
}

/** An event source does not say why it failed; a plain request does. */
async function probe(): Promise<void> {
  try {
    const answer = await fetch(address("api/jobs"), { signal: AbortSignal.timeout(PROBE_MS) });
    if (answer.status === 401) return setLink("locked");
    if (answer.ok) return;
  } catch {
    // Not reached: told below.
  }
  setLink("lost");
}

function read(data: string): void {
  try {
    tell(JSON.parse(data) as ServiceEvent);
  } catch (e) {
    if (!(e instanceof SyntaxError)) throw e;
  }
}

function tell(event: ServiceEvent): void {
  for (const reader of [...readers]) reader(event);
}
