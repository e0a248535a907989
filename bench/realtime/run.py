"""Live: latency, dropped scans and what is left for the map, beside tracking peers.

PYTHONPATH=bench/peers .venv/bin/python bench/realtime/run.py \
    --covsplat build/release/apps/covsplat --recording bench_out/courtyard
"""

from __future__ import annotations

import argparse
import json
import os
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
from covsplat_run import base_command, track_times
from map_runs import strict_f_percent
from options import add_options, recordings
from processes import apart, run_program
from recording import Recording
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
FAST_HZ = 20.0


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
    rows = []
    for recording in recordings(options):
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
    add_options(parser, out="bench_out/realtime", mark="*track*")
    return parser.parse_args()


def runs_of(recording: Recording, options: argparse.Namespace) -> dict:
    rate = FAST_HZ * float(np.median(np.diff(recording.stamps_s)))
    flags = {
        "covsplat, real time": ["--realtime"],
        f"covsplat, {FAST_HZ:.0f} scans per s": ["--realtime", "--rate", f"{rate:.3f}"],
        "covsplat, full speed": [],
        "covsplat, lockstep": ["--deterministic"],
    }
    runs = {name: partial(covsplat, recording, name, flags[name], options) for name in flags}
    trackers = {
        "KISS-ICP": partial(peers.run_kiss_icp, recording, options.threads),
        "small_gicp G-ICP": partial(
            peers.run_small_gicp, recording, options.threads, voxelized=False, true_deskew=False
        ),
    }
    for name, track in trackers.items():
        runs[name] = partial(peer, recording, name, track)
    return runs


def covsplat(
    recording: Recording, name: str, flags: list[str], options: argparse.Namespace
) -> Row:
    out = options.out / recording.name / name.replace(", ", "_").replace(" ", "_")
    out.parent.mkdir(parents=True, exist_ok=True)
    command = base_command(options.covsplat, recording, out, options.threads)
    run_program([*command, "--quiet", *flags])
    metrics = json.loads((out / "metrics.json").read_text())
    return Row(
        recording.name,
        name,
        track_runs.ate_m(Trajectory.read_tum(out / "trajectory_tum.txt"), recording),
        track_times(out),
        metrics["time"]["scans_per_s"],
        metrics["memory"]["peak_rss_bytes"] / 2**20,
        metrics,
        strict_f_percent(recording, out, options),
    )


def peer(recording: Recording, name: str, track: partial) -> Row:
    outcome = apart(track)
    return Row(
        recording.name,
        name,
        track_runs.ate_m(outcome.trajectory, recording),
        list(outcome.wall_ms),
        1e3 / float(np.mean(outcome.wall_ms)),
        outcome.peak_mib,
    )


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
