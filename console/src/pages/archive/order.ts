import type { SubjectLine, SubjectState } from "../../api/types";

export type SortKey = "modified" | "name" | "date" | "state" | "warnings";

/** What needs somebody comes first. */
const RANK: Record<SubjectState, number> = { damaged: 0, failed: 0, busy: 1, stale: 2, recorded: 3, empty: 4, processed: 5 };

const compareText = new Intl.Collator(undefined, { numeric: true, sensitivity: "base" }).compare;

function compare(key: SortKey, a: SubjectLine, b: SubjectLine): number {
  switch (key) {
    case "name": return compareText(a.name, b.name);
    case "date": return compareText(b.date, a.date);
    case "state": return RANK[a.state] - RANK[b.state];
    case "warnings": return b.warnings - a.warnings;
    case "modified": return b.modified - a.modified;
  }
}

/** Sorted by a key, and by name where that is equal; the given list stays as it is. */
export function sorted(subjects: SubjectLine[], key: SortKey, reversed: boolean): SubjectLine[] {
  const sign = reversed ? -1 : 1;
  return [...subjects].sort((a, b) => sign * compare(key, a, b) || compareText(a.name, b.name) || compareText(a.id, b.id));
}

/** Those of which every word of the search is found in name, folder, date, state or layers. */
export function found(subjects: SubjectLine[], search: string): SubjectLine[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  if (words.length === 0) return subjects;
  return subjects.filter((subject) => {
    const layers = subject.layers.map((layer) => `${layer.name} ${layer.type ?? ""}`).join(" ");
    const text = `${subject.name} ${subject.id} ${subject.date} ${subject.state} ${layers}`.toLowerCase();
    return words.every((word) => text.includes(word));
  });
}
