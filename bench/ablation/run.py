"""Runs the paper's ablations on simulated worlds and writes its four tables, ours beside theirs.

PYTHONPATH=bench/peers .venv/bin/python bench/ablation/run.py --covsplat build/release/apps/covsplat
"""

from __future__ import annotations

import argparse
import os
import re
import statistics
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import page
import report
from covsplat_run import simulate_seed
from measures import Job, Measures, World, measured
from variants import TABLES, Table, Variant, all_variants

PAPER_NAMES = ("paper, quad", "paper, Keble")
# Column, its figure, digits.
COLUMNS = {
    "ATE": ("ATE mm", lambda m: 1e3 * m.ate_m, 1),
    "Acc": ("Acc cm", lambda m: m.accuracy_cm, 2),
    "Com": ("Com cm", lambda m: m.completeness_cm, 2),
    "C-L1": ("C-L1 cm", lambda m: m.chamfer_l1_cm, 2),
    "F": ("F", lambda m: m.f_percent, 2),
    "strict F": ("strict F 0.2 / 0.05 m", lambda m: m.strict_f_percent, 2),
    "Gaussians": ("Gaussians", lambda m: m.gaussians, 0),
    "map MB": ("map.ply MB", lambda m: m.map_mb, 1),
    "tracking scans/s": ("tracking scans/s", lambda m: m.tracking_scans_per_s, 1),
    "iterations": ("iterations", lambda m: m.iterations, 2),
    "unmatched": ("unmatched %", lambda m: m.unmatched_percent, 2),
}
Found = dict[tuple[str, Variant], list[Measures]]


def main() -> int:
    options = parse()
    worlds = {name: scans for name, scans in map(world_and_scans, options.world)}
    jobs = [
        Job(World(name, options.out / f"{name}-{seed}" / "recording", scans), seed, variant)
        for seed in range(1, options.seeds + 1)
        for name, scans in worlds.items()
        for variant in all_variants()
        if options.only.search(f"{name}, {variant.name}")
    ]
    for job in jobs:
        simulate(options.covsplat, job)
    found: Found = {}
    with ThreadPoolExecutor(options.jobs) as pool:
        run = lambda job: measured(job, options.covsplat, options.out, options.again)  # noqa: E731
        for job, measures in zip(jobs, pool.map(run, jobs), strict=True):
            found.setdefault((job.world.name, job.variant), []).append(measures)
            print(f"{job.world.name} {job.seed} {job.variant.name}: {measures}", flush=True)
    text = "".join(tables(table, list(worlds), found) for table in TABLES)
    page.publish(text, "ablation", options.update)
    return 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--covsplat", type=Path, required=True, help="the binary")
    parser.add_argument(
        "--world",
        action="append",
        metavar="NAME[=SCANS]",
        help="a simulated world, or its first scans only; default: courtyard and college",
    )
    parser.add_argument("--seeds", type=int, default=3, help="worlds and walks of each kind")
    parser.add_argument(
        "--only",
        type=re.compile,
        default=re.compile(""),
        metavar="REGEX",
        help="run only what it is found in, as in 'courtyard, manage'",
    )
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--out", type=Path, default=Path("bench_out/ablation"))
    parser.add_argument("--again", action="store_true", help="make known runs again")
    parser.add_argument("--update", type=Path, metavar="PAGE", help="write between its markers")
    options = parser.parse_args()
    options.world = options.world or ["courtyard", "college"]
    return options


def world_and_scans(text: str) -> tuple[str, int | None]:
    name, _, scans = text.partition("=")
    return name, int(scans) if scans else None


def simulate(covsplat: Path, job: Job) -> None:
    folder = job.world.folder
    if (folder / "gt_tum.txt").is_file():  # written last
        return
    simulate_seed(covsplat, job.world.name, job.seed, folder)


def tables(table: Table, worlds: list[str], found: Found) -> str:
    """Of medians over the seeds, a block of columns for each world, then the paper's."""
    header = [""]
    for world in worlds:
        header += [f"{world}: {COLUMNS[column][0]}" for column in table.columns]
    has_keble = any(row.paper.keble for row in table.rows)
    for name in PAPER_NAMES[: 1 + has_keble]:
        header += [f"{name}: {column}" for column in table.paper_columns]
    lines = []
    for row in table.rows:
        cells = [row.label]
        for world in worlds:
            runs = found.get((world, row.variant), [])
            cells += [cell(column, runs) for column in table.columns]
        lines.append([*cells, *row.paper.quad, *row.paper.keble])
    return f"\n{table.title}:\n\n{report.table(header, lines)}\n"


def cell(column: str, runs: list[Measures]) -> str:
    if not runs:
        return "-"
    _, figure, digits = COLUMNS[column]
    text = f"{statistics.median(map(figure, runs)):.{digits}f}"
    if column == "strict F":
        text += f" / {statistics.median(run.strict_f_fine_percent for run in runs):.2f}"
    return text


if __name__ == "__main__":
    sys.exit(main())
