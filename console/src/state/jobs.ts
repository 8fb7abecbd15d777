import { api } from "../api/client";
import { onEvent } from "../api/events";
import type { Job } from "../api/types";
import { createStore } from "./store";

/** All jobs that the service knows, newest first. */
export const jobs = createStore<Job[]>([]);

export function withJob(list: Job[], job: Job): Job[] {
  const rest = list.filter((other) => other.id !== job.id);
  return [...rest, job].sort((a, b) => b.id - a.id);
}

export function isOpen(job: Job): boolean {
  return job.state === "queued" || job.state === "running";
}

async function read(): Promise<void> {
  try {
    jobs.set([...(await api.jobs())].sort((a, b) => b.id - a.id));
  } catch {
    // The banner tells that the service is away; the next hello reads again.
  }
}

onEvent((event) => {
  if (event.hello !== undefined) void read();
  if (event.job !== undefined) jobs.set(withJob(jobs.get(), event.job));
});

/** Resolves when a job has ended, whichever way. */
export function jobEnded(id: number): Promise<Job> {
  return new Promise((resolve) => {
    const look = (list: Job[]) => {
      const job = list.find((other) => other.id === id);
      if (job === undefined || isOpen(job)) return false;
      resolve(job);
      return true;
    };
    if (look(jobs.get())) return;
    const stop = jobs.subscribe((list) => {
      if (look(list)) stop();
    });
  });
}
