"""Compares covsplat with KISS-ICP and small_gicp: same scans, same call, same number of threads.

python3 bench/peers/run.py --covsplat build/release/apps/covsplat --recording DIR --threads 2
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import shlex
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

os.environ.setdefault("OMP_WAIT_POLICY", "passive")  # else idle threads burn a shared machine

import numpy as np

import peers
import report
import stages
from covsplat_run import run_covsplat
from recording import Recording
from se3 import Trajectory, position_errors

Run = Callable[[], tuple[peers.Outcome, float | None]]


def main() -> int:
    options = parse(sys.argv[1:])
    load_before = os.getloadavg()
    periods = dict(split_period(text) for text in options.azimuth_time)
    rows: list[report.Row] = []
    for folder in options.recording + tracked(options.data):
        recording = Recording.open(folder, periods.get(folder.resolve().name))
        for name, run in methods(recording, options):
            rows.append(measure(recording, name, options.threads, run))
            print(" | ".join(report.cells(rows[-1])), flush=True)
    command = "python3 " + shlex.join(sys.argv)
    about = report.circumstances(command, load_before)
    write(rows, about, options)
    return 0 if all(row.failure is None for row in rows) else 1


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--covsplat", type=Path, help="the binary; without it only the peers run")
    parser.add_argument("--recording", type=Path, action="append", default=[], metavar="DIR")
    parser.add_argument(
        "--data", type=Path, metavar="DIR", help="also what its INDEX.md marks *track*"
    )
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("bench_out"))
    parser.add_argument("--json", type=Path, metavar="FILE", help="default: OUT/peers.json")
    parser.add_argument("--update", type=Path, metavar="PAGE", help="write between its markers")
    parser.add_argument(
        "--azimuth-time",
        action="append",
        default=[],
        metavar="NAME=SECONDS",
        help="recording whose points' times follow from the azimuth of a clockwise turn so long",
    )
    return parser.parse_args(arguments)


def split_period(text: str) -> tuple[str, float]:
    name, separator, seconds = text.partition("=")
    if not separator:
        raise SystemExit(f"--azimuth-time {text}: expected NAME=SECONDS")
    return name, float(seconds)


def tracked(data: Path | None) -> list[Path]:
    """The recordings that INDEX.md marks; none if there is no such folder."""
    if data is None or not (data / "INDEX.md").is_file():
        return []
    columns = (line.split("|") for line in (data / "INDEX.md").read_text().splitlines())
    names = [row[1].strip(" `") for row in columns if len(row) > 2 and "*track*" in row[2]]
    return [data / name for name in names if (data / name / "velodyne").is_dir()]


def methods(recording: Recording, options: argparse.Namespace) -> Iterator[tuple[str, Run]]:
    if options.covsplat is not None:
        for name, mapping in (("covsplat", True), ("covsplat, frozen map", False)):
            out = options.out / recording.name / name.replace(", ", "_").replace(" ", "_")
            out.parent.mkdir(parents=True, exist_ok=True)
            yield (
                name,
                partial(
                    run_covsplat,
                    options.covsplat,
                    recording,
                    out,
                    options.threads,
                    mapping=mapping,
                ),
            )
    yield "KISS-ICP", partial(apart, peers.run_kiss_icp, recording, options.threads)
    for deskew in (False, True) if recording.is_simulated else (False,):
        for voxelized, kind in ((True, "VGICP"), (False, "G-ICP")):
            scans = "truly deskewed" if deskew else "raw"
            run = partial(peers.run_small_gicp, voxelized=voxelized, true_deskew=deskew)
            yield f"small_gicp {kind}, {scans}", partial(apart, run, recording, options.threads)


def apart(
    run: Callable[[Recording, int], peers.Outcome], recording: Recording, threads: int
) -> tuple[peers.Outcome, None]:
    """In a process of its own: thread pools outlive their method and would disturb the next."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        return pool.submit(run, recording, threads).result(), None


def measure(recording: Recording, name: str, threads: int, run: Run) -> report.Row:
    measured_by = "exact truth" if recording.is_simulated else "reference"
    try:
        outcome, scans_per_s = run()
        errors = errors_of(outcome.trajectory, recording)
    except Exception as error:  # a failed method is a row of the table, not the end of the others
        return report.Row(
            recording.name, name, measured_by, threads, len(recording), failure=str(error)
        )
    return report.Row(
        recording.name,
        name,
        measured_by,
        threads,
        len(recording),
        poses=len(errors),
        ate_rmse_m=float(np.sqrt(np.mean(errors**2))),
        ate_max_m=float(errors.max()),
        median_ms=float(np.median(outcome.wall_ms)),
        p95_ms=float(np.percentile(outcome.wall_ms, 95)),
        cpu_ms=outcome.cpu_ms,
        scans_per_s=scans_per_s or 1e3 / float(np.mean(outcome.wall_ms)),
    )


def errors_of(estimate: Trajectory, recording: Recording) -> np.ndarray:
    """At equal times: the exact truth is taken at the estimate's, which are a method's own.

    A reference knows the stamps only, so there the estimate is interpolated; stamps before its
    first pose (KISS-ICP's is half a turn late) are left out.
    """
    if not np.isfinite(estimate.positions).all():
        raise ValueError("the trajectory is not finite")
    truth = recording.truth()
    if recording.is_simulated:
        covered = truth.covers(estimate.times_s)
        at_estimate = truth.at(estimate.times_s[covered])
        return position_errors(estimate.positions[covered], at_estimate.positions)
    covered = estimate.covers(truth.times_s)
    at_truth = estimate.at(truth.times_s[covered])
    return position_errors(at_truth.positions, truth.positions[covered])


def write(rows: list[report.Row], about: dict[str, object], options: argparse.Namespace) -> None:
    options.out.mkdir(parents=True, exist_ok=True)
    text = report.markdown(rows, about) + stages.markdown(options.out)
    (options.json or options.out / "peers.json").write_text(report.as_json(rows, about))
    (options.out / "peers.md").write_text(text)
    if options.update is not None:
        report.update(options.update, text)
    print("\n" + text)


if __name__ == "__main__":
    sys.exit(main())
