"""A node whose parameters, including empty lists, can be set, dumped, edited and loaded again."""

import re
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

_ARRAYS = (
    Parameter.Type.BYTE_ARRAY,
    Parameter.Type.BOOL_ARRAY,
    Parameter.Type.INTEGER_ARRAY,
    Parameter.Type.DOUBLE_ARRAY,
    Parameter.Type.STRING_ARRAY,
)


_CLOCK = "use_sim_time"
_NO_DOT = re.compile(r"[+-]?\d+e[+-]?\d+")  # YAML 1.1 reads it as text; Python prints 0.000001 like this


class ParameterNode(Node):
    """A node that converts values sent by ``ros2 param`` to the declared parameter type.

    An empty list has no type in YAML: rcl passes it as an unset parameter, ``ros2 param`` sends it as a
    boolean array. rclpy raises an exception for the first and rejects the second. ``ros2 param load`` sends
    1e-06 as text.
    """

    @property
    def given(self) -> dict[str, Any]:
        """Parameter overrides by name, from files, arguments and the constructor; includes unknown names."""
        return {name: plain(one) for name, one in self._parameter_overrides.items()}

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
        return super().set_parameters_atomically(changes)

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


def plain(parameter: Parameter) -> Any:
    """Value as in a parameter file; ROS uses several array types, and passes an empty list as unset."""
    value = parameter.value
    if parameter.type_ is Parameter.Type.NOT_SET:
        return []
    return value if isinstance(value, bool | int | float | str) else list(value)
