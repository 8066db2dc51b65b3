"""Times and bytes of a fleet of short synthetic legs; interrupted, with a worker killed, and gone on.

Legs in two lots walk some recordings of a few seconds each; some recordings are damaged, and ten legs have
worn joints from the begin. Needs the extras bags, fleet and dask. With --keep, the directory stays.
"""

import argparse
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from leg_wear_monitor.bags.mcap_writer import McapWriter
from leg_wear_monitor.fleet.overview import load_overview
from leg_wear_monitor.gait.config import EncoderConfig, GaitConfig, PaceConfig, TorqueSensorConfig
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.gait.sensors import readings
from leg_wear_monitor.messages import encode
from leg_wear_monitor.twin import TORQUE

RATE_HZ, WALK_S, BEGIN_NS = 200, 12, 1_790_000_000 * 10**9
DAY_S, NEW_M, WORN_M = 86_400, 3.0e-4, 1.0e-3
DAMAGED = 17  # each so many-th recording is truncated, the one after it is no recording
LEGS_YAML = """
out: fleet
legs:
"""


def torques(clearance_m: float) -> np.ndarray:
    """Drive torque [N m] of the synthetic leg over whole gait cycles, the first sample at crank angle 0."""
    config = GaitConfig(
        duration_s=WALK_S + 0.5 / RATE_HZ,
        clearances_m=(clearance_m,) * 5,
        pace=PaceConfig(speeds_rpm=(60.0,)),
        encoder=EncoderConfig(rate_hz=10.0),
        torque_sensor=TorqueSensorConfig(rate_hz=float(RATE_HZ)),
    )
    found = [one.torque_nm for one in readings(SyntheticLeg(config), config) if one.kind == TORQUE]
    return np.roll(found, 1)  # the first reading comes a sample after the start


def write(path: Path, torque_nm: np.ndarray, begin_ns: int, seconds: float, seed: int) -> None:
    n = round(seconds * RATE_HZ)
    angle = 2.0 * np.pi * np.arange(n) / RATE_HZ + np.random.default_rng(seed).normal(0.0, 2.0e-4, n)
    stamps = begin_ns + np.arange(n, dtype=np.int64) * (10**9 // RATE_HZ)
    wrench = np.zeros((n, 3))
    wrench[:, 2] = np.take(torque_nm, np.arange(n) + RATE_HZ * (seed % WALK_S), mode="wrap")
    joints = encode.joint_states(stamps, ["crank"], position=angle[:, None])
    wrenches = encode.wrenches(stamps, torque=wrench, frame_id="pelvis")
    with McapWriter(path, chunk_bytes=100_000) as writer:
        crank = writer.channel("/joint_states", encode.JOINT_STATE)
        drive = writer.channel("/drive_torque", encode.WRENCH_STAMPED)
        for stamp, joint, force in zip(stamps.tolist(), joints, wrenches, strict=True):
            writer.write(crank, stamp, bytes(joint))
            writer.write(drive, stamp, bytes(force))


def make(home: Path, legs: int, recordings: int, seconds: float) -> tuple[Path, dict[str, int]]:
    """A fleet's description with its recordings, and what must be found in them."""
    healthy, worn = torques(NEW_M), torques(WORN_M)
    entries, expected = [], {"sound": 0, "truncated": 0, "unreadable": 0}
    for leg in range(legs):
        name, lot = f"leg-{leg:04}", "AB"[leg % 2]
        (home / name).mkdir(parents=True)
        entries.append(f'  - {{id: {name}, recordings: "{name}/*", lot: {lot}}}\n')
        for day in range(recordings):
            number = leg * recordings + day
            path = home / name / f"{recordings - day}.mcap"  # names that do not sort by time
            torque_nm = worn if leg % max(1, legs // 10) == 0 else healthy
            write(path, torque_nm, BEGIN_NS + day * DAY_S * 10**9 + leg, seconds, number)
            kind = {0: "truncated", 1: "unreadable"}.get(number % DAMAGED, "sound")
            if kind == "truncated":
                path.write_bytes(path.read_bytes()[: path.stat().st_size * 7 // 8])
            elif kind == "unreadable":
                path.write_bytes(b"not a recording %d" % number)
            expected[kind] += 1
    (home / "fleet.yaml").write_text(LEGS_YAML + "".join(entries))
    return home / "fleet.yaml", expected


def start(path: Path, out: Path, *options: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "leg_wear_monitor", "fleet", "update", str(path), "--out", str(out)]
    return subprocess.Popen(
        [*command, *options],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )


def counted(out: Path) -> int:
    """Recordings that have their line."""
    return sum(len(log.read_bytes().splitlines()) for log in out.glob("legs/*/log"))


def until(program: subprocess.Popen[bytes], out: Path, number: int) -> bool:
    """Wait until so many recordings are done; False if the program ends before."""
    while program.poll() is None:
        if counted(out) >= number:
            return True
        time.sleep(0.05)
    return False


@contextmanager
def cluster(home: Path, workers: int) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A Dask scheduler and workers on this machine."""
    file = home / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": home}
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    programs = [subprocess.Popen([*command, "--no-dashboard", "--scheduler-file", str(file)], **quiet)]
    try:
        while not file.exists() or not file.read_text().strip():
            time.sleep(0.05)
        worker = [sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", str(file)]
        worker += ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1"]
        started = [subprocess.Popen(worker, **quiet) for _ in range(workers)]
        programs += started
        yield json.loads(file.read_text())["address"], started
    finally:
        for program in programs:
            program.kill()
            program.wait()


def contents(out: Path) -> dict[str, bytes]:
    """What must not depend on how the fleet was updated: all files but ledgers."""
    left_out = ("ledger", ".lock")
    files = (path for path in out.rglob("*") if path.is_file() and path.name not in left_out)
    return {str(path.relative_to(out)): path.read_bytes() for path in files}


def size(out: Path, pattern: str) -> int:
    return sum(path.stat().st_size for path in out.glob(pattern) if path.is_file())


def cpu_s() -> float:
    """CPU time of all processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def measured(path: Path, out: Path, *options: str) -> tuple[int, float, float]:
    """Exit code, wall time and CPU time [s] of an update."""
    wall, cpu = time.perf_counter(), cpu_s()
    code = start(path, out, *options).wait()
    return code, time.perf_counter() - wall, cpu_s() - cpu


def interrupted(path: Path, out: Path, workers: int, total: int) -> int:
    """Interrupt an update at a third, kill it at two thirds, and let it end; its exit code."""
    for number, name in ((total // 3, signal.SIGINT), (2 * total // 3, signal.SIGKILL)):
        program = start(path, out, "--workers", str(workers))
        if until(program, out, number):
            program.send_signal(name)
        program.wait()
        print(f"  ended by {name.name} with {counted(out)} of {total} recordings done")
        time.sleep(2.0)  # its workers end with it
    return start(path, out, "--workers", str(workers)).wait()


def on_cluster(path: Path, out: Path, home: Path, workers: int, total: int) -> int:
    """Kill a worker at a third; the exit code of the update."""
    with cluster(home, workers) as (address, programs):
        update = start(path, out, "--scheduler", address)
        if until(update, out, total // 3):
            programs[0].kill()
            print(f"  a worker was killed with {counted(out)} of {total} recordings done")
        return update.wait()


def report(out: Path, expected: dict[str, int], total: int, seconds: float) -> None:
    health = [leg.recordings for leg in load_overview(out).legs]
    found = {
        "sound": sum(each.counted - each.partial for each in health),
        "truncated": sum(each.partial for each in health),
        "unreadable": sum(each.unreadable for each in health),
    }
    print(f"recordings: {found}, expected {expected}{'' if found == expected else '  DIFFERS'}")
    print(f"states: {load_overview(out).counts}")
    patterns = {"ledgers": "legs/*/ledger", "cycles": "cycles/*/*.parquet", "lines": "legs/*/*.jsonl"}
    patterns |= {"summaries": "legs/*/summary.json", "fleet.json": "fleet.json"}
    for name, pattern in patterns.items():
        print(f"{name}: {size(out, pattern) / 1.0e3:.0f} kB")
    print(f"{total} recordings of {seconds:g} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--legs", type=int, default=200)
    parser.add_argument("--recordings", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--keep", type=Path, help="directory that is made and stays")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        home = arguments.keep or Path(temporary)
        path, expected = make(home / "legs", arguments.legs, arguments.recordings, arguments.seconds)
        total, workers = arguments.legs * arguments.recordings, arguments.workers
        outs = {name: home / name for name in ("whole", "interrupted", "cluster")}
        code, wall, cpu = measured(path, outs["whole"], "--workers", str(workers))
        print(f"whole: exit {code}, {wall:.1f} s, {cpu:.1f} s of CPU, {cpu / total:.2f} s a recording")
        report(outs["whole"], expected, total, arguments.seconds)
        code, wall, cpu = measured(path, outs["whole"], "--workers", str(workers))
        print(f"again: exit {code}, {wall:.1f} s, {cpu:.2f} s of CPU")
        print(f"interrupted: exit {interrupted(path, outs['interrupted'], workers, total)}")
        print(f"cluster: exit {on_cluster(path, outs['cluster'], home, workers, total)}")
        whole = contents(outs["whole"])
        for name in ("interrupted", "cluster"):
            print(f"{name}: {'the same to the bit' if contents(outs[name]) == whole else 'DIFFERS'}")


if __name__ == "__main__":
    main()
