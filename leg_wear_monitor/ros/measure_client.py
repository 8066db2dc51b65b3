"""Client of ``~/measure``: a measured clearance for a monitor that runs in another process."""

import rclpy
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.context import Context
from rclpy.exceptions import InvalidServiceNameException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown
from rclpy.validate_full_topic_name import validate_full_topic_name

from leg_wear_monitor.errors import ConfigError, LegWearError

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
        Whether the forecast uses it even if it contradicts the model.
    wait_s : float
        Longest wait for the service, and again for its answer.

    Returns
    -------
    str
        What came of it.

    Raises
    ------
    LegWearError
        If nobody answers, or the monitor refuses it.
    """
    service = _service_of(monitor)
    context = Context()
    rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = Node(_NAME, context=context, enable_rosout=False, start_parameter_services=False)
        try:
            values = {"joint": joint, "clearance_m": clearance_m, "sigma_m": sigma_m, "accept": accept}
            return _answer(node, service, values, wait_s)
        finally:
            node.destroy_node()
    finally:
        try_shutdown(context=context)


def _service_of(monitor: str) -> str:
    service = f"/{monitor.strip('/')}/measure"
    try:
        validate_full_topic_name(service, is_service=True)
    except InvalidServiceNameException as error:
        reason = " ".join(str(error).split())
        raise ConfigError("--node", "", f"{monitor!r} is not the name of a node: {reason}") from error
    return service


def _answer(node: Node, service: str, values: dict[str, object], wait_s: float) -> str:
    client = node.create_client(SetParametersAtomically, service)
    if not client.wait_for_service(timeout_sec=wait_s):
        raise LegWearError(
            f"{service}: nobody offers this service within {wait_s:g} s; is the monitor running, "
            "with this name and this ROS_DOMAIN_ID?"
        )
    parameters = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
    future = client.call_async(SetParametersAtomically.Request(parameters=parameters))
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    executor.spin_until_future_complete(future, timeout_sec=wait_s)
    executor.shutdown()
    if not future.done():
        raise LegWearError(
            f"{service}: no answer within {wait_s:g} s; whether the measurement was entered is not known: "
            "see the log of the monitor"
        )
    result = future.result().result
    if not result.successful:
        raise LegWearError(f"{service}: {result.reason}")
    return str(result.reason)
