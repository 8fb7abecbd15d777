import { useMemo, useState } from "preact/hooks";
import type { ComponentChildren } from "preact";
import { api } from "../../api/client";
import type { JobKind, Notice, Subject } from "../../api/types";
import { place, placeText, refine } from "../../router";
import { isOpen, jobs } from "../../state/jobs";
import { useStore } from "../../state/store";
import { Icon } from "../../ui/icons";
import { Tabs, type Tab } from "../../ui/tabs";
import { tell, tellError } from "../../ui/toasts";
import { JOB_KINDS, SUBJECT_STATES } from "../../ui/words";
import { JobProgress } from "../jobs/jobs";
import { AnimateDialog } from "./animate";
import { FilesPanel } from "./files";
import { FramesTab } from "./frames";
import { LayersTab } from "./layers";
import { MeasuresTab } from "./measures";
import { MotionTab } from "./motion";
import { placeOfNotice } from "./notice_place";
import { NoticesPanel } from "./notices";
import { ScanTab } from "./scan";
import { useSubject } from "./use_subject";

export type View = "layers" | "scan" | "frames" | "measures" | "motion" | "notices" | "files";

/** What every tab is given: it answers with its picture and its panel. */
export interface TabProps {
  subject: Subject;
  layout: (picture: ComponentChildren, panel: ComponentChildren) => ComponentChildren;
}

export function SubjectPage({ id }: { id: string }) {
  const { subject, error } = useSubject(id);
  if (subject === null) {
    return (
      <div class="page narrow stack">
        <h1>{id}</h1>
        {error === null ? <p class="dim" role="status">Reading the subject …</p> : <p class="bad" role="alert">{error}</p>}
        <p><a href="#/">Back to the archive</a></p>
      </div>
    );
  }
  return <Loaded subject={subject} />;
}

function Loaded({ subject }: { subject: Subject }) {
  const query = useStore(place).query;
  const view = (query.get("view") ?? (subject.files.includes("avatar.glb") || subject.takes.length === 0 ? "layers" : "frames")) as View;
  const layout = (picture: ComponentChildren, panel: ComponentChildren) => (
    <div class="subject-body">
      <div class="subject-picture">{picture}</div>
      <div class="subject-panel" id="subject-panel" role="tabpanel" aria-label={view} tabIndex={0}>{panel}</div>
    </div>
  );
  return (
    <div class="subject">
      <SubjectHead subject={subject} />
      {subject.problem !== null && <p class="bad pad" role="alert">{subject.problem}</p>}
      <Tabs label="What to look at" tabs={tabsOf(subject)} chosen={view} panel="subject-panel" onChoose={(next) => refine({ view: next })} />
      <Content view={view} subject={subject} layout={layout} />
    </div>
  );
}

function Content({ view, ...props }: TabProps & { view: View }) {
  const { subject } = props;
  switch (view) {
    case "scan": return <ScanTab {...props} />;
    case "frames": return <FramesTab {...props} />;
    case "measures": return <MeasuresTab {...props} />;
    case "motion": return <MotionTab {...props} />;
    case "notices": return <LayersTab {...props} panel={<NoticesPanel notices={subject.notices} onGo={showNotice} />} />;
    case "files": return <LayersTab {...props} panel={<FilesPanel subject={subject} />} />;
    default: return <LayersTab {...props} panel={null} />;
  }
}

function tabsOf(subject: Subject): Tab<View>[] {
  const count = subject.notices.length;
  return [
    { id: "layers", label: "Layers" },
    { id: "scan", label: "Scans" },
    { id: "frames", label: "Frames" },
    { id: "measures", label: "Measurements" },
    { id: "motion", label: "Motion" },
    { id: "notices", label: <>Warnings{count > 0 && <span class="tally">{count}</span>}</> },
    { id: "files", label: "Files" },
  ];
}

/** Goes to the picture that a warning speaks of. */
function showNotice(notice: Notice): void {
  refine(placeOfNotice(notice));
}

function SubjectHead({ subject }: { subject: Subject }) {
  const [animating, setAnimating] = useState(false);
  const running = useStore(jobs).find((job) => job.subject === subject.id && isOpen(job));
  const start = (kind: JobKind) => void api.addJob(kind, subject.id).then(() => tell(`${JOB_KINDS[kind]}: ${subject.name} is in the queue.`), tellError);
  const about = useMemo(() => aboutText(subject), [subject]);
  const built = subject.layers.some((layer) => layer.built);
  const correctable = subject.layers.find((layer) => layer.index > 0 && subject.files.includes(`build/${layer.folder}/scan.ply`));
  return (
    <div class="subject-head">
      <div class="subject-name">
        <a class="back" href="#/" aria-label="Back to the archive">‹</a>
        <div><h1>{subject.name}</h1><p class="dim">{about}</p></div>
        <span class={`state ${subject.state}`}>{SUBJECT_STATES[subject.state] ?? subject.state}</span>
      </div>
      {running !== undefined && <a class="subject-job" href={placeText(["jobs", String(running.id)])}><JobProgress job={running} /></a>}
      <div class="actions">
        <a class="button" href={placeText(["scan", subject.id])}><Icon name="camera" />Scan</a>
        <button type="button" class={built ? "plain" : "main"} disabled={subject.takes.length === 0 || running !== undefined} onClick={() => start("process")}>Process</button>
        <a class={correctable === undefined ? "button off" : "button"} aria-disabled={correctable === undefined}
          href={correctable === undefined ? undefined : placeText(["subjects", subject.id, "correct"], { layer: correctable.index })}>
          <Icon name="brush" />Correct
        </a>
        <button type="button" class="plain" disabled={!subject.files.includes("avatar.glb") || running !== undefined} onClick={() => setAnimating(true)}>Animate</button>
      </div>
      {animating && <AnimateDialog subject={subject} onClose={() => setAnimating(false)} />}
    </div>
  );
}

function aboutText(subject: Subject): string {
  const stature = subject.stature_m === null ? "" : ` · ${(100 * subject.stature_m).toFixed(1)} cm`;
  return `${subject.date} · ${subject.takes.length} takes${stature}`;
}
