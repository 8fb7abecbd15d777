import type { Notice } from "../../api/types";

/** The query of the place that shows what a warning speaks of. */
export function placeOfNotice(notice: Notice): Record<string, string | number | null> {
  const layer = notice.layer;
  if (/\bmotion\b/.test(notice.text)) return { view: "motion", layer };
  if (notice.step === "fuse" || notice.step === "pose") return { view: "scan", take: layer ?? 0 };
  if (notice.step === "fit") return { view: "scan", take: 0, body: "1" };
  if (/measure|girth|tape/.test(notice.text)) return { view: "measures" };
  return { view: "layers", layer };
}
