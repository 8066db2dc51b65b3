"""``leg-wear-monitor draw``: a picture of a mechanism, working or not."""

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from leg_wear_monitor.cli.number import bounded
from leg_wear_monitor.cli.output import check_file, write_file
from leg_wear_monitor.cli.waiting import compilation
from leg_wear_monitor.errors import ConfigError, LegWearError, printable

if TYPE_CHECKING:
    from leg_wear_monitor.report.drawing.drawing import Drawing

WITH_FINDINGS = 1

_SUFFIXES = (".html", ".svg")
_OURS = b"leg-wear-monitor draw"  # near the begin of what this verb writes
_POLL_S = 0.2

_Stamp = tuple[int, int, int]


@click.command(short_help="Draw a mechanism, working or not.")
@click.argument("mechanism", metavar="MECHANISM")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="A file .html or .svg.  [default: MECHANISM.html in this directory]",
)
@click.option("--forces", is_flag=True, help="Draw the forces in the joints, without clearance (.html).")
@click.option(
    "--crank-angle",
    type=float,
    callback=bounded("deg"),
    metavar="DEG",
    help="Position to draw, or to show first.  [default: 0, or the one that shows what is wrong]",
)
@click.option("--watch", is_flag=True, help="Draw again whenever the mechanism file is saved, until Ctrl-C.")
def draw(mechanism: str, out: Path | None, forces: bool, crank_angle: float | None, watch: bool) -> int:
    """Draw a mechanism file, or a mechanism that comes with the package.

    The HTML page moves the mechanism through its cycle; it is one file and needs no network. Where the
    mechanism does not close, its bodies are drawn apart at the open joint, with the distance; where its crank
    does not turn through, the page shows the range and the bodies in line at its ends. The exit code is then
    1. Replaces a drawing of an earlier run, and no other file.
    """
    target = Path(f"{Path(mechanism).stem}.html") if out is None else out
    _check_target(target)
    if forces and target.suffix.lower() == ".svg":
        raise ConfigError("--forces", "", f"{target} is a still picture, expected an --out FILE.html")
    if watch:
        return _watch(mechanism, target, forces, crank_angle)
    return _draw(mechanism, target, forces, crank_angle)


def _check_target(path: Path) -> None:
    """Make sure that a drawing can be written, and that it replaces none but a drawing."""
    if path.suffix.lower() not in _SUFFIXES:
        raise ConfigError("--out", str(path), f"expected a file that ends in {' or '.join(_SUFFIXES)}")
    check_file("--out", path)
    if path.is_file():
        with path.open("rb") as file:
            is_ours = _OURS in file.read(4096)
        if not is_ours:
            raise ConfigError(
                "--out", str(path), "exists and is no drawing of this command, expected another --out FILE"
            )


def _draw(mechanism: str, target: Path, forces: bool, crank_angle: float | None, watch: bool = False) -> int:
    """Draw once, and say what was drawn and what is wrong."""
    from leg_wear_monitor.mechanism.loader import load_mechanism

    leg = load_mechanism(mechanism)
    angle = None if crank_angle is None else math.radians(crank_angle)
    with compilation("mechanism", how_long="a few seconds"):
        from leg_wear_monitor.report.drawing.drawing import drawing_of

        drawing = drawing_of(leg, angle, forces)
        content = _content(drawing, target, watch)
    was_there = target.exists()
    write_file(target, content)
    how = "replaced" if was_there else "written"
    click.echo(f"{how}: {target}: {printable(leg.name)}: {printable(drawing.headline)}")
    for finding in drawing.findings:
        click.echo(f"warning: {leg.source}: {printable(finding)}", err=True)
    return WITH_FINDINGS if drawing.findings else 0


def _content(drawing: "Drawing", target: Path, watch: bool) -> bytes:
    if target.suffix.lower() == ".svg":
        from leg_wear_monitor.report.drawing.still import drawing_svg

        return drawing_svg(drawing)
    from leg_wear_monitor.report.drawing.page import drawing_html

    return drawing_html(drawing, is_watched=watch).encode()


def _watch(mechanism: str, target: Path, forces: bool, crank_angle: float | None) -> int:
    """Draw whenever the file has changed, until Ctrl-C; a fault in it is one line, until the next save."""
    source = _source(mechanism)
    drawn: _Stamp | None = None
    try:
        while True:
            stamp = _stamp(source)
            if stamp is not None and stamp != drawn:
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


def _stamp(source: Path) -> _Stamp | None:
    """What changes when a file is saved; None while an editor replaces it."""
    try:
        stat = source.stat()
    except OSError:
        return None
    return stat.st_mtime_ns, stat.st_size, stat.st_ino
