import { useEffect, useState } from "preact/hooks";
import { api } from "../../api/client";
import type { Job } from "../../api/types";
import { go, placeText } from "../../router";
import { isOpen, jobs } from "../../state/jobs";
import { useStore } from "../../state/store";
import { tellError } from "../../ui/toasts";
import { countText, JOB_KINDS, JOB_STATES, momentText, timeText } from "../../ui/words";

export function JobsPage({ id }: { id: number | null }) {
  const all = useStore(jobs);
  const running = all.filter((job) => job.state === "running");
  const waiting = all.filter((job) => job.state === "queued").reverse();
  const ended = all.filter((job) => !isOpen(job));
  const chosen = all.find((job) => job.id === id) ?? null;
  return (
    <div class={chosen === null ? "jobs" : "jobs with-log"}>
      <div class="jobs-lists">
        <h1>Jobs</h1>
        {all.length === 0 && <p class="dim">Nothing was asked for yet. Jobs start from a subject’s page.</p>}
        <JobList title="Running" list={running} chosen={id} />
        <JobList title="Waiting" list={waiting} chosen={id} />
        <JobList title="Ended" list={ended} chosen={id} />
      </div>
      {chosen !== null && <JobLog job={chosen} />}
    </div>
  );
}

function JobList({ title, list, chosen }: { title: string; list: Job[]; chosen: number | null }) {
  if (list.length === 0) return null;
  return (
    <section>
      <h2>{title}</h2>
      <ul class="job-list">{list.map((job) => <JobRow key={job.id} job={job} chosen={job.id === chosen} />)}</ul>
    </section>
  );
}

function JobRow({ job, chosen }: { job: Job; chosen: boolean }) {
  return (
    <li class={chosen ? "job chosen" : "job"}>
      <div class="job-what">
        <strong>{JOB_KINDS[job.kind] ?? job.kind}</strong>
        <a href={placeText(["subjects", job.subject])}>{job.subject}</a>
        <span class={`state ${job.state}`}>{job.paused ? "paused for a capture" : JOB_STATES[job.state]}</span>
      </div>
      {job.state === "running" && <JobProgress job={job} />}
      {job.error !== null && <p class="bad">{job.error}</p>}
      {job.state === "done" && job.warnings > 0 && <p><a href={placeText(["subjects", job.subject], { view: "notices" })}>{countText(job.warnings, "warning")}</a></p>}
      <div class="job-foot">
        <span class="dim">{footText(job)}</span>
        <JobActions job={job} chosen={chosen} />
      </div>
    </li>
  );
}

export function JobProgress({ job }: { job: Job }) {
  const left = job.seconds_left === null ? "" : `about ${timeText(job.seconds_left)} left`;
  return (
    <div class="job-progress">
      <progress value={job.progress ?? undefined} max={1} aria-label={`Progress of ${JOB_KINDS[job.kind]} ${job.subject}`} />
      <span>{job.step ?? "starting"}</span><span class="dim">{left}</span>
    </div>
  );
}

function footText(job: Job): string {
  if (job.state === "queued") return `asked for ${momentText(job.created)}`;
  if (job.started === null) return "";
  if (job.ended === null) return `started ${momentText(job.started)}`;
  return `${momentText(job.ended)} · took ${timeText(job.ended - job.started)}`;
}

function JobActions({ job, chosen }: { job: Job; chosen: boolean }) {
  const act = (what: (id: number) => Promise<unknown>) => () => void what(job.id).catch(tellError);
  return (
    <span class="actions">
      {isOpen(job) && <button type="button" class="plain" onClick={act(api.cancel)}>Cancel</button>}
      {(job.state === "failed" || job.state === "cancelled") && <button type="button" class="plain" onClick={act(api.retry)}>Retry</button>}
      <button type="button" class="plain" aria-pressed={chosen} onClick={() => go(chosen ? ["jobs"] : ["jobs", String(job.id)])}>Log</button>
    </span>
  );
}

const LOG_EVERY_MS = 1500;

function JobLog({ job }: { job: Job }) {
  const [text, setText] = useState("");
  const open = isOpen(job);
  useEffect(() => {
    let wanted = true;
    const read = () => api.log(job.id).then((log) => wanted && setText(log), (e: unknown) => wanted && setText(e instanceof Error ? e.message : ""));
    void read();
    const timer = open ? setInterval(read, LOG_EVERY_MS) : undefined;
    return () => {
      wanted = false;
      clearInterval(timer);
    };
  }, [job.id, open]);
  return (
    <section class="job-log" aria-label={`Log of job ${job.id}`}>
      <div class="job-log-head"><h2>Log of {JOB_KINDS[job.kind]}, {job.subject}</h2><a href="#/jobs">Close</a></div>
      <pre tabIndex={0}>{text === "" ? "The log is empty so far." : text}</pre>
    </section>
  );
}
