"""What verbs print and write: proposals of parameters."""

import math
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from leg_wear_monitor.cli.tables import figure, plain_table
from leg_wear_monitor.errors import printable

if TYPE_CHECKING:
    from leg_wear_monitor.commissioning.result import CommissioningItem, CommissioningResult


# A proposal of parameters as text.


_NEVER = 1000  # gait cycles, from which on their number is of no interest


def print_commissioning(result: "CommissioningResult") -> None:
    """Print what was found, what cannot be determined, and what does not fit."""
    console = Console(highlight=False, markup=False)
    console.print(f"\nfrom {result.turns:.3g} turns of the crank\n")
    console.print(_table(result))
    console.print("\nmismatch: RMS of the torque that stays unexplained, as a fraction of the torque's\n")
    for item in result.items:
        if item.better:
            console.print(f"better known: {item.name}: {item.better}", soft_wrap=True)
    _print_joints(console, result)
    texts = (
        ("not enough to tell", result.not_told),
        ("does not fit", result.findings),
        ("note", result.notes),
    )
    for label, sentences in texts:
        for text in sentences:
            console.print(f"{label}: {printable(text)}", soft_wrap=True)
    if result.config is None:
        console.print("no parameters are proposed, because a choice between them is not certain")


def _print_joints(console: Console, result: "CommissioningResult") -> None:
    """Print what the torque will show of each joint."""
    if result.joints:
        console.print(
            "\ngait cycles until the drive torque shows a wider joint: detected, as expected;\n"
            "named, in four of five legs whose masses are 4 % off\n"
        )
        console.print(_joints(result))
        console.print(f"\n{result.judgement}", soft_wrap=True)
    if result.reference_used:
        label = "reference: " if result.joints else ""
        console.print(f"{label}{printable(result.reference_used)}", soft_wrap=True)
    console.print()


def _joints(result: "CommissioningResult") -> Table:
    table = plain_table(("joint", "clearance", "detected", "named", "what else explains it"), 1, 5)
    for one in result.joints:
        last = len(one.clearances_m) - 1
        for i, clearance_m in enumerate(one.clearances_m):
            table.add_row(
                "" if i else one.joint,
                f"{1.0e3 * clearance_m:.3g} mm",
                _cycles(one.cycles[i]),
                _cycles(one.named_cycles[i]),
                one.runner_up if i == last else "",
            )
    return table


def _cycles(number: float) -> str:
    return f"{math.ceil(number)}" if number < _NEVER else "never" if math.isnan(number) else f"over {_NEVER}"


def _table(result: "CommissioningResult") -> Table:
    head = ("\nparameter", "\nvalue", "\n±", "mis-\nmatch", "\nrunner-up", "mis-\nmatch")
    table = plain_table(head, 1, 2, 5)
    for item in result.items:
        table.add_row(*_cells(item))
    return table


def _cells(item: "CommissioningItem") -> list[str]:
    return [
        item.name,
        f"{_shown(item.value)} {item.unit}".strip() if _is_known(item.value) else "-",
        "" if item.sigma is None else figure(item.sigma),
        "" if item.mismatch is None else f"{item.mismatch:.3f}",
        "" if item.other is None else _shown(item.other),
        "" if item.other_mismatch is None else f"{item.other_mismatch:.3f}",
    ]


def _is_known(value: str | int | float) -> bool:
    return not isinstance(value, float) or math.isfinite(value)


def _shown(value: str | int | float) -> str:
    if isinstance(value, str):
        return printable(value, 60)
    return str(value) if isinstance(value, int) else f"{value:.5g}"
