"""How a node starts, waits and ends, and its progress messages."""

import ctypes
import itertools
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, TypeVar

import rclpy
from rclpy.context import Context
from rclpy.exceptions import ParameterException
from rclpy.executors import Executor, ExternalShutdownException
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from rclpy.utilities import remove_ros_args, try_shutdown

from leg_wear_monitor.errors import (
    ConfigError,
    LegWearError,
    close_open,
    exception_may_be_swallowed,
    printable,
)
from leg_wear_monitor.monitor.config.parameters import sections_for_others
from leg_wear_monitor.ros.parameters import ParameterNode

# Progress messages in a node's log during long operations.


EVERY_S = 10.0


@contextmanager
def repeated(report: Callable[[float], None], every_s: float = EVERY_S) -> Iterator[None]:
    """Call a function periodically with the elapsed seconds while the body of the context runs.

    Parameters
    ----------
    report : callable
        Called in a separate thread with the elapsed time [s].
    every_s : float, s
    """
    done = threading.Event()

    def repeat() -> None:
        passed_s = every_s
        while not done.wait(every_s):
            report(passed_s)
            passed_s += every_s

    thread = threading.Thread(target=repeat, daemon=True)  # a signal may end the process meanwhile
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


# Life cycle of a node process: arguments, signals, executor, exit code.


# The events executor needs a sixth of the default executor's time (docs/decisions/0007-live-node.md). Its
# spin() without a timeout hangs at full load in the Jazzy wheels, so it is called repeatedly with a timeout:
# with a future that is never done, because spin_once() returns after each message.
# Jazzy has it since rclpy 7.1.4 of April 2025.
WAKE_S = 0.2

DONE, COULD_NOT = 0, 2

_SIGNALS = (signal.SIGINT, signal.SIGTERM)

# Switch interval of the interpreter's lock, which each message takes. While another thread prepares a
# simulated leg, Python's default of 5 ms would let only 200 messages a second through.
_SWITCH_S = 2.0e-4


class ClosingNode(ParameterNode):
    """A node that must save its state before it exits."""

    def close(self) -> None:
        """Save the state; the context may already be shut down."""


_Node = TypeVar("_Node", bound=ClosingNode)


@contextmanager
def until_down(context: Context) -> Iterator[None]:
    """Suppress exceptions that rclpy raises on context shutdown; a signal can cause one at any call."""
    try:
        yield
    except (ExternalShutdownException, RuntimeError):
        if context.ok():
            raise


_MMAP_THRESHOLD, _LARGE_BYTES = -3, 2**18  # M_MMAP_THRESHOLD of glibc's malloc.h


def release_large_arrays() -> None:
    """Return each large array to the system when it is freed, if the C library supports it.

    By default, glibc keeps freed arrays of up to 32 MB for reuse once it has seen some: 40 MB of the 260 MB
    of a walking node, and 300 MB of a node that identifies a leg.
    """
    with suppress(AttributeError, OSError):
        ctypes.CDLL(None).mallopt(_MMAP_THRESHOLD, _LARGE_BYTES)


def release_memory() -> None:
    """Return free memory between smaller objects to the system; starting leaves 25 MB of it."""
    with suppress(AttributeError, OSError):
        ctypes.CDLL(None).malloc_trim(0)


def spin(
    node: Node,
    wanted: Callable[[], bool] = lambda: True,
    make_executor: Callable[..., Executor] = EventsExecutor,
) -> None:
    """Spin a node until its context shuts down or `wanted` returns false."""
    executor = make_executor(context=node.context)
    try:
        with until_down(node.context):
            executor.add_node(node)
            while node.context.ok() and wanted():
                # The future is new each time, because a future keeps the objects that wait for it.
                executor.spin_until_future_complete(Future(), timeout_sec=WAKE_S)
    finally:
        executor.shutdown()


def _init(argv: list[str]) -> None:
    """Initialize rclpy with the arguments; reject arguments that it would ignore."""
    try:
        stray = remove_ros_args(argv)[1:]
        if not stray:
            rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
    except (RuntimeError, _rclpy.RCLInvalidROSArgsError) as error:
        raise ConfigError(argv[0], "", str(error).split(", at /")[0]) from error
    if stray:
        raise ConfigError(argv[0], "", f"unknown argument {stray[0]!r}. Expected --ros-args ...")


def _warn_of_unused(node: ParameterNode, argv: list[str]) -> None:
    """Report parameter files that are for other nodes; ROS ignores them silently."""
    name = node.get_fully_qualified_name()
    for option, path in itertools.pairwise(argv):
        if option != "--params-file":
            continue
        try:
            others = ", ".join(map(printable, sections_for_others(path, name)))
            fault = f"{path}: this file is not used: its sections are for {others}, and this node is {name}"
        except ConfigError as error:  # ROS has read it
            others, fault = "unknown", str(error)
        if others:
            node.get_logger().warning(fault)


def _stop_making(_number: int, frame: FrameType | None) -> None:
    """Abort the construction of a node: by an exception or, where Python would discard it, by exit."""
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_IGN)  # once only; a launch file sends several signals
    if not exception_may_be_swallowed(frame):
        raise KeyboardInterrupt
    code = COULD_NOT
    try:
        close_open()
        code = DONE
    except LegWearError as error:
        _print_error(error)
    finally:
        os._exit(code)


def _print_error(error: LegWearError) -> None:
    print(f"error: {' '.join(str(error).split())}", file=sys.stderr, flush=True)


def run(
    make: Callable[[], _Node], serve: Callable[[_Node, Callable[[], bool]], None], argv: Sequence[str] | None
) -> int:
    """Create a node, run it until a signal or its own end, and shut it down.

    We handle signals ourselves: rclpy's handlers shut the context down at once, between any two calls. The
    node could then no longer publish the last messages it took in.

    Parameters
    ----------
    make : callable
        Creates the node.
    serve : callable
        Called with the node and a function that returns whether to continue; returns when it is finished.
    argv : sequence of str, optional
        Arguments like ``sys.argv``, including ROS arguments.

    Returns
    -------
    int
        Exit code: 0 on success, 2 on failure, with one line on stderr.
    """
    node: _Node | None = None
    asked = threading.Event()
    sys.setswitchinterval(_SWITCH_S)
    release_large_arrays()
    for number in _SIGNALS:
        signal.signal(number, _stop_making)
    try:
        try:
            arguments = list(sys.argv if argv is None else argv)
            _init(arguments)
            try:
                node = make()
            except (ParameterException, _rclpy.RCLError) as error:  # a parameter of rclpy itself
                raise ConfigError(arguments[0], "", str(error).split(", at /")[0]) from error
            _warn_of_unused(node, arguments)
            for number in _SIGNALS:
                signal.signal(number, lambda *_: asked.set())
        except KeyboardInterrupt:  # interrupted before the node started
            close_open()  # the node may be complete but not yet assigned
            return DONE
        try:
            serve(node, lambda: not asked.is_set())
        finally:
            node.close()
    except LegWearError as error:
        _print_error(error)
        return COULD_NOT
    finally:
        if node is not None:
            node.destroy_node()
        try_shutdown()
    return DONE


def stamp_ns_of(stamp: Any) -> int:
    """Nanoseconds of a message's stamp, also of one that `rclpy.time.Time` refuses."""
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
