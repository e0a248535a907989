"""Runs programs and Python functions in processes of their own, and what that took."""

from __future__ import annotations

import multiprocessing
import os
import resource
import subprocess
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

T = TypeVar("T")
MIB_PER_KIB = 1 / 1024


@dataclass(frozen=True)
class Finished:
    stdout: str
    wall_s: float
    cpu_s: float
    peak_mib: float


def run_program(command: list[str]) -> Finished:
    """An exit code other than 0 is an error that carries the end of what the program said."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        start_s = time.perf_counter()
        process = subprocess.Popen(command, stdout=out, stderr=err)
        _, status, usage = os.wait4(process.pid, 0)
        wall_s = time.perf_counter() - start_s
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        err.seek(0)
        stdout, stderr = out.read(), err.read()
    if process.returncode != 0:
        message = stderr.strip() or stdout.strip()
        raise RuntimeError(f"exit code {process.returncode}: {message[-300:]}")
    cpu_s = usage.ru_utime + usage.ru_stime
    return Finished(stdout, wall_s, cpu_s, usage.ru_maxrss * MIB_PER_KIB)


def apart(run: Callable[[], T]) -> T:
    """In a new interpreter: thread pools outlive their method and would disturb the next."""
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        return pool.submit(run).result()


def own_cpu_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def own_peak_mib() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * MIB_PER_KIB
