# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Node parameters as frozen records; `declaration` brings them to a node."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from poststall_sim.aero import model as models
from poststall_sim.aero.decambering import AngleForm
from poststall_sim.aero.schemes import Scheme
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.wake import Shape
from poststall_sim.aero.wash import Precision
from poststall_sim.sensors import LEAST_RATE
from poststall_sim.topics import SIMULATED, Rate, Switch

_AERO = models.Settings()

LEAST_FACTOR = 1e-3
"""Least real-time factor but 0: the wall time of a step, its inverse, is to stay a number."""


def entry(name: str, default: Any, description: str, *, low: float | None = None,
          high: float | None = None, choices: tuple[str, ...] = (),
          writable: bool = False, any_length: bool = False, constraints: str = '',
          least_on: float | None = None,
          under: Mapping[str, tuple[str, ...]] = MappingProxyType({})) -> Any:
    """
    Return a dataclass field that is a parameter: its ROS name, default, description, range.

    constraints : in words, where choices and ranges do not say what it may be; least_on : the
    least value but 0, which is off; under : by name, what other parameters have to be for this
    one to have an effect, which its description says.

    A writable one can be changed while the node runs; the others are read-only. A list has as
    many values as its default unless it may have any_length; its default is never empty, for ROS
    does not know the type of an empty list.
    """
    if under:
        description += f'; without effect but under {_listed(under)}'
    if least_on is not None:
        constraints = f'0 or at least {least_on:g}'
    return dataclasses.field(default=default, metadata={
        'name': name, 'description': description, 'low': low, 'high': high,
        'choices': choices, 'writable': writable, 'any_length': any_length,
        'constraints': constraints, 'least_on': least_on, 'under': under})


def _listed(under: Mapping[str, tuple[str, ...]]) -> str:
    return ' and '.join(f'{name} {" or ".join(values)}' for name, values in under.items())


def rate_entry(rate: Rate, what: str, *, low: float = 0.0, high: float = 10000.0) -> Any:
    """Return a dataclass field that is the rate of some topics."""
    return entry(rate.parameter, rate.default, f'Rate [Hz of {rate.counts}] of {what}',
                 low=low, high=high, least_on=None if low else LEAST_RATE)


def switch_entry(switch: Switch, what: str) -> Any:
    """Return a dataclass field that switches some topics."""
    return entry(switch.parameter, switch.default, what)


def axis_entry(control: str, default: int) -> Any:
    """Return a dataclass field that is the axis of a control."""
    return entry(f'joy.axes.{control}', default, f'Axis that moves {control} [-]; -1 = none',
                 low=-1, high=63)


def scale_entry(control: str, default: float, what: str, bound: float) -> Any:
    """Return a dataclass field that is what the full way of an axis does."""
    return entry(f'joy.scale.{control}', default, what, low=-bound, high=bound, writable=True)


def button_entry(name: str, default: int, what: str) -> Any:
    """Return a dataclass field that is a button."""
    return entry(f'joy.buttons.{name}', default, f'Button that {what} [-]; -1 = none',
                 low=-1, high=63)


LOCAL = {'decambering.closure': ('local',)}
FREE = {'uvlm.wake': (Shape.FREE.value,)}
GOMAN_KHRABROV = {'separation.law': (Separation.GOMAN_KHRABROV.value,)}
"""What some parameters need to have an effect, see `entry`."""


@dataclass(frozen=True, slots=True)
class JoySettings:
    """Parameters of a stick: axes as the package joy has them, left and up positive."""

    joy_enabled: bool = entry('joy.enabled', False, 'Listen to `joy`: a stick is the pilot')
    joy_aileron: int = axis_entry('aileron', 3)
    joy_elevator: int = axis_entry('elevator', 4)
    joy_rudder: int = axis_entry('rudder', 0)
    joy_throttle: int = axis_entry('throttle', 1)
    joy_aileron_scale: float = scale_entry(
        'aileron', -0.35, 'Aileron beyond trim at the full way of its axis [rad]', 1.6)
    joy_elevator_scale: float = scale_entry(
        'elevator', 0.35, 'Elevator beyond trim at the full way of its axis [rad]', 1.6)
    joy_rudder_scale: float = scale_entry(
        'rudder', 0.35, 'Rudder beyond trim at the full way of its axis [rad]', 1.6)
    joy_throttle_scale: float = scale_entry(
        'throttle', 1.0, 'Way of the throttle over that of its axis, which stands for trim in the '
        'middle [-]', 2.0)
    joy_deadband: float = entry(
        'joy.deadband', 0.05, 'Part of the way of an axis that does nothing [-]',
        low=0.0, high=0.9, writable=True)
    joy_pause: int = button_entry('pause', 7, 'pauses, or flies on')
    joy_reset: int = button_entry('reset', 6, 'resets')
    joy_trim: int = button_entry('trim', 0, 'trims, as the service does')


@dataclass(frozen=True, slots=True)
class SimulatorSettings(JoySettings):
    """Parameters of the simulator."""

    aircraft: str = entry(
        'aircraft', 'trainer', 'Aircraft: a file, or a name in config/aircraft')
    dt: float = entry(
        'dt', 0.0, 'Step of simulated time [s]; 0 = auto: panel chord over initial.airspeed, '
        'rounded down to whole milliseconds', low=0.0, high=1.0)
    real_time_factor: float = entry(
        'real_time_factor', 1.0, 'Simulated over wall time [-]; 0 = as fast as possible',
        low=0.0, high=1000.0, writable=True, least_on=LEAST_FACTOR)
    max_steps_per_wake: int = entry(
        'max_steps_per_wake', 10, 'Steps taken at one wake to catch up [-]; debt beyond it is '
        'forgiven and counted as lost time', low=1, high=1000)
    start_paused: bool = entry('start_paused', False, 'Wait for the pause service at the start')
    publish_clock: bool = entry(
        'publish_clock', True, 'Publish /clock: be the source of time; false with use_sim_time: '
        'follow the /clock of another')
    publish_tf: bool = switch_entry(
        Switch.TF, 'Publish /tf, at rates.tf, and /tf_static, where tf2_msgs is installed')
    publish_markers: bool = switch_entry(Switch.MARKERS, 'Publish markers, at rates.views')
    publish_ned: bool = switch_entry(
        Switch.NED, 'Publish odom_ned and wrench_frd, in the axes of aviation, at rates.ned')
    flight_file: str = entry(
        'flight_file', '', 'File that save_state writes and load_state reads',
        writable=True, constraints='a path that ends in .npz, or nothing')
    lockstep: str = entry(
        'lockstep', 'off', 'What time waits for: off = wall time; service = each call of the step '
        'service; command = each full command, once', choices=('off', 'command', 'service'))
    step_count: int = entry(
        'step_count', 1, 'Steps that one call of the step service, or a command in lock-step, '
        'takes [-]',
        low=1, high=1_000_000, writable=True)
    reset_time: bool = entry(
        'reset.time', False, 'Let the reset service also set simulated time to 0: a jump back '
        'that breaks TF and bags', writable=True)
    rates_clock: float = rate_entry(Rate.CLOCK, '/clock, at most every step', low=1.0)
    rates_state: float = rate_entry(
        Rate.STATE, 'pose, odom, wrench, air_data, joint_states and the like; 0 = off')
    rates_strips: float = rate_entry(Rate.STRIPS, 'strip_*; 0 = off')
    rates_wind: float = rate_entry(Rate.WIND, 'wind/applied; 0 = off')
    rates_battery: float = rate_entry(Rate.BATTERY, 'battery, of electric engines; 0 = off')
    rates_tf: float = rate_entry(Rate.TF, '/tf, with publish_tf; 0 = off')
    rates_views: float = rate_entry(
        Rate.VIEWS, 'markers, with publish_markers, and strips; 0 = off')
    rates_path: float = rate_entry(Rate.PATH, 'path; 0 = off')
    rates_ned: float = rate_entry(
        Rate.NED, 'odom_ned and wrench_frd, with publish_ned; 0 = off')
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
    engine_failures: str = entry(
        'engine_failures', '', 'Names of engines that do not work, with commas between them',
        writable=True, constraints='names of engines that the aircraft has, or nothing')
    initial_position: tuple[float, ...] = entry(
        'initial.position', (0.0, 0.0, 0.0),
        'Where the flight starts: east, north, up [m]; up 0 = '
        'initial.altitude', low=-1e6, high=1e6)
    initial_euler: tuple[float, ...] = entry(
        'initial.euler_deg', (0.0, 0.0, 0.0),
        'Attitude at the start: roll to the right, pitch up, '
        'heading clockwise from north [deg]; in trim the heading alone',
        low=-360.0, high=360.0)
    initial_trim: bool = entry(
        'initial.trim', True,
        'Start in straight trim; false: in the attitude of initial.euler_deg '
        'at the airspeed, flow angles and controls of trim')
    command_source: str = entry(
        'command.source', 'auto', 'Who flies; auto: the pilot while his commands are fresh, '
        'else the autopilot; sum: trim and what both add to it',
        choices=('auto', 'pilot', 'autopilot', 'sum'), writable=True)
    command_deadband: float = entry(
        'command.deadband', 0.01, 'Under auto, a pilot whose deflections are this near to trim '
        'leaves the controls to an autopilot who is there [rad]; 0 = never',
        low=0.0, high=1.0, writable=True)
    command_timeout: float = entry(
        'command.timeout', 0.5, 'Age at which a command is no longer fresh [s of simulated time]',
        low=0.0, high=1e6, writable=True)
    command_on_timeout: str = entry(
        'command.on_timeout', 'hold', 'What the controls do without a fresh command',
        choices=('hold', 'trim', 'neutral'), writable=True)
    surface_limits_deg: tuple[float, ...] = entry(
        'surface_limits_deg', (-1.0,), 'How far every control goes to either side, or one for '
        'each control [deg]; 0 or less = as the aircraft has it', low=-1.0, high=90.0,
        any_length=True)
    surface_rate_limits_deg: tuple[float, ...] = entry(
        'surface_rate_limits_deg', (-1.0,), 'Rate limit of all actuators, or one for each control '
        '[deg/s]; 0 or less = as the aircraft has it', low=-1.0, high=1e5, any_length=True)
    servo_tau: tuple[float, ...] = entry(
        'servo_tau', (-1.0,), 'Time constant of all actuators, or one for each control [s]; less '
        'than 0 = as the aircraft has it', low=-1.0, high=10.0, any_length=True)
    failures: tuple[str, ...] = entry(
        'failures', ('',), 'What has failed, each NAME:KIND by the name of a part in '
        "surface_states or of a control: 'elevator:stuck', 'aileron_right:stuck=-5' [deg], "
        "'rudder:float', 'flap:lost'; an empty word says nothing",
        writable=True, any_length=True, constraints='any number of words NAME:stuck, '
        'NAME:stuck=DEGREES, NAME:float or NAME:lost, or empty')
    uvlm_chordwise: int = entry(
        'uvlm.chordwise', _AERO.chordwise, 'Panels along every chord [-]', low=1, high=32)
    uvlm_spanwise: int = entry(
        'uvlm.spanwise', 0, "Strips of every surface [-]; 0 = those of the aircraft's file",
        low=0, high=200)
    uvlm_wake_length: float = entry(
        'uvlm.wake_length', 0.0, 'Length of wake that is kept [m]; 0 = auto',
        low=0.0, high=10000.0)
    uvlm_core: float = entry(
        'uvlm.core', _AERO.core, 'Core of the vortices of other surfaces, of free wakes and of '
        'mirror images [strip widths]', low=1e-3, high=1.0)
    uvlm_wake: str = entry(
        'uvlm.wake', _AERO.wake.value, 'Where shed rows go: with the air, with what they induce '
        'as well, or nowhere seen from the body', choices=tuple(shape.value for shape in Shape))
    uvlm_free_rows: int = entry(
        'uvlm.free_rows', _AERO.free_rows, 'Rows of a free wake that move [-]', low=1, high=1000,
        under=FREE)
    uvlm_free_every: int = entry(
        'uvlm.free_every', _AERO.free_every, 'Steps from one move of a free wake to the next [-]',
        low=1, high=100, under=FREE)
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
        'flow at any angle', writable=True)
    decambering_closure: str = entry(
        'decambering.closure', 'nonlocal', 'How the section angle is found',
        choices=('nonlocal', 'local'))
    decambering_ell: float = entry(
        'decambering.ell', _AERO.ell, 'Averaging length of the non-local closure [chords]',
        low=0.0, high=10.0, under={'decambering.closure': ('nonlocal',)})
    decambering_scheme: str = entry(
        'decambering.scheme', _AERO.scheme.value, 'How the local closure is solved: a scheme of '
        'the dissertation, or the one that does not fail',
        choices=tuple(each.value for each in Scheme), under=LOCAL)
    decambering_start: str = entry(
        'decambering.start', 'previous', 'Where the search of the local closure begins at each '
        'step, which settles the solution among several: at the last one, or at attached flow; '
        'the non-local closure has one solution', choices=('previous', 'attached'))
    decambering_angle_form: str = entry(
        'decambering.angle_form', _AERO.angle_form.value, 'Angles of strips by their sines, or '
        'small as in the dissertation, with separation.law quasi_steady only',
        choices=tuple(form.value for form in AngleForm))
    decambering_relaxation: float = entry(
        'decambering.relaxation', _AERO.damping, 'Under-relaxation of schemes A to D [-]',
        low=0.01, high=1.0, under={**LOCAL, 'decambering.scheme': ('A', 'B', 'C', 'D')})
    decambering_tolerance: float = entry(
        'decambering.tolerance', _AERO.tolerance, 'Residual at which the iteration ends [rad]',
        low=1e-12, high=0.1)
    decambering_max_iterations: int = entry(
        'decambering.max_iterations', _AERO.limit, 'Iterations after which the best is taken [-]',
        low=1, high=10_000)
    separation: str = entry(
        'separation.law', _AERO.separation.value, 'How separation follows the flow in time: at '
        'once, late with one time constant, or by the law of Goman and Khrabrov',
        choices=tuple(law.value for law in Separation))
    separation_lag: float = entry(
        'separation.lag', _AERO.lag, 'Time constant of the lag [chords travelled]',
        low=1e-3, high=100.0, under={'separation.law': ('lag',)})
    separation_relaxation: float = entry(
        'separation.relaxation', _AERO.relaxation, 'Time in which separation relaxes '
        '[chords travelled]', low=1e-3, high=100.0, under=GOMAN_KHRABROV)
    separation_delay: float = entry(
        'separation.delay', _AERO.delay, 'Delay of separation in a motion [chords travelled]',
        low=0.0, high=100.0, under=GOMAN_KHRABROV)

    @property
    def idle(self) -> dict[str, str]:
        """What is not as it comes and has no effect beside the others, and what that needs."""
        by_name = {field.metadata['name']: (getattr(self, field.name), field)
                   for field in dataclasses.fields(self)}
        found = {}
        for name, (value, field) in by_name.items():
            needed = field.metadata['under']
            if value == field.default or field.name == 'decambering_enabled':
                continue
            if name.startswith('decambering.') and not self.decambering_enabled:
                needed = {**needed, 'decambering.enabled': ('true',)}
            if any(by_name[other][0] not in values for other, values in needed.items()):
                found[name] = _listed(needed)
        return found

    @property
    def rates(self) -> dict[Rate, float]:
        """Rates of what is published at times that simulated time gives [Hz], 0 = off."""
        by_parameter = {field.metadata['name']: getattr(self, field.name)
                        for field in dataclasses.fields(self)}
        return {rate: by_parameter[rate.parameter] for rate in Rate if rate.counts == SIMULATED}

    @property
    def switched_off(self) -> set[Switch]:
        """What is not published, whatever its rate."""
        by_name = {Switch.TF: self.publish_tf, Switch.MARKERS: self.publish_markers,
                   Switch.NED: self.publish_ned}
        return {switch for switch, on in by_name.items() if not on}

    @property
    def start_altitude(self) -> float:
        """Altitude above the ground at which the flight starts [m]."""
        return self.initial_position[2] or self.initial_altitude

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
