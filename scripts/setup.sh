#!/usr/bin/env bash
# Installs what building Toile needs and this machine lacks: a C compiler (for zstd and libusb) and Rust.
set -euo pipefail
cd "$(dirname "$0")/.."
needed=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)

as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; elif command -v sudo >/dev/null; then sudo "$@"; else
        echo "setup: run this as root, then run make again: $*" >&2
        return 1
    fi
}

debian() { # installs Debian packages, where there is apt-get
    command -v apt-get >/dev/null || return 1
    as_root apt-get update -q && as_root apt-get install -y -q --no-install-recommends "$@"
}

cargo_version() { PATH="$HOME/.cargo/bin:$PATH" cargo --version 2>/dev/null | sed -n 's/^cargo \([0-9.]*\).*/\1/p'; }

is_enough() { [ -n "$1" ] && [ "$(printf '%s\n%s\n' "$needed" "$1" | sort -V | head -n 1)" = "$needed" ]; }

install_rust() {
    echo "setup: installing Rust with rustup"
    if ! command -v rustup >/dev/null && [ ! -x "$HOME/.cargo/bin/rustup" ]; then
        command -v curl >/dev/null || debian curl ca-certificates || return 1
        curl --proto '=https' --tlsv1.2 --silent --show-error --fail https://sh.rustup.rs |
            sh -s -- -y --quiet --no-modify-path --profile minimal --default-toolchain none || return 1
    fi
    PATH="$HOME/.cargo/bin:$PATH" rustup toolchain install stable --profile minimal --component clippy,rustfmt
}

if ! command -v cc >/dev/null; then
    echo "setup: installing a C compiler"
    debian build-essential || true
fi
command -v cc >/dev/null || { echo "setup: there is no C compiler: install gcc or clang, then run make again" >&2; exit 1; }

if ! is_enough "$(cargo_version)"; then
    install_rust || true
    is_enough "$(cargo_version)" || {
        echo "setup: Toile needs Rust $needed or later, and it could not be installed here: install it from https://rustup.rs, then run make again" >&2
        exit 1
    }
fi
