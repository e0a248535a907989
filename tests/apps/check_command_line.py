"""Calls the binary as a user would and checks exit codes and messages.

usage: check_command_line.py COVSPLAT
"""
import pathlib
import subprocess
import sys
import tempfile

CASES = [
    # arguments, exit code, part of stdout, part of stderr
    (["--version"], 0, "covsplat 0.", ""),
    (["--help"], 0, "Exit codes:", ""),
    (["config", "--help"], 0, "dump", ""),
    ([], 2, "", "covsplat: error: "),
    (["fly"], 2, "", "covsplat: error: "),
    (["config"], 2, "", "covsplat: error: "),
    (["config", "dump", "--nonsense"], 2, "", "--nonsense"),
    (["config", "dump"], 0, "", ""),
    (["config", "dump", "-s", "no.such=1"], 2, "", "covsplat: error: --set unknown key 'no.such'"),
    (["config", "dump", "-s", "word"], 2, "", "section.key=value"),
    (["config", "dump", "-s", "gicp.max_iteration=9"], 2, "", "gicp.max_iterations"),
    (["run"], 2, "", "recording"),
    (["run", "--help"], 0, "--deterministic", ""),
    (["info", "no_such_folder"], 3, "", "no_such_folder"),
    (["eval", "traj", "one.txt"], 2, "", "truth"),
    (["bench", "kitti"], 2, "", "--root"),
    (["bench", "mars", "--root", "."], 2, "", "kitti"),
    (["bench", "kitti", "--root", "."], 3, "", "sequences/NN/velodyne"),
    (["bench", "oxford_spires", "--root", "no_such_folder"], 3, "", "ground_truth_map"),
    (["simulate", "--list"], 0, "courtyard", ""),
    (["config", "check"], 0, "valid", ""),
    (["config", "check", "no_such_file.yaml"], 2, "", "no_such_file.yaml: cannot read"),
    (["config", "check", "bad.yaml"], 2, "", "bad.yaml:2: unknown key 'no_such_key'"),
    (["config", "describe"], 0, "# Configuration", ""),
]


def problems(binary: str, folder: str):
    pathlib.Path(folder, "bad.yaml").write_text("\nno_such_key: 1\n")
    for arguments, code, out, err in CASES:
        call = subprocess.run([binary, *arguments], cwd=folder, capture_output=True, text=True)
        name = "covsplat " + " ".join(arguments)
        if call.returncode != code:
            yield f"{name}: exit code {call.returncode} instead of {code}"
        if out not in call.stdout:
            yield f"{name}: {out!r} not in stdout {call.stdout!r}"
        if err not in call.stderr:
            yield f"{name}: {err!r} not in stderr {call.stderr!r}"
        if code == 0 and call.stderr:
            yield f"{name}: printed {call.stderr!r}"
    with open("/dev/full", "w") as full:
        call = subprocess.run([binary, "config", "describe"], stdout=full, stderr=subprocess.PIPE)
    if call.returncode != 4:
        yield f"a full disk: exit code {call.returncode} instead of 4"


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        found = list(problems(str(pathlib.Path(sys.argv[1]).resolve()), folder))
    print("\n".join(found) or f"command line: all {len(CASES)} calls behave")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
