"""What loops were worth: which were wrong, which were missed, and whether walls are double."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from recording import Recording
from se3 import Array, Trajectory, rotations_of, ways_along

# A loop that is farther off is one of another place.
WRONG_M = 0.5
WRONG_DEG = 3.0
# A revisit: on the same level, this near to a way that was gone long before.
NEAR_M = 10.0
LEVEL_M = 1.0
LONG_BEFORE_M = 30.0
SHORTEST_M = 5.0
# Surfaces of two passes that are to be one: of Gaussians that are this near to each other, face the
# same way and can be seen, within the disc that is drawn of one.
REACH_M = 0.4
SAME_WALL_DEG = 20.0
MIN_OPACITY = 0.5
DISC_SIGMAS = 3.0
# Of ways between two Gaussians' keyframes: those of two passes, and those of one.
TWO_PASSES_M = (LONG_BEFORE_M, np.inf)
ONE_PASS_M = (1.0, 10.0)


@dataclass(frozen=True)
class Loop:
    old: int
    new: int
    T_old_new: Array


@dataclass(frozen=True)
class LoopFacts:
    looked_at: int
    accepted: int
    wrong: int | None = None  # these need the truth
    worst_m: float | None = None
    revisits: int | None = None
    found: int | None = None


def loop_facts(run: Path, recording: Recording) -> LoopFacts:
    with (run / "loops.csv").open(newline="") as lines:
        looked_at = len(list(csv.DictReader(lines)))
    loops = read_loops(run / "pose_graph.g2o")
    if not recording.is_simulated:
        return LoopFacts(looked_at, len(loops))
    keyframes = Trajectory.read_tum(run / "keyframes_tum.txt")
    truth = recording.truth().at(keyframes.times_s).matrices()
    errors = [np.linalg.inv(T_between(truth, loop)) @ loop.T_old_new for loop in loops]
    errors_m = [float(np.linalg.norm(error[:3, 3])) for error in errors]
    wrong = sum(is_wrong(error) for error in errors)
    revisits = revisits_of(truth)
    found = [any(loop.new in revisit for loop in loops) for revisit in revisits]
    return LoopFacts(
        looked_at, len(loops), wrong, max(errors_m, default=None), len(revisits), sum(found)
    )


def read_loops(g2o: Path) -> list[Loop]:
    """The edges that are no steps from one keyframe to the next."""
    loops = []
    for line in g2o.read_text().splitlines():
        words = line.split()
        if not words or words[0] != "EDGE_SE3:QUAT" or int(words[2]) == int(words[1]) + 1:
            continue
        x, y, z, qx, qy, qz, qw = map(float, words[3:10])
        pose = np.eye(4)
        pose[:3, :3] = rotations_of(np.array([[qw, qx, qy, qz]]))[0]
        pose[:3, 3] = x, y, z
        loops.append(Loop(int(words[1]), int(words[2]), pose))
    return loops


def T_between(poses: Array, loop: Loop) -> Array:
    return np.linalg.inv(poses[loop.old]) @ poses[loop.new]


def is_wrong(error: Array) -> bool:
    cosine = np.clip((np.trace(error[:3, :3]) - 1) / 2, -1.0, 1.0)
    return bool(
        np.linalg.norm(error[:3, 3]) > WRONG_M or np.degrees(np.arccos(cosine)) > WRONG_DEG
    )


def revisits_of(truth: Array) -> list[range]:
    """Stretches of keyframes that go where the way had been long before."""
    positions = truth[:, :3, 3]
    way_m = ways_along(positions)
    again = [any_near(positions, way_m, k) for k in range(len(positions))]
    revisits, begin = [], None
    for k, is_again in enumerate([*again, False]):
        if is_again and begin is None:
            begin = k
        if not is_again and begin is not None:
            if way_m[k - 1] - way_m[begin] >= SHORTEST_M:
                revisits.append(range(begin, k))
            begin = None
    return revisits


def any_near(positions: Array, way_m: Array, k: int) -> bool:
    before = positions[way_m < way_m[k] - LONG_BEFORE_M] - positions[k]
    near = (np.linalg.norm(before[:, :2], axis=1) < NEAR_M) & (np.abs(before[:, 2]) < LEVEL_M)
    return bool(near.any())


@dataclass(frozen=True)
class Thickness:
    """Distances between surfaces that a run has left of the same wall."""

    two_passes_m: Array
    one_pass_m: Array  # as far apart as noise and local drift leave them, whatever loops do


def thickness(run: Path) -> Thickness:
    surfels, keyframe = read_surfels(run / "map.ply")
    passes_m = ways_along(Trajectory.read_tum(run / "keyframes_tum.txt").positions)[keyframe]
    return Thickness(
        passes_apart_m(surfels, passes_m, TWO_PASSES_M),
        passes_apart_m(surfels, passes_m, ONE_PASS_M),
    )


def passes_apart_m(surfels: Surfels, passes_m: Array, ways_m: tuple[float, float]) -> Array:
    """Of each Gaussian to the disc that it lies over of one whose keyframe is `ways_m` away.
    Beyond a disc its plane tells nothing: there it meets another surface. `passes_m`: on the way of
    the sensor, where each Gaussian was seen first."""
    kept = (surfels.opacity > MIN_OPACITY) & np.isfinite(surfels.positions).all(1)
    surfels, passes_m = surfels.at(kept), passes_m[kept]
    normals = surfels.axes[:, :, 2]
    tree = cKDTree(surfels.positions)
    found = []
    for i, near in enumerate(tree.query_ball_point(surfels.positions, REACH_M)):
        others = np.array(near)
        way_m = np.abs(passes_m[others] - passes_m[i])
        others = others[(way_m > ways_m[0]) & (way_m < ways_m[1])]
        others = others[normals[others] @ normals[i] > np.cos(np.radians(SAME_WALL_DEG))]
        if not len(others):
            continue
        apart = surfels.positions[i] - surfels.positions[others]
        in_disc = np.einsum("nij,ni->nj", surfels.axes[others], apart)
        sigmas = np.hypot(*(in_disc[:, :2] / surfels.sigma_m[others]).T)
        over = sigmas.argmin()
        if sigmas[over] <= DISC_SIGMAS:
            found.append(abs(in_disc[over, 2]))
    return np.array(found)


@dataclass(frozen=True)
class Surfels:
    positions: Array
    axes: Array  # columns: both directions of the disc, normal
    sigma_m: Array  # of both directions
    opacity: Array

    def at(self, kept: Array) -> Surfels:
        return Surfels(
            self.positions[kept], self.axes[kept], self.sigma_m[kept], self.opacity[kept]
        )


def read_surfels(ply: Path) -> tuple[Surfels, Array]:
    """With the keyframe of each."""
    raw = ply.read_bytes()
    end = raw.index(b"end_header\n") + len(b"end_header\n")
    words = [line.split() for line in raw[:end].decode().splitlines()]
    names = [line[2] for line in words if line[0] == "property"]
    count = next(int(line[2]) for line in words if line[:2] == ["element", "vertex"])
    table = np.frombuffer(raw[end:], dtype=[(name, "<f4") for name in names], count=count)

    def columns(*names: str) -> Array:
        return np.stack([table[name] for name in names], 1).astype(float)

    quaternions = columns("rot_0", "rot_1", "rot_2", "rot_3")
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    surfels = Surfels(
        columns("x", "y", "z"),
        rotations_of(quaternions),
        np.exp(columns("scale_0", "scale_1")),
        1 / (1 + np.exp(-table["opacity"].astype(float))),
    )
    return surfels, table["keyframe"].astype(int)
