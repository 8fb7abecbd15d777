import type { ComponentChildren } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { Viewer, type Look } from "./viewer";
import { hasWebGl } from "./webgl";

const LOOK_NAMES: [Look, string][] = [["front", "Front"], ["back", "Back"], ["left", "Left"], ["right", "Right"], ["top", "Top"]];

interface Props {
  label: string;
  children?: (viewer: Viewer) => ComponentChildren;
  /** What lies over the picture. */
  over?: ComponentChildren;
}

/** The place for pictures in space; where the browser cannot draw them, it says so and the rest of the page works. */
export function Stage({ label, children, over }: Props) {
  const box = useRef<HTMLDivElement>(null);
  const canvas = useRef<HTMLCanvasElement>(null);
  const [viewer, setViewer] = useState<Viewer | null>(null);
  const [fault, setFault] = useState(!hasWebGl);
  useEffect(() => {
    if (!hasWebGl) return;
    let made: Viewer;
    try {
      made = new Viewer(box.current!, canvas.current!);
    } catch {
      setFault(true);
      return;
    }
    setViewer(made);
    return () => made.dispose();
  }, []);
  if (fault) {
    return (
      <div class="stage fault" role="note">
        <p>This browser shows no pictures in space (WebGL 2 is missing or switched off). Everything else on this page works.</p>
        {over}
      </div>
    );
  }
  return (
    <div class="stage" ref={box}>
      <canvas ref={canvas} tabIndex={0} role="img" aria-label={`${label}. Drag or use the arrow keys to turn it, plus and minus to come nearer.`} />
      <div class="looks" role="group" aria-label="View from">
        {LOOK_NAMES.map(([look, name]) => <button key={look} type="button" onClick={() => viewer?.look(look)}>{name}</button>)}
      </div>
      {viewer !== null && children?.(viewer)}
      {over}
    </div>
  );
}
