#!/usr/bin/env python3
"""Counts the instructions of the hot kernels under callgrind, which unlike time have no noise.

usage: tools/count_instructions.py BENCH_FOLDER [--check FILE] [--tolerance 0.03]

BENCH_FOLDER holds the release builds of scaling_bench and registration_bench. Prints instructions per
unit of work as JSON. With --check, fails if a count is more than the tolerance above that of FILE.

Valgrind knows no AVX-512, so it is the AVX2 kernels that are counted. They grow and shrink with the
AVX-512 ones unless a change is for one of them only. Counts depend on the compiler as well: record
them anew, without other changes, when it changes.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile

# What is counted: benchmark, its filter, the function inside which instructions count, and how many
# units of work one iteration of the benchmark calls it for. Benchmarks with one thread only: those of
# other threads would not be counted.
KERNELS = {
    "optimiser step, 100k Gaussians, 64 x 1024": (
        "scaling_bench", "BM_StepByWork/threads:1/beams:64/gaussians:100000/",
        "covsplat::CpuEngine::Step(*", 10),
    "preparation of a scan": (
        "registration_bench", "BM_Preprocess/1/", "covsplat::Preprocess(*", 1),
    "registration of a scan": (
        "registration_bench", "BM_Align/1/", "covsplat::Align(*", 1),
}


def count(folder, program, benchmark, function, units):
    """Instructions per unit in one iteration of a benchmark."""
    with tempfile.TemporaryDirectory() as scratch:
        command = [
            "valgrind", "--tool=callgrind", f"--toggle-collect={function}",
            f"--callgrind-out-file={scratch}/out",
            str(folder / program), f"--benchmark_filter=^{benchmark}", "--benchmark_min_time=1e-9"]
        result = subprocess.run(command, capture_output=True, text=True)
    collected = re.search(r"Collected : (\d+)", result.stderr)
    if result.returncode != 0 or not collected or int(collected[1]) == 0:
        sys.exit(f"{' '.join(command)}\n{result.stdout}{result.stderr}nothing was counted")
    return int(collected[1]) // units


def grown(counts, recorded, tolerance):
    """Messages about counts that are too far above the recorded ones."""
    return [f"{name}: {now:,} instructions, {now / recorded[name] - 1:+.1%}"
            for name, now in counts.items()
            if name in recorded and now > (1 + tolerance) * recorded[name]]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path, metavar="BENCH_FOLDER")
    parser.add_argument("--check", type=pathlib.Path, metavar="FILE")
    parser.add_argument("--tolerance", type=float, default=0.03)
    args = parser.parse_args()
    counts = {name: count(args.folder, *kernel) for name, kernel in KERNELS.items()}
    print(json.dumps(counts, indent=2))
    if args.check:
        messages = grown(counts, json.loads(args.check.read_text()), args.tolerance)
        if messages:
            sys.exit("grown:\n  " + "\n  ".join(messages))


if __name__ == "__main__":
    main()
