"""How a node starts, waits and ends, and its parameters."""

import ctypes
import math
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, Generic, TypeVar

import rclpy
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.context import Context
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter
from rclpy.service import Service
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.task import Future
from rclpy.utilities import remove_ros_args, try_shutdown
from rosgraph_msgs.msg import Clock

from leg_wear_monitor.errors import ConfigError, LegWearError, printable, put_in_order, would_be_lost
from leg_wear_monitor.monitor.config.parameters import (
    Parameter,
    changed,
    parameters_of,
    structured,
    values_of,
)

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


# A node whose parameters, including empty lists, can be set, dumped, edited and loaded again.


_ARRAYS = (
    RosParameter.Type.BYTE_ARRAY,
    RosParameter.Type.BOOL_ARRAY,
    RosParameter.Type.INTEGER_ARRAY,
    RosParameter.Type.DOUBLE_ARRAY,
    RosParameter.Type.STRING_ARRAY,
)

_TYPES = frozenset(one.value for one in RosParameter.Type)

_CLOCK = "use_sim_time"
_NO_DOT = re.compile(r"[+-]?\d+e[+-]?\d+")  # YAML 1.1 reads it as text; Python prints 0.000001 like this


class ParameterNode(Node):
    """A node that converts values sent by ``ros2 param`` to the declared parameter type.

    An empty list has no type in YAML: rcl passes it as an unset parameter, ``ros2 param`` sends it as a
    boolean array. rclpy raises an exception for the first and rejects the second. ``ros2 param load`` sends
    1e-06 as text.

    Attributes
    ----------
    fault_of : callable
        Why parameters cannot be set, empty if they can. It is asked before rclpy, which would name neither
        unit nor bounds of a value that is out of range.
    """

    fault_of: Callable[[list[RosParameter]], str] = staticmethod(lambda _: "")

    @property
    def given(self) -> dict[str, Any]:
        """Parameter overrides by name, from files, arguments and the constructor; includes unknown names."""
        return {name: plain(one) for name, one in self._parameter_overrides.items()}

    def create_service(
        self, srv_type: Any, srv_name: str, callback: Callable[[Any, Any], Any], **options: Any
    ) -> Service:
        """Create a service; rclpy creates those for parameters by this function, too.

        Requests with a parameter of a type that does not exist do not reach the callback: rclpy raises an
        exception for it, which ends the node.
        """
        if srv_type is SetParameters:
            callback = _each_of_a_type(callback)
        elif srv_type is SetParametersAtomically:
            callback = _all_of_a_type(callback)
        return super().create_service(srv_type, srv_name, callback, **options)

    def create_subscription(
        self, msg_type: Any, topic: str, callback: Callable[[Any], None], *options: Any, **named: Any
    ) -> Subscription:
        """Create a subscription; rclpy creates that of ``/clock`` by this function, too.

        A time before 0 does not reach the callback: rclpy raises an exception for it, which ends the node.
        """
        if msg_type is Clock:
            callback = self._times_of(callback)
        return super().create_subscription(msg_type, topic, callback, *options, **named)

    def _times_of(self, callback: Callable[[Any], None]) -> Callable[[Any], None]:
        def take(message: Clock) -> None:
            if message.clock.sec >= 0:
                callback(message)
            else:
                self.get_logger().warning(
                    f"{_CLOCK}: a time of {message.clock.sec} s on /clock is before 0 and is ignored",
                    throttle_duration_sec=10.0,
                )

        return take

    def set_parameters_atomically(self, parameter_list: list[RosParameter]) -> SetParametersResult:
        """Set parameters, all or none.

        Read-only parameters may be set to their present value, so that a dump can be loaded. The clock cannot
        be changed either: accounting and audit must not continue with another clock.
        """
        wanted = [self._typed(one) for one in parameter_list]
        changes = [one for one in wanted if not self._stands(one)]
        if wanted and not changes:
            return SetParametersResult(successful=True)
        if any(one.name == _CLOCK for one in changes):
            reason = f"{_CLOCK}: is read only at the start; start the node again with it"
            return SetParametersResult(successful=False, reason=reason)
        if all(map(self._can_be_set, changes)) and (fault := self.fault_of(changes)):
            return SetParametersResult(successful=False, reason=fault)
        return super().set_parameters_atomically(changes)

    def _can_be_set(self, one: RosParameter) -> bool:
        """Whether a parameter is declared, of this type and not read-only; rclpy refuses the others."""
        if not self.has_parameter(one.name):
            return False
        declared = self.describe_parameter(one.name)
        return declared.type == one.type_.value and not declared.read_only

    def _typed(self, one: RosParameter) -> RosParameter:
        """The parameter, converted to the declared type where the sender could not know that type."""
        if not self.has_parameter(one.name):
            return one
        declared = RosParameter.Type(self.describe_parameter(one.name).type)
        if declared in _ARRAYS and one.type_ in _ARRAYS and not len(one.value):
            return RosParameter(one.name, declared, [])
        if (
            declared is RosParameter.Type.DOUBLE
            and isinstance(one.value, str)
            and _NO_DOT.fullmatch(one.value)
        ):
            return RosParameter(one.name, declared, float(one.value))
        return one

    def _stands(self, one: RosParameter) -> bool:
        """Whether a parameter is read-only and already has this value."""
        if not self.has_parameter(one.name):
            return False
        if not self.describe_parameter(one.name).read_only and one.name != _CLOCK:
            return False
        now = self.get_parameter(one.name)
        return now.type_ is one.type_ and plain(now) == plain(one)


def _type_fault(parameter: ParameterMessage) -> str:
    """Why a parameter of a request is none; empty if it is one."""
    if parameter.value.type in _TYPES:
        return ""
    name = printable(parameter.name, 100)
    return f"{name}: {parameter.value.type} is no type of a parameter, expected 0 to {max(_TYPES)}"


def _each_of_a_type(
    callback: Callable[[SetParameters.Request, SetParameters.Response], SetParameters.Response],
) -> Callable[[SetParameters.Request, SetParameters.Response], SetParameters.Response]:
    def answer(request: SetParameters.Request, response: SetParameters.Response) -> SetParameters.Response:
        for one in request.parameters:
            if fault := _type_fault(one):
                response.results.append(SetParametersResult(successful=False, reason=fault))
            else:
                callback(SetParameters.Request(parameters=[one]), response)  # appends its result
        return response

    return answer


def _all_of_a_type(
    callback: Callable[[SetParametersAtomically.Request, SetParametersAtomically.Response], Any],
) -> Callable[[SetParametersAtomically.Request, SetParametersAtomically.Response], Any]:
    def answer(
        request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        if fault := next(filter(None, map(_type_fault, request.parameters)), ""):
            response.result = SetParametersResult(successful=False, reason=fault)
            return response
        return callback(request, response)

    return answer


def plain(parameter: RosParameter) -> Any:
    """Value as in a parameter file; ROS uses several array types, and passes an empty list as unset."""
    value = parameter.value
    if parameter.type_ is RosParameter.Type.NOT_SET:
        return []
    return value if isinstance(value, bool | int | float | str) else list(value)


# Life cycle of a node process: arguments, signals, executor, exit code.


# The events executor needs a sixth of the default executor's time (docs/decisions/0007-live-node.md). Its
# spin() without a timeout hangs at full load in the Jazzy wheels, so it is called repeatedly with a timeout:
# until a future is done that never is, since spin_once() returns after each message.
# Jazzy has it since rclpy 7.1.4 of April 2025.
_new_executor: Callable[..., Executor] | None = None
with suppress(ImportError):
    from rclpy.experimental.events_executor import EventsExecutor

    _new_executor = EventsExecutor
WAKE_S = 0.2

_FORMER = (
    "this rclpy has no events executor (rclpy 7.1.4 and newer have it): the node runs with the default "
    "executor, which needs six times the processor time"
)

DONE, COULD_NOT = 0, 2

_SIGNALS = (signal.SIGINT, signal.SIGTERM)

# of the interpreter's lock, which each message takes: while another thread prepares a simulated leg, Python's
# own 5 ms would let 200 messages a second through
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


_MMAP_THRESHOLD, _LARGE_BYTES = -3, 2**20  # M_MMAP_THRESHOLD of glibc's malloc.h


def release_large_arrays() -> None:
    """Have each large array given back to the system when it is freed, where the C library can.

    By itself glibc keeps arrays of up to 32 MB for later ones once it has seen some: 40 MB of a walking node
    of 260, and 300 MB of one that identifies a leg.
    """
    with suppress(AttributeError, OSError):
        ctypes.CDLL(None).mallopt(_MMAP_THRESHOLD, _LARGE_BYTES)


def release_memory() -> None:
    """Give back to the system what is free in this process between smaller objects; starting leaves 25 MB."""
    with suppress(AttributeError, OSError):
        ctypes.CDLL(None).malloc_trim(0)


def executor_for(node: Node) -> Executor:
    """Executor for a node, not yet with it; the log says if it is not the events executor."""
    if _new_executor is not None:
        return _new_executor(context=node.context)
    node.get_logger().warning(_FORMER)
    return SingleThreadedExecutor(context=node.context)


def spin(
    node: Node,
    wanted: Callable[[], bool] = lambda: True,
    make_executor: Callable[[Node], Executor] = executor_for,
) -> None:
    """Spin a node until its context shuts down or `wanted` returns false."""
    executor = make_executor(node)
    try:
        with until_down(node.context):
            executor.add_node(node)
            while node.context.ok() and wanted():
                # a new one each time: a future keeps what waits for it
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
        raise ConfigError(argv[0], "", f"unknown argument {stray[0]!r}, expected --ros-args ...")


def _stop_making(_number: int, frame: FrameType | None) -> None:
    """Abort the construction of a node: by an exception or, where Python would discard it, by exit."""
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_IGN)  # once only; a launch file sends several signals
    if not would_be_lost(frame):
        raise KeyboardInterrupt
    code = COULD_NOT
    try:
        put_in_order()
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

    Signals are ours and not rclpy's: its handlers take the context down at once, between any two calls, and
    with it the way to publish what was taken in last.

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
        _init(list(sys.argv if argv is None else argv))
        node = make()
        for number in _SIGNALS:
            signal.signal(number, lambda *_: asked.set())
        try:
            serve(node, lambda: not asked.is_set())
        finally:
            node.close()
    except KeyboardInterrupt:  # interrupted before the node started
        put_in_order()  # the node may be complete but not yet assigned
        return DONE
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


# Parameters of a node from a configuration class: reading, validation, description, changes.


Config = TypeVar("Config")

# parameters of every node, handled by rclpy itself
_LARGEST = 2**63 - 1  # of an integer parameter
_OF_ROS = ("use_sim_time", "start_type_description_service", "qos_overrides.")


class Parameters(Generic[Config]):
    """Parameters of a node.

    Unknown parameter names are rejected; rclpy would ignore them.

    Parameters
    ----------
    node : ParameterNode
    kind : type
        Configuration class, such as ``MonitorConfig``.
    empty : mapping of str to str, optional
        Values of text parameters that are missing or empty, by name.

    Attributes
    ----------
    config
        Present configuration, an instance of ``kind``.

    Raises
    ------
    ConfigError
        If a value is invalid; the message names node, parameter, value, unit and expectation.
    """

    def __init__(
        self, node: ParameterNode, kind: type[Config], empty: Mapping[str, str] | None = None
    ) -> None:
        self._source = node.get_fully_qualified_name()
        given = {name: value for name, value in node.given.items() if not name.startswith(_OF_ROS)}
        given |= {name: text for name, text in (empty or {}).items() if not given.get(name)}
        self.config: Config = structured(kind, given, self._source)
        for name, value in values_of(self.config).items():
            _declare(node, parameters_of(kind)[name], value)

    def follow(
        self,
        node: ParameterNode,
        changed_to: Callable[[Config], None],
        check_fit: Callable[[Config], None] = lambda _: None,
    ) -> None:
        """Allow parameter changes while the node runs, and report each accepted change.

        Parameters
        ----------
        node : ParameterNode
        changed_to : callable
        check_fit : callable, optional
            Raises ConfigError for values that are valid on their own but inconsistent with the node's state.
        """

        def fault_of(parameters: list[RosParameter]) -> str:
            try:
                check_fit(self._with(parameters))
            except ConfigError as error:
                return str(error)
            return ""

        def take(parameters: list[RosParameter]) -> None:
            self.config = self._with(parameters)
            changed_to(self.config)

        node.fault_of = fault_of
        node.add_post_set_parameters_callback(take)

    def _with(self, parameters: list[RosParameter]) -> Config:
        known = values_of(self.config)
        changes = {one.name: plain(one) for one in parameters if one.name in known}
        return changed(self.config, changes, self._source)


def _range(parameter: Parameter) -> dict[str, Any]:
    """Field of a descriptor with the bounds of one number; without bounds, none.

    A lower bound that is excluded is part of the range, which cannot exclude it; it is refused by the check.
    The step is 0, for any value between.
    """
    bounds = (parameter.above, parameter.at_least, parameter.at_most)
    if parameter.type not in ("double", "integer") or all(bound is None for bound in bounds):
        return {}
    least = parameter.above if parameter.at_least is None else parameter.at_least
    if parameter.type == "double":
        begin = -math.inf if least is None else float(least)
        end = math.inf if parameter.at_most is None else float(parameter.at_most)
        return {"floating_point_range": [FloatingPointRange(from_value=begin, to_value=end, step=0.0)]}
    first = -_LARGEST if least is None else math.ceil(least)
    last = _LARGEST if parameter.at_most is None else math.floor(parameter.at_most)
    return {"integer_range": [IntegerRange(from_value=first, to_value=last, step=0)]}


def _declare(node: ParameterNode, parameter: Parameter, value: Any) -> None:
    unit = f" [{parameter.unit}]" if parameter.unit else ""
    descriptor = ParameterDescriptor(
        description=f"{parameter.description}{unit}",
        additional_constraints=parameter.bounds,
        read_only=parameter.read_only,
        **_range(parameter),
    )
    if isinstance(value, tuple) and not value:
        # rclpy treats an empty array as one of bytes; an unset parameter breaks every reply that contains it
        kind = RosParameter.Type[parameter.type.upper()]
        node.declare_parameter(parameter.name, kind, ParameterDescriptor(), ignore_override=True)
        node.set_parameters_atomically([RosParameter(parameter.name, kind, [])])
        descriptor.type = kind.value
        node.set_descriptor(parameter.name, descriptor)
        return
    node.declare_parameter(
        parameter.name, list(value) if isinstance(value, tuple) else value, descriptor, ignore_override=True
    )
