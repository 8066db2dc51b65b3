"""Compilation of the motion before any leg is there: types of arguments do not depend on the mechanism."""

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import numpy as np

from leg_wear_monitor.beside import compiled_beside
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance.advance import advance_clearances, observe
from leg_wear_monitor.dynamics.clearance.coupling import rigid_coupling
from leg_wear_monitor.dynamics.clearance.film_system import film_model
from leg_wear_monitor.dynamics.clearance.joint_laws import contact_laws
from leg_wear_monitor.dynamics.clearance.layout import motion_shapes
from leg_wear_monitor.dynamics.clearance.model import (
    ClearanceModel,
    ClearanceState,
    ClearanceWork,
    clearance_state,
    clearance_work,
)
from leg_wear_monitor.dynamics.clearance.tables import ClearanceTables
from leg_wear_monitor.dynamics.run.run_statistics import new_run_statistics
from leg_wear_monitor.kernel import compile_for


def _contacts() -> ContactArrays:
    """Settings of one clearance joint, all 0."""
    whole, line, pair = np.zeros(1, np.int64), np.zeros(1), np.zeros((1, 2))
    return ContactArrays(
        joint=whole, bushing_radius=line, clearance=line, width=line, modulus=line, normal_form=whole,
        stiffness=line, hysteresis=line, speed_floor=line, friction_law=whole, friction=np.zeros((1, 3)),
        wear_coefficient=pair,
    )  # fmt: skip


def _tables() -> ClearanceTables:
    """Tables of one clearance joint, all 0 and as small as can be."""
    width = sum(math.prod(shape) for shape in motion_shapes(1, damped=False).values())
    return ClearanceTables(
        motion=np.zeros((1, width)),
        reaction=np.zeros((1, 1, 1)),
        reaction_joint=np.zeros(1, np.int64),
        stored=np.zeros((1, 1)),
        parts=np.zeros(1, np.int64),
        by_e=np.zeros((1, 1, 1, 1), np.float32),
        bend=np.zeros((1, 1, 1, 1), np.float32),
        spin=np.zeros((1, 1, 1, 1), np.float32),
        spin_reaction=np.zeros((1, 1, 1), np.float32),
    )


def _leg() -> tuple[ClearanceModel, ClearanceState, ClearanceWork]:
    """A leg that has the types of all legs, and nothing else."""
    contacts, line = _contacts(), np.zeros(2)
    film = film_model(contacts, np.zeros((1, 2)))
    model = ClearanceModel(
        contacts,
        _tables(),
        1.0,
        tolerance=line,
        law=contact_laws(contacts),
        usual=1,
        film=film,
        damped=0,
        coupling=rigid_coupling(),
    )
    state = clearance_state(np.zeros((1, 2, 1)), 0.0, 1.0)
    return model, state, clearance_work(model, state)


def advance_arguments() -> tuple[Any, ...]:
    """Arguments of the types that `advance_clearances` is called with."""
    model, state, work = _leg()
    return model, 0, state, np.zeros(7), 0.0, new_run_statistics(1), work


def observe_arguments() -> tuple[Any, ...]:
    """Arguments of the types that `observe` is called with."""
    model, state, work = _leg()
    return model, 0, state, work


def compile_advance() -> None:
    """Compile `advance_clearances`, or load it."""
    compile_for(advance_clearances, *advance_arguments())


def advance_beside() -> AbstractContextManager[None]:
    """Have a second process compile `advance_clearances` while the work inside compiles all else."""
    return compiled_beside(compile_advance, advance_clearances)


@contextmanager
def motion_beside() -> Iterator[None]:
    """Have two processes compile the motion: `advance_clearances` the second, `observe` this one."""
    with advance_beside():
        compile_for(observe, *observe_arguments())
        yield
