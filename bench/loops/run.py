"""What closing loops gains: trajectories, loops, double walls and surfaces, beside KISS-SLAM.

PYTHONPATH=bench/peers .venv/bin/python bench/loops/run.py --covsplat build/release/apps/covsplat \
    --recording bench_out/multilevel
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

import page
import peers
import report
import track_runs
from covsplat_run import base_command
from loop_measures import LoopFacts, Thickness, loop_facts, thickness
from map_runs import strict_f_percent
from options import add_options, recordings
from processes import apart, run_program
from recording import Recording
from report import number
from se3 import Array, Trajectory, ways_along

HEADER = (
    "recording",
    "way m",
    "method",
    "ATE mm",
    "% of the way",
    "looked at",
    "accepted",
    "wrong",
    "worst mm",
    "revisits found",
    "double walls: median mm",
    "90 % mm",
    "of one pass: median mm",
    "strict F 0.1 m",
    "0.05 m",
)


@dataclass(frozen=True)
class Row:
    recording: str
    way_m: float
    method: str
    ate_m: float
    loops: LoopFacts | None = None
    double: Thickness | None = None
    strict_f_percent: tuple[float, float] | None = None  # at 0.1 and 0.05 m


def main() -> int:
    options = parse()
    rows = []
    for recording in recordings(options):
        rows += compared(recording, options)
    page.publish(f"\n{report.table(HEADER, list(map(cells, rows)))}\n", "loops", options.update)
    return 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--covsplat", type=Path, required=True, help="the binary")
    add_options(parser, out="bench_out/loops", mark="*loop*")
    return parser.parse_args()


def compared(recording: Recording, options: argparse.Namespace) -> list[Row]:
    out = options.out / recording.name
    out.mkdir(parents=True, exist_ok=True)
    runs = {
        "loops off": ["--loops", "off"],
        "loops on": ["--loops", "on"],
        "true poses": ["--loops", "off", "--poses", str(recording.folder / "gt_tum.txt")],
    }
    if not recording.is_simulated:
        del runs["true poses"]
    rows = []

    def add(row: Row) -> None:
        rows.append(row)
        print(" | ".join(cells(row)), flush=True)

    for name, flags in runs.items():
        folder = out / name.replace(" ", "_")
        if options.only.search(f"{recording.name}, {name}"):
            command = base_command(options.covsplat, recording, folder, options.threads)
            run_program([*command, "--deterministic", "--quiet", *flags])
            add(judged(recording, name, folder, options))
    if options.only.search(f"{recording.name}, optimize"):
        folder = out / "optimized"
        command = [str(options.covsplat), "optimize", str(out / "loops_on"), "-o", str(folder)]
        run_program([*command, "--overwrite", "--quiet", "--threads", str(options.threads)])
        add(judged(recording, "loops on, then `optimize`", folder, options))
    if options.only.search(f"{recording.name}, KISS-SLAM"):
        outcome = apart(partial(peers.run_kiss_slam, recording, options.threads))
        add(row_of(recording, "KISS-SLAM", outcome.trajectory))
    return rows


def row_of(recording: Recording, method: str, trajectory: Trajectory) -> Row:
    way_m = float(ways_along(recording.truth().positions)[-1])
    return Row(recording.name, way_m, method, track_runs.ate_m(trajectory, recording))


def judged(recording: Recording, method: str, run: Path, options: argparse.Namespace) -> Row:
    row = row_of(recording, method, Trajectory.read_tum(run / "trajectory_tum.txt"))
    closed = run / "loops" if (run / "loops").is_dir() else run
    loops = loop_facts(closed, recording) if (closed / "loops.csv").is_file() else None
    strict = strict_f_percent(recording, run, options, compared_voxel_m=0.05)
    return Row(row.recording, row.way_m, method, row.ate_m, loops, thickness(run), strict)


def cells(row: Row) -> list[str]:
    loops = row.loops or LoopFacts(0, 0)
    known = row.loops is not None
    two_passes_m = row.double.two_passes_m if row.double else np.empty(0)
    one_pass_m = row.double.one_pass_m if row.double else np.empty(0)
    strict = row.strict_f_percent or (None, None)
    has_truth = known and loops.revisits is not None
    return [
        row.recording,
        number(row.way_m, 0),
        row.method,
        number(1e3 * row.ate_m, 1),
        number(100 * row.ate_m / row.way_m, 4),
        str(loops.looked_at) if known else "-",
        str(loops.accepted) if known else "-",
        str(loops.wrong) if has_truth else "-",
        number(None if loops.worst_m is None else 1e3 * loops.worst_m, 1),
        f"{loops.found}/{loops.revisits}" if has_truth else "-",
        percentile_mm(two_passes_m, 50),
        percentile_mm(two_passes_m, 90),
        percentile_mm(one_pass_m, 50),
        number(strict[0], 2),
        number(strict[1], 2),
    ]


def percentile_mm(values_m: Array, percent: float) -> str:
    return number(1e3 * np.percentile(values_m, percent) if len(values_m) else None, 1)


if __name__ == "__main__":
    sys.exit(main())
