"""The same points on a Dask cluster of two workers, of which one is killed: none lost, none twice."""

import os
import signal

import pytest
from dask_cluster import cluster

from leg_wear_monitor.studies.execution import run_study
from leg_wear_monitor.studies.results import load_results

pytest.importorskip("distributed", reason="the extra 'dask' is not installed")


@pytest.mark.slow  # test_run.py holds it for processes, which get the same jobs
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
