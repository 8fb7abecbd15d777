import type { DistanceTask } from "./distances.worker";

/** Signed distances of points from a closed surface in metres, positive outside, computed beside the page. */
export function distancesFrom(task: DistanceTask, signal: AbortSignal): Promise<Float32Array> {
  return new Promise((resolve, reject) => {
    const worker = new Worker(new URL("./distances.worker.ts", import.meta.url), { type: "module" });
    const end = () => worker.terminate();
    signal.addEventListener("abort", end);
    worker.onmessage = (message: MessageEvent<Float32Array>) => {
      end();
      resolve(message.data);
    };
    worker.onerror = () => {
      end();
      reject(new Error("The distances could not be computed in this browser."));
    };
    worker.postMessage(task);
  });
}

type Rgb = [number, number, number];

/** Inside is blue, on the surface is pale, outside is red: linear light. */
const STOPS: Rgb[] = [[0.02, 0.1, 0.5], [0.15, 0.42, 0.8], [0.82, 0.82, 0.78], [0.85, 0.3, 0.1], [0.42, 0.01, 0.02]];

/** The colour of a share from −1 (inside) to 1 (outside). */
export function divergingColor(share: number): Rgb {
  const at = 2 + 2 * Math.min(1, Math.max(-1, share));
  const below = Math.min(3, Math.floor(at));
  const t = at - below;
  return STOPS[below].map((value, k) => value + t * (STOPS[below + 1][k] - value)) as Rgb;
}

export function divergingColors(distances: Float32Array, range: number): Float32Array {
  const out = new Float32Array(3 * distances.length);
  distances.forEach((distance, i) => out.set(divergingColor(distance / range), 3 * i));
  return out;
}

export interface DistanceSummary {
  mean_mm: number;
  p95_mm: number;
}

/** Mean and 95th percentile of the unsigned distances. */
export function summary(distances: Float32Array): DistanceSummary {
  const sizes = distances.map(Math.abs).sort();
  const mean = sizes.reduce((sum, x) => sum + x, 0) / Math.max(1, sizes.length);
  return { mean_mm: 1000 * mean, p95_mm: 1000 * (sizes[Math.floor(0.95 * (sizes.length - 1))] ?? 0) };
}
