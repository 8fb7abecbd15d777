"""One subject, by the program `toile` on this machine. Plain functions: Ray is not needed here."""

import json
import os
import subprocess
import tempfile
import time

ATTEMPTS = 2
"""How often a subject is tried."""

TICK = 0.5
"""Seconds between two looks at a subject that another process still writes."""


def process(program, archive, subject, threads, settings=None, patience=600.0):
    """Processes one subject and tells how it ended, with the fields of a line of `toile batch --json`.

    A subject that fails is tried once more. One that another process writes (the one of a worker that died, until the system has
    ended it) is waited for, at most `patience` seconds.
    """
    cpu_seconds, attempts, since = 0.0, 0, time.monotonic()
    while True:
        attempts += 1
        run = run_once(program, os.path.join(archive, subject), threads, settings)
        cpu_seconds += run["cpu_seconds"]
        if run["kind"] == "busy" and time.monotonic() - since < patience:
            attempts -= 1
            time.sleep(TICK)
            continue
        ended = {"subject": subject, "attempts": attempts, **run, "cpu_seconds": cpu_seconds}
        if run["outcome"] != "failed" or run["kind"] in ("busy", "disk-full") or attempts >= ATTEMPTS:
            ended["outcome"] = "busy" if run["kind"] == "busy" else run["outcome"]
            return ended


def run_once(program, root, threads, settings):
    """One call of `toile process`: outcome, why, kind of the error, seconds, processor seconds, peak memory, remarks."""
    words = [program, "process", root, "--json", "--quiet", "--with-parent", str(os.getpid()), "--threads", str(threads)]
    words += ["--settings", settings] if settings else []
    started = time.monotonic()
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as errors:
        child = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=out, stderr=errors)
        _, status, used = os.wait4(child.pid, 0)
        code = child.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        errors.seek(0)
        answer, said = read_json(out.read()), errors.read().decode("utf-8", "replace")[-4000:]
    result = (answer.get("results") or [{}])[0]
    error = result.get("error") or answer.get("error") or {}
    has_result = code in (0, 3) or (code == 1 and not error and result.get("outcome") == "failed")
    if has_result:
        outcome, why = {0: "done", 3: "lost"}.get(code, "failed-in-part"), None
    else:
        ended = f"its process was ended by signal {-code}" if code < 0 else f"its process ended with code {code}: {said.strip()}"
        outcome, why = "failed", error.get("message") or ended
    return {
        "outcome": outcome,
        "why": why,
        "kind": error.get("kind", ""),
        "seconds": time.monotonic() - started,
        "cpu_seconds": used.ru_utime + used.ru_stime,
        "peak_memory_bytes": used.ru_maxrss * 1024,
        "warnings": result.get("warnings", []),
        "lost": result.get("lost", []),
        "failures": result.get("failures", []),
    }


def read_json(text):
    try:
        document = json.loads(text)
    except ValueError:
        return {}
    return document if isinstance(document, dict) else {}
