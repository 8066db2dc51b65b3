"""What studies cost: a point; one process, two, and a Dask cluster; a worker killed midway.

    python benchmarks/studies.py

The default leg at 60 rpm. Needs the extra 'dask'. Five to ten minutes on two free cores.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

# isort: split
from watch import Watch

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.studies.execution import load_settings, parse_settings, run_study
from leg_wear_monitor.studies.kinds import STUDIES
from leg_wear_monitor.studies.leg_tasks import compute
from leg_wear_monitor.studies.plan import Study, code_digest
from leg_wear_monitor.studies.results import load_results

CORES, LEGS = 100, 1000


def costs() -> dict[str, float]:
    """Processor seconds of every study that comes with the package: one point of each task, scaled by its "
    "cost."""
    leg, found = load_mechanism(), {}
    for point in work(1).points():  # compiled before anything is measured
        compute(point.task, leg, point.settings, code_digest())
    print("Cost of the studies as they come, by the processor's time")
    print(f"  {'study':>10} {'points':>7} {'seconds':>9}   of which")
    for name in STUDIES:
        points = load_settings(name).points()
        total: dict[str, float] = {}
        for task in dict.fromkeys(point.task for point in points):
            alike = [point for point in points if point.task == task]
            middle = sorted(alike, key=lambda point: point.cost)[len(alike) // 2]
            watch = Watch()
            compute(task, leg, middle.settings, code_digest())
            total[task] = watch.processor / middle.cost * sum(point.cost for point in alike)
        found[name] = sum(total.values())
        parts = ", ".join(f"{task} {seconds:.0f}" for task, seconds in total.items())
        print(f"  {name:>10} {len(points):7d} {found[name]:9.0f}   {parts}", flush=True)
    return found


def sweep(found: dict[str, float]) -> None:
    """What all studies of a thousand legs would take, on paper."""
    whole, multi = sum(found.values()), found["multi"]
    print(f"\n{LEGS} legs on {CORES} cores, on paper: all studies {LEGS * whole / CORES / 3600.0:.1f} h,")
    print(f"  multi alone {LEGS * multi / CORES / 60.0:.0f} min; without what scheduler and network cost")


def work(points: int) -> Study:
    """Points alike, so that they share out evenly."""
    clearances = [2.0e-4 + 2.0e-6 * i for i in range(points)]
    ensemble = {"runs": 8, "cycles": 20, "skip_cycles": 2, "traced_cycles": 2}
    return parse_settings("size", {"joints": ["G"], "clearances_m": clearances, "ensemble": ensemble}, "work")


def timed(settings: Study, out: Path, **how: Any) -> tuple[float, dict[str, bytes]]:
    """Wall seconds of a study, and the files of its points."""
    watch = Watch()
    run_study("size", settings, out, **how)
    return watch.read()[0], {path.name: path.read_bytes() for path in sorted((out / "points").iterdir())}


@contextmanager
def cluster(directory: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler and two workers of one thread on the loopback, warm: its address, and the workers."""
    file, quiet = directory / "scheduler.json", {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    python = [sys.executable, "-m"]
    scheduler = ["distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    worker = [
        "distributed.cli.dask_worker",
        "--nthreads",
        "1",
        "--no-nanny",
        "--no-dashboard",
        "--host",
        "127.0.0.1",
    ]
    at = ["--scheduler-file", str(file)]
    programs = [subprocess.Popen([*python, *scheduler, *at], **quiet)]
    try:
        while not file.exists() or not file.read_text().strip():
            time.sleep(0.1)
        workers = [subprocess.Popen([*python, *worker, *at], **quiet) for _ in range(2)]
        programs += workers
        address = json.loads(file.read_text())["address"]
        run_study("size", work(4), directory / "warm", scheduler=address)
        yield address, workers
    finally:
        for program in programs:
            program.kill()
            program.wait()


def scaling(points: int, repeats: int) -> None:
    """One and two processes, and two workers of a cluster, in turns; then one of them is killed."""
    settings = work(points)
    with tempfile.TemporaryDirectory() as scratch, cluster(Path(scratch)) as (address, workers):
        ways: dict[str, dict[str, Any]] = {
            "one process": {"workers": 1},
            "two processes": {"workers": 2},
            "cluster, two workers": {"scheduler": address},
        }
        times: dict[str, list[float]] = {way: [] for way in ways}
        results: list[dict[str, bytes]] = []
        for turn in range(repeats):
            for way, how in ways.items():
                seconds, files = timed(settings, Path(scratch) / f"{way}{turn}", **how)
                times[way].append(seconds)
                results.append(files)
        one = min(times["one process"])
        print(
            f"\n{points} points alike, wall seconds, the least of {repeats} turns (times as fast as one "
            "process)"
        )
        for way, seconds in times.items():
            print(f"  {way:>22} {min(seconds):7.1f} ({one / min(seconds):.2f})")
        print(f"  the same to the bit: {all(files == results[0] for files in results)}")

        def kill_one_midway(fraction: float) -> None:
            if fraction >= 0.5 and workers[0].poll() is None:
                os.kill(workers[0].pid, signal.SIGKILL)

        out = Path(scratch) / "killed"
        seconds, files = timed(settings, out, scheduler=address, progress=kill_one_midway)
        lost, alike = load_results(out).missing, files == results[0]
        print(
            f"  a worker killed midway {seconds:7.1f} s: {len(lost)} points lost, {len(files)} kept, the "
            f"same: {alike}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--points", type=int, default=24, help="points of the scaling runs")
    parser.add_argument("--repeats", type=int, default=3, help="turns of each way")
    parser.add_argument("--skip-costs", action="store_true", help="scaling only")
    options = parser.parse_args()
    if not options.skip_costs:
        sweep(costs())
    scaling(options.points, options.repeats)


if __name__ == "__main__":
    main()
