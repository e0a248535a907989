"""What the scripts that call the binary share: cases, expectations, and the loop over them."""
import pathlib
import subprocess
import sys

LIMIT_S = 600  # of one call, for machines and builds that are slow
CASES = []


def case(function):
    CASES.append(function)
    return function


def expect(call, code, out="", err=""):
    said = f"stdout: {call.stdout}\nstderr: {call.stderr}"
    assert call.returncode == code, f"exit code {call.returncode} instead of {code}\n{said}"
    assert out in call.stdout, f"{out!r} is not in stdout\n{said}"
    assert err in call.stderr, f"{err!r} is not in stderr\n{said}"


def binary() -> str:
    return str(pathlib.Path(sys.argv[1]).resolve())


def run_cases(apply) -> int:
    """Calls `apply(check)` for the cases that the command line names, or all; the exit code."""
    wanted = sys.argv[2:]
    failed = 0
    for check in CASES:
        if wanted and check.__name__ not in wanted:
            continue
        try:
            apply(check)
            print(f"ok      {check.__name__}", flush=True)
        except (AssertionError, OSError, subprocess.TimeoutExpired, KeyError) as error:
            failed += 1
            print(f"FAILED  {check.__name__}: {error!r}", flush=True)
    return 1 if failed else 0
