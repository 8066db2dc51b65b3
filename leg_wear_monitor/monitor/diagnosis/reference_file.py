"""Files of torque references, each bound to the leg that it was simulated for."""

import zipfile
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO, Any

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError, LegWearError, printable
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.ledger.entry import fingerprint
from leg_wear_monitor.twin.reference import CrankProfile, LegParameters
from leg_wear_monitor.twin.references import TorqueReference, TorqueReferenceRun, levels_of
from leg_wear_monitor.wear import SECTORS

FORMAT = 4  # 3 had no legs that show how masses, lengths and friction act

_LOAD_SIGMA = 0.05  # relative error of a given force: a sensor's mean over some steps

BEFOREHAND_CYCLES = 40  # gait cycles per leg: two and four times as many as while the leg walks

# exceptions from a damaged archive, because a damaged byte may be anywhere in it
_DAMAGES = (
    EOFError, KeyError, MemoryError, NotImplementedError, RuntimeError, TypeError, ValueError,
    zipfile.BadZipFile, zlib.error,
)  # fmt: skip


def simulated_references(
    mechanism: Mechanism,
    cadences_rpm: Sequence[float],
    progress: Callable[[float], None] = lambda _fraction: None,
    load: Floats | None = None,
) -> tuple[TorqueReference, ...]:
    """References of a new leg whose crank turns steadily, as many cores as there are at once.

    For a leg in the air, legs that show the effect of masses, lengths and friction follow each reference.

    Parameters
    ----------
    mechanism : Mechanism
        With the parameters of the configuration applied.
    cadences_rpm : sequence of float
        A reference each; negative for a crank that turns clockwise.
    progress : callable
        Called with the fraction that is done, 0 to 1.
    load : (PHASES, 2) array, optional
        Mean force of the ground on the toe at equal steps of the crank angle from 0 [N].

    Raises
    ------
    LegWearError
        If the leg cannot be simulated.
    """
    made: list[TorqueReference] = []
    number = len(cadences_rpm) * (2 if load is None else 1)

    def part(fraction: float) -> None:
        progress((len(made) + fraction) / number)

    for cadence in cadences_rpm:
        profile = CrankProfile.steady(cadence / 60.0 * TURN)
        made.append(simulated_under(mechanism, profile, part, load))
        if load is None:
            run = TorqueReferenceRun(mechanism, -(-BEFOREHAND_CYCLES // 2))
            run.begin_identification(*_new(mechanism), profile, LegParameters.none(mechanism))
            made.append(_finished(run, mechanism, part))
    return tuple(made)


def simulated_under(
    mechanism: Mechanism,
    profile: CrankProfile,
    progress: Callable[[float], None] = lambda _fraction: None,
    load: Floats | None = None,
) -> TorqueReference:
    """Reference of a new leg under a given motion of its crank, as `simulated_references`.

    Raises
    ------
    LegWearError
        If the leg cannot be simulated.
    """
    leg = LegParameters.none(mechanism)
    leg = leg if load is None else attrs.evolve(leg, load=load, load_sigma=_LOAD_SIGMA)
    run = TorqueReferenceRun(mechanism, BEFOREHAND_CYCLES, BEFOREHAND_CYCLES)
    run.begin(*_new(mechanism), profile, leg)
    return _finished(run, mechanism, progress)


def _new(mechanism: Mechanism) -> tuple[Floats, Floats]:
    """Clearances (k,) and wear depths (k, 2, N) of a new leg [m]."""
    fresh = np.array([mechanism.clearances[one].radial_clearance for one in mechanism.clearance_joints])
    return fresh, np.zeros((len(fresh), 2, SECTORS))


def _finished(
    run: TorqueReferenceRun, mechanism: Mechanism, progress: Callable[[float], None]
) -> TorqueReference:
    """The reference that a run gives at its end."""
    found = run.finish(progress)
    if found is None:
        raise LegWearError(f"{mechanism.name}: cannot be simulated at {run.profile.cadence_rpm:.3g} rpm")
    return found


def shipped_references(mechanism: Mechanism) -> tuple[TorqueReference, ...]:
    """References that come with the package for just this leg; empty if there are none.

    Raises
    ------
    ConfigError
        If a file cannot be read.
    """
    files = sorted((share_directory() / "config" / "references").glob("*.npz"))
    return tuple(one for file in files for one in _references(file, mechanism)[0])


def write_references(file: IO[bytes], mechanism: Mechanism, references: Sequence[TorqueReference]) -> None:
    """Write references of a leg; the same references give the same bytes."""
    parts: dict[str, Any] = {
        "format": FORMAT,
        "fingerprint": fingerprint(mechanism),
        "mechanism": mechanism.name,
        "joints": mechanism.clearance_joints,
        "bodies": tuple(mechanism.bodies),
        "references": len(references),
    }
    for i, one in enumerate(references):
        parts |= {
            f"speed_radps_{i}": one.profile.speed,
            f"ripple_rad_{i}": np.stack([one.profile.cosine, one.profile.sine]),
            f"mass_{i}": one.parameters.mass,
            f"length_{i}": one.parameters.length,
            f"friction_{i}": one.parameters.friction,
            f"compliance_rad_per_nm_{i}": one.parameters.compliance,
            f"damping_ratio_{i}": one.parameters.damping,
            f"load_n_{i}": one.parameters.load,
            f"load_sigma_{i}": one.parameters.load_sigma,
            f"clearance_m_{i}": one.clearance_m,
            f"cycles_{i}": [len(torque) for torque in one.torque_nm],
            f"torque_nm_{i}": np.concatenate(one.torque_nm),
        }
    np.savez_compressed(file, **parts)


def read_references(path: Path, mechanism: Mechanism) -> tuple[TorqueReference, ...]:
    """References in a file.

    Raises
    ------
    ConfigError
        If the file cannot be read, or describes a different leg.
    """
    found, name = _references(path, mechanism)
    if not found:
        raise ConfigError(
            str(path),
            "",
            f"has torque references of a different leg ({printable(name, 60)}). Expected those of "
            f"{mechanism.name} with its bodies, lengths, clearance joints and clearances, in the same order",
        )
    return found


def _references(path: Path, mechanism: Mechanism) -> tuple[tuple[TorqueReference, ...], str]:
    """References in a file, none if it describes a different leg, and the name of its mechanism."""
    try:
        if path.stat().st_size and not zipfile.is_zipfile(path):
            raise ValueError("it is not an archive of numpy")
        with np.load(path, allow_pickle=False) as parts:
            number = int(parts["format"])
            if number != FORMAT:
                raise ValueError(f"format {number}. Expected {FORMAT}")
            name, joints = str(parts["mechanism"]), tuple(parts["joints"].tolist())
            # the fingerprint leaves open the order of joints and bodies, in which clearances and masses are
            order, bodies = (mechanism.clearance_joints, tuple(mechanism.bodies)), parts["bodies"].tolist()
            if str(parts["fingerprint"]) != fingerprint(mechanism) or (joints, tuple(bodies)) != order:
                return (), name
            references = range(int(parts["references"]))
            found = tuple(_reference(parts, i, len(joints)) for i in references)
            if not found:
                raise ValueError("it contains no reference")
            return found, name
    except OSError as error:
        raise ConfigError(str(path), "", f"cannot be read: {error.strerror or error}") from error
    except _DAMAGES as error:
        reason = printable(" ".join(str(error).split()), 200) or type(error).__name__
        raise ConfigError(
            str(path), "", f"is not a file of torque references, or is damaged: {reason}"
        ) from error


def _reference(parts: Any, i: int, joints: int) -> TorqueReference:
    """Reference number i of an archive."""
    names = ("friction", "compliance_rad_per_nm", "damping_ratio")
    friction, compliance, damping = (float(parts[f"{name}_{i}"]) for name in names)
    mass, length, load = (parts[f"{name}_{i}"] for name in ("mass", "length", "load_n"))
    leg = LegParameters(mass, length, friction, compliance, damping, load, float(parts[f"load_sigma_{i}"]))
    profile = CrankProfile(float(parts[f"speed_radps_{i}"]), *parts[f"ripple_rad_{i}"])
    torque_nm = np.split(parts[f"torque_nm_{i}"], np.cumsum(parts[f"cycles_{i}"])[:-1])
    found = TorqueReference(profile, parts[f"clearance_m_{i}"], tuple(torque_nm), leg)
    if found.is_of_parameters:
        if len(torque_nm) != len(levels_of(leg)):
            raise ValueError(
                f"it has {len(torque_nm)} legs with other masses. Expected {len(levels_of(leg))}"
            )
        return found
    others = len(torque_nm) - 1 - found.of_masses.size - found.of_frictions.size
    if others % joints:
        raise ValueError(f"its {others} wider legs are not the same number for each of {joints} joints")
    return found
