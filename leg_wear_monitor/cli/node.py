"""A node as a verb: its arguments are those of ROS, and without ROS there is one line."""

from collections.abc import Callable, Sequence
from importlib import import_module

import click

from leg_wear_monitor.errors import LegWearError

_Main = Callable[[Sequence[str] | None], int]


def node_main(module: str) -> _Main:
    """Entry point of a node; raises LegWearError without ROS."""
    need_rclpy()
    main: _Main = import_module(f"leg_wear_monitor.ros.{module}").main
    return main


def need_rclpy() -> None:
    """Raise LegWearError where ROS is not installed, or not found."""
    try:
        import_module("rclpy")
    except ImportError as error:
        raise LegWearError(
            f"rclpy: {error}; source a ROS 2 installation, or pip install 'leg_wear_monitor[ros]'"
        ) from error


def check_alone(**others: object) -> None:
    """Refuse options beside ``--node``: a running monitor has its own parameters and ledger."""
    if any(others.values()):
        names = ", ".join(f"--{name.replace('_', '-')}" for name in others)
        raise click.UsageError(f"--node cannot be combined with {names}")


def trigger(node: str, service: str, wait_s: float, times: int = 1) -> str:
    """Last reply of a service of a running monitor, which is called so many times.

    Raises
    ------
    LegWearError
        Without ROS, if nobody answers, or if the last call is refused.
    """
    need_rclpy()
    from leg_wear_monitor.ros.measure_client import trigger_on

    return trigger_on(node, service, wait_s, times)


def node_verb(name: str, module: str, summary: str, text: str) -> click.Command:
    """Command that runs a node."""

    @click.command(
        name=name,
        short_help=summary,
        help=text,
        context_settings={"ignore_unknown_options": True},
        options_metavar="[--ros-args ...]",
    )
    @click.argument("arguments", nargs=-1, type=click.UNPROCESSED, metavar="")
    def verb(arguments: tuple[str, ...]) -> int:
        return node_main(module)([name, *arguments])

    return verb
