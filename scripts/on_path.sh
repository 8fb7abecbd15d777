#!/usr/bin/env bash
# Says how to put a folder on the search path, where it is not on it.
case ":$PATH:" in
*":$1:"*) ;;
*) echo "toile is installed in $1, which is not on your PATH. For this shell: export PATH=\"$1:\$PATH\"" ;;
esac
