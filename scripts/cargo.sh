#!/usr/bin/env bash
# Runs cargo, also where a fresh rustup has not touched this shell's PATH yet.
set -euo pipefail
command -v cargo >/dev/null || export PATH="$HOME/.cargo/bin:$PATH"
exec cargo "$@"
