const RADIUS = 88;
const ROUND = 2 * Math.PI * RADIUS;
const FASTEST_SHOWN = 40;

/** How far the turn is, as a ring that closes, with the speed in its middle. */
export function Ring({ degrees, speed, advice, turned }: { degrees: number; speed: number | null; advice: boolean; turned: boolean }) {
  const share = Math.min(1, Math.max(0, degrees / 360));
  const needle = speed === null ? 0 : Math.min(1, speed / FASTEST_SHOWN);
  return (
    <div class={`ring ${turned ? "full" : advice ? "warned" : ""}`} role="img" aria-label={`${Math.round(degrees)} of 360 degrees`}>
      <svg viewBox="0 0 200 200" aria-hidden="true">
        <circle class="ring-track" cx="100" cy="100" r={RADIUS} />
        <circle class="ring-done" cx="100" cy="100" r={RADIUS} stroke-dasharray={`${share * ROUND} ${ROUND}`} transform="rotate(-90 100 100)" />
        <path class="ring-speed-track" d="M60 138h80" />
        <path class="ring-speed" d={`M60 138h${80 * needle}`} />
      </svg>
      <p><strong>{Math.round(degrees)}°</strong><span>{speed === null ? " " : `${speed.toFixed(0)}° a second`}</span></p>
    </div>
  );
}
