#!/usr/bin/env python3
"""Runs Toile on subjects with known truth and prints every figure against its bar.

    python tests/score.py SUBJECTS EVAL OUT [--toile target/release/toile] [--subject NAME ...] [--threads N] [--fresh] [--quick]

SUBJECTS  folder of subjects (NAME/NN-layer/ with depth/, color/, camera.json, timestamps.txt and truth/)
EVAL      folder of the scoring scripts; run this with the Python that has their requirements
OUT       where the subjects are imported, processed and scored (OUT/NAME, OUT/NAME.scores.json)
--fresh   forgets what OUT holds; --quick leaves out body under clothes, trajectories and self-crossings
--no-long leaves out the take of ordinary length: a generated person, half a minute at 30 frames a second
"""
import argparse
import json
import os
import shutil
import subprocess
import sys
import time

ROWS = []   # subject, what, figure as text, bar as text, met (None: no bar)


def run(command, **more):
    return subprocess.run([str(c) for c in command], text=True, stdout=subprocess.PIPE, **more)


def toile(args, *command):
    started = time.time()
    done = subprocess.Popen([args.toile, *command, "--json", "--threads", str(args.threads)], stdout=subprocess.PIPE, text=True)
    out = done.stdout.read()
    _, status, usage = os.wait4(done.pid, 0)
    code = os.waitstatus_to_exitcode(status)
    try:
        answer = json.loads(out)
    except ValueError:
        answer = {"text": out}
    if code not in (0, 3):
        print(f"toile {' '.join(command)}: exit {code}: {answer.get('error') or answer.get('failures') or answer}", file=sys.stderr)
    return answer, time.time() - started, usage.ru_maxrss / 1024, code


def import_all(args, truth, takes, subject):
    for take in takes:
        if not os.path.exists(f"{subject}/takes/{take}.mcap"):
            toile(args, "import", f"{truth}/{take}", "--subject", subject, "--layer", take.split("-", 1)[1])


def score(args, script, *files):
    missing = [f for f in files if "/" in str(f) and not os.path.exists(f)]
    if missing:
        return None
    done = run([sys.executable, f"{args.eval}/{script}.py", *files], stderr=subprocess.PIPE)
    if done.returncode:
        print(done.stderr.strip()[-400:], file=sys.stderr)
        return None
    return json.loads(done.stdout.strip().splitlines()[-1])


def row(subject, what, value, unit="mm", bar=None, least=False):
    """One line of the table; `bar` is the limit, from above (or from below where `least` is set)."""
    if value is None:
        ROWS.append((subject, what, "-", bar_text(bar, unit, least), False if bar is not None else None))
        return
    met = None if bar is None else (value >= bar if least else value <= bar)
    ROWS.append((subject, what, f"{value:.2f} {unit}", bar_text(bar, unit, least), met))


def bar_text(bar, unit, least):
    return "" if bar is None else f"{'>=' if least else '<='} {bar:g} {unit}"


def get(result, *path):
    for key in path:
        if result is None:
            return None
        result = result.get(key) if isinstance(result, dict) else None
    return result


def score_takes(args, name, truth, takes, build, all_scores):
    for n, take in enumerate(takes):
        s = score(args, "score_scan", f"{build}/{take}/scan.ply", f"{truth}/{take}/truth/surface.ply")
        row(name, f"{take} scan mean", get(s, "accuracy", "mean_mm"), bar=2)
        row(name, f"{take} scan p95", get(s, "accuracy", "p95_mm"), bar=6)
        row(name, f"{take} scan complete within 5 mm", get(s, "completeness", "within_5mm_pct"), "%", 95, True)
        row(name, f"{take} scan far from everything", get(s, "extra_pct"), "%")
        all_scores[f"{take}/scan"] = s
        if not args.quick:
            t = score(args, "score_trajectory", f"{build}/{take}/trajectory.tum", f"{truth}/{take}/truth/poses.txt")
            all_scores[f"{take}/trajectory"] = t
        if n == 0:
            continue
        if not args.quick:
            u = score(args, "score_under", f"{build}/{take}/body.ply", f"{build}/{take}/scan.ply", f"{truth}/{take}/truth/surface.ply")
            row(name, f"{take} body under clothes mean", get(u, "under", "mean_mm"))
            row(name, f"{take} body outside clothes", get(u, "outside_pct"), "%")
            all_scores[f"{take}/under"] = u
        g = score(args, "score_garment", build, truth, n)
        row(name, f"{take} garment IoU", get(g, "iou"), "", 0.85, True)
        row(name, f"{take} hem found->true mean", get(g, "hem_found_to_true", "mean_mm"))
        if g:
            ROWS.append((name, f"{take} loops", f"{g['loops_found']} of {g['loops_true']}, {g['small_holes']} small", "", None))
        all_scores[f"{take}/garment"] = g


def score_body(args, name, truth, takes, build, all_scores):
    s = score(args, "score_body", f"{build}/body/body.ply", f"{truth}/{takes[0]}/truth/surface.ply",
              "--truth-pose", f"{truth}/{takes[0]}/truth/pose.json", "--truth-subject", f"{truth}/subject.json")
    row(name, "body truth->fit, no hands, feet, head", get(s, "surface_no_hands_head", "mean_mm"), bar=5)
    row(name, "body fit->truth", get(s, "fit_to_truth", "mean_mm"), bar=5)
    row(name, "22 body joints mean", get(s, "joints", "body_mean_mm"), bar=20)
    row(name, "stature error", get(s, "stature_error_mm"))
    for girth, error in (get(s, "girths_stated_error_mm") or {}).items():
        row(name, f"{girth} girth error", error)
    all_scores["body"] = s


def score_avatar(args, name, subject, takes, all_scores):
    s = score(args, "score_layers", f"{subject}/avatar.glb", *(["--no-self"] if args.quick else []))
    layers = [x["name"] for x in (get(s, "layers") or [])]
    wanted = ["body", *takes[1:]]
    ROWS.append((name, "avatar.glb layers", ", ".join(layers) or "-", ", ".join(wanted), layers == wanted))
    row(name, "vertices inside a layer below, worst pair", get(s, "inside_pct_worst"), "%", 1)
    row(name, "deepest inside a layer below", get(s, "deepest_mm"), bar=3)
    row(name, "crossing triangle pairs", get(s, "crossing_pairs_total"), "")
    all_scores["layers"] = s


def score_subject(args, name):
    truth, subject = f"{args.subjects}/{name}", f"{args.out}/{name}"
    takes = sorted(t for t in os.listdir(truth) if os.path.exists(f"{truth}/{t}/camera.json"))
    if args.fresh:
        shutil.rmtree(subject, ignore_errors=True)
    import_all(args, truth, takes, subject)
    cached = os.path.exists(f"{subject}/build")
    answer, seconds, megabytes, code = toile(args, "process", subject)
    ROWS.append((name, "process exit code", str(code), "0", code == 0))
    row(name, "process wall" + (" (resumed)" if cached else ""), seconds, "s", 180)
    row(name, "process peak memory", megabytes, "MB", 2048)
    all_scores = {"process": answer, "seconds": seconds, "peak_mb": megabytes}
    score_takes(args, name, truth, takes, f"{subject}/build", all_scores)
    score_body(args, name, truth, takes, f"{subject}/build", all_scores)
    score_avatar(args, name, subject, takes, all_scores)
    with open(f"{args.out}/{name}.scores.json", "w") as f:
        json.dump(all_scores, f, indent=1)


def score_long(args):
    """A take of 900 frames: what noise leaves behind grows with the number of frames, a scan must not."""
    truth, subject, take = f"{args.out}/long-truth", f"{args.out}/long", "00-body"
    if args.fresh:
        shutil.rmtree(truth, ignore_errors=True)
        shutil.rmtree(subject, ignore_errors=True)
    # The person, and so the true surface, follows from the seed alone.
    if not os.path.exists(truth):
        toile(args, "synthesize", "--out", truth, "--as", "folders", "--garments", "")
    if not os.path.exists(subject):
        toile(args, "synthesize", "--out", subject, "--garments", "", "--frames", "900", "--fps", "30")
    _, seconds, megabytes, code = toile(args, "process", subject)
    ROWS.append(("long", "process exit code", str(code), "0", code == 0))
    row("long", "process wall", seconds, "s")
    row("long", "process peak memory", megabytes, "MB", 2048)
    s = score(args, "score_scan", f"{subject}/build/{take}/scan.ply", f"{truth}/{take}/truth/surface.ply")
    row("long", f"{take} scan mean", get(s, "accuracy", "mean_mm"), bar=2)
    row("long", f"{take} scan p95", get(s, "accuracy", "p95_mm"), bar=6)
    row("long", f"{take} scan complete within 5 mm", get(s, "completeness", "within_5mm_pct"), "%", 95, True)
    row("long", f"{take} scan far from everything", get(s, "extra_pct"), "%", 0.5)


def main():
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for positional in ("subjects", "eval", "out"):
        a.add_argument(positional)
    root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    a.add_argument("--toile", default=f"{root}/target/release/toile")
    a.add_argument("--subject", action="append")
    a.add_argument("--threads", type=int, default=2)
    a.add_argument("--fresh", action="store_true")
    a.add_argument("--quick", action="store_true")
    a.add_argument("--no-long", action="store_true")
    args = a.parse_args()
    names = args.subject or sorted(n for n in os.listdir(args.subjects) if os.path.exists(f"{args.subjects}/{n}/subject.json"))
    os.makedirs(args.out, exist_ok=True)
    for name in names:
        score_subject(args, name)
    if not args.no_long:
        score_long(args)
    width = max(len(r[1]) for r in ROWS)
    for subject, what, value, bar, met in ROWS:
        print(f"{subject:8s} {what:{width}s}  {value:>24s}  {bar:14s} {'' if met is None else 'met' if met else 'MISSED'}")
    missed = sum(r[4] is False for r in ROWS)
    print(f"{missed} bars missed" if missed else "all bars met")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
