"""Rows of the comparison of trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

HEADER = (
    "recording",
    "method",
    "poses",
    "ATE RMSE m",
    "max m",
    "RPE m",
    "ms/scan median",
    "p95",
    "CPU-ms/scan",
    "threads",
    "scans/s",
    "peak MiB",
)


@dataclass(frozen=True)
class Row:
    """One method on one recording; `failure` says why there are no numbers."""

    recording: str
    method: str
    measured_by: str  # "exact truth" or "reference"
    threads: int
    scans: int
    poses: int = 0  # compared ones
    ate_rmse_m: float | None = None
    ate_max_m: float | None = None
    rpe_rmse_m: float | None = None  # over 1 m of the way
    median_ms: float | None = None
    p95_ms: float | None = None
    cpu_ms: float | None = None
    peak_mib: float | None = None
    scans_per_s: float | None = None
    failure: str | None = None


def number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def cells(row: Row) -> list[str]:
    method = row.method if row.failure is None else f"{row.method}: **failed**, {row.failure}"
    return [
        f"{row.recording} ({row.measured_by})",
        method.replace("|", "\\|").replace("\n", " "),
        f"{row.poses}/{row.scans}",
        number(row.ate_rmse_m, 4),
        number(row.ate_max_m, 4),
        number(row.rpe_rmse_m, 4),
        number(row.median_ms, 1),
        number(row.p95_ms, 1),
        number(row.cpu_ms, 1),
        str(row.threads),
        number(row.scans_per_s, 1),
        number(row.peak_mib, 0),
    ]


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
