"""Triangle meshes as arrays, and as binary PLY."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from se3 import Array


@dataclass(frozen=True)
class SurfaceMesh:
    vertices: Array  # [N, 3] m
    triangles: np.ndarray  # [M, 3] indices of vertices

    @staticmethod
    def joined(parts: list[SurfaceMesh]) -> SurfaceMesh:
        """One mesh of all; vertices that parts share stay double."""
        if not parts:
            return SurfaceMesh(np.empty((0, 3)), np.empty((0, 3), np.int64))
        starts = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
        triangles = [part.triangles + start for part, start in zip(parts, starts, strict=True)]
        vertices = np.concatenate([part.vertices for part in parts])
        return SurfaceMesh(vertices, np.concatenate(triangles))

    def write_ply(self, path: Path) -> None:
        faces = np.empty(len(self.triangles), [("count", "u1"), ("vertices", "<i4", 3)])
        faces["count"] = 3
        faces["vertices"] = self.triangles
        header = (
            "ply\nformat binary_little_endian 1.0\n"
            f"element vertex {len(self.vertices)}\n"
            "property float x\nproperty float y\nproperty float z\n"
            f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
        )
        with path.open("wb") as file:
            file.write(header.encode())
            file.write(self.vertices.astype("<f4").tobytes())
            file.write(faces.tobytes())
