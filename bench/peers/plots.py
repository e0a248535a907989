"""Bars of the trajectories' errors and of the surfaces' F-scores, as small SVG files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import map_runs
import report
from page import Results

OURS, PEERS = "#c8553d", "#588b8b"
BAR_INCH = 0.24


def draw(results: Results, folder: Path) -> list[tuple[str, Path]]:
    """Titles and files of what there is to draw."""
    drawn = []
    tracks = [row for row in results.tracks if row.ate_rmse_m is not None]
    if tracks:
        file = folder / "benchmarks_trajectories.svg"
        draw_tracks(tracks, file)
        drawn.append(("Errors of the trajectories", file))
    maps = [row for row in results.maps if row.scores is not None]
    if maps:
        file = folder / "benchmarks_surfaces.svg"
        draw_maps(maps, file)
        drawn.append(("F-scores of the surfaces", file))
    return drawn


def colour(method: str) -> str:
    return OURS if method.startswith("covsplat") else PEERS


def recordings(rows: Sequence[report.Row] | Sequence[map_runs.Row]) -> list[str]:
    return list(dict.fromkeys(row.recording for row in rows))


def draw_tracks(rows: list[report.Row], file: Path) -> None:
    """One panel for each recording; logarithmic, as a lost track is metres off."""
    names = recordings(rows)
    counts = [sum(row.recording == name for row in rows) for name in names]
    figure, axes = panels(counts, 1)
    for name, (axis,) in zip(names, axes, strict=True):
        shown = [row for row in rows if row.recording == name]
        errors_m = [row.ate_rmse_m for row in shown]
        bars = axis.barh(
            [row.method for row in shown], errors_m, color=[colour(row.method) for row in shown]
        )
        axis.bar_label(bars, [f"{error_m:.3g}" for error_m in errors_m], padding=2, fontsize=7)
        axis.set_xscale("log")
        axis.set_title(f"{name}: ATE RMSE in metres ({shown[0].measured_by})", fontsize=8)
        axis.margins(x=0.15)
        axis.invert_yaxis()
    save(figure, file)


def draw_maps(rows: list[map_runs.Row], file: Path) -> None:
    """A row of panels for each recording, a panel for each threshold."""
    names = recordings(rows)
    counts = [sum(row.recording == name for row in rows) for name in names]
    figure, axes = panels(counts, len(map_runs.TAUS_M))
    for name, line in zip(names, axes, strict=True):
        shown = [row for row in rows if row.recording == name]
        labels = [f"{row.method}, {row.poses} poses" for row in shown]
        for number, (axis, tau_m) in enumerate(zip(line, map_runs.TAUS_M, strict=True)):
            scores = [row.scores.paper.f_percent[tau_m] for row in shown]
            bars = axis.barh(labels, scores, color=[colour(row.method) for row in shown])
            axis.bar_label(bars, [f"{score:.1f}" for score in scores], padding=2, fontsize=7)
            axis.set_xlim(0, 115)
            axis.set_title(f"{name}: F-score in % at {tau_m:g} m", fontsize=8)
            axis.invert_yaxis()
            if number > 0:
                axis.set_yticklabels([])
    save(figure, file)


def panels(bars: list[int], columns: int) -> tuple:
    """A figure and its axes [rows][columns], where a row is as high as it has bars."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams["svg.hashsalt"] = "covsplat"  # the same bytes for the same numbers
    matplotlib.rcParams["svg.fonttype"] = "none"  # letters as letters: smaller files
    from matplotlib import pyplot

    heights = [count + 2.5 for count in bars]
    figure, axes = pyplot.subplots(
        len(bars),
        columns,
        squeeze=False,
        figsize=(8, BAR_INCH * sum(heights)),
        gridspec_kw={"height_ratios": heights},
        layout="constrained",
    )
    for axis in axes.flat:
        axis.tick_params(labelsize=7)
        axis.spines[["top", "right"]].set_visible(False)
    return figure, axes


def save(figure: object, file: Path) -> None:
    from matplotlib import pyplot

    figure.savefig(file, metadata={"Date": None})
    pyplot.close(figure)
