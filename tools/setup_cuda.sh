#!/usr/bin/env bash
# Installs the CUDA compiler that PyPI ships as wheels into .venv/cuda and prints the CMake flags that
# build the CUDA back end with it. Compiling needs no GPU, no driver and no root.
# usage: cmake --preset release $(tools/setup_cuda.sh)
set -euo pipefail
cd "$(dirname "$0")/.."

# 13.0 is the oldest toolkit with this layout: what it builds runs with every driver from 580 on.
packages=(
  nvidia-cuda-nvcc==13.0.88 nvidia-nvvm==13.0.88 nvidia-cuda-crt==13.0.88
  nvidia-cuda-runtime==13.0.96 nvidia-cuda-cccl==13.0.85
)

venv=$PWD/.venv/cuda
if [[ "$(cat "$venv/installed" 2>/dev/null)" != "${packages[*]}" ]]; then
  python3 -m venv "$venv" >&2
  "$venv/bin/pip" install --quiet --disable-pip-version-check "${packages[@]}" >&2
  echo "${packages[*]}" > "$venv/installed"
fi
toolkit=$(echo "$venv"/lib/python3*/site-packages/nvidia/cu13)
ln -sfn lib "$toolkit/lib64"  # where nvcc looks for its runtime
[[ -x $toolkit/bin/nvcc ]] || { echo "tools/setup_cuda.sh: no nvcc in $toolkit" >&2; exit 1; }
echo "-DCOVSPLAT_CUDA=ON -DCMAKE_CUDA_COMPILER=$toolkit/bin/nvcc"
