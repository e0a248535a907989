#!/usr/bin/env bash
# Runs clang-tidy over our sources as the dev preset compiles them.
# usage: tools/tidy.sh [PATH ...]   only sources below these paths, e.g. covsplat/config
set -euo pipefail
cd "$(dirname "$0")/.."

commands=build/dev/compile_commands.json
[[ -f $commands ]] || cmake --preset dev >/dev/null
paths=("$@")
[[ ${#paths[@]} -gt 0 ]] || paths=(covsplat apps tests bench)

# Only what is built: other sources have no compile command.
mapfile -t sources < <(find "${paths[@]}" -name '*.cpp' | sort | while read -r source; do
  if grep -qF "\"$PWD/$source\"" "$commands"; then echo "$source"; fi
done)
[[ ${#sources[@]} -gt 0 ]] || { echo "tidy: no sources below ${paths[*]}" >&2; exit 2; }
printf '%s\0' "${sources[@]}" | xargs -0 -n 1 -P "$(nproc)" clang-tidy-14 -p build/dev --quiet \
  2> >(grep -v " warnings generated" >&2)
echo "tidy: ${#sources[@]} sources are clean"
