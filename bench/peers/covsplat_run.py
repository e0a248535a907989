"""Runs the covsplat binary on a recording and reads what it wrote."""

from __future__ import annotations

import csv
import json
import resource
import subprocess
from pathlib import Path

from peers import Outcome
from recording import Recording
from se3 import Trajectory


def run_covsplat(
    binary: Path, recording: Recording, out: Path, threads: int, *, mapping: bool
) -> tuple[Outcome, float | None]:
    """The outcome and scans per second of the whole run, the mapper's work included.

    The times per scan are the tracker's ("scan in to pose out"). CPU time is the process's, with
    reading, mapping and writing: an upper bound next to the peers'.
    """
    command = [str(binary), "run", str(recording.folder), "-o", str(out), "--overwrite"]
    command += ["--threads", str(threads)]
    if recording.azimuth_period_s is not None:
        command += ["-s", "deskew.time_source=azimuth"]
        command += ["-s", f"deskew.scan_period_s={recording.azimuth_period_s}"]
    if not mapping:
        command += ["-s", "mapping.enabled=false"]
    before_s = children_cpu_s()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        message = done.stderr.strip() or done.stdout.strip()
        raise RuntimeError(f"exit code {done.returncode}: {message[-300:]}")
    cpu_ms = (children_cpu_s() - before_s) * 1e3 / len(recording)
    trajectory = Trajectory.read_tum(out / "trajectory_tum.txt")
    return Outcome(trajectory, track_times(out), cpu_ms), scans_per_s(out)


def children_cpu_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def track_times(out: Path) -> list[float]:
    path = out / "frames.csv"
    with path.open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    if not rows or "track_ms" not in rows[0]:
        raise RuntimeError(f"{path}: no column track_ms")
    return [float(row["track_ms"]) for row in rows]


def scans_per_s(out: Path) -> float | None:
    metrics = json.loads((out / "metrics.json").read_text())
    value = metrics.get("time", {}).get("scans_per_s")
    return None if value is None else float(value)
