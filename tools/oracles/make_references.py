#!/usr/bin/env python3
"""Figures of evo and Open3D that covsplat's own have to meet.

usage: make_references.py --write              makes tests/golden/eval anew
       make_references.py --check [COVSPLAT]   recomputes them and compares, live with the binary

evo measures trajectories. Open3D thins clouds and measures distances between them; the paper's
protocol is then a few lines of NumPy. KITTI's drift has no package: `kitti_drift` follows the
description of the benchmark.
"""
import argparse
import copy
import json
import pathlib
import struct
import subprocess
import sys

import numpy as np
import open3d as o3d
from evo.core import metrics, sync, units
from evo.tools import file_interface

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "tests" / "golden" / "eval"
VOXEL_M = 0.125  # exact in binary, and the clouds start at half a voxel: both grids are the same
TAUS_M = [0.2, 0.1, 0.05]
TOLERANCE = 1e-6
POSES = 240
POINTS = 600


# ---- inputs ---------------------------------------------------------------------------------------

def quaternion(yaw, pitch, roll):
    """x, y, z, w of Rz(yaw) Ry(pitch) Rx(roll)."""
    (sy, sp, sr), (cy, cp, cr) = np.sin([yaw / 2, pitch / 2, roll / 2]), np.cos(
        [yaw / 2, pitch / 2, roll / 2])
    return np.array([sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
                     cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy])


def product(a, b):
    """Of two quaternions x, y, z, w."""
    vector = a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])
    return np.array([*vector, a[3] * b[3] - a[:3] @ b[:3]])


def rotated(q, vector):
    return product(product(q, np.array([*vector, 0.0])), q * [-1, -1, -1, 1])[:3]


def write_trajectories(random):
    """A winding path of about 240 m, and the same with drift and noise in another frame."""
    truth, estimate = [], []
    position, drift = np.zeros(3), np.zeros(3)
    turn = quaternion(2.0, -0.5, 0.3)
    for i in range(POSES):
        yaw, pitch, roll = 0.9 * np.sin(i / 25), 0.1 * np.sin(i / 7), 0.08 * np.cos(i / 11)
        position = position + [np.cos(yaw), np.sin(yaw), 0.05 * np.sin(i / 9)]
        drift = drift + 0.01 * random.standard_normal(3)
        stamp = f"{1700000000 + 0.1 * i:.3f}"
        truth.append([stamp, *position, *quaternion(yaw, pitch, roll)])
        wobble = 0.01 * random.standard_normal(3)
        seen = rotated(turn, 1.004 * position + drift) + [5.0, -3.0, 2.0]
        looks = product(turn, quaternion(*(np.array([yaw, pitch, roll]) + wobble)))
        estimate.append([stamp, *seen, *looks])
    for name, rows in [("truth.tum", truth), ("estimate.tum", estimate)]:
        lines = [" ".join([row[0], *(f"{v:.8f}" for v in row[1:])]) for row in rows]
        (FOLDER / name).write_text("\n".join(lines) + "\n")


def write_cloud(name, points):
    header = ("ply\nformat binary_little_endian 1.0\n"
              f"element vertex {len(points)}\n"
              "property double x\nproperty double y\nproperty double z\nend_header\n")
    body = b"".join(struct.pack("<3d", *point) for point in points)
    (FOLDER / name).write_bytes(header.encode() + body)


def write_clouds(random):
    """A bumpy sheet; the result is noisy, lacks a strip and has outliers."""
    corner = np.full((1, 3), -8.5 * VOXEL_M)
    def sheet():
        xy = random.uniform(corner[0, 0] + 0.01, 1.5, (POINTS - 1, 2))
        return np.column_stack([xy, 0.2 * np.sin(3 * xy[:, 0])])
    result = sheet() + 0.06 * random.standard_normal((POINTS - 1, 3))
    result = np.maximum(result, corner + 0.01)
    result[result[:, 0] > 1.2, 2] += 0.9
    write_cloud("truth.ply", np.vstack([corner, sheet()]))
    write_cloud("result.ply", np.vstack([corner, result]))


# ---- evo ------------------------------------------------------------------------------------------

def evo_figures(metric, pair):
    metric.process_data(pair)
    found = metric.get_all_statistics()
    return {key: found[key] for key in ["rmse", "mean", "median", "max"]}


def trajectory_references():
    truth = file_interface.read_tum_trajectory_file(str(FOLDER / "truth.tum"))
    estimate = file_interface.read_tum_trajectory_file(str(FOLDER / "estimate.tum"))
    truth, estimate = sync.associate_trajectories(truth, estimate, max_diff=1e-4)
    aligned = copy.deepcopy(estimate)
    aligned.align(truth, correct_scale=False)
    position = metrics.PoseRelation.translation_part
    angle = metrics.PoseRelation.rotation_angle_deg

    def rpe(relation, delta, unit):
        return evo_figures(
            metrics.RPE(relation, delta=delta, delta_unit=unit, all_pairs=False,
                        pairs_from_reference=True), (truth, estimate))

    return {
        "matched": truth.num_poses,
        "ate_translation_m": evo_figures(metrics.APE(position), (truth, aligned)),
        "ate_rotation_deg": evo_figures(metrics.APE(angle), (truth, aligned)),
        "rpe_by_pose": {"translation_m": rpe(position, 1, units.Unit.frames),
                        "rotation_deg": rpe(angle, 1, units.Unit.frames)},
        "rpe_by_distance_5m": {"translation_m": rpe(position, 5, units.Unit.meters),
                               "rotation_deg": rpe(angle, 5, units.Unit.meters)},
        "drift_kitti": kitti_drift(truth.poses_se3, estimate.poses_se3),
    }


def kitti_drift(truth, estimate):
    """Mean over segments that start at every 10th pose and end at the first pose beyond their
    length, divided by that length."""
    steps = [np.linalg.norm(b[:3, 3] - a[:3, 3]) for a, b in zip(truth, truth[1:])]
    along = np.concatenate([[0.0], np.cumsum(steps)])
    errors = []
    for length in range(100, 900, 100):
        for first in range(0, len(truth), 10):
            beyond = np.nonzero(along > along[first] + length)[0]
            if len(beyond) == 0:
                continue
            last = beyond[0]
            true_motion = np.linalg.inv(truth[first]) @ truth[last]
            motion = np.linalg.inv(estimate[first]) @ estimate[last]
            error = np.linalg.inv(motion) @ true_motion
            cosine = np.clip((np.trace(error[:3, :3]) - 1) / 2, -1, 1)
            errors.append([100 * np.linalg.norm(error[:3, 3]) / length,
                           np.degrees(np.arccos(cosine)) / length])
    mean = np.mean(errors, axis=0)
    return {"segments": len(errors), "translation_percent": mean[0], "rotation_deg_per_m": mean[1]}


# ---- Open3D ---------------------------------------------------------------------------------------

def distances(a, b):
    return np.asarray(a.compute_point_cloud_distance(b))


def map_references():
    result = o3d.io.read_point_cloud(str(FOLDER / "result.ply"))
    truth = o3d.io.read_point_cloud(str(FOLDER / "truth.ply"))
    raw = {"mean_from_result_m": distances(result, truth).mean(),
           "mean_from_truth_m": distances(truth, result).mean(),
           "max_from_result_m": distances(result, truth).max()}
    result, truth = (cloud.voxel_down_sample(VOXEL_M) for cloud in (result, truth))
    from_result, from_truth = distances(result, truth), distances(truth, result)
    kept, cut = from_result[from_result < 0.5], from_truth[from_truth < 1.2]
    accuracy, completeness = 100 * kept.mean(), 100 * np.minimum(cut, 0.5).mean()
    scores = []
    for tau in TAUS_M:
        precision, recall = 100 * (kept < tau).mean(), 100 * (cut < tau).mean()
        scores.append({"tau_m": tau, "precision_percent": precision, "recall_percent": recall,
                       "f_score_percent": 2 * precision * recall / (precision + recall)})
    return {"raw": raw,
            "voxel_m": VOXEL_M,
            "paper": {"accuracy_cm": accuracy, "completeness_cm": completeness,
                      "chamfer_l1_cm": (accuracy + completeness) / 2,
                      "result_points": len(kept), "truth_points": len(cut),
                      "result_left_out_percent": 100 * (1 - len(kept) / len(from_result)),
                      "scores": scores}}


# ---- comparison -----------------------------------------------------------------------------------

def differences(expected, found, name=""):
    """Every number of `expected` that `found` does not meet."""
    if isinstance(expected, dict):
        for key, value in expected.items():
            yield from differences(value, found[key], f"{name}.{key}")
    elif isinstance(expected, list):
        for i, value in enumerate(expected):
            yield from differences(value, found[i], f"{name}[{i}]")
    elif not abs(expected - found) <= TOLERANCE:
        yield f"{name}: {found} instead of {expected}"


def live(binary):
    """The same figures out of covsplat's binary."""
    def figures(*arguments):
        call = subprocess.run([binary, "eval", *map(str, arguments), "--json"], check=True,
                              capture_output=True, text=True)
        return json.loads(call.stdout)
    traj = figures("traj", FOLDER / "estimate.tum", FOLDER / "truth.tum", "--delta", 5)
    traj["rpe_by_distance_5m"] = traj["rpe_by_distance"]
    return {"trajectory": traj,
            "map": figures("map", FOLDER / "result.ply", FOLDER / "truth.ply", "--voxel", VOXEL_M,
                           "--tau", ",".join(map(str, TAUS_M)))}


def check(binary):
    committed = json.loads((FOLDER / "references.json").read_text())
    fresh = {"trajectory": trajectory_references(), "map": map_references()}
    wrong = [f"committed {d}" for d in differences(fresh, committed)]
    if binary:
        del fresh["map"]["raw"], fresh["map"]["voxel_m"]  # not among the command's figures
        wrong += [f"covsplat {d}" for d in differences(fresh, live(binary))]
    print("\n".join(wrong) or "evo and Open3D agree")
    return 1 if wrong else 0


def write():
    FOLDER.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(3)
    write_trajectories(random)
    write_clouds(random)
    references = {"trajectory": trajectory_references(), "map": map_references()}
    (FOLDER / "references.json").write_text(json.dumps(references, indent=1) + "\n")
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--write", action="store_true", help="make the files anew")
    action.add_argument("--check", nargs="?", const="", metavar="COVSPLAT", help="compare")
    arguments = parser.parse_args()
    return write() if arguments.write else check(arguments.check)


if __name__ == "__main__":
    sys.exit(main())
