"""Joint wear of a crank-driven leg: mechanism, motion with clearances, wear, monitor and forecast.

Names are imported when they are first used, so that the command line can answer before numba is loaded.
"""

from importlib import import_module

from leg_wear_monitor.errors import AssemblyError, ConfigError, LegWearError, SimulationError, extras_hinted

TYPE_CHECKING = False  # as typing has it, without the time to import that
if TYPE_CHECKING:
    from typing import Any

    from leg_wear_monitor.commissioning.commission import commission
    from leg_wear_monitor.commissioning.proposal import CommissioningItem, CommissioningResult
    from leg_wear_monitor.dynamics.result import (
        EnergyBalance,
        Impact,
        JointResult,
        SimulationResult,
        ToeResult,
        TorqueResult,
        Trace,
    )
    from leg_wear_monitor.dynamics.simulation import simulate
    from leg_wear_monitor.files import share_directory
    from leg_wear_monitor.fleet.overview import Fleet, FleetOverview, LegOverview
    from leg_wear_monitor.life.design import BushingLife, design
    from leg_wear_monitor.life.life import LifeRun, LifeSettings, simulate_life
    from leg_wear_monitor.life.result import Duty, Life
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.mechanism.materials import (
        Drive,
        Material,
        drives,
        load_drive,
        load_material,
        materials,
    )
    from leg_wear_monitor.mechanism.person import with_ground_reaction, with_person
    from leg_wear_monitor.mechanism.spec import Mechanism
    from leg_wear_monitor.monitor.config.parameters import load_config
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.monitor.ledger.ledger import open_ledger
    from leg_wear_monitor.monitor.wear_monitor import WearMonitor
    from leg_wear_monitor.recordings.replay import replay
    from leg_wear_monitor.recordings.result import ReplayJoint, ReplaySummary
    from leg_wear_monitor.recordings.summary import ReplayResult
    from leg_wear_monitor.report.plot import plot
    from leg_wear_monitor.studies.run import load_study
    from leg_wear_monitor.twin.sample import gait_samples

_HOME = {
    "BushingLife": "life.design",
    "CommissioningItem": "commissioning.proposal",
    "CommissioningResult": "commissioning.proposal",
    "Drive": "mechanism.materials",
    "Duty": "life.result",
    "EnergyBalance": "dynamics.result",
    "Fleet": "fleet.overview",
    "FleetOverview": "fleet.overview",
    "Impact": "dynamics.result",
    "JointResult": "dynamics.result",
    "LegOverview": "fleet.overview",
    "Life": "life.result",
    "LifeRun": "life.life",
    "LifeSettings": "life.life",
    "Material": "mechanism.materials",
    "Mechanism": "mechanism.spec",
    "MonitorConfig": "monitor.config.settings",
    "ReplayJoint": "recordings.result",
    "ReplayResult": "recordings.summary",
    "ReplaySummary": "recordings.result",
    "SimulationResult": "dynamics.result",
    "ToeResult": "dynamics.result",
    "TorqueResult": "dynamics.result",
    "Trace": "dynamics.result",
    "WearMonitor": "monitor.wear_monitor",
    "commission": "commissioning.commission",
    "design": "life.design",
    "drives": "mechanism.materials",
    "gait_samples": "twin.sample",
    "load_config": "monitor.config.parameters",
    "load_drive": "mechanism.materials",
    "load_material": "mechanism.materials",
    "load_mechanism": "mechanism.loader",
    "load_study": "studies.run",
    "materials": "mechanism.materials",
    "with_ground_reaction": "mechanism.person",
    "open_ledger": "monitor.ledger.ledger",
    "plot": "report.plot",
    "replay": "recordings.replay",
    "share_directory": "files",
    "simulate": "dynamics.simulation",
    "simulate_life": "life.life",
    "with_person": "mechanism.person",
}

__all__ = [
    "AssemblyError",
    "BushingLife",
    "CommissioningItem",
    "CommissioningResult",
    "ConfigError",
    "Drive",
    "Duty",
    "EnergyBalance",
    "Fleet",
    "FleetOverview",
    "Impact",
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
    "design",
    "drives",
    "gait_samples",
    "load_config",
    "load_drive",
    "load_material",
    "load_mechanism",
    "load_study",
    "materials",
    "open_ledger",
    "plot",
    "replay",
    "share_directory",
    "simulate",
    "simulate_life",
    "with_ground_reaction",
    "with_person",
]


def __getattr__(name: str) -> "Any":
    if name == "__version__":
        return import_module("importlib.metadata").version(__name__)
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    with extras_hinted():
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, "__version__"})
