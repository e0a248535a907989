"""One run of covsplat, measured: what the tables of ablations are made of."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

from covsplat_run import TRACKING, ate_m, frames_of, mesh_of_run, score_mesh, stage_ms
from processes import run_program
from recording import Recording
from variants import Variant

VOXEL_M = 0.1
TAU_M, FINE_TAU_M = 0.2, 0.05
KEEP = ("measures.json", "config.yaml", "metrics.json")


@dataclass(frozen=True)
class Measures:
    ate_m: float
    accuracy_cm: float
    completeness_cm: float
    chamfer_l1_cm: float
    f_percent: float
    strict_f_percent: float
    strict_f_fine_percent: float
    gaussians: float
    map_mb: float
    tracking_scans_per_s: float
    iterations: float
    unmatched_percent: float
    depth_error_cm: float


@dataclass(frozen=True)
class World:
    name: str
    folder: Path
    scans: int | None


@dataclass(frozen=True)
class Job:
    world: World
    seed: int
    variant: Variant


def measured(job: Job, covsplat: Path, out: Path, again: bool) -> Measures:
    """Runs, meshes and evaluates; a run with the same settings is not made twice.

    In lockstep: the same steps for every variant, the same result for any number of threads.
    """
    run = out / f"{job.world.name}-{job.seed}" / job.variant.name
    command = [str(covsplat), "run", str(job.world.folder), "-o", str(run)]
    command += ["--deterministic", "--threads", "1", "--overwrite", "--quiet"]
    command += [part for setting in job.variant.settings for part in ("-s", setting)]
    if job.world.scans is not None:
        command += ["-n", str(job.world.scans)]
    about = {"command": command[1:], "program": version(covsplat)}
    cache = run / "measures.json"
    if cache.is_file() and not again:
        known = json.loads(cache.read_text())
        if known["about"] == about:
            return Measures(**known["measures"])
    run_program(command)
    measures = evaluate(covsplat, run, job.world.folder)
    cache.write_text(json.dumps({"about": about, "measures": asdict(measures)}, indent=2) + "\n")
    for path in run.iterdir():
        if path.name not in KEEP:
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    return measures


def evaluate(covsplat: Path, run: Path, recording: Path) -> Measures:
    mesh, trajectory = run / "mesh.ply", run / "trajectory_tum.txt"
    mesh_of_run(covsplat, run, mesh, VOXEL_M, threads=1)
    score = score_mesh(
        covsplat, mesh, Recording.open(recording), (TAU_M, FINE_TAU_M), 1, trajectory
    )
    metrics = json.loads((run / "metrics.json").read_text())
    frames = [frame for frame in frames_of(run) if int(frame["iterations"]) > 0]
    return Measures(
        ate_m=ate_m(covsplat, trajectory, recording / "gt_tum.txt"),
        accuracy_cm=score.paper.accuracy_cm,
        completeness_cm=score.paper.completeness_cm,
        chamfer_l1_cm=score.paper.chamfer_l1_cm,
        f_percent=score.paper.f_percent[TAU_M],
        strict_f_percent=score.strict.f_percent[TAU_M],
        strict_f_fine_percent=score.strict.f_percent[FINE_TAU_M],
        gaussians=metrics["map"]["gaussians"],
        map_mb=metrics["map"]["file_bytes"] / 1e6,
        tracking_scans_per_s=1e3 / mean(frames, lambda frame: stage_ms(frame, TRACKING)),
        iterations=mean(frames, lambda frame: float(frame["iterations"])),
        unmatched_percent=100.0 * mean(frames, unmatched),
        depth_error_cm=100.0 * metrics["held_out"]["after"]["mean_abs_m"],
    )


def unmatched(frame: dict[str, str]) -> float:
    return 1.0 - int(frame["correspondences"]) / max(1, int(frame["source_points"]))


def mean(frames: list[dict[str, str]], value: Callable[[dict[str, str]], float]) -> float:
    return sum(map(value, frames)) / max(1, len(frames))


def version(covsplat: Path) -> str:
    """Of the program's bytes: a version's number does not change with every change."""
    return hashlib.sha256(covsplat.read_bytes()).hexdigest()
