#!/usr/bin/env bash
# Tests, sanitises and measures the CUDA backend on a machine with a GPU; ends with a short table.
# usage: tools/gpu_check.sh [--out DIR]           builds build/gpu with the machine's CUDA toolkit
#        tools/gpu_check.sh --pack DIR            builds, and puts all that a bare machine needs in DIR
#        DIR/gpu_check.sh --packed [--out DIR]    there: needs the CUDA toolkit and Python only
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
out=gpu_out
mode=build
while [[ $# -gt 0 ]]; do
  case "$1" in
    --out) out=$2; shift ;;
    --pack) mode=pack; pack=$2; shift ;;
    --packed) mode=packed ;;
    *) sed -n '3,5s/^# //p' "$0" >&2; exit 2 ;;
  esac
  shift
done

build() {  # the flags of the compiler, then others
  cmake -S "$here/.." -B "$here/../build/gpu" -G Ninja -DCMAKE_BUILD_TYPE=Release "$@"
  cmake --build "$here/../build/gpu" --target splat_test splat_bench covsplat
}

case "$mode" in
  pack)
    # shellcheck disable=SC2046
    build $("$here/setup_cuda.sh") ${COVSPLAT_GPU_FLAGS:-}
    mkdir -p "$pack/lib"
    for program in tests/splat/splat_test bench/splat_bench apps/covsplat; do
      strip -o "$pack/${program##*/}" "$here/../build/gpu/$program"
    done
    cp "$here/gpu_check.sh" "$here/gpu_table.py" "$pack"
    # All libraries but those of the C and C++ runtimes.
    ldd "$pack/splat_bench" "$pack/covsplat" | awk '$3 ~ /^\// {print $3}' | sort -u |
      grep -vE '/lib(c|m|gcc_s|stdc\+\+)\.so' | xargs -I{} cp -L {} "$pack/lib"
    echo "$pack: $(du -sh "$pack" | cut -f1)"
    exit ;;
  build)
    build -DCOVSPLAT_CUDA=ON -DCMAKE_CUDA_ARCHITECTURES=native
    test=$here/../build/gpu/tests/splat/splat_test
    bench=$here/../build/gpu/bench/splat_bench
    app=$here/../build/gpu/apps/covsplat ;;
  packed)
    export LD_LIBRARY_PATH=$here/lib:${LD_LIBRARY_PATH:-}
    test=$here/splat_test
    bench=$here/splat_bench
    app=$here/covsplat ;;
esac

mkdir -p "$out"
export PATH=$PATH:/usr/local/cuda/bin
status=0

echo "== tests"
timeout 120 "$test" --gtest_filter='CudaEngineTest.*:SplatEngine.*' > "$out/tests.log" 2>&1 || status=1
grep -E '^\[  (PASSED|FAILED|SKIPPED)|^\[==========\].*ran|Failure' "$out/tests.log" || true

# Small scenes: every kernel runs, and the tools slow them down a hundredfold.
some='CudaEngineTest.RendersWhatTheCpuRenders:CudaEngineTest.OneStep*:CudaEngineTest.GaussiansCome*'
some+=':CudaEngineTest.AnEmptyMap*:CudaEngineTest.BrokenGaussians*'
for tool in memcheck racecheck initcheck; do
  echo "== compute-sanitizer $tool"
  timeout 120 compute-sanitizer --tool "$tool" --error-exitcode 9 "$test" --gtest_filter="$some" \
    > "$out/$tool.log" 2>&1 || status=1
  grep -E 'ERROR SUMMARY|RACECHECK SUMMARY' "$out/$tool.log" || tail -n 3 "$out/$tool.log"
done

echo "== benchmarks"
timeout 120 "$bench" --benchmark_out="$out/bench.json" --benchmark_out_format=json \
  --benchmark_min_time="${COVSPLAT_BENCH_SECONDS:-0.5}" > "$out/bench.log" 2>&1 || status=1

echo "== kernels"
# The second of two visits: one binning and ten steps, as a run makes them.
metrics=gpu__time_duration.sum,sm__throughput.avg.pct_of_peak_sustained_elapsed
metrics+=,gpu__compute_memory_throughput.avg.pct_of_peak_sustained_elapsed
metrics+=,dram__throughput.avg.pct_of_peak_sustained_elapsed
metrics+=,sm__warps_active.avg.pct_of_peak_sustained_active
timeout 100 ncu --csv --clock-control none --metrics "$metrics" --launch-count 130 --log-file "$out/ncu.csv" \
  "$bench" --benchmark_filter='BM_Step/cuda/100000' --benchmark_min_time=0.000001 \
  > "$out/ncu.log" 2>&1 || echo "ncu says nothing: see $out/ncu.log"

echo "== whole system"
timeout 60 "$app" simulate courtyard --sensor os1-64 --motion walking -n "${COVSPLAT_SCANS:-300}" \
  -o "$out/rec" --overwrite --quiet || status=1
for backend in cpu cuda; do
  # In turns, for the same number of steps; then as fast as it goes.
  timeout 100 "$app" run "$out/rec" -o "$out/$backend" --backend $backend --deterministic --quiet || status=1
  timeout 60 "$app" run "$out/rec" -o "$out/${backend}_live" --backend $backend --quiet || status=1
  [[ ${COVSPLAT_MESH:-1} -eq 1 ]] || continue
  timeout 100 "$app" mesh "$out/$backend" --quiet || status=1
  timeout 60 "$app" eval map "$out/$backend/mesh.ply" "$out/rec/gt_mesh.ply" --run "$out/$backend" \
    --recording "$out/rec" --json --quiet > "$out/$backend.map.json" || status=1
done

python3 "$here/gpu_table.py" "$out" | tee "$out/table.md"
exit "$status"
