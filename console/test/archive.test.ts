import { describe, expect, it } from "vitest";
import type { SubjectLine } from "../src/api/types";
import { found, sorted } from "../src/pages/archive/order";
import { rowsInSight } from "../src/ui/virtual";
import { bytesText, idFor, momentText, timeText } from "../src/ui/words";

function subject(id: string, part: Partial<SubjectLine> = {}): SubjectLine {
  return { id, name: id, date: "2026-01-01", state: "processed", layers: [], warnings: 0, picture: null, modified: 0, problem: null, ...part };
}

describe("the archive's list", () => {
  it("sorts numbers in names as numbers, and states by who needs somebody", () => {
    const list = [subject("s10"), subject("s9", { state: "failed" }), subject("S1", { state: "recorded" })];
    expect(sorted(list, "name", false).map((s) => s.id)).toEqual(["S1", "s9", "s10"]);
    expect(sorted(list, "name", true).map((s) => s.id)).toEqual(["s10", "s9", "S1"]);
    expect(sorted(list, "state", false).map((s) => s.id)).toEqual(["s9", "S1", "s10"]);
  });

  it("finds subjects of which every word fits", () => {
    const list = [subject("anna", { layers: [{ name: "coat", type: "jacket" }] }), subject("ann", { state: "failed" })];
    expect(found(list, " ANN jack").map((s) => s.id)).toEqual(["anna"]);
    expect(found(list, "failed").map((s) => s.id)).toEqual(["ann"]);
    expect(found(list, "")).toHaveLength(2);
  });

  it("draws the rows in sight and few more", () => {
    expect(rowsInSight(0, 680, 68, 5000)).toEqual([0, 16]);
    expect(rowsInSight(68 * 4995, 680, 68, 5000)).toEqual([4989, 5000]);
    expect(rowsInSight(68 * 4995, 680, 68, 3)).toEqual([3, 3]);
    expect(rowsInSight(0, 680, 68, 0)).toEqual([0, 0]);
  });

  it("writes sizes, times and folders", () => {
    expect(bytesText(6_319_268)).toBe("6.3 MB");
    expect(bytesText(999)).toBe("999 bytes");
    expect(timeText(125.2)).toBe("2 min 05 s");
    expect(timeText(4000)).toBe("1 h 7 min");
    expect(momentText(100, 130)).toBe("just now");
    expect(idFor("Zoë  O'Neill 2")).toBe("zoe-o-neill-2");
  });
});
