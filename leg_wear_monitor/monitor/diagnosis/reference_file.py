"""Torque references that come with the package, each bound to the leg that it was simulated for."""

import zipfile
from pathlib import Path
from typing import IO

import numpy as np

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.ledger.binding import fingerprint
from leg_wear_monitor.share import share_directory
from leg_wear_monitor.twin.reference.crank_profile import CrankProfile
from leg_wear_monitor.twin.reference.leg_parameters import LegParameters
from leg_wear_monitor.twin.reference.torque_reference import TorqueReference


def shipped_reference(mechanism: Mechanism) -> TorqueReference | None:
    """Reference that comes with the package for just this leg, under a steady crank; None if there is none.

    Raises
    ------
    ConfigError
        If a file cannot be read.
    """
    for file in sorted((share_directory() / "config" / "references").glob("*.npz")):
        found = read_reference(file, mechanism)
        if found is not None:
            return found
    return None


def write_reference(file: IO[bytes], mechanism: Mechanism, reference: TorqueReference) -> None:
    """Write a reference of a leg."""
    np.savez_compressed(
        file,
        fingerprint=np.array(fingerprint(mechanism)),
        speed_radps=np.array(reference.profile.speed),
        ripple_rad=np.stack([reference.profile.cosine, reference.profile.sine]),
        clearance_m=reference.clearance_m,
        expected_torque_nm=reference.torque_nm[0],
        torque_nm=np.stack(reference.torque_nm[1:]),
    )


def read_reference(path: Path, mechanism: Mechanism) -> TorqueReference | None:
    """Reference in a file; None if it is of another leg.

    Raises
    ------
    ConfigError
        If it cannot be read.
    """
    try:
        with np.load(path, allow_pickle=False) as parts:
            if str(parts["fingerprint"]) != fingerprint(mechanism):
                return None
            cosine, sine = parts["ripple_rad"]
            profile = CrankProfile(float(parts["speed_radps"]), cosine, sine)
            torque = (parts["expected_torque_nm"], *parts["torque_nm"])
            return TorqueReference(profile, parts["clearance_m"], torque, LegParameters.none(mechanism))
    except OSError as error:
        raise ConfigError(str(path), "", f"cannot be read: {error.strerror or error}") from error
    except (KeyError, ValueError, zipfile.BadZipFile) as error:
        raise ConfigError(str(path), "", f"is not a torque reference: {error}") from error
