#!/usr/bin/env bash
# Batches on what others make. `batch.sh s3`: an S3 server (PyPI: moto) that fails and stalls on purpose. `batch.sh ray`: a Ray cluster of two
# nodes in this box, whose worker, driver and node are killed. Both where nothing is said. What they need is installed
# into target/outside where it is missing. Prints S3 PASS and RAY PASS, or SKIPPED and why: a machine that cannot reach PyPI, or is too slow
# for BATCH_SECONDS, is no fault.
set -uo pipefail
cd "$(dirname "$0")/../.."
top=$PWD
limit=${BATCH_SECONDS:-600}
status=0
mkdir -p target/outside

trial() { # name, package, script, python and what it needs before it
    local name=$1 package=$2 script=$3 log=target/outside/batch-$1.log seconds=$SECONDS
    shift 3
    if ! env "$@" -c "import $package" 2>/dev/null; then
        echo "$name SKIPPED: the package $package could not be installed (target/outside/batch.log)"
        return
    fi
    (cd tests/batch && timeout --kill-after=10 "$limit" env "$@" "$script") >"$log" 2>&1
    case $? in
        0) echo "$name PASS in $((SECONDS - seconds)) s: $(tail -n 1 "$log")" ;;
        124 | 137) echo "$name SKIPPED: it did not end within $limit s on this machine ($log)" ;;
        *) tail -n 20 "$log" >&2; echo "$name FAILED ($log)"; status=1 ;;
    esac
}

[ $# -gt 0 ] || set -- s3 ray
for name in "$@"; do
    case $name in
        s3)
            if [ ! -e target/outside/s3/moto ]; then
                timeout 300 python3 -m pip install -q --no-warn-conflicts --target target/outside/s3 "moto[s3]==5.2.5" flask==3.1.3 flask-cors==6.0.5 >target/outside/batch.log 2>&1 || true
            fi
            trial S3 moto.server s3.py PYTHONPATH="$top/target/outside/s3" python3
            ;;
        ray)
            if [ ! -x target/outside/batch/bin/ray ]; then
                { python3 -m venv target/outside/batch && timeout 300 target/outside/batch/bin/pip install -q "ray==2.*" psutil; } >target/outside/batch.log 2>&1 || true
            fi
            trial RAY ray ray_cluster.py "$top/target/outside/batch/bin/python"
            ;;
    esac
done
exit "$status"
