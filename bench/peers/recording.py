"""Reads a recording: velodyne/*.bin, timestamps/*.bin, times.txt and whatever it is measured by."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from se3 import Array, Trajectory, inverse, rotations_of


@dataclass(frozen=True)
class Scan:
    """Points as measured; each one's time counts from the stamp."""

    stamp_s: float
    points: Array  # [N, 3] m, sensor frame at each point's own time
    offsets_s: Array | None  # [N]

    @property
    def middle_s(self) -> float:
        if self.offsets_s is None:
            return self.stamp_s
        return self.stamp_s + float(self.offsets_s.min() + self.offsets_s.max()) / 2

    @property
    def start_s(self) -> float:
        return self.stamp_s + (0.0 if self.offsets_s is None else float(self.offsets_s.min()))

    @property
    def end_s(self) -> float:
        return self.stamp_s + (0.0 if self.offsets_s is None else float(self.offsets_s.max()))


@dataclass(frozen=True)
class Recording:
    folder: Path
    stamps_s: Array
    azimuth_period_s: float | None  # turn of a clockwise sensor whose points have no times

    @staticmethod
    def open(folder: Path, azimuth_period_s: float | None = None) -> Recording:
        stamps_s = np.loadtxt(folder / "times.txt", ndmin=1)
        scans = len(list((folder / "velodyne").glob("*.bin")))
        if scans == 0 or scans != len(stamps_s):
            raise SystemExit(f"{folder}: {scans} scans but {len(stamps_s)} lines in times.txt")
        return Recording(folder, stamps_s, azimuth_period_s)

    @property
    def name(self) -> str:
        return self.folder.resolve().name

    @property
    def is_simulated(self) -> bool:
        return (self.folder / "gt_tum.txt").is_file()

    @property
    def has_point_times(self) -> bool:
        return self.azimuth_period_s is not None or (self.folder / "timestamps").is_dir()

    @property
    def true_mesh(self) -> Path | None:
        path = self.folder / "gt_mesh.ply"
        return path if path.is_file() else None

    def __len__(self) -> int:
        return len(self.stamps_s)

    def scan(self, index: int) -> Scan:
        path = self.folder / "velodyne" / f"{index:06d}.bin"
        points = np.fromfile(path, np.float32).reshape(-1, 4)[:, :3].astype(np.float64)
        offsets_s = self._offsets(index, points)
        keep = np.isfinite(points).all(1) & (np.abs(points).max(1, initial=0.0) > 0)
        kept_offsets_s = None if offsets_s is None else offsets_s[keep]
        return Scan(float(self.stamps_s[index]), points[keep], kept_offsets_s)

    def _offsets(self, index: int, points: Array) -> Array | None:
        if self.azimuth_period_s is not None:
            # Clockwise from the rear, facing forward at the stamp (INDEX.md of the recordings).
            azimuth_rad = np.arctan2(points[:, 1], points[:, 0])
            return -azimuth_rad / (2 * np.pi) * self.azimuth_period_s
        path = self.folder / "timestamps" / f"{index:06d}.bin"
        return np.fromfile(path, np.float32).astype(np.float64) if path.is_file() else None

    def truth(self) -> Trajectory:
        """Exact and at any time if simulated, else the reference at the stamps."""
        if self.is_simulated:
            return Trajectory.read_tum(self.folder / "gt_tum.txt")
        rows = np.loadtxt(self.folder / "poses_reference.txt", ndmin=2).reshape(-1, 3, 4)
        poses = np.concatenate([rows, np.tile([[[0.0, 0, 0, 1]]], (len(rows), 1, 1))], 1)
        return Trajectory.from_matrices(self.stamps_s, poses)


def azimuth_periods(texts: list[str]) -> dict[str, float]:
    """Of NAME=SECONDS: the turn of each recording whose points' times follow from their azimuth."""
    periods = {}
    for text in texts:
        name, separator, seconds = text.partition("=")
        if not separator:
            raise SystemExit(f"--azimuth-time {text}: expected NAME=SECONDS")
        periods[name] = float(seconds)
    return periods


def marked(data: Path | None, mark: str) -> list[Path]:
    """The recordings that INDEX.md marks so; none if there is no such folder."""
    if data is None or not (data / "INDEX.md").is_file():
        return []
    columns = (line.split("|") for line in (data / "INDEX.md").read_text().splitlines())
    names = [row[1].strip(" `") for row in columns if len(row) > 2 and mark in row[2]]
    return [data / name for name in names if (data / name / "velodyne").is_dir()]


def deskewed(scan: Scan, trajectory: Trajectory) -> Array:
    """The points in the sensor's frame at the middle of the scan, moved with the trajectory."""
    if scan.offsets_s is None:
        return scan.points
    times_s, which = np.unique(scan.stamp_s + scan.offsets_s, return_inverse=True)
    poses = trajectory.at(times_s)
    T_middle_world = inverse(trajectory.pose_at(scan.middle_s))
    rotations = T_middle_world[:3, :3] @ rotations_of(poses.quaternions)
    positions = poses.positions @ T_middle_world[:3, :3].T + T_middle_world[:3, 3]
    return np.einsum("nij,nj->ni", rotations[which], scan.points) + positions[which]


def placed(scan: Scan, trajectory: Trajectory) -> tuple[Array, Array] | None:
    """Deskewed points and the sensor's position at the middle, in the trajectory's world.

    Nothing for a scan that the trajectory does not wholly cover: its skew is not known.
    """
    if not len(scan.points) or not trajectory.covers(np.array([scan.start_s, scan.end_s])).all():
        return None
    pose = trajectory.pose_at(scan.middle_s)
    points = deskewed(scan, trajectory)
    return points @ pose[:3, :3].T + pose[:3, 3], pose[:3, 3]
