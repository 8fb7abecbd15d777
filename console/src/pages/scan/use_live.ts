import { useEffect, useRef, useState } from "preact/hooks";
import type { Guidance } from "../../api/types";
import { openLive, type LiveSurface, type PictureHeader, type PictureKind } from "./live";

/** What the live line gave last; pictures go straight to their canvases. */
export interface Live {
  guidance: Guidance | null;
  surface: LiveSurface | null;
  open: boolean;
  /** Pictures a second in this browser, and how old the last one was when it was drawn. */
  rate: number;
  ageMs: number;
  /** Forgets the surface of the last take. */
  clearSurface: () => void;
  place: (kind: PictureKind) => (canvas: HTMLCanvasElement | null) => void;
}

const RATE_EVERY_MS = 1000;
/** The page around the pictures is drawn at most so often. */
const GUIDANCE_EVERY_MS = 120;

/** Draws pictures as they come; while one is being decoded, only the newest of those that follow is kept. */
class Painter {
  private busy = false;
  private next: { jpeg: Uint8Array<ArrayBuffer>; header: PictureHeader; came: number } | null = null;
  canvas: HTMLCanvasElement | null = null;

  constructor(private readonly drawn: (header: PictureHeader, came: number) => void) {}

  take(jpeg: Uint8Array<ArrayBuffer>, header: PictureHeader): void {
    this.next = { jpeg, header, came: performance.now() };
    if (!this.busy) void this.work();
  }

  private async work(): Promise<void> {
    this.busy = true;
    while (this.next !== null) {
      const { jpeg, header, came } = this.next;
      this.next = null;
      try {
        const picture = await createImageBitmap(new Blob([jpeg], { type: "image/jpeg" }));
        this.paint(picture);
        this.drawn(header, came);
      } catch {
        // A torn picture: the next one follows within a moment.
      }
    }
    this.busy = false;
  }

  private paint(picture: ImageBitmap): void {
    const canvas = this.canvas;
    if (canvas === null) return picture.close();
    canvas.getContext("bitmaprenderer")?.transferFromImageBitmap(picture);
  }
}

const IS_LOCAL = ["127.0.0.1", "localhost", "[::1]"].includes(location.hostname);

/** Age of a picture now that it is drawn, milliseconds; by the clock where service and page have the same one. */
function ageOf(header: PictureHeader, came: number): number {
  if (IS_LOCAL && header.unix_ms !== undefined) return Math.max(0, Date.now() - header.unix_ms);
  return header.age_ms + performance.now() - came;
}

export function useLive(on: boolean, want: (PictureKind | "surface")[]): Live {
  const [guidance, setGuidance] = useState<Guidance | null>(null);
  const [surface, setSurface] = useState<LiveSurface | null>(null);
  const [open, setOpen] = useState(false);
  const [pace, setPace] = useState({ rate: 0, ageMs: 0 });
  const count = useRef({ pictures: 0, ageMs: 0, guidanceAt: 0 });
  const painters = useRef(new Map<PictureKind, Painter>());
  const places = useRef(new Map<PictureKind, (canvas: HTMLCanvasElement | null) => void>());
  const painter = (kind: PictureKind): Painter => {
    let made = painters.current.get(kind);
    if (made === undefined) {
      made = new Painter((header, came) => {
        if (header.what === want[0]) count.current.pictures += 1;
        count.current.ageMs = ageOf(header, came);
      });
      painters.current.set(kind, made);
    }
    return made;
  };
  const place = (kind: PictureKind) => {
    let set = places.current.get(kind);
    if (set === undefined) {
      set = (canvas) => (painter(kind).canvas = canvas);
      places.current.set(kind, set);
    }
    return set;
  };
  useEffect(() => {
    if (!on) return;
    const timer = setInterval(() => {
      setPace({ rate: (1000 * count.current.pictures) / RATE_EVERY_MS, ageMs: count.current.ageMs });
      count.current.pictures = 0;
    }, RATE_EVERY_MS);
    const close = openLive(want, (message) => {
      if (message.kind === "surface") return setSurface(message.surface);
      painter(message.header.what).take(message.jpeg, message.header);
      const now = performance.now();
      if (message.header.guidance == null || now - count.current.guidanceAt < GUIDANCE_EVERY_MS) return;
      count.current.guidanceAt = now;
      setGuidance(message.header.guidance);
    }, setOpen);
    return () => {
      clearInterval(timer);
      close();
      setGuidance(null);
    };
  }, [on, want.join()]);
  return { clearSurface: () => setSurface(null), guidance, surface, open, rate: pace.rate, ageMs: pace.ageMs, place };
}
