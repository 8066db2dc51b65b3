"""Service ``~/measure``: a clearance that somebody measured, while the monitor runs."""

from collections.abc import Callable, Sequence
from typing import Any

import attrs
from rcl_interfaces.msg import Parameter, ParameterType, SetParametersResult
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.node import Node

from leg_wear_monitor.configuration.nearest import did_you_mean
from leg_wear_monitor.errors import ConfigError, LegWearError, printable
from leg_wear_monitor.monitor.wear_monitor import WearMonitor

SERVICE = "~/measure"
WHO = f"service {SERVICE}"

_TYPES = {
    ParameterType.PARAMETER_STRING: ("string", "string_value"),
    ParameterType.PARAMETER_DOUBLE: ("double", "double_value"),
    ParameterType.PARAMETER_BOOL: ("bool", "bool_value"),
    ParameterType.PARAMETER_INTEGER: ("integer", "integer_value"),
}
_WANTED = {
    "joint": ("string", "the name of a clearance joint"),
    "clearance_m": ("double", "a mean radial clearance in m, such as 0.00042"),
    "sigma_m": ("double", "its standard deviation in m, such as 0.000005"),
    "accept": ("bool", "true or false"),
}
_OPTIONAL = ("accept",)


@attrs.frozen(kw_only=True)
class MeasureRequest:
    """A measured clearance, as the service takes it.

    Attributes
    ----------
    joint : str
    clearance_m, sigma_m : float
        Mean radial clearance, and its standard deviation.
    accept : bool
        Whether the forecast uses it even if it contradicts the model.
    """

    joint: str
    clearance_m: float
    sigma_m: float
    accept: bool = False


def request_of(parameters: Sequence[Parameter]) -> MeasureRequest:
    """The request that parameters contain.

    Raises
    ------
    ConfigError
        For a parameter that is unknown, missing, given twice or of another type.
    """
    values: dict[str, Any] = {}
    for one in parameters:
        if one.name not in _WANTED:
            names = ", ".join(_WANTED)
            fault = f"unknown parameter, expected {names}{did_you_mean(one.name, _WANTED)}"
            raise ConfigError(printable(one.name, 100), "", fault)
        if one.name in values:
            raise ConfigError(one.name, "", "is given twice")
        values[one.name] = _value(one)
    for name, (kind, meaning) in _WANTED.items():
        if name not in values and name not in _OPTIONAL:
            raise ConfigError(name, "", f"is missing, expected a {kind}: {meaning}")
    return MeasureRequest(**values)


def _value(one: Parameter) -> Any:
    kind, meaning = _WANTED[one.name]
    found, field = _TYPES.get(one.value.type, ("other", ""))
    if found != kind:
        raise ConfigError(one.name, "", f"is of type {found}, expected a {kind}: {meaning}")
    return getattr(one.value, field)


def measured(monitor: WearMonitor, wanted: MeasureRequest, stamp_ns: int) -> str:
    """Enter a measured clearance into a running monitor; what came of it, in one line.

    Raises
    ------
    LegWearError
        For a joint without clearance, or impossible values; then nothing is entered.
    """
    found = monitor.measure(
        wanted.joint, wanted.clearance_m, wanted.sigma_m, stamp_ns, WHO, accept=wanted.accept
    )
    limit_m = monitor.clearance_limits_m[monitor.clearance_joints.index(found.measurement.joint)]
    lines = found.told(limit_m, monitor.config.limits.warn_fraction, monitor.measurements[:-1])
    try:
        monitor.save()
    except LegWearError as error:
        lines = (*lines, f"it is not stored: {error}")
    return "; ".join(lines)


def offer_measure(node: Node, act: Callable[[MeasureRequest], str]) -> None:
    """Create the service; an action enters what was measured and returns what came of it."""

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
