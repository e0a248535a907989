#!/usr/bin/env python3
"""Checks that includes follow the allowed dependencies between modules; `--graph` prints them.

The table below is the architecture: a module may include itself, core, and what is listed here.
Headers of CUDA are for splat/cuda alone.
"""
import pathlib
import re
import sys

EDGES = {
    "core": [],
    "io": [],
    "registration": [],
    "splat": [],
    "sim": ["io"],
    "eval": ["io"],
    "config": [],
    "loops": ["io", "registration"],
    "mapping": ["io", "registration", "splat"],
    "mesh": ["io", "splat"],
    "slam": ["loops", "mapping", "registration", "splat"],
    "report": ["eval", "io", "loops", "slam", "mapping", "splat"],
    "apps": ["config", "eval", "io", "loops", "mapping", "mesh", "registration", "report", "sim", "slam",
             "splat"],
}
INCLUDE = re.compile(r'#include\s+"covsplat/(\w+)/')
CUDA = re.compile(r"#include\s+<(cuda|cub/)")


def violations(root: pathlib.Path):
    for module, allowed in EDGES.items():
        folder = root / ("apps" if module == "apps" else f"covsplat/{module}")
        for path in sorted(p for end in ("?pp", "cu", "cuh") for p in folder.rglob(f"*.{end}")):
            for number, line in enumerate(path.read_text().splitlines(), 1):
                match = INCLUDE.search(line)
                if match and match[1] not in {module, "core", *allowed}:
                    yield f"{path.relative_to(root)}:{number}: {module} may not include {match[1]}"
                if CUDA.match(line) and path.parent != root / "covsplat/splat/cuda":
                    yield f"{path.relative_to(root)}:{number}: CUDA stays in splat/cuda"


def main() -> int:
    if "--graph" in sys.argv:
        for module, allowed in EDGES.items():
            print(f"{module:13} -> {', '.join(['core', *allowed]) if module != 'core' else '-'}")
        return 0
    root = pathlib.Path(__file__).resolve().parent.parent
    unknown = {p.name for p in (root / "covsplat").iterdir() if p.is_dir()} - EDGES.keys()
    found = [f"covsplat/{name}: not in the table of modules" for name in sorted(unknown)]
    found += violations(root)
    print("\n".join(found) or "layers: every include follows the table")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
