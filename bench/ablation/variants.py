"""The rows of the paper's four tables of ablations, and how covsplat is told to be one of them."""

from __future__ import annotations

from dataclasses import dataclass

SPAWN = "mapping.spawn.mode"
MANAGE = "mapping.manage.mode"
FEEDBACK = "mapping.feedback.mode"
LOSS = "mapping.engine.loss"


@dataclass(frozen=True)
class Variant:
    name: str
    settings: tuple[str, ...] = ()


FULL = Variant("full")
NO_NORMAL = Variant("no_normal", (f"{LOSS}.gicp_normal=0",))


@dataclass(frozen=True)
class PaperRow:
    """As printed there, for its two sequences: quad (Newer College) and Keble College (Oxford)."""

    quad: tuple[str, ...]
    keble: tuple[str, ...]


@dataclass(frozen=True)
class Row:
    label: str
    variant: Variant
    paper: PaperRow | None


@dataclass(frozen=True)
class Table:
    title: str
    columns: tuple[str, ...]  # of ours: names in measures.COLUMNS
    paper_columns: tuple[str, ...]
    rows: tuple[Row, ...]


def row(label: str, variant: Variant, quad: str, keble: str = "") -> Row:
    return Row(label, variant, PaperRow(tuple(quad.split()), tuple(keble.split())))


QUALITY = ("ATE", "Acc", "Com", "C-L1", "F", "strict F")
PAPER_QUALITY = ("ATE m", "Acc cm", "Com cm", "C-L1 cm", "F")
SIZES = ("Acc", "Com", "C-L1", "F", "strict F", "Gaussians", "map MB")
PAPER_SIZES = ("Acc cm", "Com cm", "C-L1 cm", "F", "Gaussians", "map MB")

TRACKING_TO_MAPPING = Table(
    "From tracking to mapping",
    QUALITY,
    PAPER_QUALITY,
    (
        row(
            "A. without initialisation (all identity)",
            Variant("spawn_identity", (f"{SPAWN}=identity",)),
            "0.088 8.495 35.885 22.190 48.688",
            "0.283 15.202 32.837 24.020 44.123",
        ),
        row(
            "B. without range-adaptive scale",
            Variant("spawn_no_range_scale", (f"{SPAWN}=no_range_scale",)),
            "0.087 8.016 15.254 11.635 85.996",
            "0.479 16.451 28.666 22.558 51.582",
        ),
        row(
            "C. without initial opacity",
            Variant("spawn_no_opacity", (f"{SPAWN}=no_opacity",)),
            "0.085 7.809 15.091 11.450 86.020",
            "0.451 15.735 28.685 22.210 53.173",
        ),
        row(
            "D. without G-ICP normals",
            NO_NORMAL,
            "0.099 8.040 15.160 11.600 85.899",
            "0.325 15.678 27.179 21.428 55.522",
        ),
        row(
            "E. without feature-aware management",
            Variant("not_feature_aware", ("mapping.manage.feature_aware=false",)),
            "0.089 8.245 15.212 11.729 86.237",
            "0.222 12.942 25.816 19.379 63.217",
        ),
        row(
            "F. full",
            FULL,
            "0.079 7.624 15.020 11.320 86.776",
            "0.212 12.713 24.568 18.640 64.024",
        ),
    ),
)

MANAGEMENT = Table(
    "Map management",
    SIZES,
    PAPER_SIZES,
    (
        row(
            "opacity pruning",
            Variant("manage_opacity", (f"{MANAGE}=opacity",)),
            "7.691 14.964 11.327 87.179 239175 9.6",
            "13.219 24.664 18.942 64.863 546400 21.9",
        ),
        row(
            "split",
            Variant("manage_split", (f"{MANAGE}=split",)),
            "7.597 14.504 11.051 88.040 248060 9.9",
            "15.718 27.220 21.469 56.681 591567 23.7",
        ),
        row(
            "plane prune",
            Variant("manage_plane", (f"{MANAGE}=plane",)),
            "7.708 15.100 11.404 86.521 119285 4.8",
            "14.694 26.163 20.429 59.327 341435 13.7",
        ),
        row(
            "split and plane prune",
            FULL,
            "7.624 15.020 11.320 86.776 129885 5.0",
            "12.713 24.568 18.640 64.024 344473 13.8",
        ),
    ),
)

MAPPING_TO_TRACKING = Table(
    "From mapping to tracking",
    ("ATE", "tracking scans/s", "iterations", "unmatched"),
    ("ATE m", "tracking scans/s"),
    (
        row("frozen map", Variant("feedback_frozen", (f"{FEEDBACK}=frozen",)), "0.099 17.69"),
        row(
            "without geometric weight",
            Variant("feedback_no_weight", (f"{FEEDBACK}=no_weight",)),
            "0.088 22.66",
        ),
        row(
            "without confidence and filter",
            Variant("feedback_no_filter", (f"{FEEDBACK}=no_filter",)),
            "0.085 20.47",
        ),
        row("full", FULL, "0.079 23.70"),
    ),
)

LOSSES = Table(
    "Losses",
    QUALITY,
    PAPER_QUALITY,
    (
        row(
            "without G-ICP normals",
            NO_NORMAL,
            "0.097 8.119 15.247 11.683 85.844",
            "0.346 16.274 27.222 22.248 54.206",
        ),
        row(
            "without scale",
            Variant("no_scale", (f"{LOSS}.scale=0",)),
            "0.086 7.788 15.859 11.823 85.732",
            "0.262 21.017 35.305 28.161 33.924",
        ),
        row(
            "without opacity",
            Variant("no_opacity", (f"{LOSS}.opacity=0",)),
            "0.084 8.681 16.230 12.456 83.217",
            "0.328 16.283 27.678 21.980 52.893",
        ),
        row(
            "full",
            FULL,
            "0.079 7.624 15.020 11.320 86.776",
            "0.212 12.713 24.568 18.640 64.024",
        ),
    ),
)

TABLES = (TRACKING_TO_MAPPING, MANAGEMENT, MAPPING_TO_TRACKING, LOSSES)


def all_variants() -> list[Variant]:
    """Each once, in the order of the tables."""
    return list(dict.fromkeys(row.variant for table in TABLES for row in table.rows))
