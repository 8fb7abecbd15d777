import { BufferAttribute, BufferGeometry, Vector3 } from "three";
import { MeshBVH, type HitPointInfo } from "three-mesh-bvh";
import type { Point } from "../api/types";
import type { PlyMesh } from "../three/ply";

/** A point lies at most this far from the body that it is mirrored on, and its image this far from the scan, metres. */
const FARTHEST_FROM_BODY = 0.25;
const FARTHEST_FROM_SCAN = 0.03;

function bvhOf(mesh: PlyMesh): MeshBVH {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(mesh.positions, 3));
  geometry.setIndex(new BufferAttribute(mesh.triangles.slice(), 1));
  return new MeshBVH(geometry);
}

/** For each vertex of the body at rest, the vertex at its mirror image: left and right are alike in the A-pose. */
export function mirrorPairs(rest: PlyMesh): Uint32Array {
  const bvh = bvhOf(rest);
  const index = bvh.geometry.index!;
  const hit: HitPointInfo = { point: new Vector3(), distance: 0, faceIndex: 0 };
  const [place, corner] = [new Vector3(), new Vector3()];
  return Uint32Array.from({ length: rest.positions.length / 3 }, (_, v) => {
    place.set(-rest.positions[3 * v], rest.positions[3 * v + 1], rest.positions[3 * v + 2]);
    bvh.closestPointToPoint(place, hit);
    const corners = [0, 1, 2].map((k) => index.getX(3 * hit.faceIndex + k));
    const far = (c: number) => corner.fromArray(rest.positions, 3 * c).distanceToSquared(place);
    return corners.reduce((best, c) => (far(c) < far(best) ? c : best));
  });
}

/** Mirrors points of a scan over the person's own middle: by the body's surface in this take's pose, whichever way the arms are. */
export class Mirror {
  private readonly body: MeshBVH;
  private readonly pairs: Uint32Array;

  constructor(private readonly posed: PlyMesh, rest: PlyMesh, private readonly scan: MeshBVH) {
    this.body = bvhOf(posed);
    this.pairs = mirrorPairs(rest);
  }

  /** The image of a point on the scan, or null where the other side has no scan. */
  image(point: Point): Point | null {
    const hit: HitPointInfo = { point: new Vector3(), distance: 0, faceIndex: 0 };
    const at = new Vector3(...point);
    if (this.body.closestPointToPoint(at, hit, 0, FARTHEST_FROM_BODY) === null) return null;
    const index = this.body.geometry.index!;
    const corners = [0, 1, 2].map((k) => index.getX(3 * hit.faceIndex + k));
    const weights = shares(hit.point, corners.map((c) => this.vertex(c)));
    const mirrored = corners.map((c) => this.vertex(this.pairs[c]));
    const foot = new Vector3();
    mirrored.forEach((corner, k) => foot.addScaledVector(corner, weights[k]));
    const side = at.clone().sub(hit.point).dot(normalOf(corners.map((c) => this.vertex(c)))) < 0 ? -1 : 1;
    // Mirrored, the corners run the other way round.
    const out = normalOf([mirrored[0], mirrored[2], mirrored[1]]).multiplyScalar(side * hit.distance).add(foot);
    const on = this.scan.closestPointToPoint(out, { point: new Vector3(), distance: 0, faceIndex: 0 }, 0, FARTHEST_FROM_SCAN);
    return on === null ? null : [on.point.x, on.point.y, on.point.z];
  }

  private vertex(index: number): Vector3 {
    return new Vector3().fromArray(this.posed.positions, 3 * index);
  }
}

function normalOf([a, b, c]: Vector3[]): Vector3 {
  return b.clone().sub(a).cross(c.clone().sub(a)).normalize();
}

/** Barycentric coordinates of a point of a triangle. */
function shares(point: Vector3, [a, b, c]: Vector3[]): [number, number, number] {
  const [ab, ac, ap] = [b.clone().sub(a), c.clone().sub(a), point.clone().sub(a)];
  const [d00, d01, d11, d20, d21] = [ab.dot(ab), ab.dot(ac), ac.dot(ac), ap.dot(ab), ap.dot(ac)];
  const whole = d00 * d11 - d01 * d01;
  if (Math.abs(whole) < 1e-18) return [1, 0, 0];
  const [v, w] = [(d11 * d20 - d01 * d21) / whole, (d00 * d21 - d01 * d20) / whole];
  return [1 - v - w, v, w];
}
