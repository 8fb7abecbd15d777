#!/usr/bin/env bash
# run.sh [SECONDS] [TARGET ...]: builds the targets and runs each, SECONDS in all (default 600). Fails where one fails.
#
# Stable Rust: the flags let the compiler's own pass count which code an input reaches, which libFuzzer needs; only
# AddressSanitizer would need a nightly compiler, and there is almost no unsafe code to look for. A target ends with an error
# at a panic, an overflow, more than 512 MB, or more than 10 seconds for one input; the input is then in artifacts/.
# JOBS=N sets how many run at a time (default: one for each processor).
set -euo pipefail
cd "$(dirname "$0")"
seconds=${1:-600}
shift || true
targets=("$@")
if [ ${#targets[@]} -eq 0 ]; then
    for file in fuzz_targets/*.rs; do targets+=("$(basename "$file" .rs)"); done
fi
jobs=${JOBS:-$(nproc)}
each=$((seconds * jobs / ${#targets[@]}))
[ "$each" -ge 1 ] || each=1

host=$(rustc -vV | sed -n 's/^host: //p')
coverage="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4"
coverage+=" -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table"
coverage+=" -Cllvm-args=-sanitizer-coverage-trace-compares"
export RUSTFLAGS="--cfg fuzzing $coverage -Cdebug-assertions -Coverflow-checks"
# With --target the flags do not reach build scripts.
cargo build --release --locked --target "$host"

run_one() {
    local target=$1 each=$2 host=$3
    mkdir -p "corpus/$target" "artifacts/$target"
    local seeds=()
    [ ! -d "seeds/$target" ] || seeds+=("seeds/$target")
    # Files of other programs, which the tests read too.
    case "$target" in
        recording) seeds+=("../capture/tests/data") ;;
        ply | obj) seeds+=("../geometry/tests/data") ;;
        bvh) seeds+=("../animation/tests/data") ;;
    esac
    if "target/$host/release/$target" "corpus/$target" "${seeds[@]}" -max_total_time="$each" -rss_limit_mb=512 \
        -malloc_limit_mb=512 -timeout=10 -artifact_prefix="artifacts/$target/" >"artifacts/$target.log" 2>&1; then
        echo "$target: $(grep -c . <<<"$(ls "corpus/$target")") inputs kept, $(tail -n 1 "artifacts/$target.log")"
    else
        echo "$target FAILED: fuzz/artifacts/$target.log"
        tail -n 30 "artifacts/$target.log"
        return 1
    fi
}
export -f run_one
echo "${#targets[@]} targets, $each seconds each, $jobs at a time"
printf '%s\n' "${targets[@]}" | xargs -P "$jobs" -I{} bash -c "run_one {} $each $host"
