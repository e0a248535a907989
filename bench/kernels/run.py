"""What the kernels take: by stage beside the machine's roofline, and against the amount of work.

PYTHONPATH=bench/peers .venv/bin/python bench/kernels/run.py --build build/release/bench
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import page
import report
from report import number

STAGES = {  # of an optimiser step on the street: what they do, and whether once per view
    "expand": ("measurements of the view", True),
    "look": ("projection, footprints, sorting into tiles", True),
    "render": ("images for surface normals", True),
    "normals": ("surface normals", True),
    "project": ("projection", False),
    "tiles": ("rasteriser: forward, loss, backward", False),
    "optimize": ("sums of gradients, chain rule, Adam", False),
}
STEPS_PER_VIEW = 10
STREET = re.compile(r"BM_StreetStages/cpu/threads:(\d+)/surfels:100000/footprint:2/")
STREET_STEP = re.compile(r"BM_StreetStep/cpu/threads:(\d+)/surfels:(\d+)/footprint:(\d)/")
CURVE = re.compile(r"BM_(Step|Track)ByWork/threads:(\d+)/beams:(\d+)(?:/gaussians:(\d+))?/")


@dataclass(frozen=True)
class Benchmark:
    name: str
    ms: float  # real or manual time of an iteration
    values: dict[str, float]


def main() -> int:
    options = parse()
    options.out.mkdir(parents=True, exist_ok=True)
    found: list[Benchmark] = []
    for program in sorted(options.build.glob("*_bench")):
        found += measured(program, options.out / f"{program.name}.json")
    page.publish("\n" + "\n".join(tables(found)) + "\n", "kernels", options.update)
    return 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--build", type=Path, required=True, help="folder of the benchmarks")
    parser.add_argument("--out", type=Path, default=Path("bench_out/kernels"), help="for JSON")
    parser.add_argument("--update", type=Path, metavar="PAGE", help="write between its markers")
    return parser.parse_args()


def measured(program: Path, out: Path) -> list[Benchmark]:
    print(program, flush=True)
    subprocess.run(
        [program, f"--benchmark_out={out}", "--benchmark_out_format=json"], check=True
    )
    return [as_benchmark(entry) for entry in json.loads(out.read_text())["benchmarks"]]


def as_benchmark(entry: dict[str, object]) -> Benchmark:
    per_ms = {"ns": 1e6, "us": 1e3, "ms": 1.0, "s": 1e-3}[str(entry["time_unit"])]
    values = {key: value for key, value in entry.items() if isinstance(value, float)}
    return Benchmark(str(entry["name"]), float(entry["real_time"]) / per_ms, values)


def tables(found: list[Benchmark]) -> list[str]:
    text = []
    stages = {int(m[1]): b.values for b in found if (m := STREET.match(b.name))}
    if stages:
        text += [stage_table(stages), peak_line(stages)]
    streets = [(m, b.ms) for b in found if (m := STREET_STEP.match(b.name))]
    if streets:
        text.append(street_table(streets))
    curves = [(m, b) for b in found if (m := CURVE.match(b.name))]
    if curves:
        text.append(curve_table(curves))
    return text


def stage_table(stages: dict[int, dict[str, float]]) -> str:
    header = ["stage", "of a step"]
    for threads in stages:
        header += [f"ms, {of(threads)}", "% of the roofline"]
    rows = []
    for stage, (what, once) in STAGES.items():
        row = [what, f"1 in {STEPS_PER_VIEW}" if once else "every"]
        for values in stages.values():
            roof = values.get(f"{stage}_roof")
            row += [number(values[stage], 2), number(roof and 100 * roof / values[stage], 0)]
        rows.append(row)
    return report.table(header, rows) + "\n"


def peak_line(stages: dict[int, dict[str, float]]) -> str:
    peaks = ", ".join(
        f"{v['peak_GFLOP/s']:.0f} GFLOP/s and {v['peak_GB/s']:.1f} GB/s with {of(threads)}"
        for threads, v in stages.items()
    )
    pairs = next(iter(stages.values()))["pairs"]
    return f"{pairs:.0f} pairs of Gaussian and tile; peaks: {peaks}.\n"


def street_table(streets: list[tuple[re.Match[str], float]]) -> str:
    threads = sorted({int(match[1]) for match, _ in streets})
    times = {tuple(map(int, match.groups())): ms for match, ms in streets}
    work = sorted({(surfels, footprint) for _, surfels, footprint in times})
    rows = [
        [str(surfels), str(footprint), *(number(times[n, surfels, footprint], 2) for n in threads)]
        for surfels, footprint in work
    ]
    header = ["surfels", "footprint factor", *(f"ms per step, {of(n)}" for n in threads)]
    return report.table(header, rows) + "\n"


def curve_table(curves: list[tuple[re.Match[str], Benchmark]]) -> str:
    rows = []
    for match, benchmark in sorted(curves, key=lambda one: work_of(one[0])):
        is_step = match[1] == "Step"
        ms = 1e3 / benchmark.values["steps/s"] if is_step else benchmark.ms
        what = "optimiser step" if is_step else "preparation and registration"
        rows.append([what, match[3], match[4] or "-", match[2], number(ms, 2)])
    return report.table(["work", "beams", "Gaussians", "threads", "ms"], rows) + "\n"


def of(threads: int) -> str:
    return "1 thread" if threads == 1 else f"{threads} threads"


def work_of(match: re.Match[str]) -> tuple[str, int, int, int]:
    return match[1], int(match[3]), int(match[4] or 0), int(match[2])


if __name__ == "__main__":
    sys.exit(main())
