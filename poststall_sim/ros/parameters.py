# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Node parameters as frozen records: declared, described, checked and changed in one place."""

import array
import dataclasses
import difflib
from collections.abc import Callable, Sequence
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
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.wake import Shape
from poststall_sim.aero.wash import Precision
from poststall_sim.aircraft import ConfigError
from poststall_sim.topics import SIMULATED, Rate

Settings = TypeVar('Settings')

_AERO = models.Settings()

_TYPES = {bool: 'true or false', int: 'a whole number', float: 'a number',
          str: 'text', tuple: 'a list of numbers'}

SIM_TIME = 'use_sim_time'
FROM_ROS = (SIM_TIME, 'start_type_description_service')
"""Parameters that every node has without declaring them."""


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


def rate_entry(rate: Rate, what: str, *, low: float = 0.0, high: float = 10000.0) -> Any:
    """Return a dataclass field that is the rate of some topics."""
    return entry(rate.parameter, rate.default, f'Rate [Hz of {rate.counts}] of {what}',
                 low=low, high=high)


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
    rates_clock: float = rate_entry(Rate.CLOCK, '/clock, at most every step', low=1.0)
    rates_state: float = rate_entry(
        Rate.STATE, 'pose, odom, wrench, air_data, joint_states and the like; 0 = off')
    rates_strips: float = rate_entry(Rate.STRIPS, 'strip_*; 0 = off')
    rates_wind: float = rate_entry(Rate.WIND, 'wind/applied; 0 = off')
    rates_tf: float = rate_entry(Rate.TF, '/tf, where tf2_msgs is installed; 0 = off')
    rates_views: float = rate_entry(Rate.VIEWS, 'markers and strips; 0 = off')
    rates_path: float = rate_entry(Rate.PATH, 'path; 0 = off')
    rates_ned: float = rate_entry(
        Rate.NED, 'odom_ned and wrench_frd, in the axes of aviation; 0 = off')
    rates_diagnostics: float = rate_entry(
        Rate.DIAGNOSTICS, '/diagnostics', low=0.1, high=100.0)
    frames_map: str = entry('frames.map', 'map', 'Name of the fixed frame (ENU)')
    frames_base: str = entry('frames.base', 'base_link', 'Name of the body frame (FLU)')
    frames_prefix: str = entry('frames.prefix', '', 'Put before the name of the body frame')
    initial_airspeed: float = entry(
        'initial.airspeed', 12.0, 'Airspeed at which the flight starts, trimmed [m/s]',
        low=0.1, high=400.0)
    initial_altitude: float = entry(
        'initial.altitude', 150.0, 'Altitude above the ground at which the flight starts [m]',
        low=0.1, high=20000.0)
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
    uvlm_wake: str = entry(
        'uvlm.wake', _AERO.wake.value, 'Where shed rows go: with the air, with what they induce '
        'as well, or nowhere seen from the body', choices=tuple(shape.value for shape in Shape))
    uvlm_free_rows: int = entry(
        'uvlm.free_rows', _AERO.free_rows, 'Rows of a free wake that move [-]', low=1, high=1000)
    uvlm_free_every: int = entry(
        'uvlm.free_every', _AERO.free_every, 'Steps from one move of a free wake to the next [-]',
        low=1, high=100)
    uvlm_precision: str = entry(
        'uvlm.precision', _AERO.precision.value, "Float type of the wake's velocity",
        choices=tuple(precision.value for precision in Precision))
    uvlm_coarsen: bool = entry(
        'uvlm.coarsen', _AERO.coarsen, 'Take rows of the wake together where they are far')
    uvlm_interpolate: bool = entry(
        'uvlm.interpolate', _AERO.interpolate, 'Compute far rows at few points of a surface')
    ground_effect: bool = entry(
        'ground.effect', _AERO.ground, 'Feel the flat ground at altitude 0, by a mirror image')
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
    separation: str = entry(
        'separation.law', _AERO.separation.value, 'How separation follows the flow in time: at '
        'once, late with one time constant, or by the law of Goman and Khrabrov',
        choices=tuple(law.value for law in Separation))
    separation_lag: float = entry(
        'separation.lag', _AERO.lag, 'Time constant under lag [chords travelled]',
        low=1e-3, high=100.0)
    separation_relaxation: float = entry(
        'separation.relaxation', _AERO.relaxation, 'Time in which separation relaxes under '
        'goman_khrabrov [chords travelled]', low=1e-3, high=100.0)
    separation_delay: float = entry(
        'separation.delay', _AERO.delay, 'Delay of separation in a motion under goman_khrabrov '
        '[chords travelled]', low=0.0, high=100.0)

    @property
    def rates(self) -> dict[Rate, float]:
        """Rates of what is published at times that simulated time gives [Hz], 0 = off."""
        by_parameter = {field.metadata['name']: getattr(self, field.name)
                        for field in dataclasses.fields(self)}
        return {rate: by_parameter[rate.parameter] for rate in Rate if rate.counts == SIMULATED}

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


def follow(node: Node, settings: Settings, changed: Callable[[Settings], None]) -> None:
    """Call ``changed`` with the new record whenever a writable parameter has been set."""
    kind = type(settings)
    by_name = {field.metadata['name']: field for field in dataclasses.fields(kind)}
    current = [settings]

    def updated(parameters: list[Parameter]) -> dict[str, Any]:
        return {by_name[p.name].name: _record_value(by_name[p.name], p.value)
                for p in parameters if p.name in by_name}

    def convert(parameters: list[Parameter]) -> list[Parameter]:
        return [Parameter(p.name, value=_number(by_name[p.name], p.value))
                if p.name in by_name and p.value is not None else p for p in parameters]

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

    node.add_pre_set_parameters_callback(convert)
    node.add_on_set_parameters_callback(check)
    node.add_post_set_parameters_callback(apply)


def refuse_sim_time(node: Node) -> None:
    """
    Refuse use_sim_time now and later, for a node that is the source of simulated time.

    Raises
    ------
    ConfigError
        When use_sim_time is true already.

    """
    why = (f'{SIM_TIME} is true, but this node is the source of simulated time: it cannot wait '
           f'for a /clock that it publishes itself; leave {SIM_TIME} false for it')
    if node.get_parameter(SIM_TIME).value:
        raise ConfigError(why)

    def check(parameters: list[Parameter]) -> SetParametersResult:
        asked = any(p.name == SIM_TIME and p.value is True for p in parameters)
        return SetParametersResult(successful=not asked, reason=why if asked else '')

    node.add_on_set_parameters_callback(check)


def declare_names(node: Node, name: str, values: tuple[str, ...], description: str) -> None:
    """Declare a read-only list of names that the node states and nobody sets."""
    node.declare_parameter(
        name, Parameter(name, Parameter.Type.STRING_ARRAY, list(values)).value or [],
        ParameterDescriptor(
            description=description, read_only=True,
            type=Parameter.Type.STRING_ARRAY.value), ignore_override=True)


def _overrides(node: Node) -> dict[str, Any]:
    """Return the values that the node was given, by -p or a file, under whatever name."""
    return {name: parameter.value for name, parameter
            in getattr(node, '_parameter_overrides', {}).items()}


def _number(field: dataclasses.Field, value: Any) -> Any:
    """Return whole numbers as real ones where those are wanted, anything else as it is."""
    if isinstance(field.default, float) and type(value) is int:
        return float(value)
    if isinstance(field.default, tuple) and isinstance(value, Sequence) and all(
            type(item) in (int, float) for item in value):
        return [float(item) for item in value]
    return value


def _check_type(field: dataclasses.Field, value: Any) -> None:
    """Raise `ConfigError` for a value of another type than the parameter's."""
    wanted = _TYPES[type(field.default)]
    numbers = not isinstance(field.default, tuple) or (
        isinstance(value, list) and all(type(item) is float for item in value))
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
            if len(value) != len(field.default) or not all(
                    entry['low'] <= x <= entry['high'] for x in value):
                raise ConfigError(
                    f'parameter {entry["name"]}: must be {len(field.default)} numbers from '
                    f'{entry["low"]:g} to {entry["high"]:g}, got {list(value)}')
        elif entry['low'] is not None and not entry['low'] <= value <= entry['high']:
            raise ConfigError(f'parameter {entry["name"]}: must be from {entry["low"]:g} to '
                              f'{entry["high"]:g}, got {value}')


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
