"""What a comparison found: as tables, as JSON and between the markers of docs/benchmarks.md."""

from __future__ import annotations

import importlib.metadata
import json
import os
import shlex
import subprocess
import sys
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import map_runs
import report

PACKAGES = (
    "kiss-icp",
    "kiss-slam",
    "map-closures",
    "small-gicp",
    "open3d",
    "scikit-image",
    "numpy",
)


@dataclass
class Results:
    tracks: list[report.Row] = field(default_factory=list)
    maps: list[map_runs.Row] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        return all(row.failure is None for row in [*self.tracks, *self.maps])


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
        "versions": {name: version(name) for name in PACKAGES},
    }


def publish(text: str, block: str, path: Path | None) -> None:
    """What a benchmark of covsplat alone found: prints it and, with a page, writes its block."""
    about = circumstances("PYTHONPATH=bench/peers python3 " + shlex.join(sys.argv), os.getloadavg())
    place = f"commit {about['commit']}, {about['cpu']}, {about['cores']} cores"
    text = f"{about['date']}, {place}.\n\n`{about['command']}`\n{text}"
    if path is not None:
        update(path, block, text)
    print("\n" + text)


def markdown(results: Results, about: dict[str, object]) -> str:
    versions = ", ".join(f"{name} {number}" for name, number in dict(about["versions"]).items())
    text = (
        f"{about['date']}, commit {about['commit']}, {about['cpu']}, {about['cores']} cores, "
        f"load average {about['load_before']:.1f} before and {about['load_after']:.1f} after; "
        f"{versions}.\n\n`{about['command']}`\n"
    )
    if results.tracks:
        rows = [report.cells(row) for row in results.tracks]
        text += f"\nTrajectories:\n\n{report.table(report.HEADER, rows)}\n"
    if results.maps:
        rows = [map_runs.cells(row) for row in results.maps]
        text += f"\nSurfaces:\n\n{report.table(map_runs.HEADER, rows)}\n"
    return text


def as_json(results: Results, about: dict[str, object]) -> str:
    return json.dumps({"about": about, **asdict(results)}, indent=2) + "\n"


def update(path: Path, block: str, text: str) -> None:
    """Replaces what stands between the markers of a block."""
    begin, end = f"<!-- {block}:begin -->", f"<!-- {block}:end -->"
    content = path.read_text()
    if content.count(begin) != 1 or content.count(end) != 1:
        raise SystemExit(f"{path}: needs the lines {begin} and {end} once each")
    head, rest = content.split(begin)
    _, tail = rest.split(end)
    path.write_text(f"{head}{begin}\n{text}{end}{tail}")
