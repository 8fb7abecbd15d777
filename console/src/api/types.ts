/** The values that the service answers with. Lengths are metres, times are seconds, moments are Unix seconds. */

export type SubjectState = "recorded" | "processed" | "stale" | "failed" | "busy" | "empty" | "damaged";

export interface LayerName {
  name: string;
  type: string | null;
}

/** A line of the archive. */
export interface SubjectLine {
  id: string;
  name: string;
  date: string;
  state: SubjectState;
  layers: LayerName[];
  warnings: number;
  picture: string | null;
  modified: number;
  problem: string | null;
}

/** A subject that was taken out of the archive. */
export interface Binned {
  undo: string;
  id: string;
  name: string;
  removed: number;
}

export interface Archive {
  name: string;
  path: string;
  version: string;
  subjects: SubjectLine[];
}

export interface Layer extends LayerName {
  index: number;
  /** Its folder under `build/`, such as `01-trousers`. */
  folder: string;
  built: boolean;
  edits: { strokes: number; hems: number } | null;
}

export interface Take {
  index: number;
  name: string;
  folder: string;
  type: string | null;
  file: string;
  bytes: number;
  frames: number;
  seconds: number;
  sensors: string[];
  state: "ok" | "torn" | "scan" | "unreadable";
  problem: string | null;
  full_turn: boolean | null;
  dropped: number;
  noise_mm: number | null;
}

export interface Notice {
  text: string;
  kind: "warning" | "lost" | "failure";
  layer: number | null;
  step: string | null;
}

export interface Motion {
  name: string;
  fps: number;
  frames: number;
  files: string[];
  glb: string | null;
}

export interface Download {
  name: string;
  file: string;
  bytes: number;
}

export interface Subject extends SubjectLine {
  notes: string;
  layers: Layer[];
  takes: Take[];
  stature_m: number | null;
  notices: Notice[];
  motions: Motion[];
  files: string[];
  downloads: Download[];
}

export type JobKind = "process" | "rebuild" | "animate" | "export";
export type JobState = "queued" | "running" | "done" | "failed" | "cancelled";

export interface Job {
  id: number;
  kind: JobKind;
  subject: string;
  state: JobState;
  progress: number | null;
  step: string | null;
  seconds_left: number | null;
  created: number;
  started: number | null;
  ended: number | null;
  error: string | null;
  paused: boolean;
  warnings: number;
  options: Record<string, unknown>;
}

export interface Device {
  id: string;
  name: string;
  kind: string;
  usable: boolean;
  problem: string | null;
  detail: string;
}

export interface DeviceList {
  devices: Device[];
  /** What could not be asked, such as a bus without permission. */
  warnings: string[];
}

export interface MotionClip {
  name: string;
  seconds: number;
  fps: number;
}

export type CaptureState = "idle" | "opening" | "preview" | "recording" | "finishing" | "review" | "failed";

export interface Capture {
  state: CaptureState;
  device: string | null;
  subject: string | null;
  layer: number | null;
  name: string | null;
  type: string | null;
  retake: boolean;
  seconds: number;
  frames: number;
  fps: number;
  dropped: number;
  degrees: number;
  turned: boolean;
  /** Names of the sides that the turn did not show. */
  unseen: string[];
  /** Of the take, once it is in review. */
  warnings: string[];
  error: string | null;
  take_file: string | null;
  disk_free_bytes: number | null;
  job_paused: boolean;
}

export interface NextLayer {
  layer: number;
  name: string;
  type: string | null;
  say: string;
}

/** What the crates made of the live frames; the page only shows it. */
export interface Guidance {
  degrees: number;
  turned: boolean;
  speed_deg_s: number | null;
  advice: string | null;
  distance_m: number | null;
  height_m: number | null;
  pose: { arms_ok: boolean | null; advice: string | null } | null;
  exposure: { ok: boolean; mean: number; advice: string | null } | null;
  in_volume: boolean;
  /** Share of pixels without depth, by height on the body. */
  dropout: Record<string, number> | null;
  unseen: Unseen | null;
  sensor: { hot: boolean; silent_s: number; dropped: number } | null;
}

/** Shares not seen, 0 to 1: by direction around (columns) and height (rows from the top), and by part of the body. */
export interface Unseen {
  directions: number[];
  columns: number;
  rows: number;
  parts: Record<string, number> | null;
}

export type Point = [number, number, number];

export interface Stroke {
  mark: "belongs" | "does-not-belong";
  points: Point[];
  radius: number;
}

export interface HemLine {
  points: Point[];
  reach: number;
}

/** `edits/NN-name.json`, as docs/edits.md describes it. */
export interface LayerEdits {
  version: 1;
  strokes: Stroke[];
  hems: HemLine[];
}

/** `edits/body.json`; fields that the page does not know are kept. */
export interface BodyEdits {
  version: 1;
  landmarks?: Record<string, Point>;
  [field: string]: unknown;
}

export interface Measure {
  name: string;
  kind: string;
  value_m: number;
  definition: string;
  path: Point[];
  uncertainty_m?: number;
  seen?: number;
  doubt?: string | null;
}

export interface Landmark {
  name: string;
  position: Point;
  seen: number;
  moved_mm: number;
  by_hand: boolean;
}
