import { useEffect, useRef, useState } from "preact/hooks";
import { api } from "../../api/client";
import type { Capture, NextLayer } from "../../api/types";
import { askCapture, capture as captureStore, readCapture } from "../../state/capture";
import { useStore } from "../../state/store";
import { actionOf, type Action } from "./action";
import { TONES } from "./cues";
import type { Choice } from "./setup";

const DEVICE_KEY = "toile.device";
export const COUNTDOWNS = [0, 3, 5, 10];

export interface Session {
  capture: Capture | null;
  next: NextLayer | null;
  choice: Choice;
  setChoice: (part: Partial<Choice>) => void;
  /** Seconds left of the countdown, or null. */
  counting: number | null;
  countdown: number;
  setCountdown: (seconds: number) => void;
  action: Action | null;
  error: string | null;
  /** What the one key does. */
  run: () => void;
  retake: () => void;
  discard: () => void;
  /** Keeps the take and leaves the camera for now. */
  finish: () => Promise<void>;
}

/** The way of a subject through its takes: the service has the state, the page asks for the next step. */
export function useSession(subject: string | null): Session {
  const capture = useStore(captureStore);
  const [next, setNext] = useState<NextLayer | null>(null);
  const [choice, setOwnChoice] = useState<Choice>({ device: localStorage.getItem(DEVICE_KEY) ?? "", name: "", type: "" });
  const [error, setError] = useState<string | null>(null);
  const [countdown, setCountdown] = useState(5);
  const [counting, setCounting] = useState<number | null>(null);
  const busy = useRef(false);
  const setChoice = (part: Partial<Choice>) => {
    if (part.device !== undefined) localStorage.setItem(DEVICE_KEY, part.device);
    setOwnChoice((old) => ({ ...old, ...part }));
  };
  const propose = async (): Promise<NextLayer | null> => {
    if (subject === null) return null;
    const proposed = await api.next(subject);
    setNext(proposed);
    setOwnChoice((old) => ({ ...old, name: proposed.name, type: proposed.type ?? "" }));
    return proposed;
  };
  const attempt = async (step: () => Promise<unknown>) => {
    if (busy.current) return;
    busy.current = true;
    setError(null);
    try {
      await step();
    } catch (e) {
      setError(e instanceof Error ? e.message : String(e));
    } finally {
      busy.current = false;
      await readCapture();
    }
  };
  const idle = capture?.state === "idle";
  useEffect(() => void propose().catch((e: unknown) => setError(String(e instanceof Error ? e.message : e))), [subject, idle]);
  useCountdown(counting, setCounting, () => void attempt(() => askCapture(() => api.captureStep("start"))));
  useEffect(() => {
    if (capture?.state !== "preview") setCounting(null);
  }, [capture?.state]);
  const open = async (wanted: Choice) => {
    if (subject === null) throw new Error("Choose a subject first.");
    const type = wanted.type === "" ? {} : { type: wanted.type };
    await askCapture(() => api.open({ device: wanted.device, subject, name: wanted.name, ...type }));
  };
  const goOn = async () => {
    const device = capture?.device ?? choice.device;
    await askCapture(() => api.accept(null));
    const proposed = await propose();
    if (proposed !== null && proposed.name !== "") await open({ device, name: proposed.name, type: proposed.type ?? "" });
  };
  const action = actionOf(capture, counting !== null);
  const steps: Record<Action, () => void> = {
    open: () => void attempt(() => open(choice)),
    start: () => (countdown === 0 ? void attempt(() => askCapture(() => api.captureStep("start"))) : setCounting(countdown)),
    unstart: () => setCounting(null),
    stop: () => void attempt(() => askCapture(() => api.captureStep("stop"))),
    accept: () => void attempt(goOn),
    close: () => void attempt(() => askCapture(() => api.captureStep("discard"))),
  };
  return {
    capture, next, choice, setChoice, counting, countdown, setCountdown, action, error,
    run: () => action !== null && steps[action](),
    retake: () => void attempt(() => askCapture(() => api.captureStep("retake"))),
    discard: () => void attempt(() => askCapture(() => api.captureStep("discard"))),
    finish: () => attempt(() => askCapture(() => api.accept(null))),
  };
}

function useCountdown(counting: number | null, set: (seconds: number | null) => void, start: () => void): void {
  useEffect(() => {
    if (counting === null) return;
    if (counting === 0) {
      set(null);
      start();
      return;
    }
    TONES.count();
    const timer = setTimeout(() => set(counting - 1), 1000);
    return () => clearTimeout(timer);
  }, [counting]);
}
