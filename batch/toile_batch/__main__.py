"""The bridge: reads subjects from standard input, a JSON object a line, and writes how each ended, a JSON object a line.

    {"subject": "anna", "memory": 250000000}          in
    {"subject": "anna", "outcome": "done", ...}       out

`toile batch --engine ray` starts it; nobody else needs to.
"""

import argparse
import json
import os
import sys

import ray

from . import subject as one


def main():
    parser = argparse.ArgumentParser(prog="toile_batch", description=__doc__.splitlines()[0])
    parser.add_argument("archive", help="folder that holds the subjects; the same path on every node")
    parser.add_argument("--program", required=True, help="the program toile; the same path on every node")
    parser.add_argument("--address", help="of a cluster, or `auto`; without, one is started on this machine")
    parser.add_argument("--threads", type=int, default=1, help="processors of each subject")
    parser.add_argument("--settings", help="a file of settings for all subjects")
    parser.add_argument("--patience", type=float, default=600.0, help="seconds to wait for a subject that another process writes")
    arguments = parser.parse_args()
    subjects = [json.loads(line) for line in sys.stdin if line.strip()]
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    ray.init(address=arguments.address, include_dashboard=False, log_to_driver=False, logging_level="ERROR",
             **package_for(arguments.address))
    try:
        for ended in run(arguments, subjects):
            print(json.dumps(ended), flush=True)
    finally:
        ray.shutdown()


def package_for(address):
    """Nodes of a cluster need this package too: it is sent to them where they may lack it."""
    folder = os.path.dirname(os.path.abspath(__file__))
    return {"runtime_env": {"py_modules": [folder]}} if address else {}


def run(arguments, subjects):
    """How each subject ended, as they end."""
    # -1: however often a worker or a node dies. The work itself is tried as often as `one.process` says.
    task = ray.remote(max_retries=-1)(one.process)
    largest = max((node["Resources"].get("memory", 0) for node in ray.nodes() if node["Alive"]), default=0)
    waiting = {}
    for subject in subjects:
        # A subject that needs more than any node has is tried alone on the largest.
        memory = min(int(subject["memory"]), int(largest))
        options = task.options(num_cpus=arguments.threads, memory=memory, name=subject["subject"])
        words = (arguments.program, arguments.archive, subject["subject"], arguments.threads)
        waiting[options.remote(*words, arguments.settings, arguments.patience)] = subject["subject"]
    while waiting:
        ready, _ = ray.wait(list(waiting), num_returns=1)
        for reference in ready:
            name = waiting.pop(reference)
            try:
                yield ray.get(reference)
            except ray.exceptions.RayError as error:
                yield failed(name, str(error).splitlines()[0])


def failed(name, why):
    """A subject of which the cluster gave no answer."""
    return {"subject": name, "outcome": "failed", "why": why, "kind": "cluster", "attempts": one.ATTEMPTS, "seconds": 0.0,
            "cpu_seconds": 0.0, "peak_memory_bytes": 0, "warnings": [], "lost": [], "failures": []}


if __name__ == "__main__":
    main()
