"""``leg-wear-monitor study``: the paper's parameter studies, each with a page of its own."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from leg_wear_monitor.cli.options import workers_option
from leg_wear_monitor.cli.output import check_directory
from leg_wear_monitor.cli.waiting import compilation, progress_bar

if TYPE_CHECKING:
    from leg_wear_monitor.studies.plan.study import Study

# spelled out, for --help shall not wait for numpy; the tests compare it with the library's
NAMES = ("size", "speed", "location", "wear", "multi", "chaos", "laws", "lubrication", "load", "legs")

FAULTS_FOUND = 1


@click.command(short_help="Run one of the parameter studies of the paper.")
@click.argument("name", type=click.Choice(NAMES), metavar="NAME")
@click.option("--mechanism", metavar="FILE", help="Another leg than that of the study file.")
@click.option(
    "--config",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Study file.  [default: config/studies/NAME.yaml of the package]",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    required=True,
    help="Data and page.",
)
@workers_option
@click.option(
    "--scheduler", metavar="ADDRESS", help="Dask scheduler whose workers compute instead, tcp://HOST:PORT."
)
def study(
    name: str,
    mechanism: str | None,
    config: Path | None,
    out: Path,
    workers: int | None,
    scheduler: str | None,
) -> int:
    """Compute a study and write its page.

    NAME is size, speed, location, wear, multi, chaos, laws, lubrication, load or legs. What DIR holds already
    for the same leg, settings and code is kept, so an interrupted study goes on where it was.
    """
    import attrs

    from leg_wear_monitor.studies.plan.settings import load_settings

    settings = load_settings(name, config)
    if mechanism is not None:
        settings = attrs.evolve(settings, mechanism=mechanism)
    check_directory("--out", out)
    computed, total = _compute(name, settings, out, workers, scheduler)
    click.echo(f"points: {total}, {computed} computed now")
    return write_study_page(out)


def _compute(
    name: str, settings: "Study", out: Path, workers: int | None, scheduler: str | None
) -> tuple[int, int]:
    import os

    from leg_wear_monitor.dynamics.clearance.beforehand import motion_beside
    from leg_wear_monitor.dynamics.simulation import simulate
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.studies.execution.run import run_study

    leg = load_mechanism(settings.mechanism)
    with compilation("clearance"), motion_beside():  # once, and not in every worker at the same time
        if leg.clearances:
            simulate(leg, clearances=[next(iter(leg.clearances))], cycles=1.0 / 256.0, skip_cycles=0.0)
    with progress_bar(f"study {name}") as progress:
        computed = run_study(
            name,
            settings,
            out,
            workers=workers or os.cpu_count() or 1,
            scheduler=scheduler,
            progress=progress,
        )
    return computed, len(settings.points())


def write_study_page(path: Path) -> int:
    """Draw the page of a study from the data in its directory; 1 if something is missing there."""
    from leg_wear_monitor.cli.output import write_directory
    from leg_wear_monitor.json_text import json_text
    from leg_wear_monitor.report.page import page_html
    from leg_wear_monitor.report.study.page import study_page
    from leg_wear_monitor.studies.results import load_results

    results = load_results(path)
    contents = {"report.html": page_html(study_page(results)).encode()}
    if results.of("leg"):
        contents["claims.json"] = json_text(results.claims().to_dict()).encode()
    for file in write_directory(path, contents):
        click.echo(f"written: {file}")
    for label, fault in results.faults:
        click.echo(f"warning: point {label}: {fault}", err=True)
    for label in results.missing:
        click.echo(f"warning: point {label}: is not computed yet", err=True)
    return FAULTS_FOUND if results.faults or results.missing else 0
