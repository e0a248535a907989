"""python3 -m unittest discover bench/peers, with the packages of requirements.txt."""

from __future__ import annotations

import tempfile
import unittest
from pathlib import Path

import numpy as np

import map_peers
import map_runs
import page
import plots
import report
from covsplat_run import MeshScore, SurfaceScore, run_covsplat, score_mesh
from recording import Recording, Scan, deskewed, placed
from se3 import (
    Trajectory,
    orthonormal,
    position_errors,
    quaternion_of,
    relative_errors,
    rotations_of,
)


def turn_about_z(angle_rad: float) -> np.ndarray:
    pose = np.eye(4)
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    pose[:2, :2] = [[cosine, -sine], [sine, cosine]]
    return pose


class Se3Test(unittest.TestCase):
    def test_quaternions_and_back(self) -> None:
        for seed in range(20):
            random = np.random.default_rng(seed).normal(size=(4, 4))
            rotation = orthonormal(random)[:3, :3]
            again = rotations_of(quaternion_of(rotation)[None])[0]
            np.testing.assert_allclose(again, rotation, atol=1e-12)

    def test_interpolation_meets_a_constant_turn(self) -> None:
        times_s = np.array([0.0, 1.0, 2.0])
        poses = np.array([turn_about_z(time_s) for time_s in times_s])
        poses[:, 0, 3] = 3 * times_s
        between = Trajectory.from_matrices(times_s, poses).at(np.array([0.25, 1.5]))
        np.testing.assert_allclose(between.positions[:, 0], [0.75, 4.5])
        rotations = rotations_of(between.quaternions)
        np.testing.assert_allclose(rotations[1], turn_about_z(1.5)[:3, :3], atol=1e-12)

    def test_alignment_leaves_only_the_error(self) -> None:
        truth = np.random.default_rng(1).normal(size=(50, 3))
        moved = truth @ turn_about_z(1.0)[:3, :3].T + [5, -2, 1]
        self.assertLess(position_errors(moved, truth).max(), 1e-12)
        self.assertGreater(position_errors(1.1 * truth, truth).max(), 0.01)

    def test_relative_errors_see_the_drift_and_not_where_the_path_lies(self) -> None:
        truth = np.tile(np.eye(4), (11, 1, 1))
        truth[:, 0, 3] = 0.5 * np.arange(11)
        moved = turn_about_z(1.0) @ truth
        self.assertLess(relative_errors(moved, truth, 1.0).max(), 1e-12)
        stretched = truth.copy()
        stretched[:, 0, 3] *= 1.02
        errors = relative_errors(stretched, truth, 1.0)
        np.testing.assert_allclose(errors, np.full(5, 0.02))
        self.assertEqual(len(relative_errors(truth[:2], truth[:2], 1.0)), 0)


class DeskewTest(unittest.TestCase):
    def test_a_moving_sensor_sees_the_scene_of_the_middle(self) -> None:
        scene = np.random.default_rng(2).uniform(-10, 10, (100, 3))
        offsets_s = np.linspace(-0.05, 0.05, 100)
        times_s = np.arange(0.0, 2.0, 0.005)
        poses = np.array([turn_about_z(0.5 * time_s) for time_s in times_s])
        poses[:, 0, 3] = 2 * times_s
        truth = Trajectory.from_matrices(times_s, poses)
        at = truth.at(1.0 + offsets_s)
        seen = np.einsum("nji,nj->ni", rotations_of(at.quaternions), scene - at.positions)
        middle = truth.at(np.array([1.0]))
        expected = (scene - middle.positions) @ rotations_of(middle.quaternions)[0]
        scan = Scan(1.0, seen, offsets_s)
        np.testing.assert_allclose(deskewed(scan, truth), expected, atol=1e-9)
        points, origin = placed(scan, truth)
        np.testing.assert_allclose(points, scene, atol=1e-9)
        np.testing.assert_allclose(origin, [2, 0, 0], atol=1e-9)

    def test_scans_that_the_trajectory_does_not_cover_are_left_out(self) -> None:
        still = Trajectory.from_matrices(np.array([0.0, 1.0]), np.tile(np.eye(4), (2, 1, 1)))
        seen, offsets_s = np.ones((2, 3)), np.array([-0.05, 0.05])
        self.assertIsNotNone(placed(Scan(0.5, seen, offsets_s), still))
        self.assertIsNone(placed(Scan(0.0, seen, offsets_s), still))
        self.assertIsNone(placed(Scan(0.5, np.empty((0, 3)), np.empty(0)), still))


FAKE_BINARY = """#!/bin/sh
while [ "$1" != -o ]; do shift; done
cd "$2" || exit 4
printf '0 0 0 0 0 0 0 1\\n0.1 1 0 0 0 0 0 1\\n' > trajectory_tum.txt
printf 'scan,track_ms\\n0,12.5\\n1,7.5\\n' > frames.csv
printf '{"time": {"scans_per_s": 9.5}}' > metrics.json
"""


class CovsplatRunTest(unittest.TestCase):
    def test_reads_what_a_run_writes_and_reports_what_fails(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            binary = folder / "covsplat"
            binary.write_text(FAKE_BINARY)
            binary.chmod(0o755)
            recording = Recording(folder, np.array([0.0, 0.1]), 0.1)
            outcome = run_covsplat(binary, recording, folder, 2, ())
            np.testing.assert_allclose(outcome.trajectory.positions[:, 0], [0, 1])
            self.assertEqual((outcome.wall_ms, outcome.scans_per_s), ([12.5, 7.5], 9.5))
            self.assertGreater(outcome.peak_mib, 0)
            with self.assertRaisesRegex(RuntimeError, "exit code 4"):
                run_covsplat(binary, recording, folder / "nowhere", 2, ())

    def test_reads_the_scores_of_a_mesh(self) -> None:
        errors = (
            '{"accuracy_cm": 1, "completeness_cm": 2, "chamfer_l1_cm": 1.5,'
            ' "scores": [{"tau_m": 0.05, "f_score_percent": 90}]}'
        )
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            binary = folder / "covsplat"
            found = f'{{"result": {{"triangles": 7}}, "paper": {errors}, "strict": {errors}}}'
            binary.write_text(f"#!/bin/sh\necho '{found}'\n")
            binary.chmod(0o755)
            recording = Recording(folder, np.array([0.0]), None)
            score = score_mesh(binary, folder / "mesh.ply", recording, (0.05,), 2, None)
            self.assertEqual(score.triangles, 7)
            self.assertEqual(score.strict.f_percent, {0.05: 90})


class MapRunsTest(unittest.TestCase):
    def test_a_method_that_fails_is_a_row_and_the_others_go_on(self) -> None:
        def fails() -> map_peers.MapOutcome:
            raise RuntimeError("out of voxels")

        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            recording = Recording(folder, np.array([0.0]), None)
            setting = map_runs.Setting(folder / "none", recording, folder, 0.1, 2)
            mesh = folder / "mesh.ply"
            made = map_peers.MapOutcome(mesh, 1, 1.0, 1.0, 1.0, 1.0)
            rows = map_runs.measure(setting, [("one; true", fails), ("two; true", lambda: made)])
            self.assertEqual([(row.method, row.poses) for row in rows][0], ("one", "true"))
            self.assertEqual(rows[0].failure, "out of voxels")
            self.assertIn("none", rows[1].failure or "")  # there is no program to judge it


class ReportTest(unittest.TestCase):
    def test_only_what_stands_between_the_markers_changes(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            path = Path(name) / "page.md"
            begin, end = "<!-- peers:begin -->", "<!-- peers:end -->"
            path.write_text(f"before\n{begin}\nold\n{end}\nafter\n")
            page.update(path, "peers", "new\n")
            self.assertEqual(path.read_text(), f"before\n{begin}\nnew\n{end}\nafter\n")

    def test_rows_have_the_cells_of_their_header(self) -> None:
        scored = SurfaceScore(1.0, 2.0, 1.5, dict.fromkeys(map_runs.TAUS_M, 90.0))
        maps = [
            map_runs.Row("world", "good", "true", MeshScore(7, scored, scored)),
            map_runs.Row("world", "bad", "true", failure="it broke | badly"),
        ]
        for row in maps:
            self.assertEqual(len(map_runs.cells(row)), len(map_runs.HEADER))
        tracks = [report.Row("world", "good", "exact truth", 2, 10, ate_rmse_m=0.1)]
        self.assertEqual(len(report.cells(tracks[0])), len(report.HEADER))
        results = page.Results(tracks, maps)
        self.assertFalse(results.complete)
        text = page.markdown(results, page.circumstances("run", (0.0, 0.0, 0.0)))
        self.assertIn("it broke \\| badly", text)
        self.check_plots(results)

    def check_plots(self, results: page.Results) -> None:
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            self.skipTest("matplotlib is not installed")
        with tempfile.TemporaryDirectory() as name:
            drawn = plots.draw(results, Path(name))
            self.assertEqual(len(drawn), 2)
            for _, file in drawn:
                self.assertIn("</svg>", file.read_text())


class KissIcpPoseTimeTest(unittest.TestCase):
    def test_its_pose_is_the_end_of_the_scan(self) -> None:
        """3 m/s along x past a box: the deskewed scan is seen from the last measurement."""
        try:
            from kiss_icp.config import KISSConfig
            from kiss_icp.kiss_icp import KissICP
        except ImportError:
            self.skipTest("kiss-icp is not installed")
        config = KISSConfig()
        config.mapping.voxel_size = 1.0
        odometry = KissICP(config)
        rng = np.random.default_rng(0)
        scene = box_surface(rng)
        speed_mps, turn_s = 3.0, 0.1
        for scan in range(25):
            phase = rng.uniform(0, 1, len(scene))
            seen = scene - np.outer(speed_mps * turn_s * (scan + phase), [1, 0, 0])
            frame, _ = odometry.register_frame(seen, phase)
        gaps_m = {
            name: float(np.abs(frame - scene + [speed_mps * turn_s * (24 + at), 0, 0]).mean())
            for name, at in (("start", 0.0), ("middle", 0.5), ("end", 1.0))
        }
        self.assertEqual(min(gaps_m, key=gaps_m.get), "end", gaps_m)
        self.assertLess(gaps_m["end"], 0.01)
        self.assertGreater(gaps_m["middle"], 0.04)


def box_surface(rng: np.random.Generator) -> np.ndarray:
    """Points on walls and pillars round a 30 m path, nothing within a metre of it."""
    walls = []
    for centre, half in [((5, 0, 3), (40, 15, 5))] + [
        ((x, y, 0), (1, 1, 2)) for x, y in [(8, 6), (15, -7), (22, 5), (-10, 6), (-5, -5)]
    ]:
        for axis in range(3):
            for side in (-1, 1):
                points = rng.uniform(-1, 1, (2000, 3))
                points[:, axis] = side
                walls.append(np.array(centre) + points * half)
    return np.concatenate(walls)


if __name__ == "__main__":
    unittest.main()
