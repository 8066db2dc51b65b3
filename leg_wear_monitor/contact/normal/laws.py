"""The normal contact laws by name, and kernels that select a joint's law (physics.md section 4).

To add a law of another form, add a file beside this one, an entry to `LAWS`, and its name to
`mechanism.law_names`, where mechanism files and the command line check it without importing numba.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from leg_wear_monitor.contact.normal.form import Form
from leg_wear_monitor.contact.normal.hertz import HERTZ
from leg_wear_monitor.contact.normal.hysteresis import (
    flores,
    gonthier,
    hu_guo,
    hunt_crossley,
    lankarani_nikravesh,
    no_loss,
)
from leg_wear_monitor.contact.normal.winkler import WINKLER
from leg_wear_monitor.kernel import kernel


class NormalLaw(NamedTuple):
    """A form of the force, and its hysteresis factor chi as a function of the coefficient of restitution."""

    form: Form
    hysteresis: Callable[[float], float]

    @property
    def number(self) -> int:
        """Number of the form in compiled code."""
        return _FORMS.index(self.form)


LAWS: dict[str, NormalLaw] = {
    "hertz": NormalLaw(HERTZ, no_loss),
    "hunt-crossley": NormalLaw(HERTZ, hunt_crossley),
    "lankarani-nikravesh": NormalLaw(HERTZ, lankarani_nikravesh),
    "gonthier": NormalLaw(HERTZ, gonthier),
    "flores": NormalLaw(HERTZ, flores),
    "hu-guo": NormalLaw(HERTZ, hu_guo),
    "winkler": NormalLaw(WINKLER, hu_guo),
}

_FORMS = tuple(dict.fromkeys(law.form for law in LAWS.values()))


def _only(this: Callable[..., Any]) -> Callable[..., Any]:
    """Kernel that calls ``this`` for any form's number."""

    @kernel
    def only(form, *arguments):
        return this(*arguments)

    return only


def _either(number: int, this: Callable[..., Any], others: Callable[..., Any]) -> Callable[..., Any]:
    """Kernel that calls ``this`` for one form's number, and ``others`` for any other."""

    @kernel
    def either(form, *arguments):
        if form == number:
            return this(*arguments)
        return others(form, *arguments)

    return either


def _of_form(part: str) -> Callable[..., Any]:
    """Kernel that takes the number of a form, then the arguments of the form's kernel named ``part``.

    It is a chain of branches, built once: compiled code cannot cheaply call a function that is an argument.
    """
    *others, last = (getattr(form, part) for form in _FORMS)
    chain = _only(last)
    for number, this in reversed(list(enumerate(others))):
        chain = _either(number, this, chain)
    return chain


law_coefficient = _of_form("coefficient")
normal_force = _of_form("force")
elastic_energy = _of_form("energy")
softening = _of_form("softening")
