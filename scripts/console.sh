#!/usr/bin/env bash
# Builds the console, the page that `toile serve` shows, into console/dist, from where the program takes it in.
# Where Node or the npm registry is missing, the program is built all the same; its page then says how to build the console.
#   console.sh          installs Node where it is missing (Debian), the packages of package-lock.json, and builds
#   console.sh test     runs the console's unit tests and checks its weight
#   console.sh e2e      drives the pages of the built program in Debian's Chromium, which is installed where it is missing
#   console.sh way      the whole way in the browser, from a new subject to an animated avatar; takes minutes and is no part of `make test`
set -uo pipefail
cd "$(dirname "$0")/../console"
needed=18

without() { # why
    echo "console: $1; the program is built without the console" >&2
    exit 0
}

node_version() { node --version 2>/dev/null | sed -n 's/^v\([0-9]*\)\..*/\1/p'; }

has_node() { [ "$(node_version)" != "" ] && [ "$(node_version)" -ge "$needed" ] && command -v npm >/dev/null; }

debian() { # installs Debian packages, where there is apt-get
    command -v apt-get >/dev/null || return 1
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || return 1
        as_root=(sudo)
    fi
    echo "console: installing $*"
    "${as_root[@]}" apt-get update -q && "${as_root[@]}" apt-get install -y -q --no-install-recommends "$@"
}

missing_browser() {
    echo "console: Chromium is missing and could not be installed; the tests in the browser are left out"
    [ "${TOILE_REQUIRE_OUTSIDE:-}" != 1 ]
    exit
}

# What is installed and what is built goes with the files that it was made of.
sum_of() { cat "$@" | sha256sum | cut -d' ' -f1; }

install_packages() {
    local sum
    sum=$(sum_of package-lock.json)
    [ "$(cat node_modules/.installed 2>/dev/null)" = "$sum" ] && return 0
    echo "console: installing its packages"
    timeout 300 npm ci --no-audit --no-fund --silent && echo "$sum" >node_modules/.installed
}

sources() { find src public index.html package-lock.json vite.config.ts tsconfig.json -type f | LC_ALL=C sort; }

has_node || debian nodejs npm || true
has_node || without "Node $needed or later and npm are missing and could not be installed"
install_packages || without "its packages could not be installed (npm ci failed)"
if [ "${1:-}" = test ]; then
    npm test --silent && npm run check --silent
    exit
fi
if [ "${1:-}" = e2e ] || [ "${1:-}" = way ]; then
    command -v chromium >/dev/null || debian chromium || missing_browser
    if [ "$1" = way ]; then npm run e2e:way --silent; else npm run e2e --silent; fi
    exit
fi
sum=$(sources | xargs cat | sha256sum | cut -d' ' -f1)
[ -f dist/index.html ] && [ "$(cat node_modules/.built 2>/dev/null)" = "$sum" ] && exit 0
npm run build --silent || { echo "console: its build failed" >&2; exit 1; }
echo "$sum" >node_modules/.built
