import type { ComponentChildren } from "preact";
import { link } from "../api/link";
import type { Place } from "../router";
import { capture } from "../state/capture";
import { isOpen, jobs } from "../state/jobs";
import { useStore } from "../state/store";
import { applyTheme, theme, type Theme } from "../state/theme";
import { Icon } from "./icons";
import { titleOf } from "./title";

const THEMES: Record<Theme, { next: Theme; says: string; icon: "sun" | "moon" | "screen" }> = {
  system: { next: "light", says: "Colours follow the system. Switch to light", icon: "screen" },
  light: { next: "dark", says: "Light colours. Switch to dark", icon: "sun" },
  dark: { next: "system", says: "Dark colours. Follow the system", icon: "moon" },
};

export function Shell({ here, children }: { here: Place; children: ComponentChildren }) {
  document.title = titleOf(here.path);
  return (
    <div class="shell">
      <a class="skip" href="#main" onClick={toMain}>Skip to the content</a>
      <Header here={here} />
      <LinkBanner />
      <main id="main" tabIndex={-1}>{children}</main>
    </div>
  );
}

function toMain(event: Event) {
  event.preventDefault();
  document.getElementById("main")?.focus();
}

function Header({ here }: { here: Place }) {
  const open = useStore(jobs).filter(isOpen).length;
  const colours = THEMES[useStore(theme)];
  const recording = ["recording", "finishing", "review"].includes(useStore(capture)?.state ?? "idle");
  const current = here.path[0] ?? "";
  return (
    <header class="bar">
      <a class="brand" href="#/"><img src="./favicon.svg" alt="" width="22" height="22" />Toile</a>
      <nav aria-label="Pages">
        <a href="#/" aria-current={current === "" || current === "subjects" ? "page" : undefined}>Archive</a>
        <a href="#/scan" aria-current={current === "scan" ? "page" : undefined}>
          Scan{recording && <span class="dot" role="img" aria-label="a take is open" />}
        </a>
        <a href="#/jobs" aria-current={current === "jobs" ? "page" : undefined}>
          Jobs{open > 0 && <span class="count" aria-label={`${open} open`}>{open}</span>}
        </a>
      </nav>
      <button class="icon" type="button" title={colours.says} aria-label={colours.says} onClick={() => applyTheme(colours.next)}>
        <Icon name={colours.icon} />
      </button>
    </header>
  );
}

function LinkBanner() {
  const state = useStore(link);
  return (
    <div role="status">
      {state === "lost" && (
        <p class="banner">
          The service does not answer. A take that was recording goes on or ends whole; this page reconnects by itself.
        </p>
      )}
    </div>
  );
}
