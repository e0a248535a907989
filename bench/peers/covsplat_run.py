"""Runs the covsplat binary and reads what it wrote."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path

from peers import Outcome
from processes import Finished, run_program
from recording import Recording
from se3 import Trajectory

TRACKING = ("preprocess", "align", "deskew")


def base_command(binary: Path, recording: Recording, out: Path, threads: int) -> list[str]:
    """Of a run, with what the recording needs."""
    command = [str(binary), "run", str(recording.folder), "-o", str(out), "--overwrite"]
    command += ["--threads", str(threads)]
    if recording.azimuth_period_s is not None:
        command += ["-s", "deskew.time_source=azimuth"]
        command += ["-s", f"deskew.scan_period_s={recording.azimuth_period_s}"]
    return command


def simulate_seed(binary: Path, world: str, seed: int, folder: Path) -> None:
    """A world of a kind, by the sensor and motion that fit it."""
    sensor, motion = ("hdl-64e", "vehicle") if world == "street" else ("os1-64", "walking")
    command = [str(binary), "simulate", world, "--sensor", sensor, "--motion", motion]
    run_program([*command, "--seed", str(seed), "-o", str(folder), "--overwrite", "--quiet"])


def run_covsplat(
    binary: Path, recording: Recording, out: Path, threads: int, flags: tuple[str, ...]
) -> Outcome:
    """Its scans per second are those of the whole run, the mapper's work included.

    The times per scan are the tracker's ("scan in to pose out"). CPU time and peak memory are the
    process's, with reading, mapping and writing: upper bounds next to the peers'.
    """
    done = run_program([*base_command(binary, recording, out, threads), *flags])
    return Outcome(
        Trajectory.read_tum(out / "trajectory_tum.txt"),
        track_times(out),
        done.cpu_s * 1e3 / len(recording),
        done.peak_mib,
        scans_per_s(out),
    )


def frames_of(out: Path) -> list[dict[str, str]]:
    """Of a run, what became of each scan."""
    with (out / "frames.csv").open(newline="") as lines:
        return list(csv.DictReader(lines))


def stage_ms(frame: dict[str, str], stages: tuple[str, ...]) -> float:
    return sum(float(frame[f"{stage}_ms"]) for stage in stages)


def track_times(out: Path) -> list[float]:
    rows = frames_of(out)
    if not rows or "track_ms" not in rows[0]:
        raise RuntimeError(f"{out / 'frames.csv'}: no column track_ms")
    return [float(row["track_ms"]) for row in rows]


def ate_m(binary: Path, trajectory: Path, truth: Path) -> float:
    command = [str(binary), "eval", "traj", str(trajectory), str(truth), "--json"]
    return json.loads(run_program(command).stdout)["ate_translation_m"]["rmse"]


def scans_per_s(out: Path) -> float | None:
    metrics = json.loads((out / "metrics.json").read_text())
    value = metrics.get("time", {}).get("scans_per_s")
    return None if value is None else float(value)


@dataclass(frozen=True)
class SurfaceScore:
    """By one protocol of `covsplat eval map`; docs/metrics.md defines both."""

    accuracy_cm: float
    completeness_cm: float
    chamfer_l1_cm: float
    f_percent: dict[float, float]  # by tau in metres

    @staticmethod
    def of(errors: dict) -> SurfaceScore:
        return SurfaceScore(
            errors["accuracy_cm"],
            errors["completeness_cm"],
            errors["chamfer_l1_cm"],
            {score["tau_m"]: score["f_score_percent"] for score in errors["scores"]},
        )


@dataclass(frozen=True)
class MeshScore:
    triangles: int
    paper: SurfaceScore
    strict: SurfaceScore


def mesh_of_run(binary: Path, out: Path, mesh: Path, voxel_m: float, threads: int) -> Finished:
    command = [str(binary), "mesh", str(out), "-o", str(mesh), "--voxel", str(voxel_m)]
    return run_program([*command, "--threads", str(threads), "--quiet"])


def score_mesh(
    binary: Path,
    mesh: Path,
    recording: Recording,
    taus_m: tuple[float, ...],
    threads: int,
    trajectory: Path | None,
    voxel_m: float | None = None,
) -> MeshScore:
    """`trajectory`: that the mesh was made with, if not the truth; aligns it with the truth.

    `voxel_m`: of the comparison, if not the program's default.
    """
    command = [str(binary), "eval", "map", str(mesh), str(recording.true_mesh)]
    command += ["--recording", str(recording.folder), "--threads", str(threads)]
    command += ["--tau", ",".join(str(tau_m) for tau_m in taus_m), "--json", "--quiet"]
    if trajectory is not None:
        command += ["--trajectory", str(trajectory)]
    if voxel_m is not None:
        command += ["--voxel", str(voxel_m)]
    found = json.loads(run_program(command).stdout)
    return MeshScore(
        found["result"]["triangles"],
        SurfaceScore.of(found["paper"]),
        SurfaceScore.of(found["strict"]),
    )
