import { request } from "../api/client";

/** A point cache: the vertices of a layer in each frame of a motion, fetched in pieces as they are played. */
export interface PointCache {
  points: number;
  frames: number;
  /** The vertices of a frame, xyz in metres, or null while they are on their way. */
  frame(index: number): Float32Array | null;
  /** Resolves once a frame is there. */
  ready(index: number): Promise<void>;
  dispose(): void;
}

export interface Pc2Header {
  points: number;
  frames: number;
}

const HEADER_BYTES = 32;
/** Frames fetched at once: some 10 MB for a jacket's mesh at 36,000 vertices. */
const PIECE = 16;

/** Reads the header of a PC2 file; throws an Error with a sentence where it is another file. */
export function parsePc2Header(bytes: ArrayBuffer): Pc2Header {
  const view = new DataView(bytes);
  const magic = new TextDecoder("latin1").decode(bytes.slice(0, 11));
  if (bytes.byteLength < HEADER_BYTES || magic !== "POINTCACHE2") throw new Error("This is not a point cache (PC2).");
  return { points: view.getInt32(16, true), frames: view.getInt32(28, true) };
}

async function range(url: string, from: number, length: number, signal: AbortSignal): Promise<ArrayBuffer> {
  const headers = { Range: `bytes=${from}-${from + length - 1}` };
  const answer = await request(url, { headers, signal });
  const bytes = await answer.arrayBuffer();
  return answer.status === 206 ? bytes : bytes.slice(from, from + length);
}

export async function openPointCache(url: string): Promise<PointCache> {
  const stopper = new AbortController();
  const { points, frames } = parsePc2Header(await range(url, 0, HEADER_BYTES, stopper.signal));
  const pieces: (Float32Array | undefined)[] = [];
  const waiting = new Map<number, Promise<void>>();
  const frameBytes = 12 * points;
  const load = async (piece: number) => {
    const count = Math.min(PIECE, frames - piece * PIECE);
    const bytes = await range(url, HEADER_BYTES + piece * PIECE * frameBytes, count * frameBytes, stopper.signal);
    pieces[piece] = new Float32Array(bytes);
  };
  const want = (piece: number): Promise<void> => {
    if (pieces[piece] !== undefined) return Promise.resolve();
    let promise = waiting.get(piece);
    if (promise === undefined) {
      promise = load(piece).finally(() => waiting.delete(piece));
      waiting.set(piece, promise);
    }
    return promise;
  };
  return {
    points,
    frames,
    frame(index) {
      const piece = Math.floor(index / PIECE);
      const next = (piece + 1) % Math.ceil(frames / PIECE);
      void want(piece).catch(() => undefined);
      void want(next).catch(() => undefined);
      const start = (index - piece * PIECE) * 3 * points;
      return pieces[piece]?.subarray(start, start + 3 * points) ?? null;
    },
    ready: (index) => want(Math.floor(index / PIECE)),
    dispose: () => stopper.abort(),
  };
}
