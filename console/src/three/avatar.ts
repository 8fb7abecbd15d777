import { AnimationMixer, BufferAttribute, type BufferGeometry, DoubleSide, Group, Mesh, MeshLambertMaterial, type MeshStandardMaterial, type Object3D } from "three";
import { GLTFLoader, type GLTF } from "three/examples/jsm/loaders/GLTFLoader.js";
import { request } from "../api/client";
import { vertexNormals } from "./normals";
import type { PointCache } from "./pc2";

/** An avatar that moves; frames run from 0. */
export interface Moving {
  object: Object3D;
  seconds: number;
  layers: Map<string, Object3D>;
  /** Shows a moment; false while its vertices are still on their way. */
  show(seconds: number): boolean;
  dispose(): void;
}

export async function loadGltf(url: string, signal: AbortSignal): Promise<GLTF> {
  const bytes = await (await request(url, { signal })).arrayBuffer();
  return await new GLTFLoader().parseAsync(bytes, "");
}

/** Meshes of an avatar by the name of their node: `body`, `01-trousers`, ... A name with a dot loses it in three.js. */
function meshesOf(gltf: GLTF): Map<string, Mesh> {
  const found = new Map<string, Mesh>();
  gltf.scene.traverse((object) => {
    if ((object as Mesh).isMesh) found.set(object.name, object as Mesh);
  });
  return found;
}

/** The clip of the file, by skinning alone. */
export function skinned(gltf: GLTF): Moving {
  const clip = gltf.animations[0];
  const mixer = new AnimationMixer(gltf.scene);
  if (clip !== undefined) mixer.clipAction(clip).play();
  const meshes = meshesOf(gltf);
  for (const mesh of meshes.values()) mesh.frustumCulled = false;
  return {
    object: gltf.scene,
    seconds: clip?.duration ?? 0,
    layers: meshes,
    show(seconds) {
      mixer.setTime(seconds);
      return true;
    },
    dispose: () => mixer.stopAllAction(),
  };
}

/** The cloth of a motion: each layer's vertices as its point cache has them, on the triangles of the avatar file. */
export function cached(gltf: GLTF, caches: Map<string, PointCache>, fps: number): Moving {
  const group = new Group();
  const parts: { mesh: Mesh; cache: PointCache }[] = [];
  for (const [name, source] of meshesOf(gltf)) {
    const cache = caches.get(name);
    if (cache === undefined || cache.points !== source.geometry.getAttribute("position").count) continue;
    const mesh = new Mesh(movingGeometry(source.geometry), materialOf(source));
    mesh.frustumCulled = false;
    mesh.name = name;
    parts.push({ mesh, cache });
    group.add(mesh);
  }
  if (parts.length === 0) throw new Error("The point caches of this motion do not fit its avatar; animate it again.");
  const frames = Math.min(...parts.map((part) => part.cache.frames));
  return {
    object: group,
    seconds: frames / fps,
    layers: new Map(parts.map((part) => [part.mesh.name, part.mesh])),
    show: (seconds) => showFrame(parts, Math.min(frames - 1, Math.floor(seconds * fps))),
    dispose() {
      for (const { mesh, cache } of parts) {
        mesh.geometry.dispose();
        cache.dispose();
      }
    },
  };
}

function movingGeometry(source: BufferGeometry): BufferGeometry {
  const geometry = source.clone();
  for (const name of ["skinIndex", "skinWeight", "tangent"]) geometry.deleteAttribute(name);
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(3 * source.getAttribute("position").count), 3));
  geometry.setAttribute("normal", new BufferAttribute(new Float32Array(3 * source.getAttribute("position").count), 3));
  return geometry;
}

function materialOf(source: Mesh): MeshLambertMaterial {
  const standard = source.material as MeshStandardMaterial;
  const colored = source.geometry.hasAttribute("color");
  return new MeshLambertMaterial({ color: standard.color, map: standard.map ?? null, vertexColors: colored, side: DoubleSide });
}

function showFrame(parts: { mesh: Mesh; cache: PointCache }[], frame: number): boolean {
  const all = parts.map(({ cache }) => cache.frame(frame));
  if (all.some((points) => points === null)) return false;
  parts.forEach(({ mesh }, k) => {
    const position = mesh.geometry.getAttribute("position") as BufferAttribute;
    const normal = mesh.geometry.getAttribute("normal") as BufferAttribute;
    (position.array as Float32Array).set(all[k]!);
    if (mesh.visible) vertexNormals(position.array as Float32Array, mesh.geometry.index!.array, normal.array as Float32Array);
    position.needsUpdate = true;
    normal.needsUpdate = true;
  });
  return true;
}
