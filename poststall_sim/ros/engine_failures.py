# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The parameter that names the engines that do not work."""

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from poststall_sim.aircraft import Aircraft, ConfigError

NAME = 'engine_failures'


def names(text: str) -> frozenset[str]:
    """Return the names in the value of the parameter, which commas part."""
    return frozenset(word for word in (each.strip() for each in text.split(',')) if word)


def text(names: frozenset[str]) -> str:
    """Return the value of the parameter that names these."""
    return ', '.join(sorted(names))


def check(node: Node, aircraft: Aircraft) -> None:
    """Refuse new values of the parameter that name what is no engine of the aircraft."""
    def checked(parameters: list[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            if parameter.name == NAME and isinstance(parameter.value, str):
                try:
                    aircraft.require_engines(names(parameter.value))
                except ConfigError as error:
                    return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(checked)
