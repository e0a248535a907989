#!/usr/bin/env python3
"""Compares a committed file with what a command prints; `make docs` writes such files.

usage: check_generated.py FILE COMMAND [ARGUMENT ...]
"""
import difflib
import pathlib
import subprocess
import sys


def main() -> int:
    path = pathlib.Path(sys.argv[1])
    made = subprocess.run(sys.argv[2:], check=True, capture_output=True, text=True).stdout
    committed = path.read_text() if path.exists() else ""
    if made == committed:
        print(f"{path.name}: up to date")
        return 0
    lines = (committed.splitlines(True), made.splitlines(True))
    sys.stdout.writelines(difflib.unified_diff(*lines, "committed", "generated"))
    print(f"{path.name}: out of date; `make docs` writes it")
    return 1


if __name__ == "__main__":
    sys.exit(main())
