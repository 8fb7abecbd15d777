"""Shared by the trials of batches: small subjects, one that was processed alone, and comparing."""

import hashlib
import json
import os
import shutil
import subprocess

TOP = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TOILE = os.environ.get("TOILE", os.path.join(TOP, "target", "release", "toile"))
VARYING = {"timings.json", "report.html"}


def toile(*words, **more):
    """Runs the program with --json; its last line as JSON, and the exit code."""
    done = subprocess.run([TOILE, *words, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **more)
    assert "panicked" not in done.stderr, done.stderr
    text = done.stdout.strip()
    try:
        return json.loads(text), done.returncode
    except ValueError:
        return json.loads(text.splitlines()[-1]), done.returncode


def small_subject(folder):
    """A person without clothes, of 16 frames: the subject as it was recorded, and a copy that was processed alone."""
    recorded, alone = os.path.join(folder, "recorded"), os.path.join(folder, "alone")
    toile("synthesize", "--out", recorded, "--seed", "3", "--frames", "16", "--garments", "")
    copy_takes(recorded, alone)
    answer, code = toile("process", alone)
    assert code == 0, answer
    return recorded, alone


def copy_takes(subject, to):
    shutil.copytree(os.path.join(subject, "takes"), os.path.join(to, "takes"))
    shutil.copy(os.path.join(subject, "subject.toml"), to)


def results(subject):
    """SHA-256 of everything in build/ and of every deliverable, but for what differs from run to run."""
    found = {}
    for folder, _, names in os.walk(subject):
        for name in names:
            path = os.path.join(folder, name)
            inside = os.path.relpath(path, subject)
            if name not in VARYING and not inside.startswith(("takes", "truth")):
                found[inside] = hashlib.sha256(open(path, "rb").read()).hexdigest()
    return found


def assert_same(subject, alone):
    assert results(subject) == results(alone), f"{subject} is not what `toile process` alone makes of it"
