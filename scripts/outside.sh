#!/usr/bin/env bash
# Outside programs that the tests ask about our files. Each is optional: a test whose program is missing says so and passes.
# With TOILE_REQUIRE_OUTSIDE=1 the test fails instead, and so does this script.
#   target/outside/node_modules/gltf-validator   Khronos' glTF validator (npm)
#   target/outside/node_modules/@pixiv/three-vrm three.js, its VRM loader, and what drives Chromium (npm); Chromium is Debian's, as for the console
#   target/outside/usd                           OpenUSD's library (PyPI: usd-core), which skins and checks USD files
#   assimp                                       loads GLB (Debian's assimp-utils)
set -uo pipefail
cd "$(dirname "$0")/.."
mkdir -p target/outside
status=0

missing() { # program, why
    echo "outside: $1 is missing: $2"
    if [ "${TOILE_REQUIRE_OUTSIDE:-}" = 1 ]; then status=1; fi
}

if [ ! -d target/outside/node_modules/gltf-validator ]; then
    if command -v npm >/dev/null; then
        echo "outside: installing gltf-validator"
        (cd target/outside && timeout 180 npm install --no-audit --no-fund --silent gltf-validator@2.0.0-dev.3.10 >npm.log 2>&1) ||
            missing gltf-validator "npm could not install it (target/outside/npm.log)"
    else
        missing gltf-validator "it is installed with npm, which is missing too"
    fi
fi

if [ ! -d target/outside/node_modules/@pixiv/three-vrm ]; then
    if command -v npm >/dev/null; then
        echo "outside: installing three-vrm"
        (cd target/outside && timeout 180 npm install --no-audit --no-fund --silent @pixiv/three-vrm@3.5.5 three@0.187.0 playwright-core@1.58.0 >npm.log 2>&1) ||
            missing three-vrm "npm could not install it (target/outside/npm.log)"
    else
        missing three-vrm "it is installed with npm, which is missing too"
    fi
fi

if [ ! -d target/outside/usd/pxr ]; then
    echo "outside: installing usd-core"
    timeout 180 python3 -m pip install --quiet --no-deps --target target/outside/usd "usd-core==26.11" >target/outside/usd.log 2>&1 ||
        missing usd-core "pip could not install it (target/outside/usd.log)"
fi

if ! command -v assimp >/dev/null; then
    if [ "$(id -u)" -eq 0 ] && command -v apt-get >/dev/null; then
        echo "outside: installing assimp"
        { timeout 120 apt-get update -q && timeout 180 apt-get install -y -q --no-install-recommends assimp-utils; } >target/outside/apt.log 2>&1 ||
            missing assimp "apt-get could not install it (target/outside/apt.log)"
    else
        missing assimp "only root can install it"
    fi
fi
exit "$status"
