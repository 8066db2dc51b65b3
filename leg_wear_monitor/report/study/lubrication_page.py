"""Conclusions of the study of oil and grease, from its data."""

from leg_wear_monitor.report.study.text import Labelled, joined, number, percent, with_spread
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.summary import (
    clearance_joints_of,
    depth_per_cycle,
    joint_force,
    of_clearance_joints,
)

_OPENS_M = 1.0e-4  # depth of the bushing at which a life is compared
_MILLION = 1.0e-6


def lubrication(labelled: Labelled) -> list[str]:
    """Order of the joints by wear, life of the first, forces and contact, dry and with each viscosity."""
    (_, dry), *greased = labelled
    sentences = [f"{_capital(label)}: {_order(arrays)}" for label, arrays in labelled]
    for joint in clearance_joints_of(dry):
        loads = [
            f"{label} {with_spread(joint_force(arrays, 'p99_force_n', joint))}" for label, arrays in labelled
        ]
        sentences.append(
            f"Joint {joint}: force of contact and film, 99 % of the time below [N]: {'; '.join(loads)}."
        )
    for label, arrays in greased:
        sentences.append(f"With {label} {_against(arrays, dry)}.")
    return sentences


def _capital(label: str) -> str:
    return label[:1].upper() + label[1:]


def _order(arrays: Arrays) -> str:
    """The joints by wear of the bushing, most first, and the life of the first."""
    depths = {joint: depth_per_cycle(arrays, joint) for joint in clearance_joints_of(arrays)}
    worn = sorted((joint for joint in depths if depths[joint].mean > 0.0), key=lambda j: -depths[j].mean)
    if not worn:
        return "the films carry everything, and no joint wears."
    texts = [f"{joint} {with_spread(depths[joint], 1.0e12)}" for joint in worn]
    first = depths[worn[0]]
    cycles = _OPENS_M / first.mean
    scatter = cycles * first.deviation / first.mean
    rest = [joint for joint in depths if joint not in worn]
    idle = f"; {joined(rest)} {'does' if len(rest) == 1 else 'do'} not wear" if rest else ""
    return (
        f"greatest depth of the bushings [pm a cycle]: {', '.join(texts)}{idle}. At this rate {worn[0]} is "
        f"{1.0e3 * _OPENS_M:g} mm deep after {number(_MILLION * cycles)} ± {number(_MILLION * scatter)} "
        "million cycles."
    )


def _against(arrays: Arrays, dry: Arrays) -> str:
    """Wear and time in contact against those of the dry joints."""
    wear, touch = [], []
    for joint in clearance_joints_of(dry):
        before, after = (
            of_clearance_joints(each, "archard_integral_j_per_cycle", joint).mean for each in (dry, arrays)
        )
        wear.append(f"{joint} {percent(after / before)}" if before > 0.0 else f"{joint} –")
        touch.append(f"{joint} {percent(of_clearance_joints(arrays, 'contact_fraction', joint).mean)}")
    return (
        f"the wear, ∫ F |v| dt of the contact's share, is of the dry one: {', '.join(wear)}; surfaces touch "
        f"for: {', '.join(touch)} of the time"
    )
