import { BufferAttribute, BufferGeometry, Color, DoubleSide, Mesh, MeshLambertMaterial, SRGBColorSpace } from "three";
import { request } from "../api/client";
import { parsePly, type PlyMesh } from "./ply";

export async function loadPly(url: string, signal?: AbortSignal): Promise<PlyMesh> {
  const answer = await request(url, signal === undefined ? {} : { signal });
  return parsePly(await answer.arrayBuffer());
}

/** Linear light for each sRGB byte: the graphics card computes with light. */
const LINEAR = Float32Array.from({ length: 256 }, (_, k) => {
  const value = k / 255;
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
});

export function linearColors(srgb: Uint8Array): Float32Array {
  return Float32Array.from(srgb, (value) => LINEAR[value]);
}

export function geometryOf(mesh: PlyMesh): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(mesh.positions, 3));
  geometry.setIndex(new BufferAttribute(mesh.triangles, 1));
  if (mesh.normals === null) geometry.computeVertexNormals();
  else geometry.setAttribute("normal", new BufferAttribute(mesh.normals, 3));
  if (mesh.colors !== null) geometry.setAttribute("color", new BufferAttribute(linearColors(mesh.colors), 3));
  return geometry;
}

export type Surface = Mesh<BufferGeometry, MeshLambertMaterial>;

/** Colours by layer for meshes without a colour of their own; told apart by people who see few colours, too. */
const TINTS = ["#c9a58d", "#4f8fb8", "#d0843c", "#5a9e78", "#9a78b4", "#b8a23a", "#b45f70", "#6f8791"];

export function tint(index: number): string {
  return TINTS[index % TINTS.length];
}

export function surface(mesh: PlyMesh, index: number): Surface {
  const material = new MeshLambertMaterial({ side: DoubleSide });
  const made = new Mesh(geometryOf(mesh), material);
  paintSurface(made, index, mesh.colors !== null);
  return made;
}

/** Shows a surface in its own colours, or in its layer's tint. */
export function paintSurface(made: Surface, index: number, own: boolean): void {
  const colored = own && made.geometry.hasAttribute("color");
  made.material.vertexColors = colored;
  made.material.color = colored ? new Color(1, 1, 1) : new Color().setStyle(tint(index), SRGBColorSpace);
  made.material.needsUpdate = true;
}

export function disposeSurface(made: Surface): void {
  made.geometry.dispose();
  made.material.dispose();
}
