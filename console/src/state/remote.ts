import { useEffect, useState } from "preact/hooks";

/** Something that is fetched: the last good value stays while a newer one is on its way. */
export interface Remote<T> {
  value: T | null;
  error: string | null;
  busy: boolean;
}

/** Fetches anew whenever the key changes; a null key fetches nothing. */
export function useRemote<T>(key: string | null, load: (signal: AbortSignal) => Promise<T>): Remote<T> {
  const [state, setState] = useState<Remote<T> & { key: string | null }>({ value: null, error: null, busy: false, key: null });
  useEffect(() => {
    if (key === null) {
      setState({ value: null, error: null, busy: false, key });
      return;
    }
    const stopper = new AbortController();
    setState((old) => ({ ...old, error: null, busy: true, key }));
    load(stopper.signal).then(
      (value) => stopper.signal.aborted || setState({ value, error: null, busy: false, key }),
      (e: unknown) => stopper.signal.aborted || setState({ value: null, error: e instanceof Error ? e.message : String(e), busy: false, key }),
    );
    return () => stopper.abort();
  }, [key]);
  return state;
}
