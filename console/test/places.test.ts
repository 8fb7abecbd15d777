import { describe, expect, it } from "vitest";
import { placeOfNotice } from "../src/pages/subject/notice_place";
import { parsePlace, placeText } from "../src/place_text";

describe("places", () => {
  it("come back from their text", () => {
    const text = placeText(["subjects", "a b%"], { view: "scan", take: 2, layer: null });
    expect(text).toBe("#/subjects/a%20b%25?view=scan&take=2");
    const place = parsePlace(text);
    expect(place.path).toEqual(["subjects", "a b%"]);
    expect(place.query.get("take")).toBe("2");
  });

  it("that are broken are places, too", () => {
    expect(parsePlace("#/subjects/%E0%A4%A").path).toEqual(["subjects", "%E0%A4%A"]);
    expect(parsePlace("").path).toEqual([]);
  });

  it("of warnings are where the thing can be seen", () => {
    const notice = { text: "x", kind: "warning", layer: 2, step: "fuse" } as const;
    expect(placeOfNotice(notice)).toEqual({ view: "scan", take: 2 });
    expect(placeOfNotice({ ...notice, step: "export", text: "in the motion `walk` ..." })).toEqual({ view: "motion", layer: 2 });
    expect(placeOfNotice({ ...notice, step: "stack" })).toEqual({ view: "layers", layer: 2 });
  });
});
