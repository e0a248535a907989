"""What the measures of loops say where it is known.

PYTHONPATH=bench/peers:bench/loops .venv/bin/python -m unittest discover bench/loops
"""

from __future__ import annotations

import unittest

import numpy as np

from loop_measures import (
    ONE_PASS_M,
    TWO_PASSES_M,
    Surfels,
    is_wrong,
    passes_apart_m,
    revisits_of,
)

FIRST_M, SECOND_M = 0.0, 100.0  # of two passes, on the way


def flat(positions: np.ndarray) -> Surfels:
    """Discs of 0.1 m that face upwards."""
    count = len(positions)
    axes = np.tile(np.eye(3), (count, 1, 1))
    return Surfels(positions, axes, np.full((count, 2), 0.1), np.ones(count))


def floor(height_m: float, x_m: float = 0.0) -> np.ndarray:
    x, y = np.meshgrid(np.arange(0.0, 4.0, 0.2) + x_m, np.arange(0.0, 4.0, 0.2))
    return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, height_m)])


def apart_m(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    passes_m = np.repeat([FIRST_M, SECOND_M], [len(first), len(second)])
    return passes_apart_m(flat(np.vstack([first, second])), passes_m, TWO_PASSES_M)


class PassesApartTest(unittest.TestCase):
    def test_both_layers_of_a_double_floor_are_as_far_apart_as_they_are(self) -> None:
        found = apart_m(floor(0.0), floor(0.013, x_m=0.07))
        self.assertGreater(len(found), 790)
        np.testing.assert_allclose(found, 0.013, atol=1e-12)

    def test_what_one_pass_left_is_not_double(self) -> None:
        surfels = flat(np.vstack([floor(0.0), floor(0.013)]))
        self.assertEqual(len(passes_apart_m(surfels, np.full(800, FIRST_M), TWO_PASSES_M)), 0)
        passes_m = np.repeat([FIRST_M, FIRST_M + 5.0], 400)
        self.assertEqual(len(passes_apart_m(surfels, passes_m, TWO_PASSES_M)), 0)
        np.testing.assert_allclose(passes_apart_m(surfels, passes_m, ONE_PASS_M), 0.013)

    def test_a_step_beside_a_floor_is_another_surface(self) -> None:
        self.assertEqual(len(apart_m(floor(0.0), floor(0.05, x_m=3.8 + 0.35))), 0)


class LoopsTest(unittest.TestCase):
    def test_half_a_metre_or_three_degrees_off_is_another_place(self) -> None:
        off = np.eye(4)
        off[0, 3] = 0.49
        self.assertFalse(is_wrong(off))
        off[0, 3] = 0.51
        self.assertTrue(is_wrong(off))
        for deg, wrong in ((2.9, False), (3.1, True)):
            c, s = np.cos(np.radians(deg)), np.sin(np.radians(deg))
            turned = np.eye(4)
            turned[:2, :2] = [[c, -s], [s, c]]
            self.assertEqual(is_wrong(turned), wrong)

    def test_a_second_lap_is_a_revisit_and_another_floor_is_none(self) -> None:
        turns = np.linspace(0.0, 2.25 * np.pi, 900)
        truth = np.tile(np.eye(4), (900, 1, 1))
        truth[:, :3, 3] = 20.0 * np.column_stack([np.cos(turns), np.sin(turns), 0 * turns])
        (revisit,) = revisits_of(truth)
        self.assertEqual(revisit.stop, 900)
        # From 10 m before where the lap began.
        self.assertAlmostEqual(turns[revisit.start], 2 * np.pi - 2 * np.arcsin(0.25), delta=0.02)
        truth[:, 2, 3] = np.linspace(0.0, 4.0, 900)
        self.assertEqual(revisits_of(truth), [])


if __name__ == "__main__":
    unittest.main()
