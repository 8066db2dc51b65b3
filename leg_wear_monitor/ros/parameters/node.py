"""A node whose parameters can be given, dumped, edited and loaded again, empty lists among them."""

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
_NO_DOT = re.compile(r"[+-]?\d+e[+-]?\d+")  # to YAML 1.1 a text, to Python what 0.000001 is printed as


class ParameterNode(Node):
    """A node that takes what ``ros2 param`` sends for what the parameter is declared as.

    An empty list has no type in YAML: rcl gives it as a parameter that is not set, ``ros2 param`` sends it as
    an array of booleans. rclpy raises for the first and refuses the second. ``ros2 param load`` sends 1e-06
    as text.
    """

    @property
    def given(self) -> dict[str, Any]:
        """What the node was given by files, arguments and its maker, by name; unknown names too."""
        return {name: plain(one) for name, one in self._parameter_overrides.items()}

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set parameters, all or none.

        Read-only ones may be set to what they are, so that a dump loads. The clock is kept, too: what is
        counted and audited by one clock must not go on by another.
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
        """The parameter, with the type that is declared where the sender could not know better."""
        if not self.has_parameter(one.name):
            return one
        declared = Parameter.Type(self.describe_parameter(one.name).type)
        if declared in _ARRAYS and one.type_ in _ARRAYS and not len(one.value):
            return Parameter(one.name, declared, [])
        if declared is Parameter.Type.DOUBLE and isinstance(one.value, str) and _NO_DOT.fullmatch(one.value):
            return Parameter(one.name, declared, float(one.value))
        return one

    def _stands(self, one: Parameter) -> bool:
        """Whether a parameter cannot be changed, and has this value."""
        if not self.has_parameter(one.name):
            return False
        if not self.describe_parameter(one.name).read_only and one.name != _CLOCK:
            return False
        now = self.get_parameter(one.name)
        return now.type_ is one.type_ and plain(now) == plain(one)


def plain(parameter: Parameter) -> Any:
    """Value as a file would hold it; ROS gives arrays of several kinds, and an empty list as not set."""
    value = parameter.value
    if parameter.type_ is Parameter.Type.NOT_SET:
        return []
    return value if isinstance(value, bool | int | float | str) else list(value)
