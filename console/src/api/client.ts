import type {
  Archive, Binned, BodyEdits, Capture, DeviceList, Job, JobKind, LayerEdits, MotionClip, NextLayer, Subject, SubjectLine,
} from "./types";
import { setLink } from "./link";

/** An answer that is not the expected one; the message is a sentence for the reader. */
export class ApiError extends Error {
  constructor(message: string, readonly status: number) {
    super(message);
  }
}

export function address(path: string): string {
  return new URL(path.replace(/^\//, ""), new URL(".", document.baseURI)).href;
}

export function fileAddress(subject: string, file: string): string {
  return address(`api/subjects/${encodeURIComponent(subject)}/files/${file.split("/").map(encodeURIComponent).join("/")}`);
}

export function frameAddress(subject: string, take: number, frame: number, what: "depth" | "colour"): string {
  return address(`api/subjects/${encodeURIComponent(subject)}/takes/${take}/frames/${frame}?what=${what}`);
}

async function sentence(answer: Response): Promise<string> {
  try {
    const body = (await answer.json()) as { error?: unknown };
    if (typeof body.error === "string") return body.error;
  } catch {
    // The answer is no JSON; its status has to do.
  }
  return `The service answered ${answer.status} ${answer.statusText}.`;
}

/** Fetches from the service; throws ApiError with a sentence, also where the service cannot be reached. */
export async function request(path: string, init?: RequestInit): Promise<Response> {
  let answer: Response;
  try {
    answer = await fetch(path.startsWith("http") ? path : address(path), init);
  } catch (e) {
    if (e instanceof DOMException && e.name === "AbortError") throw e;
    setLink("lost");
    throw new ApiError("The service cannot be reached. The page tries again by itself.", 0);
  }
  if (answer.status === 401) setLink("locked");
  if (!answer.ok) throw new ApiError(await sentence(answer), answer.status);
  return answer;
}

async function get<T>(path: string): Promise<T> {
  return (await (await request(path)).json()) as T;
}

async function send<T>(method: string, path: string, body?: unknown): Promise<T> {
  const init: RequestInit = { method };
  if (body !== undefined) {
    init.headers = { "Content-Type": "application/json" };
    init.body = JSON.stringify(body);
  }
  const text = await (await request(path, init)).text();
  return (text === "" ? undefined : JSON.parse(text)) as T;
}

export interface CaptureWish {
  device: string;
  subject: string;
  name: string;
  type?: string;
  retake?: boolean;
}

const one = (id: string) => `api/subjects/${encodeURIComponent(id)}`;

export const api = {
  login: (token: string) => send<void>("POST", "api/login", { token }),
  archive: () => get<Archive>("api/archive"),
  addSubject: (id: string, name: string) => send<SubjectLine>("POST", "api/subjects", { id, name }),
  removeSubject: (id: string) => send<{ undo: string }>("DELETE", one(id)),
  bin: () => get<Binned[]>("api/bin"),
  restore: (undo: string) => send<void>("POST", `api/bin/${encodeURIComponent(undo)}/restore`),
  subject: (id: string) => get<Subject>(one(id)),
  next: (id: string) => get<NextLayer>(`${one(id)}/next`),
  file: async <T>(id: string, file: string) => (await (await request(fileAddress(id, file))).json()) as T,
  layerEdits: (id: string, layer: number) => get<LayerEdits>(`${one(id)}/layers/${layer}/edit`),
  bodyEdits: (id: string) => get<BodyEdits>(`${one(id)}/layers/0/edit`),
  keepEdits: (id: string, layer: number, edits: LayerEdits | BodyEdits) =>
    send<void>("PUT", `${one(id)}/layers/${layer}/edit`, edits),
  rebuild: (id: string, layer: number) => send<Job>("POST", `${one(id)}/layers/${layer}/rebuild`),
  jobs: () => get<Job[]>("api/jobs"),
  addJob: (kind: JobKind, subject: string, options: Record<string, unknown> = {}) =>
    send<Job>("POST", "api/jobs", { kind, subject, options }),
  cancel: (job: number) => send<Job>("POST", `api/jobs/${job}/cancel`),
  retry: (job: number) => send<Job>("POST", `api/jobs/${job}/retry`),
  log: async (job: number) => await (await request(`api/jobs/${job}/log`)).text(),
  motions: () => get<MotionClip[]>("api/motions"),
  devices: () => get<DeviceList>("api/devices"),
  capture: () => get<Capture>("api/capture"),
  open: (wish: CaptureWish) => send<Capture>("POST", "api/capture", wish),
  captureStep: (step: "start" | "stop" | "retake" | "discard") => send<Capture>("POST", `api/capture/${step}`),
  accept: (next: { name: string; type?: string } | null) =>
    send<Capture>("POST", "api/capture/accept", next === null ? {} : { next }),
};
