import { BufferAttribute, BufferGeometry } from "three";
import { MeshBVH } from "three-mesh-bvh";
import { fileAddress } from "../../api/client";
import type { Layer, Subject } from "../../api/types";
import { edgeStrength } from "../../brush/edges";
import { ScanGraph } from "../../brush/scan_graph";
import { Mirror } from "../../brush/symmetry";
import "../../three/bvh_setup";
import { loadPly, surface, type Surface } from "../../three/meshes";
import type { PlyMesh } from "../../three/ply";

/** A layer's scan as the tools need it. */
export interface Canvas {
  scan: PlyMesh;
  surface: Surface;
  graph: ScanGraph;
  edges: Float32Array;
  mirror: Mirror | null;
}

export function scanFile(layer: Layer): string {
  return `build/${layer.folder}/scan.ply`;
}

/** The garment as it was cut, in the frame of the take's scan. */
export function cutFile(layer: Layer): string {
  return `build/${layer.folder}/cut.ply`;
}

export async function loadCanvas(subject: Subject, layer: Layer, signal: AbortSignal): Promise<Canvas> {
  const load = (file: string) => (subject.files.includes(file) ? loadPly(fileAddress(subject.id, file), signal) : Promise.resolve(null));
  const posedFile = layer.index === 0 ? "build/body/body.ply" : `build/${layer.folder}/body.ply`;
  const [scan, posed, rest] = await Promise.all([load(scanFile(layer)), load(posedFile), load("build/body/rest.ply")]);
  if (scan === null) throw new Error("This take is not fused yet; process the subject first.");
  const made = surface({ ...scan, triangles: scan.triangles.slice() }, 7);
  made.geometry.setAttribute("color", new BufferAttribute(new Float32Array(scan.positions.length), 3));
  made.material.vertexColors = true;
  made.material.color.set(0xffffff);
  const bvh = new MeshBVH(made.geometry);
  made.geometry.boundsTree = bvh;
  const graph = new ScanGraph(scan.positions, scan.triangles);
  const fits = posed !== null && rest !== null && posed.positions.length === rest.positions.length;
  return {
    scan, surface: made, graph,
    edges: edgeStrength(graph, scan.colors, scan.normals),
    mirror: fits ? new Mirror(posed, rest, bvh) : null,
  };
}

/** A geometry for lines through points, xyz each. */
export function lineGeometry(points: number[]): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(Float32Array.from(points), 3));
  return geometry;
}
