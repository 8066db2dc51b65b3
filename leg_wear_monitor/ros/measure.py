"""Service ``~/measure``, and a client of the services of a monitor in a different process."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import rclpy
from rcl_interfaces.msg import Parameter, SetParametersResult
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.context import Context
from rclpy.exceptions import InvalidServiceNameException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter as ParameterMessage
from rclpy.parameter import parameter_value_to_python
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown
from rclpy.validate_full_topic_name import validate_full_topic_name
from std_srvs.srv import Trigger

from leg_wear_monitor.errors import ConfigError, LegWearError, did_you_mean, printable
from leg_wear_monitor.monitor.forecast.forecaster import NOT_STORED, with_codes
from leg_wear_monitor.monitor.wear_monitor import WearMonitor

# Service ``~/measure``: the operator enters a measured clearance while the monitor runs.


SERVICE = "~/measure"
WHO = f"service {SERVICE}"

_WANTED: dict[str, tuple[type, str]] = {
    "joint": (str, "a string: the name of a clearance joint"),
    "clearance_m": (float, "a double: a mean radial clearance in m, such as 0.00042"),
    "sigma_m": (float, "a double: its standard deviation in m, such as 0.000005"),
    "accept": (bool, "a bool: true or false"),
}
_OPTIONAL = ("accept",)


def request_of(parameters: Sequence[Parameter]) -> dict[str, Any]:
    """The measured clearance that parameters contain, as `WearMonitor.measure` takes it.

    Raises
    ------
    ConfigError
        If a parameter is unknown, missing, given twice or of a different type.
    """
    values: dict[str, Any] = {}
    for one in parameters:
        if one.name not in _WANTED:
            names = ", ".join(_WANTED)
            fault = f"unknown parameter. Expected {names}{did_you_mean(one.name, _WANTED)}"
            raise ConfigError(printable(one.name, 100), "", fault)
        if one.name in values:
            raise ConfigError(one.name, "", "is given twice")
        values[one.name] = parameter_value_to_python(one.value)
    for name, (kind, meaning) in _WANTED.items():
        if name not in values and name not in _OPTIONAL:
            raise ConfigError(name, "", f"is missing. Expected {meaning}")
        if name in values and type(values[name]) is not kind:
            found = type(values[name]).__name__
            raise ConfigError(name, "", f"is of type {found}. Expected {meaning}")
    return values


def measured(monitor: WearMonitor, wanted: dict[str, Any], stamp_ns: int) -> str:
    """Enter a measured clearance into a running monitor; return the outcome in one line.

    Raises
    ------
    LegWearError
        If the joint has no clearance, or a value is impossible; then nothing is entered.
    """
    found = monitor.measure(**wanted, stamp_ns=stamp_ns, who=WHO)
    return with_storage("; ".join(found.lines), not_stored(monitor), found.codes)


def not_stored(monitor: WearMonitor) -> str:
    """Reason why the ledger does not contain an operator's action; empty if it does."""
    try:
        monitor.save()
    except LegWearError as error:
        return str(error)
    return ""


def with_storage(reply: str, fault: str, codes: Sequence[str] = ()) -> str:
    """Reply to an operator, with its codes at its start and the fault of `not_stored` at its end."""
    if fault:
        return with_codes([*codes, NOT_STORED], f"{reply}; it is not stored: {fault}")
    return with_codes(codes, reply)


def offer_measure(node: Node, act: Callable[[dict[str, Any]], str]) -> None:
    """Create the service; an action enters the measured value and returns the outcome."""

    def answer(
        request: SetParametersAtomically.Request, response: SetParametersAtomically.Response
    ) -> SetParametersAtomically.Response:
        try:
            result = SetParametersResult(successful=True, reason=act(request_of(request.parameters)))
        except LegWearError as error:
            result = SetParametersResult(successful=False, reason=" ".join(str(error).split()))
        node.get_logger().info(f"{SERVICE}: {result.reason}")
        response.result = result
        return response

    node.create_service(SetParametersAtomically, SERVICE, answer)


# Client of the services of a monitor in a different process: measurements, acknowledgements, resets.


_NAME = "leg_wear_measure"


def measure_on(
    monitor: str, joint: str, clearance_m: float, sigma_m: float, accept: bool, wait_s: float
) -> str:
    """Enter a measured clearance into a running monitor.

    Parameters
    ----------
    monitor : str
        Full name of its node, such as ``/left/leg_wear_monitor``.
    joint : str
    clearance_m, sigma_m : float
        Mean radial clearance, and its standard deviation.
    accept : bool
        True if the forecast uses it even if it contradicts the model.
    wait_s : float
        Longest wait for the service, and again for its answer.

    Returns
    -------
    str
        Outcome of the measurement.

    Raises
    ------
    LegWearError
        If no monitor answers, or the monitor refuses it.
    """
    service = _service_of(monitor, "measure")
    values = {"joint": joint, "clearance_m": clearance_m, "sigma_m": sigma_m, "accept": accept}
    parameters = [ParameterMessage(name, value=value).to_parameter_msg() for name, value in values.items()]
    with _caller(SetParametersAtomically, service, wait_s) as call:
        result = call(SetParametersAtomically.Request(parameters=parameters)).result
    if not result.successful:
        raise LegWearError(f"{service}: {result.reason}")
    return str(result.reason)


def trigger_on(monitor: str, name: str, wait_s: float) -> str:
    """Call a service without arguments of a running monitor.

    Parameters
    ----------
    monitor : str
        Full name of its node.
    name : str
        Name of the service below the node, such as ``reset_wear/G``.
    wait_s : float
        Longest wait for the service, and again for its answer.

    Returns
    -------
    str
        The answer.

    Raises
    ------
    LegWearError
        If no monitor answers, or the monitor refuses the call.
    """
    service = _service_of(monitor, name)
    with _caller(Trigger, service, wait_s) as call:
        answer = call(Trigger.Request())
    if not answer.success:
        raise LegWearError(f"{service}: {answer.message}")
    return str(answer.message)


@contextmanager
def _caller(kind: Any, service: str, wait_s: float) -> Iterator[Callable[[Any], Any]]:
    """A function that calls a service from its own node.

    Raises
    ------
    LegWearError
        If no node offers the service, or no node answers.
    """
    context = Context()
    rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Node(_NAME, context=context, enable_rosout=False, start_parameter_services=False)
        try:
            client = node.create_client(kind, service)
            if not client.wait_for_service(timeout_sec=wait_s):
                raise LegWearError(
                    f"{service}: no node offers this service within {wait_s:g} s; is the monitor running, "
                    "with this name and this ROS_DOMAIN_ID?"
                )
            yield partial(_answer, node, client, service, wait_s)
        finally:
            node.destroy_node()
    finally:
        try_shutdown(context=context)


def _service_of(monitor: str, name: str) -> str:
    service = f"/{monitor.strip('/')}/{name}"
    try:
        validate_full_topic_name(service, is_service=True)
    except InvalidServiceNameException as error:
        reason = " ".join(str(error).split())
        raise ConfigError("--node", "", f"{monitor!r} is not the name of a node: {reason}") from error
    return service


def _answer(node: Node, client: Any, service: str, wait_s: float, request: Any) -> Any:
    future = client.call_async(request)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    executor.spin_until_future_complete(future, timeout_sec=wait_s)
    executor.shutdown()
    if not future.done():
        raise LegWearError(
            f"{service}: no answer within {wait_s:g} s; the result is not known: see the log of the monitor"
        )
    return future.result()
