"""Verbs that compute and draw: ``simulate``, ``study``, ``draw``."""

import math
import time
import warnings
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli import common
from leg_wear_monitor.errors import ConfigError, ConfigWarning, LegWearError, printable
from leg_wear_monitor.files import Stamp, share_directory, stamp_of
from leg_wear_monitor.mechanism import FRICTION_LAWS, NORMAL_LAWS

if TYPE_CHECKING:
    from leg_wear_monitor.dynamics.result import SimulationResult
    from leg_wear_monitor.mechanism.spec import Mechanism
    from leg_wear_monitor.report.drawing import Drawing
    from leg_wear_monitor.studies.study import Study


# ``leg-wear-monitor study``: the paper's parameter studies, each with a page of its own.


# by their files, for --help shall not wait for numpy
NAMES = tuple(sorted(path.stem for path in (share_directory() / "config" / "studies").glob("*.yaml")))


@click.command(
    short_help="Run a parameter study.",
    help=f"""Compute a study and write its page.

    STUDY is a YAML file, or one of {", ".join(NAMES)}. Points that DIR already has for the same leg, settings
    and code are kept: the same command continues an interrupted study.
    """,
)
@click.argument("name", metavar="STUDY")
@common.option("--mechanism", "FILE", "Use a different leg than the study file.")
@common.path_option("--out", "DIR", "Data and page.", required=True)
@common.workers_option
@common.scheduler_option("compute")
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
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.mechanism.plausible import doubts
    from leg_wear_monitor.studies.run import run_study

    leg = load_mechanism(settings.mechanism)
    with common.compilation("clearance"), motion_beside():  # once, and not in every worker at the same time
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
    common.warn_of(leg.source, doubts(leg))  # what fails names them itself, in its one line
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


_URDF = ".urdf"
_SUFFIXES = (".html", ".svg", _URDF)
_OURS = b"leg-wear-monitor draw"  # near the begin of what this verb writes
_POLL_S = 0.2


@click.command(short_help="Draw a mechanism, working or not.")
@click.argument("mechanism", metavar="MECHANISM")
@common.path_option(
    "--out", "FILE", "A file .html, .svg or .urdf.  [default: MECHANISM.html in this directory]"
)
@click.option(
    "--urdf",
    is_flag=True,
    help="Write MECHANISM.urdf in place of a picture: a tree of its links with the loops cut, for RViz.",
)
@click.option("--forces", is_flag=True, help="Draw the forces in the joints, without clearance (.html).")
@common.number_option(
    "--crank-angle",
    "DEG",
    "Position to draw, or to show first.  [default: 0, or the one that shows what is wrong]",
    "deg",
)
@click.option("--watch", is_flag=True, help="Draw again whenever the mechanism file is saved, until Ctrl-C.")
def draw(
    mechanism: str, out: Path | None, urdf: bool, forces: bool, crank_angle: float | None, watch: bool
) -> int:
    """Draw a mechanism file, or a mechanism that comes with the package.

    The HTML page moves the mechanism through its cycle; it is one file and needs no network. Where the
    mechanism does not close, its bodies are drawn apart at the open joint, with the distance; where its crank
    does not turn through, the page shows the range and the bodies in line at its ends. The exit code is then
    1. Replaces a drawing of an earlier run, and no other file.
    """
    target = Path(f"{Path(mechanism).stem}.{'urdf' if urdf else 'html'}") if out is None else out
    _check_target(target)
    if urdf or target.suffix.lower() == _URDF:
        if forces or watch or crank_angle is not None or target.suffix.lower() != _URDF:
            fault = f"{target} is a robot description, expected no other option than --out FILE.urdf"
            raise ConfigError("--urdf", "", fault)
        return _describe(mechanism, target)
    if forces and target.suffix.lower() == ".svg":
        raise ConfigError("--forces", "", f"{target} is a still picture, expected an --out FILE.html")
    if watch:
        return _watch(mechanism, target, forces, crank_angle)
    return _draw(mechanism, target, forces, crank_angle)


def _check_target(path: Path) -> None:
    """Make sure that a drawing can be written, and that it replaces none but a drawing."""
    if path.suffix.lower() not in _SUFFIXES:
        raise ConfigError("--out", str(path), f"expected a file that ends in {' or '.join(_SUFFIXES)}")
    common.check_file("--out", path)
    if path.is_file():
        with path.open("rb") as file:
            is_ours = _OURS in file.read(4096)
        if not is_ours:
            raise ConfigError(
                "--out", str(path), "exists and is no drawing of this command, expected another --out FILE"
            )


def _describe(mechanism: str, target: Path) -> int:
    """Write a mechanism as URDF."""
    from leg_wear_monitor.mechanism.loader import load_mechanism

    leg = load_mechanism(mechanism)
    with common.compilation("mechanism", how_long="a few seconds"):
        from leg_wear_monitor.mechanism.urdf import urdf

        text = urdf(leg)
    head, _, robot = text.partition("\n")
    common.write_file(target, f"{head}\n<!-- made by {_OURS.decode()} -->\n{robot}".encode())
    click.echo(f"written: {target}: {printable(leg.name)}")
    return 0


def _draw(mechanism: str, target: Path, forces: bool, crank_angle: float | None, watch: bool = False) -> int:
    """Draw once, and say what was drawn and what is wrong."""
    from leg_wear_monitor.mechanism.loader import load_mechanism

    leg = load_mechanism(mechanism)
    angle = None if crank_angle is None else math.radians(crank_angle)
    with common.compilation("mechanism", how_long="a few seconds"):
        from leg_wear_monitor.report.drawing import drawing_of

        drawing = drawing_of(leg, angle, forces)
        content = _content(drawing, target, watch)
    was_there = target.exists()
    common.write_file(target, content)
    how = "replaced" if was_there else "written"
    click.echo(f"{how}: {target}: {printable(leg.name)}: {printable(drawing.headline)}")
    for finding in drawing.findings:
        click.echo(f"warning: {leg.source}: {printable(finding)}", err=True)
    return common.WITH_FINDINGS if drawing.findings else 0


def _content(drawing: "Drawing", target: Path, watch: bool) -> bytes:
    if target.suffix.lower() == ".svg":
        from leg_wear_monitor.report.drawing import drawing_svg

        return drawing_svg(drawing)
    from leg_wear_monitor.report.drawing import drawing_html

    return drawing_html(drawing, is_watched=watch).encode()


def _watch(mechanism: str, target: Path, forces: bool, crank_angle: float | None) -> int:
    """Draw whenever the file has changed, until Ctrl-C; a fault in it is one line, until the next save."""
    source = _source(mechanism)
    drawn: Stamp | None = None
    try:
        while True:
            stamp = stamp_of(source)
            if any(stamp) and stamp != drawn:  # there is none while an editor replaces it
                drawn = stamp
                try:
                    _draw(mechanism, target, forces, crank_angle, watch=True)
                except LegWearError as error:
                    click.echo(f"error: {printable(str(error))}", err=True)
            time.sleep(_POLL_S)
    except KeyboardInterrupt:
        _finish(mechanism, target, forces, crank_angle)
        return 0


def _finish(mechanism: str, target: Path, forces: bool, crank_angle: float | None) -> None:
    """Write the page for the last time, without the script that loads it again."""
    try:
        _draw(mechanism, target, forces, crank_angle)
    except LegWearError:
        click.echo(f"kept: {target} is of an earlier state of the file", err=True)


def _source(mechanism: str) -> Path:
    """The file to watch.

    Raises
    ------
    ConfigError
        If there is none.
    """
    from leg_wear_monitor.mechanism.loader import is_file_name, shipped_mechanisms

    source = Path(mechanism) if is_file_name(mechanism) else shipped_mechanisms().get(mechanism)
    if source is None or not source.is_file():
        raise ConfigError(mechanism, "", "there is no such file to watch")
    return source


# ``leg-wear-monitor simulate``: the leg offline, ideal or with clearances.


# Spelled out, for --help shall not wait for numba; the tests compare them with the library's.
MODELS, DEFAULT_MODEL = ("clearance", "full"), "clearance"

# a motion too short to take time, but through all of the code
_WARM_UP_CYCLES, _WARM_UP_S = 1.0 / 256.0, 1.0e-9


@click.command(short_help="Simulate the leg offline, ideal or with clearances.")
@common.mechanism_option
@common.clearances_option("A,B|none")
@common.number_option(
    "--clearance-m", "M", "Radial clearance in metres.  [default: the mechanism's own]", "m", above=0.0
)
@common.speed_option
@common.number_option("--cycles", "N", "Gait cycles to count.  [default: 5]", above=0.0)
@common.number_option("--duration", "S", "Time to count, in seconds, instead of cycles.", "s", above=0.0)
@common.number_option(
    "--skip-cycles", "N", "Gait cycles before counting.  [default: 1; 0 with --duration]", at_least=0.0
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
@common.option(
    "--normal-law",
    "NAME",
    f"Normal contact law of all clearance joints: {', '.join(NORMAL_LAWS)}.",
    type=click.Choice(NORMAL_LAWS),
)
@common.number_option(
    "--restitution", "E", "Coefficient of restitution of all clearance joints.", "", above=0.0
)
@common.option(
    "--friction",
    "NAME",
    f"Friction law of all clearance joints: {', '.join(FRICTION_LAWS)}.",
    type=click.Choice(FRICTION_LAWS),
)
@common.number_option(
    "--friction-coefficient", "MU", "Friction coefficient of all clearance joints.", "", at_least=0.0
)
@common.option("--toe", "BODY.POINT", "Point whose motion is reported.  [default: the point called toe]")
@click.option(
    "--trace",
    type=click.IntRange(min=0),
    metavar="N",
    default=0,
    help="Keep N samples per cycle, for --json and for the pictures of --out; from some hundred on, samples "
    "take longer than the simulation.",
)
@common.option(
    "--intervals",
    "N",
    "Resolution of model clearance: intervals of time per gait cycle.  [default: 2048]",
    type=int,
)
@common.json_option("the result")
@common.out_option("Write result.json and pictures of the leg and its worn bushings.")
def simulate(mechanism: str, json_file: Path | None, out: Path | None, **options: Any) -> None:
    """Simulate the motion of the leg, ideal or with clearances, and report forces and wear."""
    if options["cycles"] is not None and options["duration"] is not None:
        raise click.UsageError("--cycles and --duration cannot be combined")
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.mechanism.plausible import doubts, ratio_fault

    leg = load_mechanism(mechanism)
    common.check_outputs(json_file, out)
    with common.options_named():
        result, wall_s = _run(leg, _keywords(**options))
    common.warn_of(leg.source, doubts(leg))  # what fails names them itself, in its one line
    if (given := options["clearance_m"]) is not None:
        for radius in sorted({leg.clearances[name].bushing_radius for name in result.clearance_joints}):
            if fault := ratio_fault(given, radius):
                warnings.warn(f"--clearance-m: {fault}", ConfigWarning, stacklevel=2)
    written = _write(leg, result, wall_s, json_file, out)
    if json_file != common.STDOUT:
        from leg_wear_monitor.cli.tables import print_result

        print_result(result, wall_s)
    common.say(json_file, (), written)


def _keywords(clearances: str | None, wear: str, duration: float | None, **options: Any) -> dict[str, Any]:
    """Arguments of the library's simulate; what was not asked for is left to the library."""
    keywords = {"wear": wear == "on", "duration_s": duration, **options}
    if clearances is not None:
        names = [] if clearances.strip() == "none" else clearances.split(",")
        keywords["clearances"] = [name.strip() for name in names]
    return {name: value for name, value in keywords.items() if value is not None}


def _run(leg: "Mechanism", keywords: dict[str, Any]) -> tuple["SimulationResult", float]:
    """The result, and the time [s] it took once all was compiled."""
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
    model = keywords.get("model") or default_model(leg)
    kernels = model if clearance_joints else "ideal"
    with common.compilation(kernels), motion_beside() if kernels == "clearance" else nullcontext():
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
    """Write what was asked for, and give the files."""
    if json_file is None and out is None:
        return []
    written: list[Path] = []
    text = result.to_json(wall_s)
    if out is not None:
        from leg_wear_monitor.report.leg_picture import pictures

        written += common.write_directory(out, {**pictures(leg, result), "result.json": text.encode()})
    return written + common.write_json(json_file, text)
