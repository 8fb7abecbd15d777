import { useEffect, useRef } from "preact/hooks";
import { ACTION_NAMES, type Headline } from "./action";
import { BodyMap } from "./body_map";
import { Ring } from "./ring";
import type { Session } from "./session";
import type { Live } from "./use_live";

interface Props {
  session: Session;
  live: Live;
  headline: Headline;
  onLeave: () => void;
}

/** For an operator four metres away: one sentence, one ring, one key. */
export function RigMode({ session, live, headline, onLeave }: Props) {
  const box = useRef<HTMLDivElement>(null);
  const capture = session.capture!;
  const g = live.guidance;
  useEffect(() => {
    box.current?.requestFullscreen?.().catch(() => undefined);
    box.current?.focus();
    const onKey = (event: KeyboardEvent) => event.key === "Escape" && onLeave();
    window.addEventListener("keydown", onKey);
    return () => {
      window.removeEventListener("keydown", onKey);
      if (document.fullscreenElement !== null) void document.exitFullscreen().catch(() => undefined);
    };
  }, []);
  const recording = capture.state === "recording";
  return (
    <div class={`rig ${headline.tone}`} ref={box} tabIndex={-1}>
      <div class="rig-top">
        <span>{capture.state === "idle" ? session.next?.name ?? "" : `${capture.subject ?? ""} · ${capture.name ?? ""}`}</span>
        <button type="button" class="plain" onClick={onLeave}>Leave rig mode</button>
      </div>
      <div class="rig-middle">
        <div class="rig-picture" hidden={session.counting !== null || !["preview", "recording"].includes(capture.state)}>
          <canvas ref={live.place("cutout")} width={4} height={3} role="img" aria-label="Live colour" />
        </div>
        {session.counting !== null && <p class="rig-count" role="status">{session.counting}</p>}
        {recording && <Ring degrees={g?.degrees ?? capture.degrees} speed={g?.speed_deg_s ?? null} advice={g?.advice != null} turned={capture.turned} />}
        {recording && g?.unseen != null && <BodyMap unseen={g.unseen} />}
      </div>
      <p class="rig-line" role="status">{session.error ?? headline.text}</p>
      <div class="rig-foot">
        <button type="button" class="main" disabled={session.action === null} onClick={session.run}>
          {session.action === null ? "Wait" : capture.state === "review" ? "Keep, next layer" : ACTION_NAMES[session.action]}
        </button>
        {capture.state === "review" && <button type="button" class="plain" onClick={session.retake}>Retake</button>}
      </div>
    </div>
  );
}
