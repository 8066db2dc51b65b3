"""A node whose parameters, including empty lists, can be set, dumped, edited and loaded again."""

import re
from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.service import Service
from rclpy.subscription import Subscription
from rosgraph_msgs.msg import Clock

from leg_wear_monitor.errors import printable

_ARRAYS = (
    Parameter.Type.BYTE_ARRAY,
    Parameter.Type.BOOL_ARRAY,
    Parameter.Type.INTEGER_ARRAY,
    Parameter.Type.DOUBLE_ARRAY,
    Parameter.Type.STRING_ARRAY,
)

_TYPES = frozenset(one.value for one in Parameter.Type)

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

    fault_of: Callable[[list[Parameter]], str] = staticmethod(lambda _: "")

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

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
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

    def _can_be_set(self, one: Parameter) -> bool:
        """Whether a parameter is declared, of this type and not read-only; rclpy refuses the others."""
        if not self.has_parameter(one.name):
            return False
        declared = self.describe_parameter(one.name)
        return declared.type == one.type_.value and not declared.read_only

    def _typed(self, one: Parameter) -> Parameter:
        """The parameter, converted to the declared type where the sender could not know that type."""
        if not self.has_parameter(one.name):
            return one
        declared = Parameter.Type(self.describe_parameter(one.name).type)
        if declared in _ARRAYS and one.type_ in _ARRAYS and not len(one.value):
            return Parameter(one.name, declared, [])
        if declared is Parameter.Type.DOUBLE and isinstance(one.value, str) and _NO_DOT.fullmatch(one.value):
            return Parameter(one.name, declared, float(one.value))
        return one

    def _stands(self, one: Parameter) -> bool:
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


def plain(parameter: Parameter) -> Any:
    """Value as in a parameter file; ROS uses several array types, and passes an empty list as unset."""
    value = parameter.value
    if parameter.type_ is Parameter.Type.NOT_SET:
        return []
    return value if isinstance(value, bool | int | float | str) else list(value)
