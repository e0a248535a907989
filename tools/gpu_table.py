#!/usr/bin/env python3
"""Prints the short table of tools/gpu_check.sh from what it left in a folder."""
import collections
import csv
import json
import pathlib
import re
import statistics
import sys


def read(path: pathlib.Path) -> str:
    return path.read_text(errors="replace") if path.exists() else ""


def checks(out: pathlib.Path):
    tests = read(out / "tests.log")
    passed = re.search(r"\[  PASSED  \] (\d+) test", tests)
    failed = len(set(re.findall(r"\[  FAILED  \] (\w+\.\w+)", tests)))
    skipped = re.search(r"\[  SKIPPED \] (\d+) test", tests)
    yield "tests", (f"{passed[1] if passed else 0} passed, {failed} failed, "
                    f"{skipped[1] if skipped else 0} skipped")
    for tool in ("memcheck", "racecheck", "initcheck"):
        summary = re.search(r"(?:ERROR|RACECHECK) SUMMARY: (.*)", read(out / f"{tool}.log"))
        yield tool, summary[1] if summary else "did not finish"


def benchmarks(out: pathlib.Path):
    text = read(out / "bench.json")
    return json.loads(text) if text else {"context": {}, "benchmarks": []}


def kernels(out: pathlib.Path):
    """Per kernel: launches, and the medians of every metric."""
    lines = [line for line in read(out / "ncu.csv").splitlines() if line.startswith('"')]
    table = collections.defaultdict(lambda: collections.defaultdict(list))
    for row in csv.DictReader(lines):
        name = row["Kernel Name"].replace("<unnamed>::", "")
        name = re.sub(r"[<(].*", "", name).split("::")[-1].removeprefix("void ")
        value = row["Metric Value"].replace(",", "")
        scale = {"us": 1.0, "ns": 1e-3, "ms": 1e3, "usecond": 1.0, "nsecond": 1e-3,
                 "msecond": 1e3}.get(row["Metric Unit"], 1.0)
        table[name][row["Metric Name"]].append(float(value) * scale)
    return table


def system_rows(out: pathlib.Path):
    """What the whole system did on each backend, in turns and live."""
    for backend in ("cpu", "cuda"):
        for mode in ("", "_live"):
            text = read(out / f"{backend}{mode}" / "metrics.json")
            if not text:
                continue
            run = json.loads(text)
            surface = read(out / f"{backend}.map.json") if not mode else ""
            scores = [f"{json.loads(surface)[p]['scores'][0]['f_score_percent']:.2f}"
                      for p in ("paper", "strict")] if surface else ["-", "-"]
            ate = run["trajectory_error"]["ate_translation_m"]["rmse"]
            held_out = run["held_out"]["after"]["mean_abs_m"]
            yield [backend, "live" if mode else "in turns", f"{run['time']['scans_per_s']:.1f}",
                   str(run["map"]["optimizer_steps"]), str(run["map"]["gaussians"]),
                   f"{ate:.5f}", f"{held_out:.4f}", *scores]


def main() -> int:
    out = pathlib.Path(sys.argv[1])
    bench = benchmarks(out)
    print(f"\ndevice: {bench['context'].get('device', 'none')}; "
          f"host: {bench['context'].get('num_cpus', '?')} CPUs\n")
    print("| check | result |\n|---|---|")
    for name, result in checks(out):
        print(f"| {name} | {result} |")

    by_name = {b["name"].removesuffix("/real_time"): b for b in bench["benchmarks"]}
    print("\n| Gaussians | pairs | CPU steps/s | CUDA steps/s | CPU render ms | CUDA render ms "
          "| device MB |\n|---|---|---|---|---|---|---|")
    for count in (30000, 100000, 300000):
        def value(name, key, digits=0):
            found = by_name.get(f"{name}/{count}", {}).get(key)
            return "-" if found is None else f"{found:.{digits}f}"
        print(f"| {count} | {value('BM_Step/cuda', 'pairs')} | {value('BM_Step/cpu', 'steps/s')} "
              f"| {value('BM_Step/cuda', 'steps/s')} | {value('BM_Render/cpu', 'real_time', 2)} "
              f"| {value('BM_Render/cuda', 'real_time', 2)} "
              f"| {value('BM_Step/cuda', 'device_MB')} |")
    copy = next((b for n, b in by_name.items() if n.startswith("BM_DeviceCopy")), None)
    if copy:
        print(f"\ncopy within the device: {1e-9 * copy['B/s']:.0f} GB/s read and written")

    found = kernels(out)
    if found:
        print("\n| kernel (100000 Gaussians) | launches | median us | arithmetic % of peak "
              "| memory % of peak | DRAM % of peak | warps active % |\n|---|---|---|---|---|---|---|")
    order = ("gpu__time_duration.sum", "sm__throughput.avg.pct_of_peak_sustained_elapsed",
             "gpu__compute_memory_throughput.avg.pct_of_peak_sustained_elapsed",
             "dram__throughput.avg.pct_of_peak_sustained_elapsed",
             "sm__warps_active.avg.pct_of_peak_sustained_active")
    for name, metrics in sorted(found.items(), key=lambda k: -sum(k[1][order[0]])):
        medians = [statistics.median(metrics[m]) if metrics[m] else float("nan") for m in order]
        print(f"| {name} | {len(metrics[order[0]])} | " +
              " | ".join(f"{m:.1f}" for m in medians) + " |")
    rows = list(system_rows(out))
    if rows:
        print("\n| whole system | schedule | scans/s | steps | Gaussians | ATE RMSE m "
              "| held-out range m | F % | F % strict |\n|---|---|---|---|---|---|---|---|---|")
        for row in rows:
            print("| " + " | ".join(row) + " |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
