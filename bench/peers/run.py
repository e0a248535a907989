"""Compares covsplat with its peers: same scans, same call, same number of threads.

python3 bench/peers/run.py --covsplat build/release/apps/covsplat --recording DIR --threads 2
"""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from pathlib import Path

os.environ.setdefault("OMP_WAIT_POLICY", "passive")  # else idle threads burn a shared machine

import map_runs
import page
import plots
import report
import stages
import track_runs
from options import add_options, recordings
from recording import Recording


def main() -> int:
    options = parse(sys.argv[1:])
    load_before = os.getloadavg()
    results = page.Results()
    for recording in recordings(options):
        compare(recording, options, results)
    about = page.circumstances("python3 " + shlex.join(sys.argv), load_before)
    write(results, about, options)
    return 0 if results.complete else 1


def parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--covsplat", type=Path, help="the binary; without it no maps are judged")
    parser.add_argument("--json", type=Path, metavar="FILE", help="default: OUT/peers.json")
    add_options(parser, out="bench_out", mark="*track*")
    return parser.parse_args(arguments)


def compare(recording: Recording, options: argparse.Namespace, results: page.Results) -> None:
    """The trajectories first: the maps of estimated poses are made with covsplat's."""
    out = options.out / recording.name
    out.mkdir(parents=True, exist_ok=True)
    for name, run in track_runs.methods(recording, options.covsplat, out, options.threads):
        if options.only.search(f"{recording.name}, {name}"):
            results.tracks.append(track_runs.measure(recording, name, options.threads, run))
            print(" | ".join(report.cells(results.tracks[-1])), flush=True)
    if options.covsplat is None or recording.true_mesh is None or recording.name in options.no_map:
        return
    setting = map_runs.Setting(options.covsplat, recording, out, options.voxel, options.threads)
    chosen = [
        (name, make)
        for name, make in map_runs.methods(setting)
        if options.only.search(f"{recording.name}, map, {name}")
    ]
    for row in map_runs.measure(setting, chosen):
        results.maps.append(row)
        print(" | ".join(map_runs.cells(row)), flush=True)


def write(results: page.Results, about: dict[str, object], options: argparse.Namespace) -> None:
    options.out.mkdir(parents=True, exist_ok=True)
    text = page.markdown(results, about) + stages.markdown(options.out)
    (options.json or options.out / "peers.json").write_text(page.as_json(results, about))
    pictures = options.out if options.update is None else options.update.parent
    drawn = plots.draw(results, pictures)
    text += "".join(f"\n![{title}]({file.name})\n" for title, file in drawn)
    (options.out / "peers.md").write_text(text)
    if options.update is not None:
        page.update(options.update, "peers", text)
    print("\n" + text)


if __name__ == "__main__":
    sys.exit(main())
