// A VRM file in motion, as any page with three.js and @pixiv/three-vrm shows it. Runs in the browser.
import { Vector3 } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { VRMLoaderPlugin } from "@pixiv/three-vrm";

export async function load(bytes) {
  const loader = new GLTFLoader();
  loader.register((parser) => new VRMLoaderPlugin(parser));
  const file = await loader.parseAsync(bytes, "");
  return file.userData.vrm;
}

/**
 * Plays `motion` in fixed steps. Its `bones` are human bones, `poses` a list of frames, each [x, y, z of the hips in metres, then a
 * quaternion (x, y, z, w) for each bone relative to its parent in the T-pose]; the first is held for `settle` steps. Gives the vertices
 * (Float32Array, metres) of each mesh in the frames `wanted`, one after the other.
 */
export function play(vrm, { bones, poses, step, settle }, wanted) {
  const meshes = [];
  vrm.scene.traverse((node) => node.isSkinnedMesh && meshes.push(node));
  const out = Object.fromEntries(meshes.map((mesh) => [mesh.name, []]));
  const take = (pose) => {
    const hips = vrm.humanoid.getNormalizedBoneNode("hips");
    hips.position.set(pose[0], pose[1], pose[2]);
    bones.forEach((bone, k) => vrm.humanoid.getNormalizedBoneNode(bone).quaternion.fromArray(pose, 3 + 4 * k));
    vrm.update(step);
  };
  take(poses[0]);
  vrm.springBoneManager?.reset();
  for (let k = 0; k < settle; k += 1) take(poses[0]);
  poses.forEach((pose, frame) => {
    take(pose);
    if (!wanted.includes(frame)) return;
    vrm.scene.updateMatrixWorld(true);
    for (const mesh of meshes) out[mesh.name].push(vertices(mesh));
  });
  return out;
}

function vertices(mesh) {
  const { count } = mesh.geometry.attributes.position;
  const [out, place] = [new Float32Array(3 * count), new Vector3()];
  for (let v = 0; v < count; v += 1) mesh.getVertexPosition(v, place).applyMatrix4(mesh.matrixWorld).toArray(out, 3 * v);
  return out;
}
