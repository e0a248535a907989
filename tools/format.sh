#!/usr/bin/env bash
# Formats all C++ sources; with --check changes nothing and fails if something is not formatted.
# usage: tools/format.sh [--check]
set -euo pipefail
cd "$(dirname "$0")/.."

case "${1:-}" in
  "") mode=(-i) ;;
  --check) mode=(--dry-run --Werror) ;;
  *) echo "usage: tools/format.sh [--check]" >&2; exit 2 ;;
esac
find covsplat apps tests bench \( -name '*.?pp' -o -name '*.cu' -o -name '*.cuh' \) -print0 | xargs -0 -r clang-format-14 "${mode[@]}"
