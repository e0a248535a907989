"""Runs the binary on small simulated recordings, good and bad, as a user would, and checks exit
codes, messages and files.

usage: check_run.py COVSPLAT [CASE ...]
"""
import json
import pathlib
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import zlib

import csmap
from cases import LIMIT_S, binary, case, expect, run_cases

SCANS = 12
SMALL = ["-s", "lidar.rows=32", "-s", "lidar.columns=256"]
FILES = ["config.yaml", "frames.csv", "keyframes.csv", "keyframes_tum.txt", "map.ply",
         "metrics.json", "report.html", "trajectory_kitti.txt", "trajectory_tum.txt"]


class Bench:
    """A scratch folder with one good recording, and the binary."""

    def __init__(self, binary: str, folder: str):
        self.binary = binary
        self.folder = pathlib.Path(folder)
        self.good = self.folder / "good"
        call = self.call("simulate", "courtyard", "-o", self.good, "-n", str(SCANS), *SMALL)
        expect(call, 0)

    def call(self, *arguments, **options):
        return subprocess.run([self.binary, *map(str, arguments)], cwd=self.folder, text=True,
                              capture_output=True, timeout=LIMIT_S, **options)

    def start(self, *arguments):
        return subprocess.Popen([self.binary, *map(str, arguments)], cwd=self.folder, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def run(self, recording, name, *arguments):
        """`covsplat run` into a fresh folder."""
        return self.call("run", recording, "-o", self.folder / name, *arguments)

    def copy(self, name):
        return pathlib.Path(shutil.copytree(self.good, self.folder / name))

    def scan(self, recording, index):
        return recording / "velodyne" / f"{index:06}.bin"


def poses(folder):
    """Rows of the TUM file; checks that every line is whole."""
    text = (folder / "trajectory_tum.txt").read_text()
    assert text.endswith("\n") or not text, "the last line is cut"
    rows = [[float(word) for word in line.split()] for line in text.splitlines()]
    assert all(len(row) == 8 for row in rows), "a line is cut"
    return rows


def metrics(folder):
    return json.loads((folder / "metrics.json").read_text())


def check_rows(folder, recording):
    """A pose for every scan, those that were left out included, in both files."""
    rows = poses(folder)
    stamps = [float(line) for line in (recording / "times.txt").read_text().splitlines()]
    assert len(rows) == len(stamps), rows
    late = [abs(row[0] - stamp) for row, stamp in zip(rows, stamps)]
    assert max(late) < 2e-3, late  # a scan's middle, whose first or last columns may be empty
    kitti = [[float(word) for word in line.split()]
             for line in (folder / "trajectory_kitti.txt").read_text().splitlines()]
    assert [row[3::4] for row in kitti] == [row[1:4] for row in rows]


def set_points(recording, index, points, times=None):
    """Replaces a scan by (x, y, z, intensity) rows."""
    data = b"".join(struct.pack("<4f", *point) for point in points)
    (recording / "velodyne" / f"{index:06}.bin").write_bytes(data)
    times = [0.0] * len(points) if times is None else times
    (recording / "timestamps" / f"{index:06}.bin").write_bytes(
        struct.pack(f"<{len(times)}f", *times))


@case
def a_good_run_writes_everything(bench):
    call = bench.run(bench.good, "out")
    expect(call, 0, out="report.html")
    out = bench.folder / "out"
    missing = [name for name in FILES if not (out / name).is_file()]
    assert not missing, f"not written: {missing}"
    assert len(poses(out)) == SCANS
    assert len((out / "trajectory_kitti.txt").read_text().splitlines()) == SCANS
    assert len((out / "frames.csv").read_text().splitlines()) == SCANS + 1
    found = metrics(out)
    assert found["trajectory_error"]["ate_translation_m"]["rmse"] < 0.1, found["trajectory_error"]
    assert found["scans"]["lost"] == 0
    latency = found["time"]["latency_ms"]
    assert 0 < latency["p50"] <= latency["p95"] <= latency["p99"] <= latency["max"], latency
    assert found["memory"]["views_bytes"] > 0 and found["memory"]["places_bytes"] > 0
    rows = (out / "keyframes.csv").read_text().splitlines()[1:]
    steps = [int(row.split(",")[2]) for row in rows]
    assert len(steps) == found["map"]["keyframes"], rows
    assert sum(steps) == found["map"]["optimizer_steps"], rows
    assert found["map"]["steps_per_keyframe"]["max"] == max(steps), found["map"]
    expect(bench.call("info", out / "map.ply", "--json"), 0, out='"gaussians"')
    expect(bench.call("info", out), 0, out="gaussians")
    expect(bench.call("eval", "traj", out / "trajectory_tum.txt",
                      bench.good / "gt_tum.txt"), 0, out=f"{SCANS} poses compared")


@case
def the_saved_configuration_gives_the_same_run(bench):
    expect(bench.run(bench.good, "first", "--deterministic", "--threads", "1"), 0)
    first = bench.folder / "first"
    expect(bench.run(bench.good, "again", "-c", first / "config.yaml"), 0, out="as configured")
    expect(bench.run(bench.good, "other", "--deterministic", "--threads", "2"), 0)
    for name in ["again", "other"]:
        for file in ["trajectory_tum.txt", "trajectory_kitti.txt", "keyframes_tum.txt", "map.ply"]:
            same = (first / file).read_bytes() == (bench.folder / name / file).read_bytes()
            assert same, f"{file} of {name} differs"


@case
def a_finished_run_becomes_meshes_clouds_and_renderings(bench):
    expect(bench.run(bench.good, "run", "--threads", "2"), 0)
    run = bench.folder / "run"
    coarse = ["--voxel", "0.3", "-s", "view.columns=256"]
    expect(bench.call("mesh", run, *coarse), 0, out="triangles")
    assert (run / "mesh.ply").read_bytes().startswith(b"ply")
    expect(bench.call("mesh", run, "-o", "a.glb", *coarse, "--threads", "1"), 0)
    assert (bench.folder / "a.glb").read_bytes().startswith(b"glTF")
    expect(bench.call("mesh", run, "-o", "a.obj", *coarse, "-s", "max_tile_blocks=200"), 0)
    assert (bench.folder / "a.obj").read_text().startswith("v ")
    for name in ["a.ply", "a.pcd"]:
        expect(bench.call("export", run, "-o", name), 0, out="points")
    expect(bench.call("render", run, "-o", "seen", "--every", "4"), 0, out=f"{SCANS // 4} views")
    for folder in ["range", "normal", "opacity"]:
        images = list((bench.folder / "seen" / folder).glob("*.png"))
        assert len(images) == SCANS // 4, images
    expect(bench.call("info", bench.folder / "seen"), 0, out="KITTI")
    expect(bench.call("render", run, "-o", "seen"), 4, err="not empty")
    expect(bench.call("render", run, "-o", "seen", "--overwrite", "--sensor", "vlp-16", "--poses",
                      run / "trajectory_tum.txt", "--every", "6"), 0, out="16 x ")
    assert len(list((bench.folder / "seen" / "range").glob("*.png"))) == SCANS // 6


@case
def a_finished_run_is_optimized_the_same_way_every_time(bench):
    expect(bench.run(bench.good, "draft", "--threads", "2"), 0)
    draft = bench.folder / "draft"
    expect(bench.call("optimize", draft, "-o", "best", "--steps", "3"), 0, out="second pass")
    best = bench.folder / "best"
    assert all((best / name).is_file() for name in [*FILES, "loops/loops.csv"])
    last_steps = 3 * metrics(draft)["map"]["keyframes"]
    found = metrics(best)["map"]
    assert found["optimizer_steps"] == 20 * found["keyframes"] + last_steps, found
    assert [row[0] for row in poses(best)] == [row[0] for row in poses(draft)]
    expect(bench.call("optimize", draft, "-o", "best2", "--steps", "3", "--threads", "1"), 0)
    for file in ["trajectory_tum.txt", "map.ply"]:
        assert (best / file).read_bytes() == (bench.folder / "best2" / file).read_bytes(), file
    expect(bench.call("optimize", draft, "-o", "best"), 4, err="--overwrite")
    expect(bench.call("optimize", bench.good, "-o", "x"), 3, err="config.yaml")
    expect(bench.call("optimize", "nowhere", "-o", "x"), 3, err="nowhere")
    moved = json.loads((draft / "metrics.json").read_text()) | {"recording": "gone"}
    (draft / "metrics.json").write_text(json.dumps(moved))
    expect(bench.call("optimize", draft, "-o", "x"), 3, err="--recording")
    expect(bench.call("optimize", draft, "-o", "x", "--recording", "gone"), 3, err="gone")
    expect(bench.call("optimize", draft, "-o", "found", "--recording", bench.good, "--steps",
                      "0"), 0)


@case
def a_pose_graph_with_a_prior_added_moves_a_finished_run(bench):
    expect(bench.run(bench.good, "drifted", "--deterministic", "-s", "keyframe.max_scans=3"), 0)
    run = bench.folder / "drifted"
    graph = (run / "pose_graph.g2o").read_text()
    last = max(int(line.split()[1]) for line in graph.splitlines() if line.startswith("VERTEX"))
    vertex = next(line for line in graph.splitlines() if line.startswith(f"VERTEX_SE3:QUAT {last} "))
    x, *rest = vertex.split()[2:]
    sure = " ".join("1e12" if row == column else "0" for row in range(6) for column in range(row, 6))
    prior = f"EDGE_SE3_PRIOR {last} 0 {float(x) + 0.05} {' '.join(rest)} {sure}"
    (bench.folder / "same.g2o").write_text(graph)
    (bench.folder / "moved.g2o").write_text(graph + prior + "\n")
    (bench.folder / "short.g2o").write_text("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n")
    ends = []
    for name in ["same", "moved"]:
        expect(bench.call("optimize", run, "-o", name, "--graph", bench.folder / f"{name}.g2o",
                          "--steps", "0", "-s", "loops.stitch.enabled=false"), 0)
        ends.append(float(poses(bench.folder / name)[-1][1]))
    assert abs(ends[0] - float(poses(run)[-1][1])) < 0.01, ends
    assert abs(ends[1] - ends[0] - 0.05) < 0.01, ends
    expect(bench.call("optimize", run, "-o", "x", "--graph", "nowhere.g2o"), 3, err="nowhere.g2o")
    expect(bench.call("optimize", run, "-o", "x", "--graph", bench.folder / "short.g2o"), 3,
           err="1 vertices")
    assert not (bench.folder / "x").exists()


@case
def maps_convert_between_all_formats_and_every_verb_reads_them(bench):
    expect(bench.run(bench.good, "converted", "--deterministic"), 0)
    run = bench.folder / "converted"
    coarse = ["--voxel", "0.3", "-s", "view.columns=256", "--quiet"]
    count = json.loads(bench.call("info", run / "map.ply", "--json").stdout)["gaussians"]
    for source, target in [(run, "a.csmap"), ("a.csmap", "b.ply"), ("b.ply", "c.spz"),
                           ("c.spz", "d.csmap"), ("d.csmap", "e.spz"), ("e.spz", "f.ply"),
                           (run / "map.ply", "g.csmap")]:
        expect(bench.call("export", source, "-o", target), 0, out="bytes each")
        facts = json.loads(bench.call("info", target, "--json").stdout)
        assert facts["gaussians"] == count, facts
    different = list(csmap.differences((bench.folder / "a.csmap").read_bytes(),
                                       (bench.folder / "b.ply").read_bytes()))
    assert not different, different[:5]
    # Only what a run or another .csmap says is known: not what a PLY or an SPZ leaves out.
    facts = json.loads(bench.call("info", "a.csmap", "--json").stdout)
    assert facts["bytes_per_gaussian"] < 20, facts  # a small map: its configuration weighs
    assert "32 beams" in facts["sensor"] and facts["keyframe_poses"] == "in the file", facts
    assert "confidence" in facts["signals"] and facts["keyframes"] >= 1, facts
    expect(bench.call("info", "a.csmap"), 0, out="csmap, version 1")
    for name in ["a.csmap", "c.spz"]:
        expect(bench.call("eval", "map", name, bench.good / "gt_mesh.ply"), 0, out="F-score")
    expect(bench.call("info", "c.spz"), 0, out="spz, version 3")
    # A .csmap stands for the run it was made of ...
    expect(bench.call("mesh", "a.csmap", "-o", "whole.ply", *coarse), 0)
    expect(bench.call("render", "a.csmap", "-o", "a.seen"), 0, out="32 x ")
    # ... also in its folder, when map.ply has gone.
    expect(bench.call("export", run, "-o", run / "map.csmap"), 0)
    (run / "map.ply").unlink()
    expect(bench.call("mesh", run, "-o", "again.ply", *coarse), 0)
    expect(bench.call("export", run), 0, out="points")
    # Other maps lack the sensor and the way, which can be given.
    for name in ["b.ply", "c.spz"]:
        expect(bench.call("mesh", name, *coarse), 3, err="a .csmap")
        expect(bench.call("render", name, "-o", "x"), 3, err="a .csmap")
        expect(bench.call("render", name, "-o", "x", "--sensor", "vlp-16"), 3, err="--poses")
        expect(bench.call("render", name, "-o", name + ".seen", "--sensor", "vlp-16", "--poses",
                          run / "trajectory_tum.txt", "--every", "6"), 0, out="16 x ")


@case
def exports_say_what_they_write_and_what_is_wrong(bench):
    expect(bench.run(bench.good, "exported", "--deterministic"), 0)
    expect(bench.call("export", "exported", "-o", "a.ply"), 0, out="points")
    expect(bench.call("info", "a.ply"), 3, err="not a map of Gaussians")
    expect(bench.call("export", "exported", "-o", "a.ply", "--as", "gaussians"), 0, out="Gaussians")
    expect(bench.call("export", "a.ply", "-o", "b.ply", "--as", "points"), 0, out="points")
    expect(bench.call("export", "a.ply", "-o", "b.pcd"), 0, out="points")
    expect(bench.call("export", "exported", "-o", "b.pcd", "--as", "gaussians"), 2, err=".csmap")
    expect(bench.call("export", "exported", "-o", "b.spz", "--as", "points"), 2, err=".pcd")
    expect(bench.call("export", "exported", "-o", "some.csmap", "--min-opacity", "0.5"), 0)
    expect(bench.call("export", "exported", "-o", "all.csmap"), 0)
    some, all_of_it = [(bench.folder / name).read_bytes() for name in ["some.csmap", "all.csmap"]]
    assert len(some) < len(all_of_it)
    (bench.folder / "bad.csmap").write_bytes(all_of_it[:-40] + b"?" + all_of_it[-39:])
    (bench.folder / "cut.csmap").write_bytes(all_of_it[:-40])
    (bench.folder / "new.csmap").write_bytes(b"CSMAP")
    for name, error in [("bad", "checksum differs"), ("cut", "truncated"), ("new", "truncated")]:
        for call in [["info"], ["export", "-o", "x.ply"], ["mesh"], ["render", "-o", "x"]]:
            expect(bench.call(*call, name + ".csmap"), 3, err=f"{name}.csmap: ")
    # A configuration with keys that this version does not know is no obstacle.
    count, sections = csmap.sections(all_of_it)
    assert sections[0][0] == "CONF", sections[0]
    text = b"not_yet_known: 1\n"
    sections[0] = ("CONF", struct.pack("<I", len(text)) + zlib.compress(text))
    (bench.folder / "later.csmap").write_bytes(csmap.pack(count, sections))
    expect(bench.call("render", "later.csmap", "-o", "later.seen", "--every", "9"), 0,
           err="not_yet_known")
    for name in ["full.csmap", "full.spz"]:
        (bench.folder / (name + ".tmp")).symlink_to("/dev/full")
        expect(bench.call("export", "exported", "-o", name), 4, err="No space left on device")
        assert not (bench.folder / name).exists()


@case
def broken_runs_are_input_errors_that_name_the_file(bench):
    expect(bench.run(bench.good, "whole"), 0)
    whole = bench.folder / "whole"
    (bench.folder / "nothing").mkdir()
    for verb in ["mesh", "render", "export"]:
        expect(bench.call(verb, "nowhere"), 3, err="nowhere")
        expect(bench.call(verb, bench.folder / "nothing"), 3, err="config.yaml")
    expect(bench.call("mesh", whole, "-o", "mesh.stl"), 2, err=".glb")
    expect(bench.call("mesh", whole, "-s", "voxel=1"), 2, err="voxel_m")
    expect(bench.call("mesh", whole, "--method", "cubes"), 2, err="poisson")
    expect(bench.call("export", whole, "-o", "cloud.las"), 2, err=".pcd")
    expect(bench.call("render", whole, "--sensor", "os9", "-o", "x"), 2, err="os0-128")
    expect(bench.call("render", whole, "--poses", "no.txt", "-o", "x"), 3, err="no.txt")
    (whole / "keyframes_tum.txt").write_text("")
    expect(bench.call("mesh", whole), 3, err="not of one run")
    (whole / "keyframes_tum.txt").write_text("0 1 2\n")
    expect(bench.call("mesh", whole), 3, err="keyframes_tum.txt:1")
    (whole / "keyframes_tum.txt").unlink()
    expect(bench.call("mesh", whole), 3, err="keyframes_tum.txt")


@case
def wrong_requests_are_usage_errors(bench):
    expect(bench.run(bench.good, "x", "--nonsense"), 2, err="--nonsense")
    expect(bench.run(bench.good, "x", "--rate", "2"), 2, err="--realtime")
    expect(bench.run(bench.good, "x", "-s", "gicp.max_iteration=3"), 2, err="gicp.max_iterations")
    expect(bench.run(bench.good, "x", "-s", "keyframe.min_overlap=7"), 2, err="0 to 1")
    expect(bench.run(bench.good, "x", "--format", "las"), 2, err="kitti")
    expect(bench.run(bench.good, "x", "-s", "mapping.spawn.min_scale_m=0.9"), 2,
           err="below mapping.spawn.max_scale_m")
    expect(bench.call("config", "check", "-s", "preprocess.min_range_m=90", "-s",
                      "preprocess.max_range_m=9"), 2, err="below preprocess.max_range_m")
    expect(bench.run(bench.good, "x", "-s", "sensor.columns=30", "-s",
                     "sensor.elevation_deg=[10,0,-10]"), 2, err="multiple of 4")
    expect(bench.run(bench.good, "x", "-s", "sensor.columns=32", "-s",
                     "sensor.elevation_deg=[0,10]"), 2, err="top beam first")
    expect(bench.call("simulate", "atlantis", "-o", "x"), 2, err="courtyard")
    expect(bench.call("simulate", "--list"), 0, out="courtyard")
    expect(bench.call("simulate", "--list", "--json"), 0, out='"hdl-64e"')
    expect(bench.call("simulate", "courtyard", "-o", "x", "--sensor", "os9"), 2, err="vlp-16")
    expect(bench.call("simulate", "courtyard", "-o", "x", "--motion", "fly"), 2, err="walking")
    expect(bench.call("simulate", "tunnel", "-o", "x", "--laps", "2"), 2, err="choose 1")
    expect(bench.call("simulate", "no_mesh.obj", "-o", "x"), 3, err="no_mesh.obj")
    assert not (bench.folder / "x").exists()


@case
def simulated_recordings_have_their_truth_beside_them(bench):
    out = bench.folder / "livox"
    expect(bench.call("simulate", "street", "-o", out, "-n", 2, "--sensor", "livox-mid70",
                      "-s", "lidar.rosette.points_per_s=2000"), 0, out="rosette")
    for name in ("gt_tum.txt", "gt_mesh.ply", "sensor.yaml"):
        assert (out / name).stat().st_size > 0, name
    for scan in ("000000", "000001"):
        labels = (out / f"labels/{scan}.label").stat().st_size // 4
        assert labels == (out / f"velodyne/{scan}.bin").stat().st_size // 16 > 100, scan
    preview = bench.folder / "street.png"
    expect(bench.call("simulate", "street", "--preview", preview), 0)
    assert preview.read_bytes()[:4] == b"\x89PNG"
    # A run takes the sensor file as it is.
    expect(bench.run(bench.good, "own_sensor", "-c", bench.good / "sensor.yaml"), 0,
           out="as configured")


@case
def missing_and_empty_folders_are_input_errors(bench):
    expect(bench.run("no_such_folder", "x"), 3, err="no_such_folder")
    (bench.folder / "empty").mkdir()
    expect(bench.run("empty", "x"), 3, err="empty")
    expect(bench.call("info", "empty"), 3, err="empty")
    expect(bench.run(bench.good, "x", "--gt", "no_truth.txt"), 3, err="no_truth.txt")
    expect(bench.run(bench.good, "x", "--first", "500"), 2, err="has 12 scans")


@case
def a_truncated_scan_is_left_out(bench):
    recording = bench.copy("truncated")
    file = bench.scan(recording, 5)
    file.write_bytes(file.read_bytes()[:-7])
    call = bench.run(recording, "out_truncated")
    expect(call, 0, err="000005.bin")
    assert metrics(bench.folder / "out_truncated")["scans"]["damaged"] == 1
    check_rows(bench.folder / "out_truncated", bench.good)


@case
def scans_damaged_at_the_ends_keep_their_rows_in_the_kitti_file(bench):
    recording = bench.copy("damaged_ends")
    for i in [0, SCANS - 1]:
        bench.scan(recording, i).write_bytes(b"short")
    expect(bench.run(recording, "out_damaged_ends"), 0)
    out = bench.folder / "out_damaged_ends"
    assert len(poses(out)) == SCANS - 2
    kitti = (out / "trajectory_kitti.txt").read_text().splitlines()
    assert len(kitti) == SCANS
    assert kitti[0] == kitti[1] and kitti[-1] == kitti[-2]


@case
def only_damaged_scans_are_an_error(bench):
    recording = bench.copy("all_damaged")
    for i in range(SCANS):
        bench.scan(recording, i).write_bytes(b"short")
    expect(bench.run(recording, "out_all_damaged"), 3, err="not one scan could be used")


@case
def points_that_are_not_finite_do_not_count(bench):
    recording = bench.copy("nan")
    nan, inf = float("nan"), float("inf")
    for i in range(SCANS):
        file = bench.scan(recording, i)
        data = bytearray(file.read_bytes())
        for k in range(0, len(data) // 16, 10):
            bad = [(nan, nan, nan, 0.0), (inf, 0.0, 0.0, 0.0), (0.0, -inf, nan, 0.0)][k % 3]
            data[16 * k:16 * k + 16] = struct.pack("<4f", *bad)
        file.write_bytes(data)
    expect(bench.run(recording, "out_nan"), 0)
    found = metrics(bench.folder / "out_nan")
    assert found["scans"]["lost"] == 0
    assert found["trajectory_error"]["ate_translation_m"]["rmse"] < 0.1


@case
def empty_scans_keep_their_row(bench):
    for name, empty in [("empty_middle", [6]), ("empty_start", [0, 1]), ("empty_end", [SCANS - 1])]:
        recording = bench.copy(name)
        for i in empty:
            set_points(recording, i, [])
        expect(bench.run(recording, "out_" + name), 0)
        rows = poses(bench.folder / ("out_" + name))
        assert len(rows) == SCANS, f"{name}: {len(rows)} poses"
    recording = bench.copy("all_empty")
    for i in range(SCANS):
        set_points(recording, i, [])
    expect(bench.run(recording, "out_all_empty"), 3, err="none of the 12 scans has points")


@case
def one_scan_makes_a_map(bench):
    expect(bench.run(bench.good, "out_one", "-n", "1"), 0)
    assert len(poses(bench.folder / "out_one")) == 1
    assert metrics(bench.folder / "out_one")["map"]["gaussians"] > 100


@case
def time_that_goes_backwards_is_left_out(bench):
    recording = bench.copy("backwards")
    times = (recording / "times.txt").read_text().splitlines()
    times[6] = times[5]  # a driver that repeats a stamp
    (recording / "times.txt").write_text("\n".join(times) + "\n")
    expect(bench.run(recording, "out_backwards"), 0, err="not later than")
    assert metrics(bench.folder / "out_backwards")["scans"]["backwards"] == 1
    check_rows(bench.folder / "out_backwards", bench.good)


@case
def outputs_that_cannot_be_written_are_output_errors(bench):
    (bench.folder / "file").write_text("x")
    expect(bench.run(bench.good, "file/out"), 4, err="cannot make the output folder")
    expect(bench.call("run", bench.good, "-o", "/proc/covsplat"), 4, err="/proc/covsplat")
    (bench.folder / "full").mkdir()
    (bench.folder / "full" / "precious").write_text("x")
    expect(bench.run(bench.good, "full"), 4, err="--overwrite")
    assert (bench.folder / "full" / "precious").read_text() == "x"


@case
def a_full_disk_is_an_output_error(bench):
    for name in ["trajectory_tum.txt", "frames.csv", "map.ply.tmp", "report.html.tmp"]:
        out = bench.folder / ("full_" + name)
        out.mkdir()
        (out / name).symlink_to("/dev/full")
        call = bench.run(bench.good, out.name, "--overwrite")
        expect(call, 4, err=f"{name}: cannot be written: No space left on device")
        written = (out / "trajectory_kitti.txt").read_text().splitlines()
        if name.endswith(".tmp"):
            assert len(written) == SCANS
            assert (out / "metrics.json").is_file()


@case
def interrupted_runs_finish_with_what_there_is(bench):
    recording = long_recording(bench)
    for which in [signal.SIGINT, signal.SIGTERM]:
        out = bench.folder / f"interrupted_{which}"
        run = bench.start("run", recording, "-o", out, "--realtime")
        wait_for_poses(out, 3)
        run.send_signal(which)
        stdout, stderr = run.communicate(timeout=LIMIT_S)
        assert run.returncode == 130, f"exit code {run.returncode}\n{stdout}\n{stderr}"
        assert 3 <= len(poses(out)), "poses are lost"
        assert all((out / name).is_file() for name in FILES)
        assert metrics(out)["interrupted"]
        expect(bench.call("info", out / "map.ply"), 0)


@case
def killed_runs_lose_nothing_that_was_tracked(bench):
    out = bench.folder / "killed"
    run = bench.start("run", bench.good, "-o", out, "--realtime")
    seen = wait_for_poses(out, 3)
    run.kill()
    run.wait(timeout=60)
    rows = poses(out)
    assert len(rows) >= seen
    assert (out / "config.yaml").is_file()
    expect(bench.call("eval", "traj", out / "trajectory_tum.txt",
                      bench.good / "gt_tum.txt"), 0)


def long_recording(bench):
    """Lasts 100 s, so that a slow machine is not at its end either when a signal comes."""
    recording = bench.folder / "long"
    if not recording.exists():
        expect(bench.call("simulate", "courtyard", "-o", recording, "-n", 200, *SMALL,
                          "-s", "lidar.scan_rate_hz=2"), 0)
    return recording


def wait_for_poses(out, count):
    """Until so many poses are written; returns how many there are."""
    file = out / "trajectory_tum.txt"
    end = time.monotonic() + LIMIT_S
    while time.monotonic() < end:
        rows = file.read_text().count("\n") if file.exists() else 0
        if rows >= count:
            return rows
        time.sleep(0.01)
    raise AssertionError(f"{file}: no {count} poses in time")


@case
def realtime_runs_count_what_they_drop(bench):
    expect(bench.run(bench.good, "realtime", "--realtime"), 0)
    scans = metrics(bench.folder / "realtime")["scans"]
    assert scans["tracked"] + scans["dropped"] == SCANS, scans


@case
def given_poses_are_followed(bench):
    truth = bench.good / "gt_tum.txt"
    expect(bench.run(bench.good, "followed", "--poses", truth), 0)
    error = metrics(bench.folder / "followed")["trajectory_error"]["ate_translation_m"]
    assert error["max"] < 1e-3, error


@case
def parts_of_a_recording_can_be_run(bench):
    expect(bench.run(bench.good, "part", "--first", "2", "-j", "2", "-n", "3"), 0)
    lines = (bench.folder / "part" / "frames.csv").read_text().splitlines()[1:]
    assert [line.split(",")[0] for line in lines] == ["2", "4", "6"], lines


@case
def info_tells_what_a_recording_is(bench):
    call = bench.call("info", bench.good, "--json")
    expect(call, 0)
    facts = json.loads(call.stdout)
    assert facts["scans"] == SCANS and facts["ground_truth"].endswith("gt_tum.txt")
    assert "32 beams" in facts["sensor"], facts["sensor"]
    assert 0.05 < facts["point_time_span_s"] < 0.11
    bare = bench.copy("bare")
    shutil.rmtree(bare / "timestamps")
    expect(bench.call("info", bare), 0, out="deskew.time_source=azimuth")


@case
def eval_judges_trajectories(bench):
    truth = bench.good / "gt_tum.txt"
    expect(bench.call("eval", "traj", truth, truth, "--json"), 0, out='"rmse": 0.0')
    expect(bench.call("eval", "traj", bench.good / "poses.txt", truth), 2, err="--times")
    expect(bench.call("eval", "traj", bench.good / "poses.txt", truth, "--times",
                      bench.good / "times.txt", "--align", "none"), 0)
    expect(bench.call("eval", "traj", "nothing.txt", truth), 3, err="nothing.txt")
    expect(bench.call("eval", "traj", truth, truth, "--align", "maybe"), 2, err="maybe")


@case
def the_demo_runs(bench):
    # Few scans: the demo's sensor has full resolution.
    expect(bench.call("demo", "-o", "demo", "-n", "4"), 0, out="report.html")
    assert (bench.folder / "demo" / "recording" / "times.txt").is_file()
    expect(bench.call("demo", "-o", "demo", "-n", "2"), 4, err="--overwrite")
    expect(bench.call("demo", "-o", "demo", "-n", "2", "--overwrite"), 0)


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(binary(), folder)
        return run_cases(lambda check: check(bench))


if __name__ == "__main__":
    sys.exit(main())
