#!/usr/bin/env bash
# Runs every block of README.md that is marked `sh`, but for its `git clone`, from top to bottom in one shell, as somebody
# does who pastes the page.
# The program is installed below a home folder of its own, and the folder trial/ that the page makes is removed again.
set -euo pipefail
cd "$(dirname "$0")/.."
[ ! -e trial ] || { echo "README: trial/ is in the way: move it elsewhere, then run this again" >&2; exit 1; }
top=$PWD
home=$(mktemp -d)
trap 'rm -rf "$home" "$top/trial"' EXIT
export CARGO_HOME=${CARGO_HOME:-$HOME/.cargo} RUSTUP_HOME=${RUSTUP_HOME:-$HOME/.rustup} HOME=$home

# The clone stands here already: its line is left out.
awk '/^```sh$/ { inside = 1; next } /^```$/ { inside = 0 } inside && !/^git clone /' README.md >"$home/page.sh"
grep -q 'toile process anna' "$home/page.sh" || { echo "README: no blocks found" >&2; exit 1; }
if ! bash -e "$home/page.sh" >"$home/page.log" 2>&1; then
    tail -n 30 "$home/page.log" >&2
    echo "README: FAILED: a command of the page does not work" >&2
    exit 1
fi
for made in anna/report.html anna/avatar.glb anna/avatar.vrm anna-culled.glb fitted/measurements.csv olga/avatar.glb; do
    [ -s "trial/$made" ] || { echo "README: FAILED: trial/$made is not there" >&2; exit 1; }
done
echo "README: every command of the page works ($(grep -c '^toile' "$home/page.sh") of them toile's)"
