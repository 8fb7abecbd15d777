/** Where the page is: the fragment, as `#/subjects/anna?view=scan`. */
export interface Place {
  path: string[];
  query: URLSearchParams;
}

export function parsePlace(fragment: string): Place {
  const [path, query = ""] = fragment.replace(/^#\/?/, "").split("?", 2);
  return { path: path.split("/").filter(Boolean).map(decoded), query: new URLSearchParams(query) };
}

function decoded(part: string): string {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

export function placeText(path: string[], query: Record<string, string | number | null> = {}): string {
  const entries = Object.entries(query).filter(([, value]) => value !== null && value !== "");
  const search = new URLSearchParams(entries.map(([key, value]) => [key, String(value)])).toString();
  return `#/${path.map(encodeURIComponent).join("/")}${search === "" ? "" : `?${search}`}`;
}
