import { Mesh } from "three";
import { acceleratedRaycast } from "three-mesh-bvh";

/** Rays against meshes use their box hierarchy where they have one. */
Mesh.prototype.raycast = acceleratedRaycast;
