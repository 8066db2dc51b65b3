"""Keeps the process on one core with one thread. Import it before numpy, which reads its threads once."""

import os

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
CORES = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []


def use_cores(count: int) -> None:
    """Keep the process, and the threads it starts from now on, on so many of the last of its cores."""
    if CORES:
        os.sched_setaffinity(0, CORES[-count:])


use_cores(1)
