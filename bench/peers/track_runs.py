"""Who tracks a recording, and how far off they are."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

import peers
import report
from covsplat_run import run_covsplat
from processes import apart
from recording import Recording
from se3 import Array, Trajectory, position_errors, relative_errors

RPE_WAY_M = 1.0

Run = Callable[[], peers.Outcome]


# Ways to run covsplat, with their flags.
COVSPLAT = {
    "covsplat": (),
    "covsplat, lockstep": ("--deterministic",),
    "covsplat, frozen map": ("-s", "mapping.feedback.mode=frozen"),
}


def covsplat_folder(out: Path, name: str = "covsplat") -> Path:
    """Where a run of covsplat lies among the results of a recording."""
    return out / name.replace(", ", "_").replace(" ", "_")


def methods(
    recording: Recording, covsplat: Path | None, out: Path, threads: int
) -> Iterator[tuple[str, Run]]:
    if covsplat is not None:
        for name, flags in COVSPLAT.items():
            folder = covsplat_folder(out, name)
            yield name, partial(run_covsplat, covsplat, recording, folder, threads, flags)
    yield "KISS-ICP", partial(apart, partial(peers.run_kiss_icp, recording, threads))
    yield "KISS-SLAM", partial(apart, partial(peers.run_kiss_slam, recording, threads))
    for deskew in (False, True) if recording.is_simulated else (False,):
        for voxelized, kind in ((True, "VGICP"), (False, "G-ICP")):
            scans = "truly deskewed" if deskew else "raw"
            run = partial(
                peers.run_small_gicp, recording, threads, voxelized=voxelized, true_deskew=deskew
            )
            yield f"small_gicp {kind}, {scans}", partial(apart, run)


def measure(recording: Recording, name: str, threads: int, run: Run) -> report.Row:
    measured_by = "exact truth" if recording.is_simulated else "reference"
    try:
        outcome = run()
        absolute_m, relative_m = errors_of(outcome.trajectory, recording)
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
        poses=len(absolute_m),
        ate_rmse_m=rms(absolute_m),
        ate_max_m=float(absolute_m.max()),
        rpe_rmse_m=rms(relative_m) if len(relative_m) else None,
        median_ms=float(np.median(outcome.wall_ms)),
        p95_ms=float(np.percentile(outcome.wall_ms, 95)),
        cpu_ms=outcome.cpu_ms,
        peak_mib=outcome.peak_mib,
        scans_per_s=outcome.scans_per_s or 1e3 / float(np.mean(outcome.wall_ms)),
    )


def rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def ate_m(estimate: Trajectory, recording: Recording) -> float:
    absolute_m, _ = errors_of(estimate, recording)
    return rms(absolute_m)


def errors_of(estimate: Trajectory, recording: Recording) -> tuple[Array, Array]:
    """Absolute and relative, at equal times: the exact truth is taken at the estimate's.

    A reference knows the stamps only, so there the estimate is interpolated; stamps before its
    first pose (KISS-ICP's is half a turn late) are left out.
    """
    if not np.isfinite(estimate.positions).all():
        raise ValueError("the trajectory is not finite")
    truth = recording.truth()
    if recording.is_simulated:
        estimate = estimate.within(truth)
        truth = truth.at(estimate.times_s)
    else:
        truth = truth.within(estimate)
        estimate = estimate.at(truth.times_s)
    absolute_m = position_errors(estimate.positions, truth.positions)
    return absolute_m, relative_errors(estimate.matrices(), truth.matrices(), RPE_WAY_M)
