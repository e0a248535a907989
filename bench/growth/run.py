"""How map, memory, latency and errors grow on a drive of 10 km.

PYTHONPATH=bench/peers .venv/bin/python bench/growth/run.py --covsplat build/release/apps/covsplat \
    --recording bench_out/city
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import page
import report
from covsplat_run import TRACKING, ate_m, frames_of, stage_ms
from processes import run_program
from se3 import ways_along

HEADER = (
    "way m",
    "scans",
    "keyframes",
    "Gaussians",
    "resident MiB",
    "target surfels",
    "tracking ms/scan",
    "latency ms: 99 %",
    "max",
    "ATE so far mm",
)


@dataclass(frozen=True)
class Scan:
    stamp_s: float
    way_m: float
    is_keyframe: bool
    gaussians: int
    rss_mib: float
    target_surfels: int
    tracking_ms: float
    latency_ms: float


def main() -> int:
    options = parse()
    command = [str(options.covsplat), "run", str(options.recording), "-o", str(options.out)]
    run_program([*command, "--realtime", "--overwrite", "--quiet"])
    scans = scans_of(options.out)
    parts = [
        [scan for scan in scans if begin <= scan.way_m < begin + options.part_m]
        for begin in np.arange(0.0, scans[-1].way_m, options.part_m)
    ]
    errors = errors_until(options, [part[-1].stamp_s for part in parts])
    rows = [row(part, error_m) for part, error_m in zip(parts, errors, strict=True)]
    table = report.table(HEADER, rows)
    page.publish(f"\n{summary(options.out)}\n\n{table}\n", "growth", options.update)
    return 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--covsplat", type=Path, required=True, help="the binary")
    parser.add_argument("--recording", type=Path, required=True, help="with its truth")
    parser.add_argument("--part-m", type=float, default=1000.0, help="way that a row stands for")
    parser.add_argument("--out", type=Path, default=Path("bench_out/growth"))
    parser.add_argument("--update", type=Path, metavar="PAGE", help="write between its markers")
    return parser.parse_args()


def scans_of(run: Path) -> list[Scan]:
    """Those that were tracked; others have poses, too."""
    poses = np.loadtxt(run / "trajectory_tum.txt")
    ways_m = ways_along(poses[:, 1:4])
    frames = frames_of(run)
    way_m = np.interp([float(frame["stamp_s"]) for frame in frames], poses[:, 0], ways_m)
    return [scan_of(frame, float(way)) for frame, way in zip(frames, way_m, strict=True)]


def summary(run: Path) -> str:
    metrics = json.loads((run / "metrics.json").read_text())
    scans, memory, loops = metrics["scans"], metrics["memory"], metrics["loops"]
    return (
        f"{scans['tracked']} scans were tracked, {scans['dropped']} dropped, {scans['lost']} lost; "
        f"{loops['accepted']} loops were accepted of {loops['candidates']} that were looked at. "
        f"Peak memory {memory['peak_rss_bytes'] / 1e6:.0f} MB, with the last scan "
        f"{memory['gaussians_bytes'] / 1e6:.0f} MB of Gaussians, {memory['views_bytes'] / 1e6:.0f} MB "
        f"of training views and {memory['places_bytes'] / 1e6:.0f} MB of places. "
        f"Finishing and writing took {metrics['time']['finish_s']:.1f} s."
    )


def scan_of(frame: dict[str, str], way_m: float) -> Scan:
    return Scan(
        float(frame["stamp_s"]),
        way_m,
        frame["keyframe"] == "1",
        int(frame["gaussians"]),
        int(frame["rss_bytes"]) / 2**20,
        int(frame["target_surfels"]),
        stage_ms(frame, TRACKING),
        float(frame["latency_ms"]),
    )


def errors_until(options: argparse.Namespace, stamps_s: list[float]) -> list[float]:
    """ATE of the trajectory's beginning, up to each stamp."""
    lines = (options.out / "trajectory_tum.txt").read_text().splitlines(keepends=True)
    beginning = options.out / "beginning_tum.txt"
    truth = options.recording / "gt_tum.txt"
    errors = []
    for stamp_s in stamps_s:
        early = [line for line in lines if float(line.split()[0]) <= stamp_s]
        beginning.write_text("".join(early))
        errors.append(ate_m(options.covsplat, beginning, truth))
    beginning.unlink()
    return errors


def row(part: list[Scan], error_m: float) -> list[str]:
    last = part[-1]
    return [
        f"{last.way_m:.0f}",
        str(len(part)),
        str(sum(scan.is_keyframe for scan in part)),
        str(last.gaussians),
        f"{last.rss_mib:.0f}",
        str(last.target_surfels),
        f"{statistics.mean(scan.tracking_ms for scan in part):.1f}",
        f"{np.percentile([scan.latency_ms for scan in part], 99):.1f}",
        f"{max(scan.latency_ms for scan in part):.1f}",
        f"{1e3 * error_m:.1f}",
    ]


if __name__ == "__main__":
    sys.exit(main())
