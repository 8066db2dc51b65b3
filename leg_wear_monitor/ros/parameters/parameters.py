"""Parameters of a node from a configuration class: reading, validation, description, changes."""

import math
from collections.abc import Callable, Mapping
from typing import Any, Generic, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.parameter import Parameter as RosParameter

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.monitor.config.parameters import (
    Parameter,
    changed,
    parameters_of,
    structured,
    values_of,
)
from leg_wear_monitor.ros.parameters.node import ParameterNode, plain

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
