"""The peers that track. Each sees the same scans in turn; only its own work is timed."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from processes import own_cpu_s, own_peak_mib
from recording import Recording, Scan, deskewed
from se3 import Array, Trajectory, inverse, orthonormal

if TYPE_CHECKING:
    import small_gicp

Step = Callable[[Scan], tuple[float, Array]]  # scan to the time of its pose and T_map_sensor


@dataclass
class Outcome:
    """What a method made of a recording."""

    trajectory: Trajectory
    wall_ms: list[float] = field(default_factory=list)  # per scan
    cpu_ms: float | None = None  # per scan, all threads
    peak_mib: float | None = None  # of the whole process
    scans_per_s: float | None = None  # if it is not what follows from wall_ms


def timed_run(recording: Recording, step: Step, prepare: Callable[[Scan], Scan]) -> Outcome:
    """Reading and preparing are not timed."""
    times_s: list[float] = []
    poses: list[Array] = []
    wall_ms: list[float] = []
    cpu_s = 0.0
    for index in range(len(recording)):
        scan = prepare(recording.scan(index))
        cpu_start_s, start_s = own_cpu_s(), time.perf_counter()
        stamp_s, pose = step(scan)
        wall_ms.append((time.perf_counter() - start_s) * 1e3)
        cpu_s += own_cpu_s() - cpu_start_s
        times_s.append(stamp_s)
        poses.append(pose)
    trajectory = Trajectory.from_matrices(np.array(times_s), np.array(poses))
    return Outcome(trajectory, wall_ms, cpu_s * 1e3 / len(recording), own_peak_mib())


def no_offsets_if_none(scan: Scan) -> Array:
    """As KISS-ICP wants the times of points."""
    return scan.offsets_s if scan.offsets_s is not None else np.empty(0)


def run_kiss_icp(recording: Recording, threads: int) -> Outcome:
    """The package's C++ pipeline with its defaults (max_range 100 m, voxel 1 m).

    Its pose is that of the scan's END. Preprocessing.cpp moves a point at normalised time s (0 the
    first, 1 the last of the scan) by exp((s - 1) * omega), so the deskewed scan is seen from the
    last measurement. Measured too: test_peers.py lets a sensor move at constant velocity.
    Without times of points nothing is deskewed and the pose is taken for the stamp.
    """
    from kiss_icp.config import KISSConfig
    from kiss_icp.kiss_icp import KissICP

    config = KISSConfig()
    config.data.max_range = 100.0
    config.data.deskew = recording.has_point_times
    config.mapping.voxel_size = 1.0
    config.registration.max_num_threads = threads
    odometry = KissICP(config)

    def step(scan: Scan) -> tuple[float, Array]:
        odometry.register_frame(scan.points, no_offsets_if_none(scan))
        return scan.end_s, odometry.last_pose.copy()

    return timed_run(recording, step, prepare=lambda scan: scan)


def run_kiss_slam(recording: Recording, threads: int) -> Outcome:
    """KISS-ICP, MapClosures and a pose graph with their defaults; the poses are the final ones.

    They are of the scans' ends, as KISS-ICP's. The last optimisation counts for scans per second.
    """
    from kiss_slam.config import load_config
    from kiss_slam.slam import KissSLAM

    config = load_config(None)
    config.odometry.preprocessing.max_range = 100.0
    config.odometry.preprocessing.deskew = recording.has_point_times
    config.odometry.mapping.voxel_size = 1.0
    config.odometry.registration.max_num_threads = threads
    slam = KissSLAM(config)

    def step(scan: Scan) -> tuple[float, Array]:
        slam.process_scan(scan.points, no_offsets_if_none(scan))
        return scan.end_s, np.eye(4)

    outcome = timed_run(recording, step, prepare=lambda scan: scan)
    cpu_start_s, start_s = own_cpu_s(), time.perf_counter()
    slam.generate_new_node()
    slam.local_map_graph.erase_last_local_map()
    poses, _ = slam.fine_grained_optimization()
    finish_s = time.perf_counter() - start_s
    return Outcome(
        Trajectory.from_matrices(outcome.trajectory.times_s, np.array(poses)),
        outcome.wall_ms,
        outcome.cpu_ms + (own_cpu_s() - cpu_start_s) * 1e3 / len(recording),
        own_peak_mib(),
        len(recording) / (sum(outcome.wall_ms) / 1e3 + finish_s),
    )


class SmallGicp:
    """Scan to map with small_gicp: 0.4 m downsampling, k = 10, 1 m, constant-velocity guess."""

    DOWNSAMPLING_M = 0.4
    NEIGHBOURS = 10
    MAX_CORRESPONDENCE_M = 1.0
    VOXEL_M = 1.0

    def __init__(self, threads: int, voxelized: bool) -> None:
        import small_gicp

        self.gicp = small_gicp
        self.threads = threads
        self.voxelized = voxelized
        kind = small_gicp.GaussianVoxelMap if voxelized else small_gicp.IncrementalVoxelMap
        self.map = kind(self.VOXEL_M)
        self.pose = np.eye(4)
        self.motion = np.eye(4)

    def step(self, scan: Scan) -> tuple[float, Array]:
        cloud, _ = self.gicp.preprocess_points(
            scan.points, self.DOWNSAMPLING_M, self.NEIGHBOURS, self.threads
        )
        if self.map.size() > 0:
            self._track(cloud)
        self.map.insert(cloud, self.pose)
        return scan.middle_s, self.pose.copy()

    def _track(self, cloud: small_gicp.PointCloud) -> None:
        # Without re-orthonormalising, the guess amplifies rounding until it diverges.
        guess = orthonormal(self.pose @ self.motion)
        result = self._align(cloud, guess)
        pose = orthonormal(result.T_target_source)
        self.motion = inverse(self.pose) @ pose
        self.pose = pose

    def _align(self, cloud: small_gicp.PointCloud, guess: Array) -> small_gicp.RegistrationResult:
        options = {
            "max_correspondence_distance": self.MAX_CORRESPONDENCE_M,
            "num_threads": self.threads,
        }
        if self.voxelized:
            return self.gicp.align(self.map, cloud, guess, **options)
        # The Python API aligns to a tree only, so the map's tree and covariances are made anew for
        # every scan. The C++ API needs neither: judge this variant by its accuracy, not its time.
        target = self.gicp.PointCloud(self.map.voxel_points())
        tree = self.gicp.KdTree(target, self.threads)
        self.gicp.estimate_covariances(target, tree, self.NEIGHBOURS, self.threads)
        return self.gicp.align(target, cloud, tree, guess, **options)


def run_small_gicp(
    recording: Recording, threads: int, *, voxelized: bool, true_deskew: bool
) -> Outcome:
    """Raw scans have no one time: their pose is taken for the middle's."""
    odometry = SmallGicp(threads, voxelized)
    truth = recording.truth() if true_deskew else None

    def prepare(scan: Scan) -> Scan:
        if truth is None:
            return scan
        return Scan(scan.middle_s, deskewed(scan, truth), None)

    return timed_run(recording, odometry.step, prepare)
