import { BufferAttribute, BufferGeometry, Vector3 } from "three";
import { MeshBVH } from "three-mesh-bvh";

export interface DistanceTask {
  points: Float32Array;
  positions: Float32Array;
  triangles: Uint32Array;
}

/** Further away than this, a distance is not looked for, metres. */
const FARTHEST = 0.5;

/** Signed distance of points from a closed surface, positive outside, metres. */
function distances({ points, positions, triangles }: DistanceTask): Float32Array {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setIndex(new BufferAttribute(triangles, 1));
  const bvh = new MeshBVH(geometry);
  const index = geometry.index!;
  const [a, b, c, point] = [new Vector3(), new Vector3(), new Vector3(), new Vector3()];
  const hit = { point: new Vector3(), distance: 0, faceIndex: 0 };
  const out = new Float32Array(points.length / 3);
  for (let i = 0; i < out.length; i += 1) {
    point.fromArray(points, 3 * i);
    if (bvh.closestPointToPoint(point, hit, 0, FARTHEST) === null) {
      out[i] = FARTHEST;
      continue;
    }
    a.fromArray(positions, 3 * index.getX(3 * hit.faceIndex));
    b.fromArray(positions, 3 * index.getX(3 * hit.faceIndex + 1)).sub(a);
    c.fromArray(positions, 3 * index.getX(3 * hit.faceIndex + 2)).sub(a);
    out[i] = point.sub(hit.point).dot(b.cross(c)) < 0 ? -hit.distance : hit.distance;
  }
  return out;
}

self.onmessage = (message: MessageEvent<DistanceTask>) => {
  const out = distances(message.data);
  self.postMessage(out, { transfer: [out.buffer] });
};
