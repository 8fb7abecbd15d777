import { useEffect, useRef, useState } from "preact/hooks";
import { api } from "../../api/client";
import type { Job, LayerEdits } from "../../api/types";
import { jobEnded, jobs, withJob } from "../../state/jobs";

export type KeepState = "kept" | "keeping" | "rebuilding" | "failed";

export interface Keeper {
  state: KeepState;
  error: string | null;
  /** Seconds that the last rebuild took. */
  seconds: number | null;
  /** Keeps the edits in the service, and rebuilds the layer where that is wanted. The newest call wins. */
  keep: (edits: LayerEdits, rebuild: boolean) => void;
}

/** One at a time: the file is kept, the layer is rebuilt, and what came meanwhile follows. */
export function useKeeper(subject: string, layer: number, onRebuilt: () => void): Keeper {
  const [state, setState] = useState<KeepState>("kept");
  const [error, setError] = useState<string | null>(null);
  const [seconds, setSeconds] = useState<number | null>(null);
  const wanted = useRef<{ edits: LayerEdits; rebuild: boolean } | null>(null);
  const working = useRef(false);
  const alive = useRef(true);
  useEffect(() => () => void (alive.current = false), []);
  const work = async () => {
    if (working.current) return;
    working.current = true;
    try {
      while (wanted.current !== null && alive.current) {
        const { edits, rebuild } = wanted.current;
        wanted.current = null;
        setState("keeping");
        await api.keepEdits(subject, layer, edits);
        if (rebuild) setSeconds(await rebuilt(subject, layer, () => setState("rebuilding"), onRebuilt));
      }
      setState("kept");
      setError(null);
    } catch (e) {
      setState("failed");
      setError(e instanceof Error ? e.message : String(e));
    } finally {
      working.current = false;
    }
  };
  const keep = (edits: LayerEdits, rebuild: boolean) => {
    wanted.current = { edits, rebuild: rebuild || (wanted.current?.rebuild ?? false) };
    void work();
  };
  return { state, error, seconds, keep };
}

/** Rebuilds a layer and resolves with the seconds that it took; the new border is there before the layers are stacked. */
async function rebuilt(subject: string, layer: number, onStart: () => void, onRebuilt: () => void): Promise<number> {
  const from = performance.now();
  onStart();
  const job = await api.rebuild(subject, layer);
  jobs.set(withJob(jobs.get(), job));
  let cut: number | null = null;
  const stop = jobs.subscribe((list) => {
    if (cut !== null || !isCut(list.find((other) => other.id === job.id))) return;
    cut = performance.now() - from;
    onRebuilt();
  });
  const ended = await jobEnded(job.id);
  stop();
  if (ended.state === "failed") throw new Error(ended.error ?? "The layer could not be rebuilt.");
  onRebuilt();
  return (cut ?? performance.now() - from) / 1000;
}

/** The layer's own cut is over once its job stacks all layers. */
function isCut(job: Job | undefined): boolean {
  return job?.state === "running" && /stack/.test(job.step ?? "");
}
