"""Poses as 4x4 matrices and trajectories with times; conventions as in docs/conventions.md."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """T_world_sensor at increasing times."""

    times_s: Array  # [N]
    positions: Array  # [N, 3] m
    quaternions: Array  # [N, 4] w x y z, unit length

    @staticmethod
    def from_matrices(times_s: Array, poses: Array) -> Trajectory:
        quaternions = np.array([quaternion_of(pose[:3, :3]) for pose in poses]).reshape(-1, 4)
        return Trajectory(np.asarray(times_s, float), poses[:, :3, 3], quaternions)

    @staticmethod
    def read_tum(path: Path) -> Trajectory:
        rows = np.loadtxt(path, comments="#", ndmin=2)
        quaternions = rows[:, [7, 4, 5, 6]]
        quaternions = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
        return Trajectory(rows[:, 0], rows[:, 1:4], quaternions)

    def write_tum(self, path: Path) -> None:
        rows = np.column_stack([self.times_s, self.positions, self.quaternions[:, [1, 2, 3, 0]]])
        np.savetxt(path, rows, fmt="%.9f")

    def covers(self, times_s: Array) -> NDArray[np.bool_]:
        # TUM files carry nanoseconds: a pose at a stamp must not miss it by rounding.
        slack_s = 1e-6
        first, last = self.times_s[0] - slack_s, self.times_s[-1] + slack_s
        return (times_s >= first) & (times_s <= last)

    def within(self, other: Trajectory) -> Trajectory:
        """The poses at times that the other one covers."""
        covered = other.covers(self.times_s)
        return Trajectory(self.times_s[covered], self.positions[covered], self.quaternions[covered])

    def at(self, times_s: Array) -> Trajectory:
        """Positions linear, rotations on the great circle; all times must be covered."""
        times_s = np.asarray(times_s, float)
        if len(self.times_s) == 1:
            count = len(times_s)
            return Trajectory(
                times_s, np.repeat(self.positions, count, 0), np.repeat(self.quaternions, count, 0)
            )
        after = np.clip(np.searchsorted(self.times_s, times_s), 1, len(self.times_s) - 1)
        before = after - 1
        span_s = self.times_s[after] - self.times_s[before]
        weight = np.clip((times_s - self.times_s[before]) / span_s, 0.0, 1.0)[:, None]
        positions = (1 - weight) * self.positions[before] + weight * self.positions[after]
        rotations = slerp(self.quaternions[before], self.quaternions[after], weight)
        return Trajectory(times_s, positions, rotations)

    def pose_at(self, time_s: float) -> Array:
        return self.at(np.array([time_s])).matrices()[0]

    def matrices(self) -> Array:
        """[N, 4, 4]"""
        poses = np.tile(np.eye(4), (len(self.times_s), 1, 1))
        poses[:, :3, :3] = rotations_of(self.quaternions)
        poses[:, :3, 3] = self.positions
        return poses


def slerp(first: Array, second: Array, weight: Array) -> Array:
    cosine = np.sum(first * second, axis=1, keepdims=True)
    second = np.where(cosine < 0, -second, second)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    sine = np.maximum(np.sin(angle), 1e-12)
    near = angle < 1e-6
    first_share = np.where(near, 1 - weight, np.sin((1 - weight) * angle) / sine)
    second_share = np.where(near, weight, np.sin(weight * angle) / sine)
    mixed = first_share * first + second_share * second
    return mixed / np.linalg.norm(mixed, axis=1, keepdims=True)


def quaternion_of(rotation: Array) -> Array:
    """w x y z; Shepperd's choice of the largest component."""
    r = rotation
    squares = 1 + np.array(
        [
            r[0, 0] + r[1, 1] + r[2, 2],
            r[0, 0] - r[1, 1] - r[2, 2],
            r[1, 1] - r[0, 0] - r[2, 2],
            r[2, 2] - r[0, 0] - r[1, 1],
        ]
    )
    wx, wy, wz = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    xy, xz, yz = r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1]
    rows = np.array(
        [
            [squares[0], wx, wy, wz],
            [wx, squares[1], xy, xz],
            [wy, xy, squares[2], yz],
            [wz, xz, yz, squares[3]],
        ]
    )
    quaternion = rows[int(np.argmax(squares))]
    return quaternion / np.linalg.norm(quaternion)


def rotations_of(quaternions: Array) -> Array:
    """[N, 4] w x y z to [N, 3, 3]."""
    w, x, y, z = quaternions.T
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1),
        ],
        -2,
    )


def orthonormal(pose: Array) -> Array:
    """The nearest proper rigid transform."""
    u, _, vt = np.linalg.svd(pose[:3, :3])
    result = np.eye(4)
    result[:3, :3] = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    result[:3, 3] = pose[:3, 3]
    return result


def inverse(pose: Array) -> Array:
    result = np.eye(4)
    result[:3, :3] = pose[:3, :3].T
    result[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return result


def position_errors(estimate: Array, truth: Array) -> Array:
    """Distances [N] after the rigid (no scale) least-squares alignment of the positions."""
    centre_e, centre_t = estimate.mean(0), truth.mean(0)
    u, _, vt = np.linalg.svd((truth - centre_t).T @ (estimate - centre_e))
    rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    aligned = (estimate - centre_e) @ rotation.T + centre_t
    return np.linalg.norm(aligned - truth, axis=1)


def ways_along(positions: Array) -> Array:
    """From the first position to each, along all between."""
    way_m = np.zeros(len(positions))
    way_m[1:] = np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))
    return way_m


def relative_errors(estimate: Array, truth: Array, distance_m: float) -> Array:
    """Errors in metres of the motion over consecutive steps of poses [N, 4, 4].

    A step ends at the first pose from which the truth's way since the start of the step is
    `distance_m` or more (docs/metrics.md).
    """
    way_m = ways_along(truth[:, :3, 3])
    ends = [0]
    while (end := int(np.searchsorted(way_m, way_m[ends[-1]] + distance_m - 1e-9))) < len(truth):
        ends.append(end)
    first, last = ends[:-1], ends[1:]
    true_motion = np.linalg.inv(truth[first]) @ truth[last]
    motion = np.linalg.inv(estimate[first]) @ estimate[last]
    return np.linalg.norm((np.linalg.inv(true_motion) @ motion)[:, :3, 3], axis=1)
