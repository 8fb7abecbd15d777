#!/usr/bin/env python3
"""Prints how the source code is built: circles of files, lengths, call depth, and lines that stand twice.

    python3 tests/structure.py [FOLDER ...] [--check] [--list]

FOLDER   crates to read (default: every member of the workspace but the generated `drivers/v4l2-sys`)
--check  exits with 1 where a limit is exceeded (continuous integration does this)
--list   also names the functions and files that are over the limits, and every duplicate

The code is read as text, without a compiler: `use crate::...`, `super::...` and qualified paths are the arrows between
files, `name(` is a call. Test modules, tests/, benches/, examples/ and generated files do not count.
"""
import argparse
import collections
import itertools
import os
import re
import statistics
import sys

# The limits that the project sets itself: lines, call depth, lines of code that stand twice.
FILE_MEDIAN, FILE_P90 = 120, 300
FUNCTION_MEDIAN, FUNCTION_P90, FUNCTION_LONGEST = 8, 22, 75
HOPS = 4
DUPLICATE_LINES = 8

# From a stage's public call to its inner loop: crate folder, function that is called, function that holds the loop.
# The tables of SIMD kernels (`dispatch`, `run`) in between do not count as hops.
INNER_LOOPS = [
    ("fusion", "push", "update_row"),
    ("fusion", "push", "accumulate"),
    ("fusion", "fuse", "update_row"),
    ("fusion", "fuse", "accumulate"),
    ("fusion", "finish", "update_row"),
    ("fusion", "finish", "match_pixel"),
    ("fitting", "fit_body", "accumulate"),
    ("fitting", "pose_under", "accumulate"),
    ("garments", "extract", "compare"),
    ("garments", "extract", "edge_costs"),
    ("garments", "stack", "displacement"),
    ("stereo", "match_pair", "aggregate_row"),
]
NOT_HOPS = {"dispatch", "run", "call", "vectorize"}

TOP = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def members():
    manifest = open(f"{TOP}/Cargo.toml").read()
    names = re.search(r"members\s*=\s*\[(.*?)\]", manifest, re.S).group(1)
    return [n for n in re.findall(r'"([^"]+)"', names) if n not in ("drivers/v4l2-sys", "tests")]


def spaces(match):
    """As many spaces as what was matched has characters; line breaks stay."""
    return re.sub(r"[^\n]", " ", match.group(0))


def blank(text, strings=True):
    """The text with comments, and where `strings` is set also strings and character literals, replaced by spaces."""
    literal = r'(?P<literal>r(?P<hashes>#*)".*?"(?P=hashes)|b?"(?:\\.|[^"\\])*"|b?\'(?:\\.[^\']*|[^\\\'\n])\')'
    replace = lambda m: spaces(m) if strings or m.group("literal") is None else m.group(0)
    return re.sub(rf"//[^\n]*|/\*.*?\*/|{literal}", replace, text, flags=re.S)


def closing(text, start):
    """Index of the brace that closes the one at `start`."""
    depth = 0
    for match in re.finditer(r"[{}]", text[start:]):
        depth += 1 if match.group(0) == "{" else -1
        if depth == 0:
            return start + match.start()
    return len(text)


def without_tests(text):
    """The text without the bodies of modules and items marked `#[cfg(test)]`."""
    while (mark := re.search(r"#\[cfg\(test\)\]", text)) is not None:
        brace, semicolon = text.find("{", mark.end()), text.find(";", mark.end())
        declared = semicolon != -1 and (brace == -1 or semicolon < brace)
        end = semicolon if declared else closing(text, brace)
        text = text[:mark.start()] + re.sub(r"[^\n]", " ", text[mark.start():end + 1]) + text[end + 1:]
    return text


class File:
    def __init__(self, crate, path):
        self.crate, self.path = crate, path
        self.raw = open(path, encoding="utf-8").read()
        self.code = without_tests(blank(self.raw))
        self.lines = len(self.raw.splitlines())
        inside = os.path.relpath(path, f"{TOP}/{crate}/src")[:-3].split(os.sep)
        self.module = [part for part in inside if part not in ("mod", "lib", "main")]
        self.functions = list(self.read_functions())

    def read_functions(self):
        for match in re.finditer(r"\bfn\s+(\w+)", self.code):
            brace, semicolon = self.code.find("{", match.end()), self.code.find(";", match.end())
            if brace == -1:
                continue
            header = self.code[match.end():brace]
            # A declaration without a body, as in a trait: its semicolon stands outside of array types.
            if semicolon != -1 and semicolon < brace and ";" in re.sub(r"\[[^\]]*\]", "", header):
                continue
            end = closing(self.code, brace)
            lines = self.code.count("\n", match.start(), end) + 1
            yield match.group(1), lines, self.code.count("\n", 0, match.start()) + 1, self.code[brace:end]


def read(crates):
    for crate in crates:
        for folder, _, names in os.walk(f"{TOP}/{crate}/src"):
            for name in sorted(names):
                if name.endswith(".rs") and name not in ("tests.rs", "bindings.rs"):
                    path = os.path.join(folder, name)
                    if not is_test_module(path):
                        yield File(crate, path)


def is_test_module(path):
    """True where the parent declares this file under `#[cfg(test)]`."""
    folder, stem = os.path.dirname(path), os.path.basename(path)[:-3]
    parents = [f"{folder}/mod.rs", f"{folder}/lib.rs", f"{folder}.rs"]
    declared = rf"#\[cfg\(test\)\]\s*(?:pub(?:\([^)]*\))?\s+)?mod\s+{stem}\s*;"
    return any(os.path.exists(p) and re.search(declared, open(p).read()) for p in parents)


def use_paths(text):
    """Every path that `use` names, groups written out."""
    def expand(prefix, tree):
        depth, part, parts = 0, "", []
        for c in tree + ",":
            depth += (c == "{") - (c == "}")
            if c == "," and depth == 0:
                parts.append(part.strip())
                part = ""
            else:
                part += c
        for item in filter(None, parts):
            head, brace, rest = item.partition("{")
            path = prefix + [p for p in head.strip().split("::") if p]
            if brace:
                yield from expand(path, rest.rsplit("}", 1)[0])
            else:
                yield [p.split(" as ")[0].strip() for p in path]
    for match in re.finditer(r"^[ \t]*use\s+(.*?);", text, re.S | re.M):
        yield from expand([], match.group(1))


def arrows(files):
    """From each file to the files of its crate that it names, re-exports of a parent resolved where they are simple."""
    by_module = {tuple(f.module): f for f in files}
    graph = {f.path: set() for f in files}
    exports = {}
    for f in files:
        for match in re.finditer(r"pub(?:\([^)]*\))?\s+use\s+(.*?);", f.code, re.S):
            for path in use_paths(f"use {match.group(1)};"):
                target = locate(path, f, by_module, {})
                if target is not None and target is not f:
                    exports[(tuple(f.module), path[-1])] = target
    for f in files:
        plain = re.sub(r"pub(?:\([^)]*\))?\s+use\s+.*?;", "", f.code, flags=re.S)
        paths = list(use_paths(plain))
        paths += [m.group(0).split("::") for m in re.finditer(r"\b(?:crate|super|self)(?:::\w+)+", re.sub(r"\buse\s+.*?;", "", plain, flags=re.S))]
        for path in paths:
            target = locate(path, f, by_module, exports)
            if target is not None and target is not f and not declares(f, target) and not declares(target, f):
                graph[f.path].add(target.path)
    return graph


def declares(parent, child):
    """True where `parent` is the file of the module that holds `child`: a parent may name what it is made of."""
    return parent.module == child.module[:len(parent.module)] and os.path.basename(parent.path) in ("lib.rs", "main.rs", "mod.rs")


def locate(path, file, by_module, exports):
    """The file that a path names, or `None` where it leaves the crate."""
    module = list(file.module)
    if path[0] == "crate":
        module, rest = [], path[1:]
    elif path[0] in ("super", "self"):
        rest = list(path)
        while rest and rest[0] in ("super", "self"):
            if rest.pop(0) == "super":
                module = module[:-1]
    elif tuple(module + path[:1]) in by_module:
        rest = list(path)
    else:
        return None
    while rest and tuple(module + rest[:1]) in by_module:
        module.append(rest.pop(0))
    if rest and (tuple(module), rest[0]) in exports:
        return exports[(tuple(module), rest[0])]
    return by_module.get(tuple(module))


def circles(graph):
    """Groups of more than one file that reach each other (Tarjan)."""
    index, low, stack, on, found = {}, {}, [], set(), []

    def visit(v):
        index[v] = low[v] = len(index)
        stack.append(v)
        on.add(v)
        for w in sorted(graph[v]):
            if w not in index:
                visit(w)
                low[v] = min(low[v], low[w])
            elif w in on:
                low[v] = min(low[v], index[w])
        if low[v] == index[v]:
            group = []
            while True:
                w = stack.pop()
                on.discard(w)
                group.append(w)
                if w == v:
                    break
            if len(group) > 1:
                found.append(sorted(group))

    sys.setrecursionlimit(10_000)
    for v in sorted(graph):
        if v not in index:
            visit(v)
    return found


def chain(files, start, end):
    """The shortest chain of calls by name from one function to another, or `None`."""
    calls = collections.defaultdict(set)
    for f in files:
        for name, _, _, body in f.functions:
            calls[name] |= set(re.findall(r"\b(\w+)(?:::<[^>]*>)?\s*\(", body)) | set(re.findall(r"\b(\w+)\b", body))
    known = {name for f in files for name, *_ in f.functions}
    queue, seen = collections.deque([[start]]), {start}
    while queue:
        path = queue.popleft()
        if path[-1] == end:
            return path
        for name in sorted(calls[path[-1]] & known - seen):
            seen.add(name)
            queue.append(path + [name])
    return None


def code_lines(file):
    """Lines that count as code, with their numbers: no comments, `use` declarations, or lines of brackets alone."""
    text = without_tests(blank(file.raw, strings=False))
    text = re.sub(r"^[ \t]*(?:pub(?:\([^)]*\))?\s+)?use\s[^;]*;", spaces, text, flags=re.M)
    lines = [(n, re.sub(r"\s+", " ", line).strip()) for n, line in enumerate(text.splitlines(), 1)]
    return [(n, line) for n, line in lines if re.search(r"\w", line)]


def duplicates(files):
    """Runs of code lines that stand in two places: (lines, place, place)."""
    places = collections.defaultdict(list)
    kept = {f.path: code_lines(f) for f in files}
    for path, lines in kept.items():
        for i in range(len(lines) - DUPLICATE_LINES + 1):
            window = lines[i:i + DUPLICATE_LINES]
            places["\n".join(line for _, line in window)].append((path, i))
    covered, found = set(), []
    for where in places.values():
        for (a, i), (b, j) in itertools.combinations(where, 2):
            if (a, i, b, j) in covered:
                continue
            length = 0
            while i + length < len(kept[a]) and j + length < len(kept[b]) and kept[a][i + length][1] == kept[b][j + length][1]:
                covered.add((a, i + length, b, j + length))
                length += 1
            found.append((length, f"{short(a)}:{kept[a][i][0]}", f"{short(b)}:{kept[b][j][0]}"))
    return sorted(found, reverse=True)


def short(path):
    return os.path.relpath(path, TOP)


def p90(values):
    return sorted(values)[int(0.9 * (len(values) - 1))]


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folders", nargs="*")
    arguments.add_argument("--check", action="store_true")
    arguments.add_argument("--list", action="store_true")
    args = arguments.parse_args()
    crates = [f.rstrip("/") for f in args.folders] or members()
    files = list(read(crates))
    failures = []

    def limit(what, value, most):
        print(f"{what}: {value} (at most {most})")
        if value > most:
            failures.append(what)

    found = [c for crate in crates for c in circles(arrows([f for f in files if f.crate == crate]))]
    limit("circles of files", len(found), 0)
    for group in found:
        print("  " + " ↔ ".join(short(p) for p in group))

    lengths = [f.lines for f in files]
    limit("file length, median", int(statistics.median(lengths)), FILE_MEDIAN)
    limit("file length, 90 %", p90(lengths), FILE_P90)
    functions = [(lines, f"{short(f.path)}:{at} {name}") for f in files for name, lines, at, _ in f.functions]
    limit("function length, median", int(statistics.median(n for n, _ in functions)), FUNCTION_MEDIAN)
    limit("function length, 90 %", p90([n for n, _ in functions]), FUNCTION_P90)
    limit("function length, longest", max(functions)[0], FUNCTION_LONGEST)
    if args.list:
        for n, where in sorted(functions, reverse=True)[:15]:
            print(f"  {n} {where}")
        for f in sorted(files, key=lambda f: -f.lines)[:15]:
            print(f"  {f.lines} {short(f.path)}")

    for crate, start, end in INNER_LOOPS:
        if crate not in crates:
            continue
        # The vector operations, and what calls a kernel with them, are geometry's.
        path = chain([f for f in files if f.crate == crate or "/lanes" in f.path], start, end)
        if path is None:
            print(f"hops, {crate}: no chain from {start} to {end}")
            failures.append(f"hops, {crate}")
            continue
        limit(f"hops, {crate}: {' → '.join(path)}", len([p for p in path if p not in NOT_HOPS]) - 1, HOPS)

    twice = duplicates(files)
    limit(f"runs of {DUPLICATE_LINES} or more equal lines in two places", len(twice), 0)
    for length, a, b in twice[:None if args.list else 10]:
        print(f"  {length} lines: {a} = {b}")
    if args.check and failures:
        sys.exit(f"over the limit: {'; '.join(failures)}")


if __name__ == "__main__":
    main()
