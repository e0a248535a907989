"""Fuses scans into a truncated signed distance field, after the method of VDBFusion.

I. Vizzo, T. Guadagnino, J. Behley, C. Stachniss: VDBFusion: Flexible and Efficient TSDF Integration
of Range Sensor Data. Sensors 22(3), 2022. Written anew from the paper, because its package has no
file for the Python used here. Every measurement updates the voxels that its ray crosses within the
truncation about the measured point: a running mean, in which all measurements weigh the same, of
the distance from the voxel's centre to the point along the ray. Space is not carved. The zero level
becomes triangles by marching cubes, where all eight voxels of a cube were observed.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from se3 import Array
from surface_mesh import SurfaceMesh

BLOCK = 8  # voxels along the edge of a block, the unit in which space is allocated
TILE = 12  # blocks along the edge of a tile, the unit in which triangles are extracted
KEY_RANGE = 1 << 20  # blocks along an axis, half of them below zero
MAX_BLOCKS = 1 << 19  # 2 GiB of voxels


class TsdfVolume:
    def __init__(self, voxel_m: float, truncation_voxels: float) -> None:
        self.voxel_m = voxel_m
        self.truncation_m = truncation_voxels * voxel_m
        self.slots: dict[int, int] = {}  # key of a block to its place in the arrays
        self.sums = np.zeros((1024, BLOCK**3), np.float32)  # of the distances in metres
        self.weights = np.zeros((1024, BLOCK**3), np.float32)

    @property
    def bytes(self) -> int:
        """Of the voxels that are allocated."""
        return len(self.slots) * BLOCK**3 * 8

    def integrate(self, points: Array, origin: Array) -> None:
        """points: [N, 3] m, measured from `origin`, both in the world."""
        rays = points - origin
        ranges_m = np.linalg.norm(rays, axis=1)
        usable = ranges_m > self.truncation_m
        rays, ranges_m = rays[usable], ranges_m[usable]
        directions = rays / ranges_m[:, None]
        which, voxels = self._crossed(origin, directions, ranges_m)
        centres = (voxels + 0.5) * self.voxel_m
        along_m = np.einsum("ij,ij->i", centres - origin, directions[which])
        distance_m = np.minimum(ranges_m[which] - along_m, self.truncation_m)
        near = distance_m > -self.truncation_m
        places = self._places(voxels[near])
        np.add.at(self.sums.reshape(-1), places, distance_m[near].astype(np.float32))
        np.add.at(self.weights.reshape(-1), places, np.float32(1))

    def _crossed(
        self, origin: Array, directions: Array, ranges_m: Array
    ) -> tuple[np.ndarray, np.ndarray]:
        """For every voxel [M, 3] that a ray crosses within the truncation, the ray's number [M].

        Between two crossings of a plane of the grid a ray stays in one voxel.
        """
        start = (origin + directions * (ranges_m - self.truncation_m)[:, None]) / self.voxel_m
        length = 2 * self.truncation_m / self.voxel_m
        step = directions * length
        planes = np.floor(np.minimum(start, start + step))[:, :, None] + np.arange(
            1, int(np.ceil(length)) + 2
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            crossings = (planes - start[:, :, None]) / step[:, :, None]
        crossings = np.where((crossings > 0) & (crossings < 1), crossings, 1.0)
        count = len(start)
        shares = np.concatenate([np.zeros((count, 1)), crossings.reshape(count, -1)], axis=1)
        shares = np.append(np.sort(shares, axis=1), np.ones((count, 1)), axis=1)
        spans = np.diff(shares)
        which, column = np.nonzero(spans > 1e-9)
        middle = shares[which, column] + spans[which, column] / 2
        voxels = np.floor(start[which] + middle[:, None] * step[which]).astype(np.int64)
        return which, voxels

    def _places(self, voxels: np.ndarray) -> np.ndarray:
        """Indices into the flat arrays; blocks that are not there yet are allocated."""
        blocks = voxels // BLOCK
        inside = voxels - blocks * BLOCK
        keys, which = np.unique(keys_of(blocks), return_inverse=True)
        slots = np.fromiter(
            (self.slots.setdefault(key, len(self.slots)) for key in keys.tolist()),
            np.int64,
            len(keys),
        )
        self._grow()
        local = (inside[:, 0] * BLOCK + inside[:, 1]) * BLOCK + inside[:, 2]
        return slots[which] * BLOCK**3 + local

    def _grow(self) -> None:
        if len(self.slots) > MAX_BLOCKS:
            raise MemoryError(f"more than {MAX_BLOCKS} blocks of voxels; use larger voxels")
        if len(self.slots) <= len(self.sums):
            return
        rows = max(len(self.slots), 3 * len(self.sums) // 2)
        for name in ("sums", "weights"):
            old = getattr(self, name)
            new = np.zeros((rows, BLOCK**3), np.float32)
            new[: len(old)] = old
            setattr(self, name, new)

    def mesh(self, min_weight: float = 1.0) -> SurfaceMesh:
        """Voxels with fewer than `min_weight` measurements count as not observed."""
        return SurfaceMesh.joined(
            [
                part
                for corner, field, observed in self._tiles(min_weight)
                if (part := self._surface(corner, field, observed)) is not None
            ]
        )

    def _tiles(self, min_weight: float) -> Iterator[tuple[np.ndarray, Array, np.ndarray]]:
        """First voxel, distances and what is observed of dense tiles that overlap by a voxel."""
        blocks = blocks_of(np.fromiter(self.slots, np.int64, len(self.slots)))
        slot_of = {tuple(block): slot for slot, block in enumerate(blocks.tolist())}
        edge = TILE * BLOCK
        for tile in np.unique(blocks // TILE, axis=0):
            field = np.full((edge + BLOCK,) * 3, self.truncation_m, np.float32)
            observed = np.zeros(field.shape, bool)
            first = tile * TILE
            for offset in np.ndindex((TILE + 1,) * 3):
                slot = slot_of.get(tuple((first + offset).tolist()))
                if slot is None:
                    continue
                weights = self.weights[slot].reshape((BLOCK,) * 3)
                known = weights >= min_weight
                window = tuple(slice(o * BLOCK, (o + 1) * BLOCK) for o in offset)
                np.divide(
                    self.sums[slot].reshape((BLOCK,) * 3), weights, field[window], where=known
                )
                observed[window] = known
            with_seam = (slice(0, edge + 1),) * 3
            yield first * BLOCK, field[with_seam], observed[with_seam]

    def _surface(
        self, corner: np.ndarray, field: Array, observed: np.ndarray
    ) -> SurfaceMesh | None:
        from skimage.measure import marching_cubes

        whole = np.ones(tuple(side - 1 for side in field.shape), bool)
        sides = (slice(0, -1), slice(1, None))
        for shift in np.ndindex(2, 2, 2):
            whole &= observed[tuple(sides[s] for s in shift)]
        mask = np.zeros(field.shape, bool)
        mask[1:, 1:, 1:] = whole  # scikit-image names a cube by its last corner
        if not whole.any() or not field[observed].min() < 0 < field[observed].max():
            return None
        try:
            vertices, triangles, _, _ = marching_cubes(field, 0.0, mask=mask)
        except RuntimeError:  # no cube that is wholly observed has a zero
            return None
        return SurfaceMesh((corner + vertices + 0.5) * self.voxel_m, triangles.astype(np.int64))


def keys_of(blocks: np.ndarray) -> np.ndarray:
    """One number for each row of three."""
    shifted = blocks + KEY_RANGE // 2
    return (shifted[:, 0] * KEY_RANGE + shifted[:, 1]) * KEY_RANGE + shifted[:, 2]


def blocks_of(keys: np.ndarray) -> np.ndarray:
    rest, z = np.divmod(keys, KEY_RANGE)
    x, y = np.divmod(rest, KEY_RANGE)
    return np.stack([x, y, z], -1) - KEY_RANGE // 2
