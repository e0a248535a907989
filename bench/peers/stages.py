"""Where covsplat's time goes: a table from the metrics.json files of its runs."""

from __future__ import annotations

import json
from pathlib import Path

TRACKER = ("preprocess", "align", "deskew", "wait")
MAPPER = ("keyframe", "reliability", "insert", "manage", "target", "optimize")


def markdown(out: Path) -> str:
    """One row for each run below `out`, in milliseconds per scan; nothing without runs."""
    runs = sorted(out.glob("*/covsplat*/metrics.json"))
    if not runs:
        return ""
    header = ["recording", "run", *TRACKER, *(f"{stage} (mapper)" for stage in MAPPER)]
    header += ["optimiser steps", "Gaussians", "whole, scans/s"]
    lines = [header, ["---"] * len(header), *(cells(run) for run in runs)]
    table = "\n".join("| " + " | ".join(line) + " |" for line in lines)
    return f"\nStages of the same covsplat runs, in ms per scan:\n\n{table}\n"


def cells(path: Path) -> list[str]:
    metrics = json.loads(path.read_text())
    scans = max(1, metrics["scans"]["tracked"] + metrics["scans"]["lost"])
    time = metrics["time"]
    tracker = time["stage_ms_per_scan"]
    mapper = time["mapper_thread_ms"]
    return [
        path.parent.parent.name,
        path.parent.name.replace("_", " "),
        *(f"{tracker.get(stage, 0.0):.1f}" for stage in TRACKER),
        *(f"{mapper.get(stage, 0.0) / scans:.1f}" for stage in MAPPER),
        str(metrics["map"]["optimizer_steps"]),
        str(metrics["map"]["gaussians"]),
        f"{time['scans_per_s']:.1f}",
    ]
