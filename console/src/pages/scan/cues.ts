import { createStore } from "../../state/store";

/** Whether tones and spoken cues are wanted. */
export const sound = createStore(localStorage.getItem("toile.sound") !== "off");

export function setSound(on: boolean): void {
  localStorage.setItem("toile.sound", on ? "on" : "off");
  sound.set(on);
  if (!on) window.speechSynthesis?.cancel();
}

let context: AudioContext | null = null;

/** A tone: frequency in hertz, length in seconds. Browsers let a page sound only after a key or a click; before, nothing happens. */
export function tone(hertz: number, seconds: number): void {
  if (!sound.get() || navigator.userActivation?.hasBeenActive === false) return;
  context ??= new AudioContext();
  const gain = new GainNode(context, { gain: 0.001 });
  const source = new OscillatorNode(context, { frequency: hertz });
  source.connect(gain).connect(context.destination);
  const now = context.currentTime;
  gain.gain.exponentialRampToValueAtTime(0.25, now + 0.015);
  gain.gain.exponentialRampToValueAtTime(0.001, now + seconds);
  source.start(now);
  source.stop(now + seconds);
}

export const TONES = {
  count: () => tone(660, 0.12),
  start: () => tone(990, 0.45),
  end: () => { tone(880, 0.2); setTimeout(() => tone(660, 0.35), 180); },
  warn: () => tone(330, 0.25),
};

/** Between two sayings of the same sentence. */
const AGAIN_MS = 5_000;
let last = { text: "", at: 0 };

/** Says a sentence by the browser's own voice; one that is still being said is broken off by another. */
export function speak(text: string): void {
  if (!sound.get() || text === "" || window.speechSynthesis === undefined) return;
  const now = Date.now();
  if (text === last.text && now - last.at < AGAIN_MS) return;
  last = { text, at: now };
  window.speechSynthesis.cancel();
  const saying = new SpeechSynthesisUtterance(text);
  saying.lang = "en";
  window.speechSynthesis.speak(saying);
}
