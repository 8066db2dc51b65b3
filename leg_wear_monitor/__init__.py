"""Wear of the joints of a crank-driven leg: its mechanism, its motion with clearances, what that wears away.

Names are imported when they are first used, so that the command line can answer before numba is loaded.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from leg_wear_monitor.errors import AssemblyError, ConfigError, LegWearError, SimulationError

if TYPE_CHECKING:
    from leg_wear_monitor.dynamics.result import SimulationResult
    from leg_wear_monitor.dynamics.simulation import simulate
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.mechanism.spec import Mechanism

_HOME = {
    "Mechanism": "mechanism.spec",
    "SimulationResult": "dynamics.result",
    "load_mechanism": "mechanism.loader",
    "simulate": "dynamics.simulation",
}

__all__ = [
    "AssemblyError",
    "ConfigError",
    "LegWearError",
    "Mechanism",
    "SimulationError",
    "SimulationResult",
    "load_mechanism",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
