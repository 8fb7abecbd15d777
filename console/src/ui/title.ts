export function titleOf(path: string[]): string {
  const [page, id, part] = path;
  if (page === "jobs") return "Jobs · Toile";
  if (page === "scan") return id === undefined ? "Scan · Toile" : `Scan ${id} · Toile`;
  if (page === "subjects" && id !== undefined) return `${part === "correct" ? "Correct " : ""}${id} · Toile`;
  return "Archive · Toile";
}
