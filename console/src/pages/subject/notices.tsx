import type { Notice } from "../../api/types";

const KINDS: Record<Notice["kind"], string> = { warning: "warning", lost: "recorded data was lost", failure: "failure" };

/** Warnings of all steps; each jumps to the picture that it speaks of. */
export function NoticesPanel({ notices, onGo }: { notices: Notice[]; onGo: (notice: Notice) => void }) {
  return (
    <div class="controls">
      <h2>Warnings</h2>
      {notices.length === 0 && <p class="dim">No step had anything to warn about.</p>}
      <ul class="notices">
        {notices.map((notice, k) => (
          <li key={k}>
            <button type="button" onClick={() => onGo(notice)}>
              <span class={`state ${notice.kind === "warning" ? "stale" : "failed"}`}>{KINDS[notice.kind]}</span>
              <span class="dim">{notice.step ?? ""}</span>
              <span class="notice-text">{notice.text}</span>
            </button>
          </li>
        ))}
      </ul>
    </div>
  );
}
