/** A triangle mesh as read from a PLY file: metres, the file's own frame. */
export interface PlyMesh {
  /** xyz by vertex. */
  positions: Float32Array;
  normals: Float32Array | null;
  /** sRGB bytes, rgb by vertex. */
  colors: Uint8Array | null;
  /** Other values by vertex, such as `filled` and `confidence`. */
  values: Map<string, Float32Array>;
  triangles: Uint32Array;
}

interface Property {
  name: string;
  type: string;
  offset: number;
}

const SIZES: Record<string, number> = {
  char: 1, uchar: 1, int8: 1, uint8: 1, short: 2, ushort: 2, int16: 2, uint16: 2,
  int: 4, uint: 4, int32: 4, uint32: 4, float: 4, float32: 4, double: 8, float64: 8,
};
const LONGEST_HEADER = 65_536;
const FACE_BYTES = 13;

interface Header {
  vertices: number;
  faces: number;
  properties: Property[];
  stride: number;
  start: number;
}

/** Reads a binary little-endian PLY of triangles as Toile writes it; throws an Error with a sentence for any other. */
export function parsePly(bytes: ArrayBuffer): PlyMesh {
  const header = parseHeader(bytes);
  const facesAt = header.start + header.vertices * header.stride;
  if (facesAt + header.faces * FACE_BYTES > bytes.byteLength) throw new Error("The mesh file is cut short.");
  const view = new DataView(bytes);
  const take = (names: string[]) => read(view, header, names);
  const rgb = take(["red", "green", "blue"]);
  const known = new Set(["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue"]);
  const others = header.properties.filter((p) => !known.has(p.name));
  const positions = take(["x", "y", "z"]);
  if (positions === null) throw new Error("The mesh file has no positions.");
  return {
    positions,
    normals: take(["nx", "ny", "nz"]),
    colors: rgb === null ? null : Uint8Array.from(rgb),
    values: new Map(others.map((p) => [p.name, take([p.name])!])),
    triangles: readTriangles(view, header, facesAt),
  };
}

function parseHeader(bytes: ArrayBuffer): Header {
  const text = new TextDecoder("latin1").decode(bytes.slice(0, Math.min(LONGEST_HEADER, bytes.byteLength)));
  const end = text.indexOf("end_header\n");
  if (!text.startsWith("ply\n") || end < 0) throw new Error("This is not a PLY file.");
  if (!text.includes("format binary_little_endian 1.0")) throw new Error("Only binary little-endian PLY files can be shown.");
  const header: Header = { vertices: 0, faces: 0, properties: [], stride: 0, start: end + "end_header\n".length };
  let element = "";
  for (const line of text.slice(0, end).split("\n")) {
    const words = line.trim().split(/\s+/);
    if (words[0] === "element") {
      element = words[1];
      if (element === "vertex") header.vertices = Number(words[2]);
      if (element === "face") header.faces = Number(words[2]);
    } else if (words[0] === "property") {
      addProperty(header, element, words);
    }
  }
  return header;
}

function addProperty(header: Header, element: string, words: string[]): void {
  if (element === "face" && words.join(" ") !== "property list uchar int vertex_indices") {
    throw new Error("The faces of this mesh file are not triangles as Toile writes them.");
  }
  if (element !== "vertex") return;
  const size = SIZES[words[1]];
  if (size === undefined) throw new Error(`The mesh file has a property of the unknown type ${words[1]}.`);
  header.properties.push({ name: words[2], type: words[1], offset: header.stride });
  header.stride += size;
}

function read(view: DataView, header: Header, names: string[]): Float32Array | null {
  const properties = names.map((name) => header.properties.find((p) => p.name === name));
  if (properties.some((p) => p === undefined)) return null;
  const width = names.length;
  const out = new Float32Array(header.vertices * width);
  properties.forEach((property, k) => {
    const value = reader(view, property!.type);
    let at = header.start + property!.offset;
    for (let i = 0, to = k; i < header.vertices; i += 1, to += width, at += header.stride) out[to] = value(at);
  });
  return out;
}

function reader(view: DataView, type: string): (at: number) => number {
  switch (type) {
    case "float": case "float32": return (at) => view.getFloat32(at, true);
    case "double": case "float64": return (at) => view.getFloat64(at, true);
    case "uchar": case "uint8": return (at) => view.getUint8(at);
    case "char": case "int8": return (at) => view.getInt8(at);
    case "ushort": case "uint16": return (at) => view.getUint16(at, true);
    case "short": case "int16": return (at) => view.getInt16(at, true);
    case "uint": case "uint32": return (at) => view.getUint32(at, true);
    default: return (at) => view.getInt32(at, true);
  }
}

function readTriangles(view: DataView, header: Header, start: number): Uint32Array {
  const triangles = new Uint32Array(3 * header.faces);
  for (let i = 0, at = start; i < header.faces; i += 1, at += FACE_BYTES) {
    if (view.getUint8(at) !== 3) throw new Error("The mesh file has a face that is no triangle.");
    for (let k = 0; k < 3; k += 1) {
      const index = view.getInt32(at + 1 + 4 * k, true);
      if (index < 0 || index >= header.vertices) throw new Error("The mesh file names a vertex that it does not have.");
      triangles[3 * i + k] = index;
    }
  }
  return triangles;
}
