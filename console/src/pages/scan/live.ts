import { address } from "../../api/client";
import type { Guidance } from "../../api/types";

export type PictureKind = "colour" | "depth" | "cutout";

export interface PictureHeader {
  what: PictureKind;
  width: number;
  height: number;
  seq: number;
  age_ms: number;
  /** When its frame arrived, Unix milliseconds by the service's clock. */
  unix_ms?: number;
  fps: number;
  guidance: Guidance | null;
}

export interface LiveSurface {
  positions: Float32Array;
  colors: Uint8Array;
  triangles: Uint32Array;
}

export type LiveMessage =
  | { kind: "picture"; header: PictureHeader; jpeg: Uint8Array<ArrayBuffer> }
  | { kind: "surface"; surface: LiveSurface };

const PICTURE = 1;
const SURFACE = 2;
const PREFIX_BYTES = 5;

/** Takes a message of the live line apart; null for kinds of a newer service. Throws where it is cut short. */
export function parseLive(bytes: ArrayBuffer): LiveMessage | null {
  const view = new DataView(bytes);
  const kind = view.getUint8(0);
  const length = view.getUint32(1, true);
  const header: unknown = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, PREFIX_BYTES, length)));
  const start = PREFIX_BYTES + length;
  if (kind === PICTURE) return { kind: "picture", header: header as PictureHeader, jpeg: new Uint8Array(bytes, start) };
  if (kind !== SURFACE) return null;
  const { vertices, triangles } = header as { vertices: number; triangles: number };
  const colorBytes = 4 * Math.ceil((3 * vertices) / 4);
  const part = (from: number, count: number) => bytes.slice(start + from, start + from + count);
  const surface = {
    positions: new Float32Array(part(0, 12 * vertices)),
    colors: new Uint8Array(part(12 * vertices, 3 * vertices)),
    triangles: new Uint32Array(part(12 * vertices + colorBytes, 12 * triangles)),
  };
  if (surface.triangles.length !== 3 * triangles) throw new RangeError("a live surface is cut short");
  return { kind: "surface", surface };
}

const RETRY_MS = 700;

/** The line of live pictures; it opens itself again until it is closed. */
export function openLive(want: (PictureKind | "surface")[], onMessage: (message: LiveMessage) => void, onOpen: (open: boolean) => void): () => void {
  let closed = false;
  let socket: WebSocket | null = null;
  let timer: ReturnType<typeof setTimeout> | undefined;
  const open = () => {
    socket = new WebSocket(address("api/capture/live").replace(/^http/, "ws"));
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      socket?.send(JSON.stringify({ want }));
      onOpen(true);
    };
    socket.onmessage = (event) => {
      const message = event.data instanceof ArrayBuffer ? parseLive(event.data) : null;
      if (message !== null) onMessage(message);
    };
    socket.onclose = () => {
      onOpen(false);
      if (!closed) timer = setTimeout(open, RETRY_MS);
    };
  };
  open();
  return () => {
    closed = true;
    clearTimeout(timer);
    socket?.close();
  };
}
