"""Joint wear of a crank-driven leg: mechanism, motion with clearances, wear, monitor and forecast.

Names are imported when they are first used, so that the command line can answer before numba is loaded.
"""

from importlib import import_module

from leg_wear_monitor.errors import AssemblyError, ConfigError, LegWearError, SimulationError
from leg_wear_monitor.shown import VIEWS

TYPE_CHECKING = False  # as typing has it, without the time to import that
if TYPE_CHECKING:
    from typing import Any

    from leg_wear_monitor.commissioning.commission import commission
    from leg_wear_monitor.commissioning.result.commissioning_result import (
        CommissioningItem,
        CommissioningResult,
    )
    from leg_wear_monitor.commissioning.result.joint_detection import JointDetection
    from leg_wear_monitor.dynamics.result.parts import (
        EnergyBalance,
        Impact,
        JointResult,
        ToeResult,
        TorqueResult,
        Trace,
    )
    from leg_wear_monitor.dynamics.result.simulation_result import SimulationResult
    from leg_wear_monitor.dynamics.simulation import simulate
    from leg_wear_monitor.fleet.fleet import Fleet
    from leg_wear_monitor.fleet.overview.parts import FleetOverview, LegOverview
    from leg_wear_monitor.life.duty import Duty
    from leg_wear_monitor.life.life import LifeRun, LifeSettings, simulate_life
    from leg_wear_monitor.life.result import Life
    from leg_wear_monitor.mechanism.drives.drive import Drive
    from leg_wear_monitor.mechanism.drives.loader import drives, load_drive
    from leg_wear_monitor.mechanism.ground_reaction import on_the_ground
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.mechanism.materials.loader import load_material, materials
    from leg_wear_monitor.mechanism.materials.material import Material
    from leg_wear_monitor.mechanism.person import with_person
    from leg_wear_monitor.mechanism.spec import Mechanism
    from leg_wear_monitor.monitor.config.parameter_file import load_config
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.monitor.ledger.ledger import open_ledger
    from leg_wear_monitor.monitor.wear_monitor import WearMonitor
    from leg_wear_monitor.playback.replay import replay
    from leg_wear_monitor.playback.result.parts import ReplayJoint
    from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
    from leg_wear_monitor.playback.summary import ReplayResult
    from leg_wear_monitor.report.plot import plot
    from leg_wear_monitor.share import share_directory
    from leg_wear_monitor.twin.sample import gait_samples

_HOME = {
    "CommissioningItem": "commissioning.result.commissioning_result",
    "CommissioningResult": "commissioning.result.commissioning_result",
    "Drive": "mechanism.drives.drive",
    "Duty": "life.duty",
    "EnergyBalance": "dynamics.result.parts",
    "Fleet": "fleet.fleet",
    "FleetOverview": "fleet.overview.parts",
    "Impact": "dynamics.result.parts",
    "JointDetection": "commissioning.result.joint_detection",
    "JointResult": "dynamics.result.parts",
    "LegOverview": "fleet.overview.parts",
    "Life": "life.result",
    "LifeRun": "life.life",
    "LifeSettings": "life.life",
    "Material": "mechanism.materials.material",
    "Mechanism": "mechanism.spec",
    "MonitorConfig": "monitor.config.settings",
    "ReplayJoint": "playback.result.parts",
    "ReplayResult": "playback.summary",
    "ReplaySummary": "playback.result.replay_summary",
    "SimulationResult": "dynamics.result.simulation_result",
    "ToeResult": "dynamics.result.parts",
    "TorqueResult": "dynamics.result.parts",
    "Trace": "dynamics.result.parts",
    "WearMonitor": "monitor.wear_monitor",
    "commission": "commissioning.commission",
    "drives": "mechanism.drives.loader",
    "gait_samples": "twin.sample",
    "load_config": "monitor.config.parameter_file",
    "load_drive": "mechanism.drives.loader",
    "load_material": "mechanism.materials.loader",
    "load_mechanism": "mechanism.loader",
    "materials": "mechanism.materials.loader",
    "on_the_ground": "mechanism.ground_reaction",
    "open_ledger": "monitor.ledger.ledger",
    "plot": "report.plot",
    "replay": "playback.replay",
    "share_directory": "share",
    "simulate": "dynamics.simulation",
    "simulate_life": "life.life",
    "with_person": "mechanism.person",
}

__all__ = [
    "AssemblyError",
    "CommissioningItem",
    "CommissioningResult",
    "ConfigError",
    "Drive",
    "Duty",
    "EnergyBalance",
    "Fleet",
    "FleetOverview",
    "Impact",
    "JointDetection",
    "JointResult",
    "LegOverview",
    "LegWearError",
    "Life",
    "LifeRun",
    "LifeSettings",
    "Material",
    "Mechanism",
    "MonitorConfig",
    "ReplayJoint",
    "ReplayResult",
    "ReplaySummary",
    "SimulationError",
    "SimulationResult",
    "ToeResult",
    "TorqueResult",
    "Trace",
    "WearMonitor",
    "commission",
    "drives",
    "gait_samples",
    "load_config",
    "load_drive",
    "load_material",
    "load_mechanism",
    "materials",
    "on_the_ground",
    "open_ledger",
    "plot",
    "replay",
    "share_directory",
    "simulate",
    "simulate_life",
    "with_person",
]

VIEWS["html"] = lambda thing: import_module(f"{__name__}.report.notebook").notebook_html(thing)
VIEWS["plot"] = lambda thing, axes: import_module(f"{__name__}.report.plot").plot(thing, axes)


def __getattr__(name: str) -> "Any":
    if name == "__version__":
        return import_module("importlib.metadata").version(__name__)
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, "__version__"})
