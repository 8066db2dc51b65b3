"""A Dask cluster of two workers on this machine."""

import json
import subprocess
import sys
import time
from contextlib import contextmanager


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
