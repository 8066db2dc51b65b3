"""Tasks by name, and their execution in a worker."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from leg_wear_monitor.errors import SimulationError
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.point import Arrays, code_digest

Task = Callable[[Mechanism, dict[str, Any]], Arrays]

TASKS = {
    "response": "response.run_ensemble",
    "leg": "leg.drawn_leg_response",
    "life": "life.wear_life",
    "section": "section.poincare_section",
    "exponent": "exponent.lyapunov_exponent",
}


def compute(task: str, mechanism: Mechanism, settings: dict[str, Any], code: str) -> Arrays:
    """Compute the result of a point; runs in the workers.

    Parameters
    ----------
    task : str
        A key of `TASKS`.
    mechanism : Mechanism
    settings : dict
        Settings of the point.
    code : str
        The caller's `code_digest`.

    Returns
    -------
    dict of arrays
        Result of the task. If the motion diverges, only ``fault`` (), the message: divergence is a valid
        result.

    Raises
    ------
    RuntimeError
        If the code version of this process differs from the caller's.
    """
    if code_digest() != code:
        raise RuntimeError("a worker has another version of leg_wear_monitor than the study that asks it")
    module, name = TASKS[task].split(".")
    run: Task = getattr(import_module(f"leg_wear_monitor.studies.tasks.{module}"), name)
    try:
        return run(mechanism, settings)
    except SimulationError as error:
        return {"fault": np.array(str(error))}
