#!/usr/bin/env bash
# Installs what building Toile needs and this machine lacks: a C compiler (zstd, libusb) and Rust.
set -euo pipefail

as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; elif command -v sudo >/dev/null; then sudo "$@"; else
        echo "setup: please run as root: $*" >&2
        return 1
    fi
}

if ! command -v cc >/dev/null && command -v apt-get >/dev/null; then
    echo "setup: installing a C compiler"
    as_root apt-get update -q
    as_root apt-get install -y -q build-essential
fi
command -v cc >/dev/null || { echo "setup: no C compiler found: install gcc or clang" >&2; exit 1; }

if ! command -v cargo >/dev/null && [ ! -x "$HOME/.cargo/bin/cargo" ]; then
    if command -v rustup >/dev/null; then
        rustup toolchain install stable --profile minimal --component clippy,rustfmt
    else
        echo "setup: Rust is missing: install it from https://rustup.rs (1.95 or later), then run make again" >&2
        exit 1
    fi
fi
