import type { ComponentChildren } from "preact";
import { useEffect, useState } from "preact/hooks";
import { link } from "./api/link";
import { place, type Place } from "./router";
import { useStore } from "./state/store";
import { Shell } from "./ui/shell";
import { Toasts } from "./ui/toasts";
import { Unlock } from "./ui/unlock";
import { ArchivePage } from "./pages/archive/archive";
import { JobsPage } from "./pages/jobs/jobs";

export function App() {
  const here = useStore(place);
  const locked = useStore(link) === "locked";
  useEffect(() => document.getElementById("main")?.focus({ preventScroll: true }), [here.path.join("/")]);
  return (
    <>
      <Shell here={here}>{locked ? <Unlock /> : <Page here={here} />}</Shell>
      <Toasts />
    </>
  );
}

/** The pages with pictures in space are loaded when they are first opened, so that the archive shows at once. */
function Page({ here }: { here: Place }) {
  const [page, id] = here.path;
  if (page === undefined) return <ArchivePage />;
  if (page === "jobs") return <JobsPage id={id === undefined ? null : Number(id)} />;
  if (page === "subjects" && id !== undefined) {
    if (here.path[2] === "correct") {
      return <Later key={`correct ${id}`} load={() => import("./pages/correct/correct").then((m) => <m.CorrectPage id={id} here={here} />)} />;
    }
    return <Later key={id} load={() => import("./pages/subject/subject").then((m) => <m.SubjectPage id={id} />)} />;
  }
  if (page === "scan") {
    return <Later key={`scan ${id}`} load={() => import("./pages/scan/scan").then((m) => <m.ScanPage subject={id ?? null} />)} />;
  }
  return (
    <div class="page narrow">
      <h1>There is no such page</h1>
      <p><a href="#/">Back to the archive</a></p>
    </div>
  );
}

function Later({ load }: { load: () => Promise<ComponentChildren> }) {
  const [content, setContent] = useState<ComponentChildren>(null);
  useEffect(() => {
    let wanted = true;
    load().then(
      (loaded) => wanted && setContent(loaded),
      () => wanted && setContent(<p class="page">A part of the page could not be loaded. Reload the page once the service answers.</p>),
    );
    return () => {
      wanted = false;
    };
  }, []);
  return <>{content ?? <p class="page dim" role="status">Loading …</p>}</>;
}
