# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Node parameters as frozen records: declared, described, checked and changed in one place."""

import dataclasses
import difflib
import math
from collections.abc import Callable
from dataclasses import dataclass
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

from poststall_sim.aero import model as models
from poststall_sim.aircraft import ConfigError

Settings = TypeVar('Settings')

_AERO = models.Settings()


def entry(name: str, default: Any, description: str, *, low: float | None = None,
          high: float | None = None, choices: tuple[str, ...] = (),
          writable: bool = False) -> Any:
    """
    Return a dataclass field that is a parameter: its ROS name, default, description, range.

    A writable one can be changed while the node runs; the others are read-only.
    """
    return dataclasses.field(default=default, metadata={
        'name': name, 'description': description, 'low': low, 'high': high,
        'choices': choices, 'writable': writable})


@dataclass(frozen=True, slots=True)
class SimulatorSettings:
    """Parameters of the simulator."""

    aircraft: str = entry(
        'aircraft', 'trainer', 'Aircraft: a file, or a name in config/aircraft')
    dt: float = entry(
        'dt', 0.0, 'Step of simulated time [s]; 0 = auto: panel chord over initial.airspeed, '
        'rounded down to whole milliseconds', low=0.0, high=1.0)
    real_time_factor: float = entry(
        'real_time_factor', 1.0, 'Simulated over wall time [-]; 0 = as fast as possible',
        low=0.0, high=1000.0, writable=True)
    max_steps_per_wake: int = entry(
        'max_steps_per_wake', 10, 'Steps taken at one wake to catch up [-]; debt beyond it is '
        'forgiven and counted as lost time', low=1, high=1000)
    start_paused: bool = entry('start_paused', False, 'Wait for the pause service at the start')
    publish_clock: bool = entry('publish_clock', True, 'Publish /clock: be the source of time')
    step_count: int = entry(
        'step_count', 1, 'Steps that one call of the step service takes [-]',
        low=1, high=1_000_000, writable=True)
    reset_time: bool = entry(
        'reset.time', False, 'Let the reset service also set simulated time to 0: a jump back '
        'that breaks TF and bags', writable=True)
    rates_clock: float = entry(
        'rates.clock', 100.0, 'Rate of /clock [Hz of simulated time], at most every step',
        low=1.0, high=10000.0)
    rates_state: float = entry(
        'rates.state', 50.0, 'Rate of pose, odom, wrench, air_data, joint_states and the like '
        '[Hz of simulated time]; 0 = off', low=0.0, high=10000.0)
    rates_strips: float = entry(
        'rates.strips', 20.0, 'Rate of strip_* [Hz of simulated time]; 0 = off',
        low=0.0, high=10000.0)
    rates_wind: float = entry(
        'rates.wind', 5.0, 'Rate of wind/applied [Hz of simulated time]; 0 = off',
        low=0.0, high=10000.0)
    rates_diagnostics: float = entry(
        'rates.diagnostics', 1.0, 'Rate of /diagnostics [Hz of wall time]', low=0.1, high=100.0)
    frames_map: str = entry('frames.map', 'map', 'Name of the fixed frame (ENU)')
    frames_base: str = entry('frames.base', 'base_link', 'Name of the body frame (FLU)')
    frames_prefix: str = entry('frames.prefix', '', 'Put before the name of the body frame')
    initial_airspeed: float = entry(
        'initial.airspeed', 12.0, 'Airspeed at which the flight starts, trimmed [m/s]',
        low=0.1, high=400.0)
    initial_altitude: float = entry(
        'initial.altitude', 150.0, 'Altitude at which the flight starts [m]',
        low=0.0, high=20000.0)
    wind_velocity: tuple[float, ...] = entry(
        'wind.velocity', (0.0, 0.0, 0.0), 'Velocity of the air, where it blows TO: east, north, '
        'up [m/s]', low=-100.0, high=100.0, writable=True)
    command_source: str = entry(
        'command.source', 'auto', 'Who flies; auto: the pilot while his commands are fresh, '
        'else the autopilot', choices=('auto', 'pilot', 'autopilot'), writable=True)
    command_timeout: float = entry(
        'command.timeout', 0.5, 'Age at which a command is no longer fresh [s of simulated time]',
        low=0.0, high=1e6, writable=True)
    command_on_timeout: str = entry(
        'command.on_timeout', 'hold', 'What the controls do without a fresh command',
        choices=('hold', 'trim', 'neutral'), writable=True)
    uvlm_chordwise: int = entry(
        'uvlm.chordwise', _AERO.chordwise, 'Panels along every chord [-]', low=1, high=32)
    uvlm_wake_length: float = entry(
        'uvlm.wake_length', 0.0, 'Length of wake that is kept [m]; 0 = auto',
        low=0.0, high=10000.0)
    decambering_enabled: bool = entry(
        'decambering.enabled', True, 'Correct the lattice by section curves; false: attached '
        'flow at any angle')
    decambering_closure: str = entry(
        'decambering.closure', 'nonlocal', 'How the section angle is found',
        choices=('nonlocal', 'local'))
    decambering_ell: float = entry(
        'decambering.ell', _AERO.ell, 'Averaging length of the non-local closure [chords]',
        low=0.0, high=10.0)
    decambering_tolerance: float = entry(
        'decambering.tolerance', _AERO.tolerance, 'Residual at which the iteration ends [rad]',
        low=1e-12, high=0.1)

    @property
    def base_frame(self) -> str:
        """Name of the body frame with its prefix."""
        return self.frames_prefix + self.frames_base


@dataclass(frozen=True, slots=True)
class PilotSettings:
    """Parameters of the pilot."""

    scenario: str = entry(
        'scenario', 'stall_and_recovery', 'Scenario: a file, or a name in config/scenarios')
    rate: float = entry(
        'rate', 100.0, 'Commands per second of simulated time [Hz], at most one for each message '
        'on /clock', low=1.0, high=1000.0)
    start_on_match: bool = entry(
        'start_on_match', True, 'Wait until a simulator listens before the scenario begins')
    unpause: bool = entry(
        'unpause', True, 'Let a paused simulator fly when the scenario begins')
    exit_when_done: bool = entry(
        'exit_when_done', False, 'End the node when the scenario is over')


def declare(node: Node, kind: type[Settings]) -> Settings:
    """
    Declare all parameters of a record on a node and return the record with their values.

    Raises
    ------
    ConfigError
        When a value that the node was given has the wrong type or is out of range.

    """
    values = {}
    for field in dataclasses.fields(kind):
        entry = field.metadata
        try:
            given = node.declare_parameter(
                entry['name'], _ros_value(field.default), _descriptor(field)).value
        except (ParameterException, ValueError, TypeError) as error:
            raise ConfigError(f'parameter {entry["name"]}: {error}') from None
        values[field.name] = _record_value(field, given)
    settings = kind(**values)
    _check(kind, values)
    _warn_of_strangers(node, kind)
    return settings


def follow(node: Node, settings: Settings, changed: Callable[[Settings], None]) -> None:
    """Call ``changed`` with the new record whenever a writable parameter has been set."""
    kind = type(settings)
    by_name = {field.metadata['name']: field for field in dataclasses.fields(kind)}
    current = [settings]

    def updated(parameters: list[Parameter]) -> dict[str, Any]:
        return {by_name[p.name].name: _record_value(by_name[p.name], p.value)
                for p in parameters if p.name in by_name}

    def check(parameters: list[Parameter]) -> SetParametersResult:
        try:
            _check(kind, updated(parameters))
        except ConfigError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def apply(parameters: list[Parameter]) -> None:
        values = updated(parameters)
        if values:
            current[0] = dataclasses.replace(current[0], **values)
            changed(current[0])

    node.add_on_set_parameters_callback(check)
    node.add_post_set_parameters_callback(apply)


def declare_names(node: Node, name: str, values: tuple[str, ...], description: str) -> None:
    """Declare a read-only list of names that the node states and nobody sets."""
    node.declare_parameter(
        name, Parameter(name, Parameter.Type.STRING_ARRAY, list(values)).value or [],
        ParameterDescriptor(
            description=description, read_only=True,
            type=Parameter.Type.STRING_ARRAY.value), ignore_override=True)


def _ros_value(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _record_value(field: dataclasses.Field, value: Any) -> Any:
    return tuple(value) if isinstance(field.default, tuple) else value


def _descriptor(field: dataclasses.Field) -> ParameterDescriptor:
    entry = field.metadata
    descriptor = ParameterDescriptor(
        description=entry['description'], read_only=not entry['writable'])
    if entry['choices']:
        descriptor.additional_constraints = 'one of: ' + ', '.join(entry['choices'])
    if isinstance(field.default, tuple):
        descriptor.additional_constraints = (
            f'{len(field.default)} values from {entry["low"]:g} to {entry["high"]:g}')
    elif isinstance(field.default, float):
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=float(entry['low']), to_value=float(entry['high']))]
    elif entry['low'] is not None:
        descriptor.integer_range = [
            IntegerRange(from_value=entry['low'], to_value=entry['high'], step=1)]
    return descriptor


def _check(kind: type, values: dict[str, Any]) -> None:
    """Raise `ConfigError` for what a descriptor cannot say: choices, lengths, NaN."""
    for field in dataclasses.fields(kind):
        entry = field.metadata
        if field.name not in values:
            continue
        value = values[field.name]
        if entry['choices'] and value not in entry['choices']:
            raise ConfigError(f'parameter {entry["name"]}: must be one of '
                              f'{", ".join(entry["choices"])}, got {value!r}')
        if isinstance(field.default, tuple):
            if len(value) != len(field.default) or not all(
                    entry['low'] <= x <= entry['high'] for x in value):
                raise ConfigError(
                    f'parameter {entry["name"]}: must be {len(field.default)} numbers from '
                    f'{entry["low"]:g} to {entry["high"]:g}, got {list(value)}')
        elif isinstance(value, float) and not math.isfinite(value):
            raise ConfigError(f'parameter {entry["name"]}: must be a finite number, got {value}')


def _warn_of_strangers(node: Node, kind: type) -> None:
    """Warn of a given value whose name is nearly that of a parameter: nobody reads it."""
    known = [field.metadata['name'] for field in dataclasses.fields(kind)]
    for name in getattr(node, '_parameter_overrides', {}):
        near = difflib.get_close_matches(name, known, n=1, cutoff=0.8)
        if near and name not in known:
            node.get_logger().warning(
                f'there is no parameter {name}, its value is not used; did you mean {near[0]}?')
