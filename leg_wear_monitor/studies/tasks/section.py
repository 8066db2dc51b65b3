"""Poincaré sections at one crank angle, and phase portraits over a few cycles."""

from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.dynamics.run.run_statistics import new_run_statistics
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.tasks.ensemble import ensemble, observed_legs
from leg_wear_monitor.studies.tasks.grid import SAMPLES


def poincare_section(mechanism: Mechanism, settings: dict[str, Any]) -> Arrays:
    """Eccentricities and their rates at one crank angle of every cycle.

    Returns
    -------
    dict of arrays
        For cycles c, clearance joints k and samples s of ``portrait_cycles`` cycles:
        ``section_eccentricity_m``, ``section_rate_mps`` (c, k, 2); ``portrait_eccentricity_m``,
        ``portrait_rate_mps`` (s, k, 2); ``clearance_joints`` (k,): names.

    Raises
    ------
    SimulationError
        If the motion diverges.
    """
    start = round(settings["crank_angle_deg"] / 360.0 * SAMPLES) % SAMPLES * (TURN / SAMPLES)
    first = ensemble(mechanism, settings)[0]
    (leg,) = observed_legs([attrs.evolve(first, crank_angle_rad=start)])
    statistics = new_run_statistics(len(mechanism.joints))
    leg.advance(settings["skip_cycles"] * SAMPLES, statistics)
    portrait = [moment for _ in range(settings["portrait_cycles"]) for moment in leg.moments(statistics)]
    section = []
    for _ in range(settings["cycles"]):
        leg.advance(SAMPLES, statistics)
        section.append(leg.observe())
    shape = (-1, len(leg.setup.clearance_joints), 2)
    return {
        "clearance_joints": np.array(leg.setup.clearance_joints),
        "section_eccentricity_m": np.array([moment.e for moment in section]),
        "section_rate_mps": np.array([moment.rate for moment in section]),
        "portrait_eccentricity_m": np.array([moment.e for moment in portrait]).reshape(shape),
        "portrait_rate_mps": np.array([moment.rate for moment in portrait]).reshape(shape),
    }


def period_of(points: Floats, longest: int, tolerance: float) -> int | None:
    """Period of a Poincaré section.

    Parameters
    ----------
    points : (n, m) array
        Points of the section.
    longest : int
        Longest period to try.
    tolerance : float
        Largest difference between equal points, in the unit of the points.

    Returns
    -------
    int or None
        Number of points after which the section repeats; None if it does not.
    """
    for period in range(1, min(longest, len(points) - 1) + 1):
        if np.abs(points[period:] - points[:-period]).max() <= tolerance:
            return period
    return None
