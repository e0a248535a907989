"""What comparisons are told on the command line, and the recordings that they are to take."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from pathlib import Path

from recording import Recording, azimuth_periods, marked


def add_options(parser: argparse.ArgumentParser, out: str, mark: str) -> None:
    """`out`: where results go by default; `mark`: of the recordings to take from `--data`."""
    parser.add_argument("--recording", type=Path, action="append", default=[], metavar="DIR")
    parser.add_argument(
        "--data", type=Path, metavar="DIR", help=f"also what its INDEX.md marks {mark}"
    )
    parser.add_argument(
        "--azimuth-time",
        action="append",
        default=[],
        metavar="NAME=SECONDS",
        help="recording whose points' times follow from the azimuth of a clockwise turn so long",
    )
    parser.add_argument(
        "--only",
        type=re.compile,
        default=re.compile(""),
        metavar="REGEX",
        help="run only what it is found in, as in 'courtyard, KISS-SLAM'",
    )
    parser.add_argument("--no-map", action="append", default=[], metavar="NAME", help="recording")
    parser.add_argument("--voxel", type=float, default=0.1, metavar="METRES", help="of all meshes")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path(out))
    parser.add_argument("--update", type=Path, metavar="PAGE", help="write between its markers")
    parser.set_defaults(mark=mark)


def recordings(options: argparse.Namespace) -> Iterator[Recording]:
    periods = azimuth_periods(options.azimuth_time)
    for folder in options.recording + marked(options.data, options.mark):
        yield Recording.open(folder, periods.get(folder.resolve().name))
