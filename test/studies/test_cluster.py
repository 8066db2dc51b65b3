"""The same points on a Dask cluster of two workers, of which one is killed: none lost, none twice."""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest

from leg_wear_monitor.studies.execution.run import run_study
from leg_wear_monitor.studies.results import load_results

pytest.importorskip("distributed", reason="the extra 'dask' is not installed")


@contextmanager
def cluster(directory):
    """A scheduler on the loopback and two workers of one thread: its address, and the workers."""
    file = directory / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": directory}
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    programs = [subprocess.Popen([*command, "--no-dashboard", "--scheduler-file", str(file)], **quiet)]
    try:
        while not file.exists() or not file.read_text().strip():
            assert programs[0].poll() is None, "the scheduler has not started"
            time.sleep(0.05)
        worker = [sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", str(file)]
        worker += ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1"]
        workers = [subprocess.Popen(worker, **quiet) for _ in range(2)]
        programs += workers
        yield json.loads(file.read_text())["address"], workers
    finally:
        for program in programs:
            program.kill()
            program.wait()


def test_a_cluster_gives_the_same_results_though_a_worker_is_killed(tiny, tmp_path):
    clearances = [1.0e-4, 1.5e-4, 2.0e-4, 2.5e-4, 3.0e-4, 3.5e-4]
    settings = tiny("size", joints=["G"], clearances_m=clearances)
    here, there = tmp_path / "here", tmp_path / "there"
    assert run_study("size", settings, here) == 6
    with cluster(tmp_path) as (address, workers):

        def kill_one_midway(fraction):
            if fraction > 0.3 and workers[0].poll() is None:
                os.kill(workers[0].pid, signal.SIGKILL)

        computed = run_study("size", settings, there, scheduler=address, progress=kill_one_midway)
        assert workers[0].wait() == -signal.SIGKILL
        assert workers[1].poll() is None
    assert computed == 6
    assert load_results(there).missing == []
    results = [{path.name: path.read_bytes() for path in (out / "points").iterdir()} for out in (here, there)]
    assert results[0] == results[1]
    assert len(results[1]) == 6
