import { BufferAttribute, BufferGeometry, DoubleSide, Mesh, MeshLambertMaterial } from "three";
import { useEffect } from "preact/hooks";
import { linearColors } from "../../three/meshes";
import { vertexNormals } from "../../three/normals";
import { Stage } from "../../three/stage";
import type { Viewer } from "../../three/viewer";
import type { LiveSurface } from "./live";

/** The surface that the turn has made so far. */
export default function SurfaceView({ surface }: { surface: LiveSurface | null }) {
  const over = surface === null ? <p class="stage-note">The surface of a take appears here while it is recorded.</p> : null;
  return (
    <Stage label="Live surface" over={over}>
      {(viewer) => <Shown viewer={viewer} surface={surface} />}
    </Stage>
  );
}

function Shown({ viewer, surface }: { viewer: Viewer; surface: LiveSurface | null }) {
  useEffect(() => {
    if (surface === null) return;
    const geometry = new BufferGeometry();
    const normals = new Float32Array(surface.positions.length);
    vertexNormals(surface.positions, surface.triangles, normals);
    geometry.setAttribute("position", new BufferAttribute(surface.positions, 3));
    geometry.setAttribute("normal", new BufferAttribute(normals, 3));
    geometry.setAttribute("color", new BufferAttribute(linearColors(surface.colors), 3));
    geometry.setIndex(new BufferAttribute(surface.triangles, 1));
    const material = new MeshLambertMaterial({ vertexColors: true, side: DoubleSide });
    const hide = viewer.show(new Mesh(geometry, material));
    return () => {
      hide();
      geometry.dispose();
      material.dispose();
    };
  }, [viewer, surface]);
  return null;
}
