import type { Capture, Guidance } from "../../api/types";
import { bytesText } from "../../ui/words";

interface Check {
  name: string;
  value: string;
  ok: boolean | null;
}

export function checksOf(guidance: Guidance | null, capture: Capture): Check[] {
  const g = guidance;
  const holes = Object.entries(g?.dropout ?? {}).filter(([, share]) => share !== null && share > 0.3).map(([part]) => part);
  return [
    { name: "Distance", value: g?.distance_m == null ? "nobody seen" : `${g.distance_m.toFixed(2)} m`, ok: g === null ? null : g.distance_m !== null },
    { name: "Height", value: g?.height_m == null ? "–" : `${(100 * g.height_m).toFixed(0)} cm`, ok: g?.height_m == null ? null : true },
    { name: "In the picture", value: g === null ? "–" : g.in_volume ? "wholly" : "not wholly", ok: g === null ? null : g.in_volume },
    { name: "Arms", value: g?.pose?.arms_ok == null ? "not seen yet" : g.pose.arms_ok ? "away from the body" : "too near", ok: g?.pose?.arms_ok ?? null },
    { name: "Exposure", value: g?.exposure == null ? "–" : g.exposure.ok ? "good" : `${Math.round(100 * g.exposure.mean)} % bright`, ok: g?.exposure?.ok ?? null },
    { name: "Depth", value: g === null ? "–" : holes.length === 0 ? "no large holes" : `holes: ${holes.join(", ")}`, ok: g === null ? null : holes.length === 0 },
    { name: "Sensor", value: sensorText(g), ok: g?.sensor == null ? null : !g.sensor.hot && g.sensor.silent_s < 1 },
    { name: "Dropped", value: `${capture.dropped} of ${capture.frames} frames`, ok: capture.dropped === 0 ? true : false },
    { name: "Disk", value: capture.disk_free_bytes === null ? "–" : `${bytesText(capture.disk_free_bytes)} free`, ok: capture.disk_free_bytes === null ? null : capture.disk_free_bytes > 2e9 },
  ];
}

function sensorText(guidance: Guidance | null): string {
  if (guidance?.sensor == null) return "–";
  if (guidance.sensor.silent_s >= 1) return `silent for ${guidance.sensor.silent_s.toFixed(0)} s`;
  return guidance.sensor.hot ? "hot" : "good";
}

const MARKS = { true: "✓", false: "!", null: "·" };

export function Checks({ guidance, capture }: { guidance: Guidance | null; capture: Capture }) {
  return (
    <dl class="checks">
      {checksOf(guidance, capture).map((check) => (
        <div key={check.name} class={check.ok === false ? "wrong" : check.ok === true ? "right" : ""}>
          <dt><span class="mark" aria-hidden="true">{MARKS[`${check.ok}`]}</span>{check.name}</dt><dd>{check.value}</dd>
        </div>
      ))}
    </dl>
  );
}
