"""Many worlds of a kind: is any loop wrong, is any revisit missed?

PYTHONPATH=bench/peers .venv/bin/python bench/loops/seeds.py --covsplat build/release/apps/covsplat
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import page
import report
from covsplat_run import ate_m, base_command, simulate_seed
from loop_measures import LoopFacts, loop_facts
from processes import run_program
from recording import Recording

HEADER = (
    "world",
    "seeds",
    "looked at",
    "accepted",
    "wrong",
    "worst mm",
    "revisits found",
    "ATE mm",
)


@dataclass(frozen=True)
class Found:
    loops: LoopFacts
    ate_m: float


def main() -> int:
    options = parse()
    rows = []
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        for world in options.world:
            one = lambda seed, world=world: closed(world, seed, options)  # noqa: E731
            found = list(pool.map(one, range(1, options.seeds + 1)))
            rows.append(summary(world, found))
            print(" | ".join(rows[-1]), flush=True)
    page.publish(f"\n{report.table(HEADER, rows)}\n", "loop-seeds", options.update)
    return 0


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--covsplat", type=Path, required=True, help="the binary")
    parser.add_argument("--world", action="append", help="default: street and multilevel")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--out", type=Path, default=Path("bench_out/loop_seeds"))
    parser.add_argument("--update", type=Path, metavar="PAGE", help="write between its markers")
    options = parser.parse_args()
    options.world = options.world or ["street", "multilevel"]
    return options


def closed(world: str, seed: int, options: argparse.Namespace) -> Found:
    """Gaussians stay as they are spawned: refined ones change little of what loops see."""
    folder = options.out / f"{world}-{seed}"
    simulate_seed(options.covsplat, world, seed, folder / "recording")
    recording = Recording.open(folder / "recording")
    command = base_command(options.covsplat, recording, folder / "run", threads=1)
    command += ["--deterministic", "--quiet", "--loops", "on"]
    run_program([*command, "-s", "mapping.feedback.mode=frozen"])
    found = Found(
        loop_facts(folder / "run", recording),
        ate_m(
            options.covsplat,
            folder / "run" / "trajectory_tum.txt",
            folder / "recording" / "gt_tum.txt",
        ),
    )
    shutil.rmtree(folder / "recording")
    print(f"{world} {seed}: {found}", flush=True)
    return found


def summary(world: str, found: list[Found]) -> list[str]:
    facts = [one.loops for one in found]
    ate_mm = [1e3 * one.ate_m for one in found]
    worst_mm = 1e3 * max(one.worst_m or 0.0 for one in facts)
    return [
        world,
        str(len(found)),
        str(sum(one.looked_at for one in facts)),
        str(sum(one.accepted for one in facts)),
        str(sum(one.wrong or 0 for one in facts)),
        f"{worst_mm:.1f}",
        f"{sum(one.found or 0 for one in facts)}/{sum(one.revisits or 0 for one in facts)}",
        f"median {statistics.median(ate_mm):.1f}, worst {max(ate_mm):.1f}",
    ]


if __name__ == "__main__":
    sys.exit(main())
