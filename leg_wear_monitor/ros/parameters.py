"""Parameters of a node: from a configuration class, and as the tools of ROS 2 set, dump and load them."""

import math
import re
from collections.abc import Callable, Mapping
from typing import Any, Generic, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter as RosParameter

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.monitor.config.parameters import (
    Parameter,
    changed,
    is_of_node,
    parameters_of,
    structured,
    values_of,
)

# A node whose parameters, including empty lists, can be set, dumped, edited and loaded again.


_ARRAYS = (
    RosParameter.Type.BYTE_ARRAY,
    RosParameter.Type.BOOL_ARRAY,
    RosParameter.Type.INTEGER_ARRAY,
    RosParameter.Type.DOUBLE_ARRAY,
    RosParameter.Type.STRING_ARRAY,
)

_CLOCK = "use_sim_time"
_QOS_OVERRIDES = "qos_overrides."
# YAML 1.1 reads 1e-06 as text, and Python prints 0.000001 like this
_NO_DOT = re.compile(r"[+-]?\d+e[+-]?\d+")


class ParameterNode(Node):
    """A node that converts values sent by ``ros2 param`` to the declared parameter type.

    An empty list has no type in YAML: rcl passes it as an unset parameter, ``ros2 param`` sends it as a
    boolean array. rclpy raises an exception for the first and rejects the second. ``ros2 param load`` sends
    1e-06 as text.

    Attributes
    ----------
    fault_of : callable
        Reason why parameters cannot be set, empty if they can. Called before rclpy, which would name neither
        unit nor bounds of a value that is out of range.
    """

    fault_of: Callable[[list[RosParameter]], str] = staticmethod(lambda _: "")

    @property
    def given(self) -> dict[str, Any]:
        """Parameter overrides by name, from files, arguments and the constructor; includes unknown names."""
        return {name: plain(one) for name, one in self._parameter_overrides.items()}

    def set_parameters_atomically(self, parameter_list: list[RosParameter]) -> SetParametersResult:
        """Set parameters, all or none.

        Read-only parameters may be set to their present value, so that a dump can be loaded. The clock cannot
        be changed either, because accounting and audit must not continue with a different clock.
        """
        wanted = [self._typed(one) for one in parameter_list]
        changes = [one for one in wanted if not self._is_unchanged(one)]
        if wanted and not changes:
            return SetParametersResult(successful=True)
        if any(one.name == _CLOCK for one in changes):
            reason = f"{_CLOCK}: is read only at the start; start the node again with it"
            return SetParametersResult(successful=False, reason=reason)
        if all(map(self._can_be_set, changes)) and (fault := self.fault_of(changes)):
            return SetParametersResult(successful=False, reason=fault)
        return super().set_parameters_atomically(changes)

    def _can_be_set(self, one: RosParameter) -> bool:
        """True if a parameter is declared, of this type and not read-only; rclpy refuses any other."""
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

    def _is_unchanged(self, one: RosParameter) -> bool:
        """True if a parameter is read-only and already has this value."""
        if not self.has_parameter(one.name):
            return False
        if not self.describe_parameter(one.name).read_only and one.name != _CLOCK:
            return False
        now = self.get_parameter(one.name)
        return now.type_ is one.type_ and plain(now) == plain(one)


def plain(parameter: RosParameter) -> Any:
    """Value as in a parameter file; ROS uses several array types, and passes an empty list as unset."""
    value = parameter.value
    if parameter.type_ is RosParameter.Type.NOT_SET:
        return []
    return value if isinstance(value, bool | int | float | str) else list(value)


# Parameters of a node from a configuration class: reading, validation, description, changes.


Config = TypeVar("Config")

_LARGEST = 2**63 - 1  # largest integer parameter
_OF_ROS = (_CLOCK, "start_type_description_service")


def _is_of_ros(name: str) -> bool:
    """True if a parameter belongs to every node and is handled by rclpy itself."""
    return name in _OF_ROS or name.startswith(_QOS_OVERRIDES)


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
        given = {name: value for name, value in node.given.items() if not _is_of_ros(name)}
        given |= {name: text for name, text in (empty or {}).items() if not given.get(name)}
        self.config: Config = structured(kind, given, self._source)
        for name, value in values_of(self.config).items():
            if is_of_node(name):
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
    """Bounds of one number for its descriptor; empty without bounds.

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
        # rclpy treats an empty array as bytes; an unset parameter breaks every reply that contains it
        kind = RosParameter.Type[parameter.type.upper()]
        node.declare_parameter(parameter.name, kind, ParameterDescriptor(), ignore_override=True)
        node.set_parameters_atomically([RosParameter(parameter.name, kind, [])])
        descriptor.type = kind.value
        node.set_descriptor(parameter.name, descriptor)
        return
    node.declare_parameter(
        parameter.name, list(value) if isinstance(value, tuple) else value, descriptor, ignore_override=True
    )
