"""``leg-wear-monitor simulate``: the leg offline, ideal or with clearances."""

import time
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli.doubts import warn_of
from leg_wear_monitor.cli.number import bounded, options_named
from leg_wear_monitor.cli.options import (
    clearances_option,
    json_option,
    mechanism_option,
    out_option,
    speed_option,
)
from leg_wear_monitor.cli.output import STDOUT, check_outputs, write_directory, write_json
from leg_wear_monitor.cli.waiting import compilation, progress_bar
from leg_wear_monitor.mechanism.law_names import NORMAL_LAWS

if TYPE_CHECKING:
    from leg_wear_monitor.dynamics.result.simulation_result import SimulationResult
    from leg_wear_monitor.mechanism.spec import Mechanism

# Spelled out, for --help shall not wait for numba; the tests compare them with the library's.
MODELS, DEFAULT_MODEL = ("clearance", "full"), "clearance"

# a motion too short to take time, but through all of the code
_WARM_UP_CYCLES, _WARM_UP_S = 1.0 / 256.0, 1.0e-9


@click.command(short_help="Simulate the leg offline, ideal or with clearances.")
@mechanism_option
@clearances_option("A,B|none")
@click.option(
    "--clearance-m",
    type=float,
    callback=bounded("m", above=0.0),
    metavar="M",
    help="Radial clearance in metres.  [default: the mechanism's own]",
)
@speed_option
@click.option(
    "--cycles",
    type=float,
    callback=bounded(above=0.0),
    metavar="N",
    help="Gait cycles to count.  [default: 5]",
)
@click.option(
    "--duration",
    type=float,
    callback=bounded("s", above=0.0),
    metavar="S",
    help="Time to count, in seconds, instead of cycles.",
)
@click.option(
    "--skip-cycles",
    type=float,
    callback=bounded(at_least=0.0),
    metavar="N",
    help="Gait cycles before counting.  [default: 1; 0 with --duration]",
)
@click.option(
    "--model", type=click.Choice(MODELS), help=f"Formulation of the motion.  [default: {DEFAULT_MODEL}]"
)
@click.option(
    "--wear",
    type=click.Choice(("on", "off")),
    default="off",
    show_default=True,
    help="Whether wear opens the clearances during the run; it is counted either way.",
)
@click.option(
    "--normal-law",
    type=click.Choice(NORMAL_LAWS),
    metavar="NAME",
    help=f"Normal contact law of all clearance joints: {', '.join(NORMAL_LAWS)}.",
)
@click.option(
    "--trace",
    type=click.IntRange(min=0),
    metavar="N",
    default=0,
    help="Keep N samples per cycle, for --json and for the pictures of --out; from some hundred on, samples "
    "take longer than the simulation.",
)
@click.option(
    "--intervals",
    type=int,
    metavar="N",
    help="Resolution of model clearance: intervals of time per gait cycle.  [default: 2048]",
)
@json_option("the result")
@out_option("Write result.json and pictures of the leg and its worn bushings.")
def simulate(mechanism: str, json_file: Path | None, out: Path | None, **options: Any) -> None:
    """Simulate the motion of the leg, ideal or with clearances, and report forces and wear."""
    if options["cycles"] is not None and options["duration"] is not None:
        raise click.UsageError("--cycles and --duration cannot be combined")
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.mechanism.plausible import doubts

    leg = load_mechanism(mechanism)
    check_outputs(json_file, out)
    with options_named():
        result, wall_s = _run(leg, _keywords(**options))
    warn_of(leg.source, doubts(leg))  # what fails names them itself, in its one line
    written = _write(leg, result, wall_s, json_file, out)
    if json_file != STDOUT:
        from leg_wear_monitor.cli.tables import print_result

        print_result(result, wall_s)
        for path in written:
            click.echo(f"written: {path}")


def _keywords(clearances: str | None, wear: str, duration: float | None, **options: Any) -> dict[str, Any]:
    """Arguments of the library's simulate; what was not asked for is left to the library."""
    keywords = {"wear": wear == "on", "duration_s": duration, **options}
    if clearances is not None:
        names = [] if clearances.strip() == "none" else clearances.split(",")
        keywords["clearances"] = [name.strip() for name in names]
    return {name: value for name, value in keywords.items() if value is not None}


def _run(leg: "Mechanism", keywords: dict[str, Any]) -> tuple["SimulationResult", float]:
    """The result, and the time [s] it took once all was compiled."""
    from leg_wear_monitor.dynamics.clearance.beforehand import motion_beside
    from leg_wear_monitor.dynamics.simulation import default_model, simulate
    from leg_wear_monitor.mechanism.spec import SpeedDrive

    span = ("cycles", "duration_s", "skip_cycles", "trace")
    short = {name: value for name, value in keywords.items() if name not in span}
    if isinstance(leg.drive, SpeedDrive):
        short |= {"cycles": _WARM_UP_CYCLES, "skip_cycles": 0.0}
    else:
        short["duration_s"] = _WARM_UP_S
    clearance_joints = keywords.get("clearances", leg.clearance_joints)
    model = keywords.get("model") or default_model(leg)
    kernels = model if clearance_joints else "ideal"
    with compilation(kernels), motion_beside() if kernels == "clearance" else nullcontext():
        simulate(leg, **short)
    with progress_bar("simulating") as progress:
        began = time.perf_counter()
        result = simulate(leg, **keywords, progress=progress)
        return result, time.perf_counter() - began


def _write(
    leg: "Mechanism",
    result: "SimulationResult",
    wall_s: float,
    json_file: Path | None,
    out: Path | None,
) -> list[Path]:
    """Write what was asked for, and give the files."""
    if json_file is None and out is None:
        return []
    written: list[Path] = []
    text = result.to_json(wall_s)
    if out is not None:
        from leg_wear_monitor.report.figures.simulation import pictures

        written += write_directory(out, {**pictures(leg, result), "result.json": text.encode()})
    return written + write_json(json_file, text)
