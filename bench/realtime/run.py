"""Live: latency, dropped scans and what is left for the map, beside tracking peers.

PYTHONPATH=bench/peers .venv/bin/python bench/realtime/run.py \
    --covsplat build/release/apps/covsplat --recording bench_out/courtyard
"""

from __future__ import annotations

import argparse
import json
import os
import re
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

os.environ.setdefault("OMP_WAIT_POLICY", "passive")  # else idle threads burn a shared machine

import numpy as np

import page
import peers
import report
import track_runs
from covsplat_run import base_command, mesh_of_run, score_mesh, track_times
from processes import apart, run_program
from recording import Recording, azimuth_periods, marked
from report import number
from se3 import Trajectory

HEADER = (
    "recording",
    "run",
    "ATE mm",
    "strict F 0.1 m",
    "0.05 m",
    "tracking ms: median",
    "95 %",
    "latency ms: median",
    "95 %",
    "99 %",
    "max",
    "dropped",
    "scans/s",
    "steps per keyframe: min",
    "median",
    "max",
    "peak MiB",
)
RUNS = {
    "covsplat, real time": ("--realtime",),
    "covsplat, full speed": (),
    "covsplat, lockstep": ("--deterministic",),
}


@dataclass(frozen=True)
class Row:
    recording: str
    run: str
    ate_m: float
    track_ms: list[float]
    scans_per_s: float
    peak_mib: float
    metrics: dict | None = None  # of covsplat
    strict_f_percent: tuple[float, float] | None = None  # at 0.1 and 0.05 m


def main() -> int:
    options = parse()
    load_before = os.getloadavg()
    periods = azimuth_periods(options.azimuth_time)
    rows = []
    for folder in options.recording + marked(options.data, "*track*"):
        recording = Recording.open(folder, periods.get(folder.resolve().name))
        for run, measure in runs_of(recording, options).items():
            if not options.only.search(f"{recording.name}, {run}"):
                continue
            rows.append(measure())
            print(" | ".join(cells(rows[-1])), flush=True)
    load = f"{load_before[0]:.1f} before and {os.getloadavg()[0]:.1f} after"
    about = f"{options.threads} threads each; load average {load}."
    table = report.table(HEADER, list(map(cells, rows)))
    page.publish(f"\n{about}\n\n{table}\n", "realtime", options.update)
    return 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--covsplat", type=Path, required=True, help="the binary")
    parser.add_argument("--recording", type=Path, action="append", default=[], metavar="DIR")
    parser.add_argument("--data", type=Path, metavar="DIR", help="also what it marks *track*")
    parser.add_argument("--azimuth-time", action="append", default=[], metavar="NAME=SECONDS")
    parser.add_argument("--only", type=re.compile, default=re.compile(""), metavar="REGEX")
    parser.add_argument("--voxel", type=float, default=0.1, metavar="METRES", help="of all meshes")
    parser.add_argument("--no-map", action="append", default=[], metavar="NAME", help="recording")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("bench_out/realtime"))
    parser.add_argument("--update", type=Path, metavar="PAGE", help="write between its markers")
    return parser.parse_args()


def runs_of(recording: Recording, options: argparse.Namespace) -> dict:
    runs = {name: partial(covsplat, recording, name, options) for name in RUNS}
    trackers = {
        "KISS-ICP": partial(peers.run_kiss_icp, recording, options.threads),
        "small_gicp G-ICP": partial(
            peers.run_small_gicp, recording, options.threads, voxelized=False, true_deskew=False
        ),
    }
    for name, track in trackers.items():
        runs[name] = partial(peer, recording, name, track)
    return runs


def covsplat(recording: Recording, name: str, options: argparse.Namespace) -> Row:
    out = options.out / recording.name / name.replace(", ", "_").replace(" ", "_")
    out.parent.mkdir(parents=True, exist_ok=True)
    command = base_command(options.covsplat, recording, out, options.threads)
    run_program([*command, "--quiet", *RUNS[name]])
    metrics = json.loads((out / "metrics.json").read_text())
    return Row(
        recording.name,
        name,
        ate_m(Trajectory.read_tum(out / "trajectory_tum.txt"), recording),
        track_times(out),
        metrics["time"]["scans_per_s"],
        metrics["memory"]["peak_rss_bytes"] / 2**20,
        metrics,
        surface(recording, out, options),
    )


def peer(recording: Recording, name: str, track: partial) -> Row:
    outcome = apart(track)
    return Row(
        recording.name,
        name,
        ate_m(outcome.trajectory, recording),
        list(outcome.wall_ms),
        1e3 / float(np.mean(outcome.wall_ms)),
        outcome.peak_mib,
    )


def ate_m(trajectory: Trajectory, recording: Recording) -> float:
    absolute_m, _ = track_runs.errors_of(trajectory, recording)
    return track_runs.rms(absolute_m)


def surface(
    recording: Recording, run: Path, options: argparse.Namespace
) -> tuple[float, float] | None:
    if recording.true_mesh is None or recording.name in options.no_map:
        return None
    mesh = run / "mesh.ply"
    mesh_of_run(options.covsplat, run, mesh, options.voxel, options.threads)
    trajectory = run / "trajectory_tum.txt"
    score = score_mesh(
        options.covsplat, mesh, recording, (0.1, 0.05), options.threads, trajectory
    )
    return score.strict.f_percent[0.1], score.strict.f_percent[0.05]


def cells(row: Row) -> list[str]:
    strict = row.strict_f_percent or (None, None)
    metrics = row.metrics or {"time": {}, "map": {}}
    latency = metrics["time"].get("latency_ms", {})
    steps = metrics["map"].get("steps_per_keyframe") or {}
    return [
        row.recording,
        row.run,
        number(1e3 * row.ate_m, 2),
        *(number(f, 2) for f in strict),
        number(float(np.median(row.track_ms)), 1),
        number(float(np.percentile(row.track_ms, 95)), 1),
        *(number(latency.get(key), 1) for key in ("p50", "p95", "p99", "max")),
        str(metrics["scans"]["dropped"]) if "scans" in metrics else "-",
        number(row.scans_per_s, 1),
        *(number(steps.get(key), 0) for key in ("min", "median", "max")),
        number(row.peak_mib, 0),
    ]


if __name__ == "__main__":
    sys.exit(main())
