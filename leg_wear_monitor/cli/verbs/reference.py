"""``leg-wear-monitor reference``: simulates what the diagnosis compares a drive torque with."""

import time
from io import BytesIO
from pathlib import Path

import click

from leg_wear_monitor.cli.number import bounded
from leg_wear_monitor.cli.options import config_option
from leg_wear_monitor.cli.output import check_file, write_file
from leg_wear_monitor.cli.waiting import compilation, progress_bar


@click.command(short_help="Simulate a torque reference beforehand.")
@click.argument("mechanism", required=False)
@config_option
@click.option(
    "--cadence",
    "cadences",
    type=float,
    multiple=True,
    callback=lambda ctx, param, values: tuple(bounded("rpm")(ctx, param, one) for one in values),
    metavar="RPM",
    help="Cadence, negative for clockwise; may be given several times.  [default: the commanded one]",
)
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="File to write, such as leg.reference.npz, for the parameter diagnosis.reference.",
)
def reference(mechanism: str | None, config: Path | None, cadences: tuple[float, ...], out: Path) -> None:
    """Simulate the torque reference of a leg, which the diagnosis compares with.

    MECHANISM is a mechanism file, or the name of one that comes with the package; by default, the one of the
    parameter file. The crank turns steadily, the leg is new. A leg whose diagnosis.reference names the file
    needs no simulation while it walks at this cadence.
    """
    check_file("--out", out)
    import attrs

    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.config.fitting import fitted
    from leg_wear_monitor.monitor.config.parameter_file import load_config
    from leg_wear_monitor.monitor.config.parameters import config_from, values_of
    from leg_wear_monitor.monitor.diagnosis.reference_file import simulated_references, write_references

    settings = load_config(config)
    if mechanism is not None:
        settings = attrs.evolve(settings, mechanism=mechanism)
    cadences = cadences or (settings.cadence.commanded_rpm,)
    for cadence in cadences:
        config_from(values_of(settings) | {"cadence.commanded_rpm": cadence}, "--cadence")
    leg = fitted(load_mechanism(settings.mechanism), settings)
    began = time.perf_counter()
    with compilation("monitor", how_long="about a minute"), progress_bar("simulating") as progress:
        made = simulated_references(leg, cadences, progress)
    for cadence, one in zip(cadences, made, strict=True):
        cycles = len(one.torque_nm[-1])
        click.echo(f"{leg.name} at {cadence:g} rpm: {len(one.torque_nm)} legs, {cycles} gait cycles each")
    file = BytesIO()
    write_references(file, leg, made)
    write_file(out, file.getvalue())
    click.echo(f"written: {out}, after {time.perf_counter() - began:.3g} s")
