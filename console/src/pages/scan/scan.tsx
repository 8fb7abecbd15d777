import type { ComponentType } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import type { Capture } from "../../api/types";
import { go, placeText } from "../../router";
import { useStore } from "../../state/store";
import { Icon } from "../../ui/icons";
import { tellError } from "../../ui/toasts";
import { timeText } from "../../ui/words";
import { ACTION_NAMES, headlineOf, type Headline } from "./action";
import { BodyMap } from "./body_map";
import { Checks } from "./checks";
import { listenForClaps } from "./clap";
import { setSound, sound, speak, TONES } from "./cues";
import { pedalKey, teachPedal, useActionKey } from "./keys";
import type { LiveSurface } from "./live";
import { RigMode } from "./rig";
import { Ring } from "./ring";
import { COUNTDOWNS, useSession, type Session } from "./session";
import { Setup } from "./setup";
import { useLive, type Live } from "./use_live";

const LIVE_STATES = ["preview", "recording", "finishing"];

export function ScanPage({ subject: asked }: { subject: string | null }) {
  const [rig, setRig] = useState(false);
  const session = useSession(asked);
  const { capture } = session;
  const live = useLive(capture !== null && LIVE_STATES.includes(capture.state), ["cutout", "depth", "surface"]);
  const headline = headlineOf(capture, live.guidance, session.counting !== null, session.next?.say ?? "");
  useFollow(capture, asked);
  useEffect(() => {
    if (capture?.state === "preview") live.clearSurface();
  }, [capture?.state]);
  useCues(capture, headline, session.counting !== null);
  useActionKey(session.run);
  if (capture === null) return <p class="page dim" role="status">Asking the service …</p>;
  if (rig) return <RigMode session={session} live={live} headline={headline} onLeave={() => setRig(false)} />;
  return (
    <div class="scan">
      <ScanHead session={session} onRig={() => setRig(true)} />
      {capture.state === "idle"
        ? <Setup subject={asked} next={session.next} choice={session.choice} error={session.error} onChoice={session.setChoice} onOpen={session.run} />
        : <Running session={session} live={live} headline={headline} />}
    </div>
  );
}

/** A page that comes back finds the take that is open, whichever subject it is of. */
function useFollow(capture: Capture | null, asked: string | null): void {
  useEffect(() => {
    if (capture !== null && capture.state !== "idle" && capture.subject !== null && capture.subject !== asked) go(["scan", capture.subject]);
  }, [capture?.subject, capture?.state]);
}

function useCues(capture: Capture | null, headline: Headline, counting: boolean): void {
  const before = useRef<string | undefined>(undefined);
  useEffect(() => {
    const now = capture?.state;
    if (before.current === "preview" && now === "recording") TONES.start();
    if (before.current === "recording" && now !== "recording") TONES.end();
    before.current = now;
  }, [capture?.state]);
  useEffect(() => {
    if (headline.tone === "warn" || headline.tone === "bad") TONES.warn();
    if (capture !== null && capture.state !== "opening" && !counting) speak(headline.text);
  }, [headline.text]);
}

function ScanHead({ session, onRig }: { session: Session; onRig: () => void }) {
  const { capture } = session;
  const noisy = useStore(sound);
  const [pedal, setPedal] = useState<string | null>(pedalKey());
  const [teaching, setTeaching] = useState(false);
  const teach = async () => {
    setTeaching(true);
    setPedal((await teachPedal()) ?? pedalKey());
    setTeaching(false);
  };
  const who = capture?.subject ?? null;
  return (
    <div class="scan-head">
      <h1>{who === null || capture === null || capture.state === "idle" ? "Scan" : <><a href={placeText(["subjects", who])}>{who}</a>, {capture.name}</>}</h1>
      <div class="actions">
        <ClapButton onClap={session.run} />
        <button type="button" class="plain" onClick={() => void teach()}>{teaching ? "Press the pedal …" : pedal === null ? "Teach a pedal" : `Pedal: ${pedal}`}</button>
        <button type="button" class="plain" aria-pressed={noisy} onClick={() => setSound(!noisy)}><Icon name="sound" />Sound</button>
        <button type="button" class="plain" onClick={onRig}><Icon name="expand" />Rig mode</button>
      </div>
    </div>
  );
}

function ClapButton({ onClap }: { onClap: () => void }) {
  const [stop, setStop] = useState<(() => void) | null>(null);
  const latest = useRef(onClap);
  latest.current = onClap;
  useEffect(() => () => stop?.(), [stop]);
  const toggle = () => {
    if (stop !== null) return setStop(null);
    listenForClaps(() => latest.current()).then((end) => setStop(() => end), tellError);
  };
  return <button type="button" class="plain" aria-pressed={stop !== null} onClick={toggle}>Clap</button>;
}

function Running({ session, live, headline }: { session: Session; live: Live; headline: Headline }) {
  const capture = session.capture!;
  return (
    <div class="scan-run">
      <Pictures live={live} capture={capture} />
      <div class="scan-side">
        <p class={`headline ${headline.tone}`} role="status">{session.counting === null ? headline.text : `${session.counting}`}</p>
        {session.error !== null && <p class="bad" role="alert">{session.error}</p>}
        <Controls session={session} />
        {capture.state === "review" ? <Review capture={capture} /> : <Watching live={live} capture={capture} />}
      </div>
    </div>
  );
}

function Watching({ live, capture }: { live: Live; capture: Capture }) {
  const g = live.guidance;
  return (
    <>
      {capture.state === "recording" && (
        <div class="turn">
          <Ring degrees={g?.degrees ?? capture.degrees} speed={g?.speed_deg_s ?? null} advice={g?.advice != null} turned={capture.turned} />
          {g?.unseen != null && <BodyMap unseen={g.unseen} />}
        </div>
      )}
      <Checks guidance={g} capture={capture} />
      <p class="dim pace" data-rate={live.rate} data-age={Math.round(live.ageMs)}>
        {live.open ? `${live.rate.toFixed(0)} pictures a second, ${Math.round(live.ageMs)} ms old` : "The live line is closed; the page opens it again."}
        {capture.job_paused && " · A job waits for the capture."}
      </p>
    </>
  );
}

function Controls({ session }: { session: Session }) {
  const { capture, action } = session;
  const state = capture!.state;
  return (
    <div class="scan-controls">
      {action !== null && <button type="button" class="main large" onClick={session.run}>{state === "review" ? "Keep, next layer" : ACTION_NAMES[action]}</button>}
      {state === "preview" && (
        <label class="row">Countdown
          <select value={session.countdown} onChange={(e) => session.setCountdown(Number(e.currentTarget.value))}>
            {COUNTDOWNS.map((seconds) => <option key={seconds} value={seconds}>{seconds === 0 ? "none" : `${seconds} s`}</option>)}
          </select>
        </label>
      )}
      {state === "review" && <button type="button" class="plain" onClick={() => void session.finish().then(() => go(["subjects", capture!.subject ?? ""]))}>Keep, and finish</button>}
      {state === "review" && <button type="button" class="plain" onClick={session.retake}>Retake</button>}
      {(state === "preview" || state === "review") && <button type="button" class="plain" onClick={session.discard}>{state === "preview" ? "Close the camera" : "Throw away"}</button>}
    </div>
  );
}

export function Review({ capture }: { capture: Capture }) {
  const facts: [string, string][] = [
    ["Turn", capture.turned ? "full" : `${Math.round(capture.degrees)}°`],
    ["Frames", `${capture.frames} in ${timeText(capture.seconds)}`],
    ["Dropped", String(capture.dropped)],
    ["Not seen", (capture.unseen ?? []).join(", ") || "nothing"],
    ["File", capture.take_file ?? "–"],
  ];
  return (
    <>
      <dl class="facts">{facts.map(([name, value]) => <div key={name}><dt>{name}</dt><dd>{value}</dd></div>)}</dl>
      <ul class="review-warnings">{(capture.warnings ?? []).map((warning) => <li key={warning}>{warning}</li>)}</ul>
      <p class="dim">A take that is retaken or thrown away is moved to takes/rejected; it is not deleted.</p>
    </>
  );
}

function Pictures({ live, capture }: { live: Live; capture: Capture }) {
  const still = !LIVE_STATES.includes(capture.state);
  return (
    <div class="scan-pictures" data-still={still}>
      <figure><canvas ref={live.place("cutout")} width={4} height={3} role="img" aria-label="Live colour" /><figcaption>Colour</figcaption></figure>
      <figure><canvas ref={live.place("depth")} width={4} height={3} role="img" aria-label="Live depth" /><figcaption>Depth</figcaption></figure>
      {capture.state !== "preview" && <figure class="live-surface"><LazySurface surface={live.surface} /></figure>}
    </div>
  );
}

/** The part that draws in space is loaded when a take is recorded. */
function LazySurface({ surface }: { surface: LiveSurface | null }) {
  const [View, setView] = useState<ComponentType<{ surface: LiveSurface | null }> | null>(null);
  useEffect(() => void import("./surface").then((m) => setView(() => m.default), tellError), []);
  return View === null ? null : <View surface={surface} />;
}
