/** Loudness that a clap has at least, and how much louder than the room it is. */
const LOUDEST = 0.3;
const OVER_ROOM = 6;
/** A clap is over after this time; speech and music go on. */
const SHORT_S = 0.18;
const QUIET_SHARE = 0.35;
const ROOM_MEMORY_S = 1.5;

/** Tells claps from other noise by peaks of the sound's level. */
export class ClapDetector {
  private room = 0.02;
  private peak: { level: number; at: number } | null = null;
  private last = 0;

  /** Takes the level (0 to 1) at a time in seconds; true once a clap is over. */
  push(level: number, at: number): boolean {
    const step = Math.min(0.2, Math.max(0, at - this.last));
    this.last = at;
    if (this.peak === null) {
      if (level > LOUDEST && level > OVER_ROOM * this.room) this.peak = { level, at };
      else this.room += (level - this.room) * Math.min(1, step / ROOM_MEMORY_S);
      return false;
    }
    this.peak.level = Math.max(this.peak.level, level);
    if (level < QUIET_SHARE * this.peak.level) {
      const wasShort = at - this.peak.at <= SHORT_S;
      this.peak = null;
      return wasShort;
    }
    if (at - this.peak.at > 3 * SHORT_S) {
      this.room = level;
      this.peak = null;
    }
    return false;
  }
}

const LISTEN_MS = 15;

/** Listens by the microphone of this computer and calls back at a clap; the sound goes nowhere. */
export async function listenForClaps(onClap: () => void): Promise<() => void> {
  if (navigator.mediaDevices === undefined) throw new Error("This browser gives no microphone to a page that is not on this computer or encrypted.");
  const stream = await navigator.mediaDevices.getUserMedia({ audio: { echoCancellation: false, noiseSuppression: false, autoGainControl: false } });
  const context = new AudioContext();
  const analyser = new AnalyserNode(context, { fftSize: 1024 });
  context.createMediaStreamSource(stream).connect(analyser);
  const samples = new Float32Array(analyser.fftSize);
  const detector = new ClapDetector();
  const timer = setInterval(() => {
    analyser.getFloatTimeDomainData(samples);
    const level = samples.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
    if (detector.push(level, context.currentTime)) onClap();
  }, LISTEN_MS);
  return () => {
    clearInterval(timer);
    for (const track of stream.getTracks()) track.stop();
    void context.close();
  };
}
