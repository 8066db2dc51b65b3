"""Verbs that compute and draw: ``simulate``, ``study``, ``draw``."""

import time
import warnings
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli import common
from leg_wear_monitor.errors import ConfigError, ConfigWarning, printable
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.mechanism import FRICTION_LAWS, NORMAL_LAWS

if TYPE_CHECKING:
    from leg_wear_monitor.dynamics.result import SimulationResult
    from leg_wear_monitor.mechanism.spec import Mechanism
    from leg_wear_monitor.studies.study import Study


# ``leg-wear-monitor study``: the paper's parameter studies, each with a page of its own.


# The names come from the files, because --help must not wait for numpy.
NAMES = tuple(sorted(path.stem for path in (share_directory() / "config" / "studies").glob("*.yaml")))


@click.command(
    short_help="Run a parameter study.",
    help=f"""Compute a study and write its page.

    STUDY is a YAML file, or one of {", ".join(NAMES)}. Points in DIR for the same leg, settings
    and code are kept, so the same command continues an interrupted study.
    """,
)
@click.argument("name", metavar="STUDY")
@common.option("--mechanism", "FILE", "Leg to use instead of the leg in the study file.")
@common.path_option("--out", "DIR", "Directory for data and page.", required=True)
@common.workers_option
@common.scheduler_option
def study(name: str, mechanism: str | None, out: Path, workers: int | None, scheduler: str | None) -> int:
    """Compute a study and write its page; the help above says more."""
    import attrs

    from leg_wear_monitor.studies.study import read_study

    settings = read_study(name)
    if mechanism is not None:
        settings = attrs.evolve(settings, mechanism=mechanism)
    common.check_directory("--out", out)
    computed, total = _compute(settings, out, workers, scheduler)
    click.echo(f"points: {total}, {computed} computed now")
    return write_study_page(out)


def _compute(settings: "Study", out: Path, workers: int | None, scheduler: str | None) -> tuple[int, int]:
    import os

    from leg_wear_monitor.dynamics.clearance.stepper import motion_beside
    from leg_wear_monitor.dynamics.simulation import simulate
    from leg_wear_monitor.mechanism.loader import doubts, load_mechanism
    from leg_wear_monitor.studies.run import run_study

    leg = load_mechanism(settings.mechanism)
    with common.compilation(), motion_beside():  # once, and not in every worker at the same time
        if leg.clearances:
            simulate(leg, clearances=[next(iter(leg.clearances))], cycles=1.0 / 256.0, skip_cycles=0.0)
    with common.progress_bar(f"study {settings.title}") as progress:
        computed = run_study(
            settings,
            out,
            workers=workers or os.cpu_count() or 1,
            scheduler=scheduler,
            progress=progress,
        )
    common.warn_of(leg.source, doubts(leg))  # an error reports its doubts in a separate line
    return computed, len(settings.points())


def write_study_page(path: Path) -> int:
    """Draw the page of a study from the data in its directory; 1 if something is missing there."""
    from leg_wear_monitor.report.page import page_html
    from leg_wear_monitor.report.study_page import study_page
    from leg_wear_monitor.studies.run import load_results

    results = load_results(path)
    for file in common.write_directory(path, {"report.html": page_html(study_page(results)).encode()}):
        click.echo(f"written: {file}")
    for label, fault in results.faults:
        click.echo(f"warning: point {label}: {fault}", err=True)
    for label in results.missing:
        click.echo(f"warning: point {label}: is not computed yet", err=True)
    return common.WITH_FINDINGS if results.faults or results.missing else 0


# ``leg-wear-monitor draw``: a picture of a mechanism, working or not.


@click.command(short_help="Draw a mechanism, even if it is faulty.")
@click.argument("mechanism", metavar="MECHANISM")
@common.path_option(
    "--out",
    "FILE",
    "A page .html.  [default: MECHANISM.html in this directory]",
)
def draw(mechanism: str, out: Path | None) -> int:
    """Draw a mechanism file, or a mechanism that comes with the package.

    The HTML page moves the mechanism through its cycle; it is one file and needs no network. If the mechanism
    does not close, the page shows the open joint and its distance. If the crank does not turn through, the
    page shows its range and the bodies in line at its ends. The exit code is then 1.
    """
    target = Path(f"{Path(mechanism).stem}.html") if out is None else out
    if target.suffix.lower() != ".html":
        raise ConfigError("--out", str(target), "expected a file that ends in .html")
    common.check_file("--out", target)
    from leg_wear_monitor.mechanism.loader import load_mechanism

    leg = load_mechanism(mechanism)
    with common.compilation():
        from leg_wear_monitor.mechanism.reach import findings, headline, reach_of
        from leg_wear_monitor.report.drawing import drawing_html

        reach = reach_of(leg)
        text, found = drawing_html(reach), findings(reach)
    common.write_file(target, text.encode())
    click.echo(f"written: {target}: {printable(f'{leg.name}: {headline(reach)}')}")
    for finding in found:
        click.echo(f"warning: {leg.source}: {printable(finding)}", err=True)
    return common.WITH_FINDINGS if found else 0


# ``leg-wear-monitor simulate``: the leg offline, ideal or with clearances.


# Names are repeated here, because --help must not wait for numba; tests compare them with the library.
MODELS, DEFAULT_MODEL = ("clearance", "full"), "clearance"

# a motion too short to take time, but through all of the code
_WARM_UP_CYCLES, _WARM_UP_S = 1.0 / 256.0, 1.0e-9


@click.command(short_help="Simulate a leg, ideal or with clearances.")
@common.mechanism_option
@common.clearances_option
@common.positive("--clearance-m", "M", "Radial clearance [m].  [default: the mechanism's own]")
@common.speed_option
@common.positive("--cycles", "N", "Gait cycles in the results.  [default: 5]")
@common.positive("--duration", "S", "Duration of the results [s], instead of --cycles.", "duration_s")
@common.option(
    "--skip-cycles",
    "N",
    "Gait cycles skipped before the results.  [default: 1; 0 with --duration]",
    type=common.Number(min=0.0),
)
@common.choice("--model", MODELS, f"Formulation of the motion.  [default: {DEFAULT_MODEL}]")
@common.choice(
    "--wear",
    ("on", "off"),
    "on: the clearances grow by wear during the run. The results contain the wear in both cases.",
    default="off",
)
@common.option(
    "--normal-law",
    "NAME",
    f"Normal contact law of all clearance joints: {', '.join(NORMAL_LAWS)}.",
    type=click.Choice(NORMAL_LAWS),
)
@common.option(
    "--friction",
    "NAME",
    f"Friction law of all clearance joints: {', '.join(FRICTION_LAWS)}.",
    type=click.Choice(FRICTION_LAWS),
)
@click.option(
    "--trace",
    type=click.IntRange(min=0),
    metavar="N",
    default=0,
    help="Keep N samples per cycle for --json and the pictures of --out. Several hundred samples take longer "
    "than the simulation.",
)
@common.json_option("the result")
@common.out_option("Write result.json and pictures of the leg and its worn bushings.")
def simulate(mechanism: str, json_file: Path | None, out: Path | None, **options: Any) -> None:
    """Simulate the motion of the leg, ideal or with clearances, and report forces and wear."""
    if options["cycles"] is not None and options["duration_s"] is not None:
        raise click.UsageError("--cycles and --duration cannot be combined")
    from leg_wear_monitor.mechanism.loader import doubts, load_mechanism, ratio_fault

    leg = load_mechanism(mechanism)
    common.check_outputs(json_file, out)
    with common.options_named():
        result, wall_s = _run(leg, _keywords(**options))
    common.warn_of(leg.source, doubts(leg))  # an error reports its doubts in a separate line
    if (given := options["clearance_m"]) is not None:
        for radius in sorted({leg.clearances[name].bushing_radius for name in result.clearance_joints}):
            if fault := ratio_fault(given, radius):
                warnings.warn(f"--clearance-m: {fault}", ConfigWarning, stacklevel=2)
    written = _write(leg, result, wall_s, json_file, out)
    if json_file != common.STDOUT:
        from leg_wear_monitor.cli.tables import print_result

        print_result(result, wall_s)
    common.say(json_file, (), written)


def _keywords(clearances: str | None, wear: str, **options: Any) -> dict[str, Any]:
    """Arguments of the library's simulate; options that are not given keep the library's defaults."""
    keywords = {"wear": wear == "on", **options}
    if clearances is not None:
        names = [] if clearances.strip() == "none" else clearances.split(",")
        keywords["clearances"] = [name.strip() for name in names]
    return {name: value for name, value in keywords.items() if value is not None}


def _run(leg: "Mechanism", keywords: dict[str, Any]) -> tuple["SimulationResult", float]:
    """The result, and its computing time [s] without compilation."""
    from leg_wear_monitor.dynamics.clearance.stepper import motion_beside
    from leg_wear_monitor.dynamics.simulation import default_model, simulate
    from leg_wear_monitor.mechanism.spec import SpeedDrive

    span = ("cycles", "duration_s", "skip_cycles", "trace")
    short = {name: value for name, value in keywords.items() if name not in span}
    if isinstance(leg.drive, SpeedDrive):
        short |= {"cycles": _WARM_UP_CYCLES, "skip_cycles": 0.0}
    else:
        short["duration_s"] = _WARM_UP_S
    clearance_joints = keywords.get("clearances", leg.clearance_joints)
    is_clearance = clearance_joints and (keywords.get("model") or default_model(leg)) == "clearance"
    with common.compilation(), motion_beside() if is_clearance else nullcontext():
        simulate(leg, **short)
    with common.progress_bar("simulating") as progress:
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
    """Write the requested files, and return their paths."""
    if json_file is None and out is None:
        return []
    written: list[Path] = []
    text = result.to_json(wall_s)
    if out is not None:
        from leg_wear_monitor.report.plot import pictures

        written += common.write_directory(out, {**pictures(leg, result), "result.json": text.encode()})
    return written + common.write_json(json_file, text)
