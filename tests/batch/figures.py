#!/usr/bin/env python3
"""Measures batches: the figures of docs/scale.md.

    python3 tests/batch/figures.py cost --subjects 200      # processor time a subject, against `toile process` alone
    python3 tests/batch/figures.py workers --subjects 200   # throughput of two workers against one
    python3 tests/batch/figures.py planning                 # 10, 100 and 1000 subjects that are up to date
    python3 tests/batch/figures.py memory --subjects 4      # four takes a subject under `ulimit -v` of 1.5 GB
    python3 tests/batch/figures.py kill                     # ended hard at 20 moments; the same bytes
    python3 tests/batch/figures.py disk                     # a full disk (a tmpfs; needs root)

Processor times are compared and not wall clocks where the machine may do other work besides; what is compared runs in turns.
"""

import argparse
import json
import os
import random
import resource
import shutil
import signal
import statistics
import subprocess
import tempfile
import time

from common import TOILE, assert_same, copy_takes, toile


def recorded(folder, frames, garments):
    """A synthetic subject, and a copy that was processed alone with one thread."""
    to, alone = os.path.join(folder, "recorded"), os.path.join(folder, "alone")
    toile("synthesize", "--out", to, "--seed", "3", "--frames", str(frames), "--garments", garments)
    copy_takes(to, alone)
    answer, code = toile("process", alone, "--threads", "1")
    assert code == 0, answer
    return to, alone


def archive(folder, name, subject, count):
    to = os.path.join(folder, name)
    for number in range(count):
        copy_takes(subject, os.path.join(to, f"person-{number:04}"))
    return to


def used(words):
    """Runs the program; processor seconds of it and all its children, and seconds."""
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run([TOILE, *words, "--quiet"], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return cpu, time.monotonic() - begin


def cost(folder, arguments):
    """Four subjects by four calls of `toile process`, and four by a batch, in turns."""
    subject, _ = recorded(folder, 30, "")
    ratios, alone_all, batch_all = [], 0.0, 0.0
    for round_ in range(max(1, arguments.subjects // 4)):
        one, two = archive(folder, f"one-{round_}", subject, 4), archive(folder, f"two-{round_}", subject, 4)
        alone = sum(used(["process", os.path.join(one, name), "--threads", "1"])[0] for name in sorted(os.listdir(one)))
        batch = used(["batch", two, "--workers", "1"])[0]
        ratios.append(batch / alone)
        alone_all, batch_all = alone_all + alone, batch_all + batch
        shutil.rmtree(one)
        shutil.rmtree(two)
    n = 4 * len(ratios)
    print(f"{n} subjects of 30 frames: {alone_all / n:.2f} s of processor time alone, {batch_all / n:.2f} s in a batch: "
          f"{100 * (batch_all / alone_all - 1):+.1f} % (median of {len(ratios)} pairs {100 * (statistics.median(ratios) - 1):+.1f} %)")


def workers(folder, arguments):
    subject, _ = recorded(folder, 30, "")
    ratios = []
    for round_ in range(max(1, arguments.subjects // 8)):
        seconds = []
        for count in ("1", "2"):
            at = archive(folder, f"w{count}-{round_}", subject, 4)
            seconds.append(used(["batch", at, "--workers", count])[1])
            shutil.rmtree(at)
        ratios.append(seconds[0] / seconds[1])
    print(f"{8 * len(ratios)} subjects in {len(ratios)} pairs of batches of 4: two workers are {statistics.median(ratios):.2f} times as fast as one "
          f"({min(ratios):.2f} to {max(ratios):.2f}); load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")


def planning(folder, arguments):
    _, alone = recorded(folder, 16, "")
    for count in (10, 100, 1000):
        at = os.path.join(folder, f"planned-{count}")
        os.mkdir(at)
        for number in range(count):
            # Links: what is planned reads small files only.
            subprocess.run(["cp", "-al", alone, os.path.join(at, f"person-{number:04}")], check=True)
        cpu, seconds = used(["batch", at, "--dry-run"])
        answer, _ = toile("batch", at, "--dry-run")
        assert answer["results"]["up_to_date"] == count, answer["results"]["up_to_date"]
        print(f"planning {count} subjects: {cpu:.2f} s of processor time, {seconds:.2f} s: {1000 * cpu / count:.2f} ms a subject")
        shutil.rmtree(at)


def memory(folder, arguments):
    subject, alone = recorded(folder, 30, "trousers,tshirt,jacket")
    at = archive(folder, "limited", subject, arguments.subjects)
    command = f"ulimit -v 1500000; exec {TOILE} batch {at} --workers 8 --json"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True)
    results = json.loads(done.stdout.splitlines()[-1])["results"]
    peaks = [ended["peak_memory_bytes"] for ended in results["ended"]]
    assert done.returncode == 0 and len(peaks) == arguments.subjects, done.stdout[-2000:]
    for name in os.listdir(at):
        if not name.startswith("."):
            assert_same(os.path.join(at, name), alone)
    print(f"{len(peaks)} subjects of four takes under 1.5 GB, 8 workers asked for: at most {results['most_at_once']} at once, "
          f"the largest {max(peaks) / 2**20:.0f} MiB; all done, same bytes")


def kill(folder, arguments):
    subject, alone = recorded(folder, 16, "")
    random_, times, done = random.Random(7), 0, 0
    while times < 20:
        at = archive(folder, f"killed-{done}", subject, 2)
        for _ in range(5):
            child = subprocess.Popen([TOILE, "batch", at, "--quiet"], stdout=subprocess.DEVNULL)
            try:
                child.wait(random_.uniform(0.1, arguments.longest))
                break
            except subprocess.TimeoutExpired:
                child.send_signal(signal.SIGKILL)
                child.wait()
                times += 1
        answer, code = toile("batch", at)
        assert code == 0, answer
        for name in os.listdir(at):
            if not name.startswith("."):
                assert_same(os.path.join(at, name), alone)
        shutil.rmtree(at)
        done += 2
    print(f"killed {times} times between 0.1 and {arguments.longest:.0f} s after its begin: {done} subjects, same bytes as `toile process` alone")


def disk(folder, arguments):
    """A file system of 12 MB: two subjects do not fit. With room again, the same command ends the work."""
    subject, alone = recorded(folder, 16, "")
    at = os.path.join(folder, "small")
    os.mkdir(at)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={arguments.megabytes}m", "tmpfs", at], check=True)
    try:
        for name in ("a", "b"):
            copy_takes(subject, os.path.join(at, name))
        done = subprocess.run([TOILE, "batch", at, "--workers", "1"], capture_output=True, text=True)
        failed = [line for line in done.stderr.splitlines() if line.startswith("failed: ")]
        assert done.returncode == 1 and len(failed) == 1 and "the disk is full" in failed[0], done.stderr
        parts = [name for _, _, names in os.walk(at) for name in names if name.endswith(".part")]
        assert not parts, parts
        assert not os.path.exists(os.path.join(at, ".toile", "quarantine")), "a full disk puts nobody in quarantine"
        subprocess.run(["mount", "-o", "remount,size=200m", at], check=True)
        answer, code = toile("batch", at)
        assert code == 0, answer
        for name in ("a", "b"):
            assert_same(os.path.join(at, name), alone)
    finally:
        subprocess.run(["umount", "-l", at], check=True)
    print("a full disk: nothing half-written, nobody in quarantine, the same bytes with room again. It said:\n" + "\n".join(failed))


def main():
    what = {f.__name__: f for f in (cost, workers, planning, memory, kill, disk)}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("figure", choices=what)
    parser.add_argument("--subjects", type=int, default=4)
    parser.add_argument("--longest", type=float, default=8.0, help="seconds until a batch is killed at most")
    parser.add_argument("--megabytes", type=int, default=12, help="the small disk")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        what[arguments.figure](folder, arguments)


if __name__ == "__main__":
    main()
