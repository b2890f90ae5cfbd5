# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The records of `parameters` on a node: declared, described, checked, changed in one place."""

import array
import dataclasses
import difflib
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from poststall_sim.aircraft import ConfigError

Settings = TypeVar('Settings')

_TYPES = {bool: 'true or false', int: 'a whole number', float: 'a number',
          str: 'text', tuple: {float: 'a list of numbers', str: 'a list of texts'}}

SIM_TIME = 'use_sim_time'
FROM_ROS = (SIM_TIME, 'start_type_description_service')
"""Parameters that every node has without declaring them."""


def declare(node: Node, kind: type[Settings]) -> Settings:
    """Declare all parameters of a record on a node and return it, see `declare_all`."""
    return declare_all(node, kind)[0]


def declare_all(node: Node, *kinds: type) -> tuple[Any, ...]:
    """
    Declare all parameters of some records on a node and return the records with their values.

    Whole numbers are taken where real ones are wanted. A value that was given under a name
    which no parameter has is warned of.

    Raises
    ------
    ConfigError
        When a value that the node was given has the wrong type or is out of range.

    """
    given = _overrides(node)
    records = tuple(_declared(node, kind, given) for kind in kinds)
    _warn_of_strangers(node, kinds, given)
    return records


def _declared(node: Node, kind: type[Settings], given: dict[str, Any]) -> Settings:
    values = {}
    for field in dataclasses.fields(kind):
        name = field.metadata['name']
        value = _ros_value(field.default)
        if name in given:
            value = _number(field, given[name])
            _check_type(field, value)
        _check(kind, {field.name: _record_value(field, value)})
        try:
            value = node.declare_parameter(
                name, value, _descriptor(field), ignore_override=True).value
        except (ParameterException, ValueError, TypeError) as error:
            raise ConfigError(f'parameter {name}: {error}') from None
        values[field.name] = _record_value(field, value)
    return kind(**values)


@dataclasses.dataclass(frozen=True, slots=True)
class Followed:
    """
    A record of parameters, and what is called when one of them was set.

    changed : is called with the new record and the names of the fields that were set; together :
    raises `ConfigError` for values that do not go together; they are refused.
    """

    settings: Any
    changed: Callable[[Any, frozenset[str]], None]
    together: Callable[[Any], Any] = lambda settings: None


def follow(node: Node, *followed: Followed) -> None:
    """
    Call what is called for a record whenever a writable parameter of it has been set.

    All records of a node at once: rclpy gives each of several functions that convert the
    parameters the list that was asked for, and sets what all of them return.
    """
    current = [each.settings for each in followed]
    by_name = {field.metadata['name']: (index, field) for index, settings in enumerate(current)
               for field in dataclasses.fields(settings)}

    def updated(parameters: list[Parameter]) -> Iterator[tuple[int, dict[str, Any]]]:
        for index in range(len(current)):
            values = {field.name: _record_value(field, p.value) for p in parameters
                      for of, field in [by_name.get(p.name, (None, None))] if of == index}
            if values:
                yield index, values

    def converted(parameter: Parameter) -> Parameter:
        """Return a parameter as it came unless it has a number or a list of another type."""
        if parameter.name not in by_name or parameter.value is None:
            return parameter
        value = _number(by_name[parameter.name][1], parameter.value)
        # From an empty list alone a new one could not tell its type.
        return parameter if value is parameter.value else Parameter(parameter.name, value=value)

    def convert(parameters: list[Parameter]) -> list[Parameter]:
        return [converted(parameter) for parameter in parameters]

    def check(parameters: list[Parameter]) -> SetParametersResult:
        try:
            for index, values in updated(parameters):
                _check(type(current[index]), values)
                followed[index].together(dataclasses.replace(current[index], **values))
        except ConfigError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def apply(parameters: list[Parameter]) -> None:
        for index, values in updated(parameters):
            current[index] = dataclasses.replace(current[index], **values)
            followed[index].changed(current[index], frozenset(values))

    node.add_pre_set_parameters_callback(convert)
    node.add_on_set_parameters_callback(check)
    node.add_post_set_parameters_callback(apply)


def fix_sim_time(node: Node, *, source: bool) -> bool:
    """
    Return whether use_sim_time is true, and let it stay as it is.

    source : whether the node is a source of simulated time, which cannot follow another.

    Raises
    ------
    ConfigError
        When it is true for a source.

    """
    follows = bool(node.get_parameter(SIM_TIME).value)
    why = f'whether this node follows /clock, as {SIM_TIME} says, is settled at its start'
    if source:
        why = (f'{SIM_TIME} is true, but this node is the source of simulated time: it cannot '
               f'wait for a /clock that it publishes itself; leave {SIM_TIME} false for it, or '
               'set publish_clock to false to follow the /clock of another')
        if follows:
            raise ConfigError(why)

    def check(parameters: list[Parameter]) -> SetParametersResult:
        asked = any(p.name == SIM_TIME and p.value is not follows for p in parameters)
        return SetParametersResult(successful=not asked, reason=why if asked else '')

    node.add_on_set_parameters_callback(check)
    return follows


def declare_names(node: Node, name: str, values: tuple[str, ...], description: str) -> None:
    """Declare a read-only list of names that the node states and nobody sets."""
    # In three steps: rclpy takes the type from the values, and an empty list for one of bytes.
    kind = Parameter.Type.STRING_ARRAY
    node.declare_parameter(name, kind, ignore_override=True)
    node.set_parameters([Parameter(name, kind, list(values))])
    node.set_descriptor(name, ParameterDescriptor(
        description=description, read_only=True, type=kind.value))


def _overrides(node: Node) -> dict[str, Any]:
    """Return the values that the node was given, by -p or a file, under whatever name."""
    return {name: parameter.value for name, parameter
            in getattr(node, '_parameter_overrides', {}).items()}


def _number(field: dataclasses.Field, value: Any) -> Any:
    """
    Return whole numbers as real ones where those are wanted, anything else as it is.

    An empty list, of which ROS does not know the type, is the default where any length will do;
    at the start it comes as None.
    """
    if isinstance(field.default, float) and type(value) is int:
        return float(value)
    if field.metadata['any_length'] and (
            value is None or isinstance(value, (list, array.array)) and not len(value)):
        return list(field.default)
    if isinstance(field.default, tuple) and isinstance(value, Sequence) and len(value) and all(
            type(item) in (int, float) for item in value):
        return [float(item) for item in value]
    return value


def _check_type(field: dataclasses.Field, value: Any) -> None:
    """Raise `ConfigError` for a value of another type than the parameter's."""
    wanted, item = _TYPES[type(field.default)], None
    if isinstance(field.default, tuple):
        item = type(field.default[0])
        wanted = wanted[item]
    numbers = item is None or (
        isinstance(value, list) and all(type(each) is item for each in value))
    if type(_ros_value(field.default)) is not type(value) or not numbers:
        shown = list(value) if isinstance(value, array.array) else value
        raise ConfigError(f'parameter {field.metadata["name"]}: must be {wanted}, got {shown!r}')


def _ros_value(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _record_value(field: dataclasses.Field, value: Any) -> Any:
    return tuple(value) if isinstance(field.default, tuple) else value


def _descriptor(field: dataclasses.Field) -> ParameterDescriptor:
    entry = field.metadata
    descriptor = ParameterDescriptor(
        description=entry['description'], read_only=not entry['writable'],
        additional_constraints=entry['constraints'])
    if entry['choices']:
        descriptor.additional_constraints = 'one of: ' + ', '.join(entry['choices'])
    if isinstance(field.default, tuple) and entry['low'] is not None:
        count = 'any number of' if entry['any_length'] else len(field.default)
        descriptor.additional_constraints = (
            f'{count} values from {entry["low"]:g} to {entry["high"]:g}')
    elif isinstance(field.default, float):
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=float(entry['low']), to_value=float(entry['high']))]
    elif entry['low'] is not None:
        descriptor.integer_range = [
            IntegerRange(from_value=entry['low'], to_value=entry['high'], step=1)]
    return descriptor


def _check(kind: type, values: dict[str, Any]) -> None:
    """Raise `ConfigError` for a value that is not one of the choices or out of range."""
    for field in dataclasses.fields(kind):
        entry = field.metadata
        if field.name not in values:
            continue
        value = values[field.name]
        if entry['choices'] and value not in entry['choices']:
            raise ConfigError(f'parameter {entry["name"]}: must be one of '
                              f'{", ".join(entry["choices"])}, got {value!r}')
        if isinstance(value, str) and field.default and not value.strip():
            raise ConfigError(f'parameter {entry["name"]}: must not be empty')
        if isinstance(field.default, tuple):
            count = 'a list of' if entry['any_length'] else len(field.default)
            if entry['low'] is not None and (
                    not entry['any_length'] and len(value) != len(field.default)
                    or not all(entry['low'] <= x <= entry['high'] for x in value)):
                raise ConfigError(
                    f'parameter {entry["name"]}: must be {count} numbers from '
                    f'{entry["low"]:g} to {entry["high"]:g}, got {list(value)}')
        elif entry['low'] is not None and not entry['low'] <= value <= entry['high']:
            raise ConfigError(f'parameter {entry["name"]}: must be from {entry["low"]:g} to '
                              f'{entry["high"]:g}, got {value}')
        elif entry['least_on'] is not None and 0.0 < value < entry['least_on']:
            raise ConfigError(f'parameter {entry["name"]}: must be 0 or at least '
                              f'{entry["least_on"]:g}, got {value}')


def _warn_of_strangers(node: Node, kinds: tuple[type, ...], given: dict[str, Any]) -> None:
    """Warn of every value that was given under a name that nobody reads."""
    known = [field.metadata['name'] for kind in kinds for field in dataclasses.fields(kind)]
    by_last: dict[str, list[str]] = {}
    for name in known:
        by_last.setdefault(name.rpartition('.')[2], []).append(name)
    for name in sorted(given.keys() - {*known, *FROM_ROS}):
        last = name.rpartition('.')[2]
        near = (by_last.get(last) or difflib.get_close_matches(name, known, n=1)
                or by_last.get(*difflib.get_close_matches(last, by_last, n=1) or ('',)))
        node.get_logger().warning(
            f'there is no parameter {name}, its value is not used'
            + (f'; did you mean {" or ".join(near)}?' if near else ''))
