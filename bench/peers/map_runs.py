"""Who makes a surface of a recording, and how good it is; all are judged by the same program."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import map_peers
from covsplat_run import MeshScore, SurfaceScore, mesh_of_run, scans_per_s, score_mesh
from processes import apart
from recording import Recording
from report import number
from track_runs import covsplat_folder

TAUS_M = (0.2, 0.1, 0.05)
HEADER = (
    "recording",
    "method",
    "poses",
    "Acc cm",
    "Com cm",
    "C-L1 cm",
    *(f"F {tau_m:g} m" for tau_m in TAUS_M),
    "strict C-L1 cm",
    *(f"strict F {tau_m:g} m" for tau_m in TAUS_M),
    "scans/s",
    "meshing s",
    "peak MiB",
    "map MiB",
    "mesh MiB",
    "triangles",
)


@dataclass(frozen=True)
class Setting:
    """What all methods on a recording share."""

    covsplat: Path
    recording: Recording
    out: Path
    voxel_m: float
    threads: int


@dataclass(frozen=True)
class Row:
    """One surface; `failure` says why there are no numbers."""

    recording: str
    method: str
    poses: str
    scores: MeshScore | None = None
    scans_per_s: float | None = None
    mesh_s: float | None = None
    peak_mib: float | None = None
    map_mib: float | None = None
    mesh_mib: float | None = None
    failure: str | None = None


Make = Callable[[], map_peers.MapOutcome]
TRUE, ESTIMATED = "true", "covsplat's"


def methods(setting: Setting) -> Iterator[tuple[str, Make]]:
    """The name of a method ends with whose poses it takes."""
    recording, voxel_m, meshes = setting.recording, setting.voxel_m, setting.out
    estimated = covsplat_folder(setting.out) / "trajectory_tum.txt"
    for name in ("covsplat", "covsplat, lockstep"):
        yield f"{name}; {ESTIMATED}", partial(mesh_covsplat, setting, name)
    tsdf = partial(map_peers.run_tsdf_fusion, recording, voxel_m)
    for name, poses, file, trajectory, truncation_voxels in (
        ("TSDF fusion (as VDBFusion)", TRUE, "tsdf_true_poses.ply", None, 3.0),
        ("TSDF fusion (as VDBFusion)", ESTIMATED, "tsdf_covsplat_poses.ply", estimated, 3.0),
        ("TSDF fusion, truncation 2 voxels", TRUE, "tsdf_truncation_2.ply", None, 2.0),
    ):
        run = partial(tsdf, meshes / file, trajectory, truncation_voxels)
        yield f"{name}; {poses}", partial(apart, run)
    poisson = partial(
        map_peers.run_poisson, recording, voxel_m, meshes / "poisson.ply", setting.threads
    )
    yield f"Poisson (Open3D); {TRUE}", partial(apart, poisson)


def mesh_covsplat(setting: Setting, name: str) -> map_peers.MapOutcome:
    """Of the run that the table of trajectories shows; its scans per second include mapping."""
    run = covsplat_folder(setting.out, name)
    if not (run / "metrics.json").is_file():
        raise RuntimeError(f"{run}: no run of covsplat; let --only choose its track as well")
    mesh = run.with_suffix(".ply")
    meshed = mesh_of_run(setting.covsplat, run, mesh, setting.voxel_m, setting.threads)
    metrics = json.loads((run / "metrics.json").read_text())
    tracking_mib = metrics["memory"]["peak_rss_bytes"] / 2**20
    scans = len(setting.recording)
    return map_peers.MapOutcome(
        mesh,
        scans,
        scans / (scans_per_s(run) or float("inf")),
        meshed.wall_s,
        max(tracking_mib, meshed.peak_mib),
        metrics["map"]["file_bytes"] / 2**20,
        run / "trajectory_tum.txt",
    )


def strict_f_percent(
    recording: Recording,
    run: Path,
    options: argparse.Namespace,
    compared_voxel_m: float | None = None,
) -> tuple[float, float] | None:
    """Of a run of covsplat, at 0.1 and 0.05 m; nothing where there is no truth or none is asked."""
    if recording.true_mesh is None or recording.name in options.no_map:
        return None
    mesh = run / "mesh.ply"
    mesh_of_run(options.covsplat, run, mesh, options.voxel, options.threads)
    score = score_mesh(
        options.covsplat,
        mesh,
        recording,
        (0.1, 0.05),
        options.threads,
        run / "trajectory_tum.txt",
        compared_voxel_m,
    )
    return score.strict.f_percent[0.1], score.strict.f_percent[0.05]


def measure(setting: Setting, chosen: Sequence[tuple[str, Make]]) -> list[Row]:
    """Surfaces are made one after the other, for the sake of the times, and judged all at once."""
    made = [(name, attempt(make)) for name, make in chosen]
    with ThreadPoolExecutor(setting.threads) as pool:
        return list(pool.map(lambda one: judge(setting, *one), made))


def attempt(make: Make) -> map_peers.MapOutcome | Exception:
    try:
        return make()
    except Exception as error:  # a failed method is a row of the table, not the end of the others
        return error


def judge(setting: Setting, name: str, made: map_peers.MapOutcome | Exception) -> Row:
    method, _, poses = name.partition("; ")
    failed = partial(Row, setting.recording.name, method, poses)
    if isinstance(made, Exception):
        return failed(failure=str(made))
    try:
        scores = score_mesh(
            setting.covsplat, made.mesh, setting.recording, TAUS_M, 1, made.trajectory
        )
    except Exception as error:
        return failed(failure=str(error))
    return Row(
        setting.recording.name,
        method,
        poses,
        scores,
        made.scans / made.fuse_s if made.fuse_s > 0 else None,
        made.mesh_s,
        made.peak_mib,
        made.map_mib,
        made.mesh.stat().st_size / 2**20,
    )


def cells(row: Row) -> list[str]:
    method = row.method if row.failure is None else f"{row.method}: **failed**, {row.failure}"
    paper, strict = (None, None) if row.scores is None else (row.scores.paper, row.scores.strict)
    return [
        row.recording,
        method.replace("|", "\\|").replace("\n", " "),
        row.poses,
        *(number(value, 2) for value in distances(paper)),
        *(number(value, 2) for value in f_scores(paper)),
        number(None if strict is None else strict.chamfer_l1_cm, 2),
        *(number(value, 2) for value in f_scores(strict)),
        number(row.scans_per_s, 1),
        number(row.mesh_s, 1),
        number(row.peak_mib, 0),
        number(row.map_mib, 1),
        number(row.mesh_mib, 1),
        "-" if row.scores is None else str(row.scores.triangles),
    ]


def distances(score: SurfaceScore | None) -> tuple[float | None, ...]:
    if score is None:
        return (None, None, None)
    return (score.accuracy_cm, score.completeness_cm, score.chamfer_l1_cm)


def f_scores(score: SurfaceScore | None) -> list[float | None]:
    return [None if score is None else score.f_percent.get(tau_m) for tau_m in TAUS_M]
