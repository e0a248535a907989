#!/usr/bin/env bash
# Installs the Debian packages that covsplat needs and that are missing; says nothing if none is.
# usage: tools/setup.sh [--with-dev] [--with-poisson] [--with-python]
set -euo pipefail

packages=(
  build-essential cmake ninja-build python3
  libeigen3-dev libfmt-dev libyaml-cpp-dev libcli11-dev nlohmann-json3-dev libhwy-dev libembree-dev
  libassimp-dev libnanoflann-dev libpng-dev liblzf-dev zlib1g-dev libexpected-dev libgtest-dev
  libbenchmark-dev libopencv-features2d-dev libceres-dev
)
for argument in "$@"; do
  case "$argument" in
    --with-dev) packages+=(clang-format-14 clang-tidy-14 valgrind) ;;
    --with-poisson) packages+=(libopen3d-dev) ;;
    --with-python) packages+=(python3-venv libusb-1.0-0 libgl1 libgomp1) ;;  # what Open3D's wheel asks for
    *) echo "usage: tools/setup.sh [--with-dev] [--with-poisson] [--with-python]" >&2; exit 2 ;;
  esac
done

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
  echo "This is not Debian. covsplat needs what these Debian 12 packages hold:"
  printf '  %s\n' "${packages[@]}"
  echo "Install them your way, then build with: cmake --preset release && cmake --build --preset release"
  exit 0
fi

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [[ $status == installed ]] || missing+=("$package")
done
[[ ${#missing[@]} -eq 0 ]] && exit 0

as_root=()
if [[ $(id -u) -ne 0 ]]; then
  command -v sudo >/dev/null || { echo "Please install as root: apt-get install ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
fi
echo "Installing missing packages: ${missing[*]}"
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
  apt-get install -y -qq --no-install-recommends "${missing[@]}" </dev/null
