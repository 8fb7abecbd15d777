#!/usr/bin/env bash
# Batches on what others make: a Ray cluster of two nodes in this box, whose worker, driver and node are killed (`make batch-trial`; it is
# no part of `make test`, since its time depends on what else the machine does). Installs Ray into target/outside/batch. Prints
# RAY PASS, or SKIPPED and why: a machine that cannot reach PyPI, or is too slow for BATCH_SECONDS, is no fault.
set -uo pipefail
cd "$(dirname "$0")/../.."
python=$PWD/target/outside/batch/bin/python
limit=${BATCH_SECONDS:-600}
status=0
mkdir -p target/outside

if [ ! -x target/outside/batch/bin/ray ]; then
    echo "installing ray"
    { python3 -m venv target/outside/batch && timeout 240 target/outside/batch/bin/pip install -q "ray==2.*" psutil; } >target/outside/batch.log 2>&1 ||
        echo "ray could not be installed (target/outside/batch.log)"
fi

trial() { # name, module, script
    local log=target/outside/batch-$1.log seconds=$SECONDS
    if ! "$python" -c "import $2" 2>/dev/null; then
        echo "$1 SKIPPED: the package $2 could not be installed (target/outside/batch.log)"
        return
    fi
    (cd tests/batch && timeout --kill-after=10 "$limit" "$python" "$3") >"$log" 2>&1
    case $? in
        0) echo "$1 PASS in $((SECONDS - seconds)) s: $(tail -n 1 "$log")" ;;
        124 | 137) echo "$1 SKIPPED: it did not end within $limit s on this machine ($log)" ;;
        *) tail -n 20 "$log" >&2; echo "$1 FAILED ($log)"; status=1 ;;
    esac
}

trial RAY ray ray_cluster.py
exit "$status"
