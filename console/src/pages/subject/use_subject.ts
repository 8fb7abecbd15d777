import { useEffect, useState } from "preact/hooks";
import { api } from "../../api/client";
import { onEvent } from "../../api/events";
import type { Subject } from "../../api/types";
import { isOpen } from "../../state/jobs";

/** A subject, read again when a job of it ends, when the archive changes, and after a lost line. */
export function useSubject(id: string): { subject: Subject | null; error: string | null; read: () => Promise<void> } {
  const [subject, setSubject] = useState<Subject | null>(null);
  const [error, setError] = useState<string | null>(null);
  const read = async () => {
    try {
      setSubject(await api.subject(id));
      setError(null);
    } catch (e) {
      setError(e instanceof Error ? e.message : String(e));
    }
  };
  useEffect(() => {
    void read();
    return onEvent((event) => {
      const ended = event.job !== undefined && event.job.subject === id && !isOpen(event.job);
      if (ended || event.archive !== undefined || event.hello !== undefined) void read();
    });
  }, [id]);
  return { subject, error, read };
}
