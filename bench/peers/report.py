"""Rows of the comparison, as a table, as JSON and between the markers of docs/benchmarks.md."""

from __future__ import annotations

import importlib.metadata
import json
import os
import subprocess
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

BEGIN, END = "<!-- peers:begin -->", "<!-- peers:end -->"
HEADER = (
    "recording",
    "method",
    "poses",
    "ATE RMSE m",
    "max m",
    "ms/scan median",
    "p95",
    "CPU-ms/scan",
    "threads",
    "scans/s",
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
    median_ms: float | None = None
    p95_ms: float | None = None
    cpu_ms: float | None = None
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
        number(row.median_ms, 1),
        number(row.p95_ms, 1),
        number(row.cpu_ms, 1),
        str(row.threads),
        number(row.scans_per_s, 1),
    ]


def table(rows: list[Row]) -> str:
    lines = [HEADER, tuple("---" for _ in HEADER), *(tuple(cells(row)) for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def command_output(*command: str) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError:
        return ""
    return done.stdout.strip()


def version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def cpu_model() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return "unknown"


def circumstances(command: str, load_before: tuple[float, float, float]) -> dict[str, object]:
    root = str(Path(__file__).resolve().parent)
    commit = command_output("git", "-C", root, "rev-parse", "--short", "HEAD")
    changed = command_output("git", "-C", root, "status", "--porcelain", "--untracked-files=no")
    return {
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "command": command,
        "commit": commit + (" with local changes" if changed else ""),
        "cpu": cpu_model(),
        "cores": len(os.sched_getaffinity(0)),
        "load_before": load_before[0],
        "load_after": os.getloadavg()[0],
        "versions": {name: version(name) for name in ("kiss-icp", "small-gicp", "numpy")},
    }


def markdown(rows: list[Row], about: dict[str, object]) -> str:
    versions = ", ".join(f"{name} {number}" for name, number in dict(about["versions"]).items())
    intro = (
        f"{about['date']}, commit {about['commit']}, {about['cpu']}, {about['cores']} cores, "
        f"load average {about['load_before']:.1f} before and {about['load_after']:.1f} after; "
        f"{versions}.\n\n`{about['command']}`"
    )
    return f"{intro}\n\n{table(rows)}\n"


def as_json(rows: list[Row], about: dict[str, object]) -> str:
    return json.dumps({"about": about, "rows": [asdict(row) for row in rows]}, indent=2) + "\n"


def update(page: Path, text: str) -> None:
    """Replaces what stands between the markers."""
    content = page.read_text()
    if content.count(BEGIN) != 1 or content.count(END) != 1:
        raise SystemExit(f"{page}: needs the lines {BEGIN} and {END} once each")
    head, rest = content.split(BEGIN)
    _, tail = rest.split(END)
    page.write_text(f"{head}{BEGIN}\n{text}{END}{tail}")
