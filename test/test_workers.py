"""Calls for workers: every result once, as soon as it is there, though a worker dies."""

import operator
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest
from dask_cluster import cluster
from worker_calls import die

from leg_wear_monitor import workers
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.workers import results

pytestmark = pytest.mark.plain


@pytest.mark.usefixtures("traps")
def test_each_result_comes_once_though_a_worker_dies(tmp_path):
    calls = {f"{k}": partial(operator.add, k, 1) for k in range(6)}
    calls["dies"] = partial(die, tmp_path / "mark")
    found = list(results(calls, workers=2))
    assert len(found) == len(calls)
    assert dict(found) == {f"{k}": k + 1 for k in range(6)} | {"dies": "alive"}


def test_a_result_is_there_before_others_are():
    calls = {"slow": partial(time.sleep, 1.0), "fast": partial(operator.add, 1, 1)}
    assert [name for name, _ in results(calls, workers=2)] == ["fast", "slow"]
    assert [name for name, _ in results(calls, workers=1)] == ["slow", "fast"]


def test_workers_that_keep_dying_are_one_error_and_finished_results_were_given(monkeypatch):
    monkeypatch.setattr(workers, "TRIES", 1)
    calls = {"fast": partial(operator.add, 1, 1), "slow": partial(time.sleep, 0.5), "dies": die}
    found = {}
    with pytest.raises(LegWearError, match="worker processes died 1 times; finished results are kept"):
        found.update(results(calls, workers=2))
    assert found.get("fast", 2) == 2


def test_an_error_of_a_call_is_that_of_the_caller():
    calls = {"a": partial(operator.truediv, 1, 0), "b": partial(operator.add, 1, 1)}
    with pytest.raises(ZeroDivisionError):
        dict(results(calls, workers=2))


def test_workers_end_with_a_process_that_is_killed(tmp_path):
    script = (
        "import sys; from functools import partial; from pathlib import Path\n"
        "from leg_wear_monitor.workers import results; from worker_calls import leave\n"
        "calls = {n: partial(leave, Path(sys.argv[1]) / n, s) for n, s in [('a', 0), ('b', 4), ('c', 4)]}\n"
        "for name, _ in results(calls, 2): print(name, flush=True)\n"
    )
    command = [sys.executable, "-c", script, str(tmp_path)]
    with subprocess.Popen(command, cwd=Path(__file__).parent, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "a\n"
        process.kill()
    time.sleep(5.0)
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


@pytest.mark.slow
def test_a_cluster_gives_the_same_though_a_worker_is_killed(tmp_path):
    pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
    calls = {f"{k}": partial(pow, k, 2) for k in range(20)} | {
        f"s{k}": partial(time.sleep, 0.2) for k in range(9)
    }
    with cluster(tmp_path) as (address, programs):
        found = []
        for name, _ in results(calls, scheduler=address):
            found.append(name)
            if len(found) == 5:
                programs[0].kill()
    assert sorted(found) == sorted(calls)


def test_a_scheduler_that_does_not_answer_is_one_line():
    pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
    with pytest.raises(ConfigError, match="--scheduler: frog://nowhere: no scheduler answers there"):
        dict(results({"a": print}, scheduler="frog://nowhere"))
