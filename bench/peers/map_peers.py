"""The peers that make surfaces of scans whose poses they are given."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from processes import own_peak_mib
from recording import Recording, placed
from se3 import Array, Trajectory
from surface_mesh import SurfaceMesh
from tsdf_fusion import TsdfVolume


@dataclass(frozen=True)
class MapOutcome:
    """What a method made of a recording; reading and deskewing are not timed."""

    mesh: Path
    scans: int
    fuse_s: float  # scans into the map
    mesh_s: float  # the map into triangles
    peak_mib: float
    map_mib: float
    trajectory: Path | None = None  # in whose world the mesh is; none: the truth's


def placed_scans(recording: Recording, trajectory: Trajectory) -> Iterator[tuple[Array, Array]]:
    """Points [N, 3] and the sensor's position, in the trajectory's world."""
    for index in range(len(recording)):
        scan = placed(recording.scan(index), trajectory)
        if scan is not None:
            yield scan


def run_tsdf_fusion(
    recording: Recording,
    voxel_m: float,
    mesh: Path,
    trajectory: Path | None,
    truncation_voxels: float,
) -> MapOutcome:
    """With the true poses, or those of a TUM file."""
    poses = recording.truth() if trajectory is None else Trajectory.read_tum(trajectory)
    volume = TsdfVolume(voxel_m, truncation_voxels)
    scans, fuse_s = 0, 0.0
    for points, origin in placed_scans(recording, poses):
        start_s = time.perf_counter()
        volume.integrate(points, origin)
        fuse_s += time.perf_counter() - start_s
        scans += 1
    start_s = time.perf_counter()
    surface = volume.mesh()
    mesh_s = time.perf_counter() - start_s
    surface.write_ply(mesh)
    map_mib = volume.bytes / 2**20
    return MapOutcome(mesh, scans, fuse_s, mesh_s, own_peak_mib(), map_mib, trajectory)


class PoissonCloud:
    """All scans as one cloud, thinned as it grows, and its surface by Open3D."""

    NEIGHBOURS = 30  # of a normal
    TRIM = 0.05  # share of the vertices that is cut where the points are sparsest
    THIN_EVERY = 20  # scans
    MAX_DEPTH = 11  # of the octree: memory and hours grow eightfold with each

    def __init__(self, voxel_m: float) -> None:
        import open3d

        self.open3d = open3d
        self.voxel_m = voxel_m
        self.cloud = open3d.geometry.PointCloud()
        self.scans = 0

    def integrate(self, points: Array, origin: Array) -> None:
        """The way to the sensor travels in the place of the normal, which it orients later."""
        scan = self.open3d.geometry.PointCloud()
        scan.points = self.open3d.utility.Vector3dVector(points)
        to_sensor = origin - points
        to_sensor /= np.linalg.norm(to_sensor, axis=1, keepdims=True)
        scan.normals = self.open3d.utility.Vector3dVector(to_sensor)
        self.cloud += scan.voxel_down_sample(self.voxel_m / 2)
        self.scans += 1
        if self.scans % self.THIN_EVERY == 0:
            self._thin()

    def _thin(self) -> None:
        self.cloud = self.cloud.voxel_down_sample(self.voxel_m / 2)

    def mesh(self, threads: int) -> SurfaceMesh:
        self._thin()
        to_sensor = np.asarray(self.cloud.normals).copy()
        self.cloud.estimate_normals(self.open3d.geometry.KDTreeSearchParamKNN(self.NEIGHBOURS))
        normals = np.asarray(self.cloud.normals)
        normals[np.einsum("ij,ij->i", normals, to_sensor) < 0] *= -1
        kind = self.open3d.geometry.TriangleMesh
        surface, densities = kind.create_from_point_cloud_poisson(
            self.cloud, depth=self._depth(), n_threads=threads
        )
        densities = np.asarray(densities)
        surface.remove_vertices_by_mask(densities < np.quantile(densities, self.TRIM))
        return SurfaceMesh(np.asarray(surface.vertices), np.asarray(surface.triangles))

    def _depth(self) -> int:
        """Of an octree whose finest cells are about as large as a voxel."""
        cube_m = 1.1 * float(np.max(self.cloud.get_axis_aligned_bounding_box().get_extent()))
        return int(np.clip(np.ceil(np.log2(cube_m / self.voxel_m)), 5, self.MAX_DEPTH))


def run_poisson(recording: Recording, voxel_m: float, mesh: Path, threads: int) -> MapOutcome:
    """With the true poses."""
    cloud = PoissonCloud(voxel_m)
    fuse_s = 0.0
    for points, origin in placed_scans(recording, recording.truth()):
        start_s = time.perf_counter()
        cloud.integrate(points, origin)
        fuse_s += time.perf_counter() - start_s
    start_s = time.perf_counter()
    surface = cloud.mesh(threads)
    mesh_s = time.perf_counter() - start_s
    surface.write_ply(mesh)
    map_mib = len(cloud.cloud.points) * 6 * 8 / 2**20
    return MapOutcome(mesh, cloud.scans, fuse_s, mesh_s, own_peak_mib(), map_mib)
