import { expect, test } from "vitest";
import type { Capture } from "../src/api/types";
import { askCapture, capture, tellCapture } from "../src/state/capture";

const at = (state: Capture["state"]) => ({ state }) as Capture;

test("an answer that comes after a newer event does not take its place", async () => {
  await askCapture(() => Promise.resolve(at("recording")));
  expect(capture.get()?.state).toBe("recording");
  await askCapture(async () => {
    tellCapture(at("review"));
    return at("finishing");
  });
  expect(capture.get()?.state).toBe("review");
});
