import { useEffect, useState } from "preact/hooks";
import { fileAddress } from "../api/client";
import type { Subject } from "../api/types";
import { useRemote, type Remote } from "../state/remote";
import { disposeSurface, loadPly, paintSurface, surface, type Surface } from "./meshes";
import type { PlyMesh } from "./ply";
import type { Viewer } from "./viewer";

/** A mesh file of the subject, read again when the subject has changed; null where it has no such file. */
export function useMesh(subject: Subject, file: string | null): Remote<PlyMesh> {
  const there = file !== null && subject.files.includes(file);
  const key = there ? `${subject.id}/${file}?${subject.modified}` : null;
  return useRemote(key, (signal) => loadPly(fileAddress(subject.id, file!), signal));
}

export interface Look {
  index: number;
  visible: boolean;
  ownColors: boolean;
  /** 0 to 1. */
  opacity: number;
  /** Metres to the side. */
  shift: number;
}

/** Shows a mesh in a viewer for as long as the component lives. */
export function useSurface(viewer: Viewer, mesh: PlyMesh | null, look: Look): Surface | null {
  const [made, setMade] = useState<Surface | null>(null);
  useEffect(() => {
    if (mesh === null) return;
    const next = surface(mesh, look.index);
    const hide = viewer.show(next);
    setMade(next);
    return () => {
      hide();
      disposeSurface(next);
      setMade(null);
    };
  }, [viewer, mesh]);
  useEffect(() => {
    if (made === null) return;
    made.visible = look.visible;
    made.position.x = look.shift;
    paintSurface(made, look.index, look.ownColors);
    made.material.transparent = look.opacity < 1;
    made.material.opacity = look.opacity;
    made.material.depthWrite = look.opacity === 1;
    made.renderOrder = look.opacity < 1 ? 1 : 0;
    viewer.draw();
  }, [made, look.index, look.visible, look.ownColors, look.opacity, look.shift]);
  return made;
}
