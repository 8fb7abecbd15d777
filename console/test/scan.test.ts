import { describe, expect, it } from "vitest";
import type { Capture, Guidance, Unseen } from "../src/api/types";
import { actionOf, headlineOf } from "../src/pages/scan/action";
import { cellsOf, seenShare } from "../src/pages/scan/body_map";
import { checksOf } from "../src/pages/scan/checks";
import { ClapDetector } from "../src/pages/scan/clap";
import { parseLive } from "../src/pages/scan/live";
import { mirroredStroke } from "../src/pages/correct/gestures";

const CAPTURE: Capture = {
  state: "preview", device: "virtual", subject: "anna", layer: 0, name: "body", type: null, retake: false, seconds: 0, frames: 300, fps: 30, dropped: 0,
  degrees: 0, turned: false, unseen: [], warnings: [], error: null, take_file: null, disk_free_bytes: 5e11, job_paused: false,
};
const GUIDANCE: Guidance = {
  degrees: 0, turned: false, speed_deg_s: null, advice: null, distance_m: 2.1, height_m: 1.7, pose: { arms_ok: true, advice: null },
  exposure: { ok: true, mean: 0.4, advice: null }, in_volume: true, dropout: { head: 0.5, chest: 0 }, unseen: null, sensor: { hot: false, silent_s: 0, dropped: 0 },
};

function message(kind: number, header: unknown, payload: Uint8Array): ArrayBuffer {
  const text = new TextEncoder().encode(JSON.stringify(header));
  const bytes = new Uint8Array(5 + text.length + payload.length);
  bytes[0] = kind;
  new DataView(bytes.buffer).setUint32(1, text.length, true);
  bytes.set(text, 5);
  bytes.set(payload, 5 + text.length);
  return bytes.buffer;
}

describe("live messages", () => {
  it("are pictures and surfaces; others are passed over", () => {
    const picture = parseLive(message(1, { what: "depth", fps: 30 }, new Uint8Array([1, 2, 3])));
    expect(picture).toMatchObject({ kind: "picture", header: { what: "depth" } });
    const payload = new Uint8Array(36 + 12 + 12);
    new DataView(payload.buffer).setFloat32(4, 1.5, true);
    payload.set([7, 8, 9], 36);
    new DataView(payload.buffer).setUint32(48 + 8, 2, true);
    const message2 = parseLive(message(2, { vertices: 3, triangles: 1 }, payload));
    if (message2?.kind !== "surface") throw new Error("no surface");
    expect(message2.surface.positions[1]).toBe(1.5);
    expect([...message2.surface.colors.slice(0, 3)]).toEqual([7, 8, 9]);
    expect([...message2.surface.triangles]).toEqual([0, 0, 2]);
    expect(parseLive(message(9, {}, new Uint8Array()))).toBeNull();
    expect(() => parseLive(message(2, { vertices: 3, triangles: 2 }, payload))).toThrow("cut short");
  });
});

describe("the one key", () => {
  it("does the next thing", () => {
    const states = ["idle", "opening", "preview", "recording", "finishing", "review", "failed"] as const;
    expect(states.map((state) => actionOf({ ...CAPTURE, state }, false))).toEqual(["open", null, "start", "stop", null, "accept", "close"]);
    expect(actionOf(CAPTURE, true)).toBe("unstart");
    expect(actionOf(null, false)).toBeNull();
  });

  it("stands under the one sentence that matters", () => {
    expect(headlineOf(CAPTURE, GUIDANCE, false, "Put on the coat.")).toEqual({ text: "Put on the coat. Ready to start.", tone: "good" });
    const arms = { ...GUIDANCE, pose: { arms_ok: false, advice: "Arms away." } };
    expect(headlineOf(CAPTURE, arms, false, "")).toEqual({ text: "Arms away.", tone: "warn" });
    const recording: Capture = { ...CAPTURE, state: "recording" };
    expect(headlineOf(recording, { ...GUIDANCE, advice: "Slower." }, false, "").text).toBe("Slower.");
    expect(headlineOf(recording, { ...GUIDANCE, sensor: { hot: false, silent_s: 3, dropped: 0 } }, false, "").tone).toBe("bad");
    expect(headlineOf({ ...CAPTURE, state: "review" }, null, false, "").tone).toBe("warn");
    expect(headlineOf({ ...CAPTURE, state: "failed", error: "The disk is full." }, null, false, "").text).toBe("The disk is full.");
  });
});

describe("checks", () => {
  it("name what is wrong", () => {
    const wrong = checksOf(GUIDANCE, { ...CAPTURE, dropped: 2, disk_free_bytes: 1e9 }).filter((check) => check.ok === false);
    expect(wrong.map((check) => check.name)).toEqual(["Depth", "Dropped", "Disk"]);
  });
});

describe("the body map", () => {
  it("shows the subject's left at our right from the front, at our left from behind", () => {
    const directions = Array<number>(24 * 6).fill(1);
    for (let row = 0; row < 6; row += 1) for (let column = 3; column < 9; column += 1) directions[24 * row + column] = 0;
    const unseen: Unseen = { directions, columns: 24, rows: 6, parts: null };
    const seen = (side: "front" | "back") => cellsOf(unseen, side).filter((cell) => cell.unseen === 0);
    expect(seen("front").every((cell) => cell.x >= 50)).toBe(true);
    expect(seen("back").every((cell) => cell.x + cell.width <= 50.001)).toBe(true);
    expect(seen("front").length + seen("back").length).toBe(36);
    expect(seenShare(unseen)).toBeCloseTo(0.25);
  });
});

describe("claps", () => {
  const heard = (levels: [number, number][]) => {
    const detector = new ClapDetector();
    return levels.filter(([level, at]) => detector.push(level, at)).length;
  };
  const quiet: [number, number][] = Array.from({ length: 100 }, (_, k) => [0.01, k * 0.015]);

  it("are short and loud", () => {
    expect(heard([...quiet, [0.8, 1.52], [0.5, 1.535], [0.1, 1.55], [0.02, 1.565]])).toBe(1);
  });

  it("are not speech, and not a noise that stays", () => {
    expect(heard([...quiet, ...Array.from({ length: 60 }, (_, k): [number, number] => [0.4 + 0.1 * Math.sin(k), 1.5 + k * 0.015]), [0.01, 2.5]])).toBe(0);
    expect(heard([...quiet, ...Array.from({ length: 20 }, (_, k): [number, number] => [0.5, 1.5 + k * 0.015]), [0.01, 1.81]])).toBe(0);
    expect(heard([...quiet, [0.15, 1.52], [0.02, 1.535]])).toBe(0);
  });
});

describe("a mirrored stroke", () => {
  it("is parted where the other side has no scan", () => {
    const points: [number, number, number][] = [[0, 0, 0], [0.01, 0, 0], [0.02, 0, 0], [0.03, 0, 0]];
    const pieces = mirroredStroke({ mark: "belongs", points, radius: 0.01 }, ([x, y, z]) => (x === 0.01 ? null : [-x, y, z]));
    expect(pieces.map((piece) => piece.points.length)).toEqual([1, 2]);
    expect(pieces[1].points[1]).toEqual([-0.03, 0, 0]);
  });
});
