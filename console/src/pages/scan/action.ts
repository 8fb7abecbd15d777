import type { Capture, Guidance } from "../../api/types";

/** What the one key does now. */
export type Action = "open" | "start" | "unstart" | "stop" | "accept" | "close";

export function actionOf(capture: Capture | null, counting: boolean): Action | null {
  switch (capture?.state) {
    case undefined: return null;
    case "idle": return "open";
    case "preview": return counting ? "unstart" : "start";
    case "recording": return "stop";
    case "review": return "accept";
    case "failed": return "close";
    default: return null;
  }
}

export const ACTION_NAMES: Record<Action, string> = {
  open: "Open the camera",
  start: "Start",
  unstart: "Stop the countdown",
  stop: "End the take",
  accept: "Keep this take",
  close: "Close and begin again",
};

/** A line for the operator: what is going on, and how urgent it is. */
export interface Headline {
  text: string;
  tone: "calm" | "good" | "warn" | "bad";
}

/** The one sentence that matters now; it is what is spoken, too. */
export function headlineOf(capture: Capture | null, guidance: Guidance | null, counting: boolean, say: string): Headline {
  switch (capture?.state) {
    case undefined: return { text: "Asking the service …", tone: "calm" };
    case "idle": return { text: say, tone: "calm" };
    case "opening": return { text: "The camera is opening.", tone: "calm" };
    case "finishing": return { text: "Writing the take.", tone: "calm" };
    case "failed": return { text: capture.error ?? "The capture failed.", tone: "bad" };
    case "review": return reviewLine(capture);
    case "recording": return recordingLine(capture, guidance);
    case "preview": {
      const advice = previewAdvice(guidance);
      if (counting) return { text: advice ?? "Hold still.", tone: advice === null ? "good" : "warn" };
      return advice === null ? { text: say === "" ? "Ready." : `${say} Ready to start.`, tone: "good" } : { text: advice, tone: "warn" };
    }
  }
}

function recordingLine(capture: Capture, guidance: Guidance | null): Headline {
  if (guidance !== null && guidance.sensor !== null && guidance.sensor.silent_s > 1) return { text: "The camera is silent.", tone: "bad" };
  if (guidance?.advice) return { text: guidance.advice, tone: "warn" };
  return capture.turned ? { text: "Once round. End the take.", tone: "good" } : { text: "Keep turning.", tone: "good" };
}

function reviewLine(capture: Capture): Headline {
  if (!capture.turned) return { text: "The turn is not full. Retake it, or keep it as it is.", tone: "warn" };
  const worst = capture.warnings[0];
  return worst === undefined ? { text: "The take is whole.", tone: "good" } : { text: worst, tone: "warn" };
}

function previewAdvice(guidance: Guidance | null): string | null {
  if (guidance === null) return null;
  return guidance.advice ?? guidance.pose?.advice ?? guidance.exposure?.advice ?? null;
}
