"""Tasks by name, and their execution in a worker."""

from collections.abc import Callable
from typing import Any

import numpy as np

from leg_wear_monitor.errors import SimulationError
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.point import Arrays, code_digest
from leg_wear_monitor.studies.tasks.exponent import lyapunov_exponent
from leg_wear_monitor.studies.tasks.leg import drawn_leg_response
from leg_wear_monitor.studies.tasks.life import wear_life
from leg_wear_monitor.studies.tasks.response import run_ensemble
from leg_wear_monitor.studies.tasks.section import poincare_section

TASKS: dict[str, Callable[[Mechanism, dict[str, Any]], Arrays]] = {
    "response": run_ensemble,
    "leg": drawn_leg_response,
    "life": wear_life,
    "section": poincare_section,
    "exponent": lyapunov_exponent,
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
    try:
        return TASKS[task](mechanism, settings)
    except SimulationError as error:
        return {"fault": np.array(str(error))}
