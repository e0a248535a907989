"""The peers that make surfaces, on scenes whose surfaces are known in closed form."""

from __future__ import annotations

import tempfile
import unittest
from pathlib import Path

import numpy as np

from map_peers import PoissonCloud
from surface_mesh import SurfaceMesh
from tsdf_fusion import BLOCK, TsdfVolume, blocks_of, keys_of


def box_scan(origin: np.ndarray, half: np.ndarray, rays: int) -> np.ndarray:
    """Where rays from within hit the inside of a box about zero."""
    directions = np.random.default_rng(rays).normal(size=(rays, 3))
    walls = np.where(directions > 0, half, -half)
    shares = ((walls - origin) / directions).min(axis=1)
    return origin + shares[:, None] * directions


def area_m2(mesh: SurfaceMesh) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


class TsdfFusionTest(unittest.TestCase):
    def setUp(self) -> None:
        try:
            import skimage  # noqa: F401
        except ImportError:
            self.skipTest("scikit-image is not installed")

    def test_a_plane_lies_where_it_was_measured_and_nowhere_else(self) -> None:
        """Negative places and a height between voxels, seen at a slant from two sides."""
        rng = np.random.default_rng(1)
        points = np.column_stack([rng.uniform(-3, -1, (40000, 2)), np.full(40000, -0.537)])
        volume = TsdfVolume(0.1, truncation_voxels=3.0)
        for origin in ([-2.0, -2.0, 1.0], [-1.5, -2.5, 1.5]):
            volume.integrate(points, np.array(origin))
        mesh = volume.mesh()
        self.assertLess(np.abs(mesh.vertices[:, 2] + 0.537).max(), 0.02)
        self.assertAlmostEqual(area_m2(mesh), 1.9**2, delta=0.1)  # between voxels' centres
        self.assertGreater(mesh.vertices[:, :2].min(), -3.2)
        self.assertLess(mesh.vertices[:, :2].max(), -0.8)

    def test_a_box_that_spans_tiles_closes_without_seams(self) -> None:
        half = np.array([6.23, 2.07, 1.51])
        volume = TsdfVolume(0.1, truncation_voxels=3.0)
        for x in (-4.0, 0.0, 4.0):
            origin = np.array([x, 0.3, 0.0])
            volume.integrate(box_scan(origin, half, 60000), origin)
        mesh = volume.mesh()
        surface_m2 = 8 * (half[0] * half[1] + half[1] * half[2] + half[2] * half[0])
        self.assertAlmostEqual(area_m2(mesh) / surface_m2, 1.0, delta=0.05)
        outside_m = np.abs(np.abs(mesh.vertices) - half).min(axis=1)
        self.assertLess(np.quantile(outside_m, 0.95), 0.02)
        self.assertLess(outside_m.max(), 0.15)  # at the edges
        self.assertEqual(volume.bytes, len(volume.slots) * BLOCK**3 * 8)

    def test_a_ray_updates_every_voxel_it_crosses_within_the_truncation(self) -> None:
        volume = TsdfVolume(0.1, truncation_voxels=3.0)
        point, origin = np.array([[1.0, 0.71, 0.33]]), np.zeros(3)
        volume.integrate(point, origin)
        depth_m = np.linalg.norm(point)
        fine = np.linspace(depth_m - 0.3, depth_m + 0.3, 20001)[1:-1, None] * point / depth_m
        voxels = np.unique(np.floor(fine / 0.1), axis=0)
        along_m = (voxels + 0.5) * 0.1 @ point[0] / depth_m
        expected = np.count_nonzero(depth_m - along_m > -0.3)
        self.assertEqual(int(volume.weights.sum()), expected)

    def test_what_was_measured_seldom_can_be_left_out(self) -> None:
        points = np.column_stack([np.random.default_rng(2).uniform(0, 1, (5000, 2)), np.ones(5000)])
        volume = TsdfVolume(0.1, truncation_voxels=3.0)
        volume.integrate(points, np.array([0.5, 0.5, 3.0]))
        self.assertGreater(len(volume.mesh().triangles), 0)
        self.assertEqual(len(volume.mesh(min_weight=1e6).triangles), 0)
        self.assertEqual(len(TsdfVolume(0.1, truncation_voxels=3.0).mesh().triangles), 0)

    def test_keys_lead_back_to_their_blocks(self) -> None:
        blocks = np.random.default_rng(3).integers(-(1 << 18), 1 << 18, (1000, 3))
        np.testing.assert_array_equal(blocks_of(keys_of(blocks)), blocks)


class PoissonTest(unittest.TestCase):
    def test_the_inside_of_a_box_faces_the_sensor(self) -> None:
        try:
            import open3d  # noqa: F401
        except ImportError:
            self.skipTest("open3d is not installed")
        half = np.array([3.0, 2.0, 1.5])
        cloud = PoissonCloud(0.1)
        for x in (-1.0, 1.0):
            origin = np.array([x, 0.0, 0.0])
            cloud.integrate(box_scan(origin, half, 40000), origin)
        mesh = cloud.mesh(threads=1)
        off_m = np.abs(np.abs(mesh.vertices) - half).min(axis=1)
        self.assertLess(np.quantile(off_m, 0.9), 0.03)
        a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
        inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), -(a + b + c))
        self.assertGreater(np.mean(inwards > 0), 0.98)


class SurfaceMeshTest(unittest.TestCase):
    def test_a_file_holds_what_its_header_says(self) -> None:
        part = SurfaceMesh(np.eye(3), np.array([[0, 1, 2]]))
        both = SurfaceMesh.joined([part, part])
        np.testing.assert_array_equal(both.triangles, [[0, 1, 2], [3, 4, 5]])
        with tempfile.TemporaryDirectory() as name:
            path = Path(name) / "mesh.ply"
            both.write_ply(path)
            header, _, body = path.read_bytes().partition(b"end_header\n")
            self.assertIn(b"element vertex 6", header)
            self.assertEqual(len(body), 6 * 12 + 2 * 13)
        self.assertEqual(len(SurfaceMesh.joined([]).triangles), 0)


if __name__ == "__main__":
    unittest.main()
