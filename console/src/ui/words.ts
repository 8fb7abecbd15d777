import type { JobKind, JobState, SubjectState } from "../api/types";

export const SUBJECT_STATES: Record<SubjectState, string> = {
  empty: "no takes yet",
  recorded: "recorded",
  processed: "processed",
  stale: "out of date",
  failed: "failed",
  busy: "busy",
  damaged: "damaged",
};

export const JOB_STATES: Record<JobState, string> = {
  queued: "waiting",
  running: "running",
  done: "done",
  failed: "failed",
  cancelled: "cancelled",
};

export const JOB_KINDS: Record<JobKind, string> = {
  process: "Process",
  rebuild: "Rebuild a layer",
  animate: "Animate",
  export: "Export",
};

export const GARMENT_TYPES = ["top", "trousers", "skirt", "dress", "jacket", "hat", "shoes", "other"];

const UNITS = ["bytes", "kB", "MB", "GB", "TB"];

export function bytesText(bytes: number): string {
  let value = bytes;
  let unit = 0;
  while (value >= 1000 && unit + 1 < UNITS.length) {
    value /= 1000;
    unit += 1;
  }
  return `${unit > 0 && value < 10 ? value.toFixed(1) : Math.round(value)} ${UNITS[unit]}`;
}

/** A length of time for the eye: `4 s`, `2 min 05 s`, `1 h 10 min`. */
export function timeText(seconds: number): string {
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 60) return `${whole} s`;
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${String(whole % 60).padStart(2, "0")} s`;
  return `${Math.floor(whole / 3600)} h ${Math.round((whole % 3600) / 60)} min`;
}

export function momentText(unix: number, now: number = Date.now() / 1000): string {
  const age = now - unix;
  if (age < 60) return "just now";
  if (age < 3600) return `${Math.floor(age / 60)} min ago`;
  if (age < 86_400) return `${Math.floor(age / 3600)} h ago`;
  return new Date(1000 * unix).toLocaleDateString(undefined, { year: "numeric", month: "short", day: "numeric" });
}

export function countText(count: number, one: string, many: string = `${one}s`): string {
  return `${count} ${count === 1 ? one : many}`;
}

/** The name of a folder for a person's name: letters, digits and dashes. */
export function idFor(name: string): string {
  const plain = name.normalize("NFD").replace(/[\u0300-\u036f]/g, "").toLowerCase();
  return plain.replace(/[^a-z0-9]+/g, "-").replace(/^-+|-+$/g, "");
}
