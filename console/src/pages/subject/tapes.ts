import type { Measure } from "../../api/types";

/** Ends of the segments of a tape, xyz; a girth is closed. */
export function segments(measure: Measure): number[] {
  const path = measure.kind === "girth" ? [...measure.path, measure.path[0]] : measure.path;
  return path.slice(1).flatMap((point, k) => [...path[k], ...point]);
}
