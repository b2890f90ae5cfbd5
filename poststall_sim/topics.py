# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The one table of topics: names, types, QoS, rates, and how a snapshot fills each of them.

The simulator node, the recorder without a ROS graph and the interface documentation are all
made from `PUBLISHED`; what the simulator hears stands in `inlets`. A topic's fields are plain:
nested dicts of floats, ints, strings and float64 arrays, spelt as in the message definition, in
ROS axes (REP-103: map is ENU, base_link is FLU with its origin at the centre of gravity). What a
message has and the fields do not name stays zero. No array is ever empty: Fast-CDR pads after an
empty float64 sequence, and readers that do not expect that refuse the message.
"""

import enum
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from poststall_sim import frames
from poststall_sim.frames import FloatArray
from poststall_sim.state import Snapshot, Status

Fields = dict[str, Any]

THROTTLE = 'throttle'
"""The name under which commands and joint_states carry the throttle, 0..1."""


class Rate(enum.Enum):
    """How often a topic is published: rate parameter, default [Hz], what the rate counts."""

    CLOCK = ('rates.clock', 100.0, 'simulated time')
    STATE = ('rates.state', 50.0, 'simulated time')
    STRIPS = ('rates.strips', 20.0, 'simulated time')
    WIND = ('rates.wind', 5.0, 'simulated time')
    DIAGNOSTICS = ('rates.diagnostics', 1.0, 'wall time')
    ONCE = ('', 0.0, '')

    def __init__(self, parameter: str, default: float, counts: str) -> None:
        self.parameter = parameter   # empty for what is published once
        self.default = default
        self.counts = counts


@dataclass(frozen=True, slots=True)
class Qos:
    """Quality of service: history depth, reliable or best effort, latched or not."""

    depth: int = 10
    reliable: bool = True
    latched: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """
    What stays the same during a flight: names, strip geometry, frames.

    control_names : in the order of the deflections; engines : whether there is a throttle;
    strip_names : one per strip; strip_y, strip_chord : (n,) in FLU [m]; strip_cl_max : (n,)
    each section's greatest lift; limits : (low, high) by control [rad]; map_frame, base_frame :
    frame ids.
    """

    control_names: tuple[str, ...]
    engines: bool
    strip_names: tuple[str, ...]
    strip_y: FloatArray
    strip_chord: FloatArray
    strip_cl_max: FloatArray
    limits: tuple[tuple[float, float], ...]
    map_frame: str = 'map'
    base_frame: str = 'base_link'

    @property
    def command_names(self) -> tuple[str, ...]:
        """Names that a command may hold: the controls, then the throttle if there is one."""
        return self.control_names + ((THROTTLE,) if self.engines else ())

    @property
    def command_limits(self) -> tuple[tuple[float, float], ...]:
        """Limits in the order of `command_names` [rad; throttle 0..1]."""
        return self.limits + (((0.0, 1.0),) if self.engines else ())


def layout(flight, *, map_frame: str = 'map', base_frame: str = 'base_link') -> Layout:
    """Return the layout of a `simulation.Flight`."""
    aircraft, lattice = flight.model.aircraft, flight.model.lattice
    place = frames.swap_body_flu(frames.geometry_to_body(lattice.quarter_chord))
    return Layout(
        control_names=tuple(aircraft.control_names),
        engines=bool(aircraft.engines),
        strip_names=tuple(lattice.strip_names),
        strip_y=place[:, 1].copy(),
        strip_chord=np.array(lattice.strip_chord, dtype=np.float64),
        strip_cl_max=lattice.greatest_lift,
        limits=tuple(control.limits for control in aircraft.controls),
        map_frame=map_frame, base_frame=base_frame)


@dataclass(frozen=True, slots=True)
class Topic:
    """
    One row of the table.

    name : relative to the node's namespace unless it starts with a slash; type : ROS name of
    the message; fields : snapshot and layout to plain fields, None where they do not come from
    a snapshot (see `diagnostics_fields`).
    """

    name: str
    type: str
    rate: Rate
    meaning: str
    fields: Callable[[Snapshot, Layout], Fields] | None = None
    qos: Qos = Qos()


def stamp(time_ns: int) -> Fields:
    """Return a builtin_interfaces/Time of simulated time [ns]."""
    seconds, nanoseconds = divmod(time_ns, 1_000_000_000)
    return {'sec': seconds, 'nanosec': nanoseconds}


def header(time_ns: int, frame: str) -> Fields:
    """Return a std_msgs/Header."""
    return {'stamp': stamp(time_ns), 'frame_id': frame}


def body_xyz(vector_B: FloatArray) -> Fields:
    """Return a geometry_msgs/Vector3 in FLU of a vector in B."""
    return dict(zip('xyz', frames.swap_body_flu(vector_B).tolist()))


def map_xyz(vector_N: FloatArray) -> Fields:
    """Return a geometry_msgs/Vector3 or Point in ENU of a vector in N."""
    return dict(zip('xyz', frames.swap_ned_enu(vector_N).tolist()))


def pose_fields(snapshot: Snapshot) -> Fields:
    """Return a geometry_msgs/Pose of FLU in ENU."""
    return {'position': map_xyz(snapshot.body.position_N),
            'orientation': dict(zip(
                'xyzw', frames.quaternion_enu_flu(snapshot.body.q_NB).tolist()))}


def strip_fields(values: FloatArray) -> Fields:
    """Return a std_msgs/Float64MultiArray of one value for each strip."""
    size = int(values.size)
    return {'layout': {'dim': [{'label': 'strip', 'size': size, 'stride': size}]},
            'data': np.ascontiguousarray(values, dtype=np.float64)}


def _pose(snapshot: Snapshot, layout: Layout) -> Fields:
    return {'header': header(snapshot.time_ns, layout.map_frame), 'pose': pose_fields(snapshot)}


def _odom(snapshot: Snapshot, layout: Layout) -> Fields:
    return {'header': header(snapshot.time_ns, layout.map_frame),
            'child_frame_id': layout.base_frame,
            'pose': {'pose': pose_fields(snapshot)},
            'twist': {'twist': {'linear': body_xyz(snapshot.body.velocity_B),
                                'angular': body_xyz(snapshot.body.rates_B)}}}


def _pair(key: str, first: str, second: str,
          values: Callable[[Snapshot], tuple[FloatArray, FloatArray]]):
    """Return the fields of a stamped message that holds two vectors given in B."""
    def fields(snapshot: Snapshot, layout: Layout) -> Fields:
        one, two = values(snapshot)
        return {'header': header(snapshot.time_ns, layout.base_frame),
                key: {first: body_xyz(one), second: body_xyz(two)}}
    return fields


def _wind(snapshot: Snapshot, layout: Layout) -> Fields:
    return {'header': header(snapshot.time_ns, layout.map_frame),
            'vector': map_xyz(snapshot.wind_N)}


def _number(key: str):
    return lambda snapshot, layout: {'data': float(getattr(snapshot, key))}


def _strips(key: str):
    values = attrgetter('strips.' + key)
    return lambda snapshot, layout: strip_fields(values(snapshot))


def _places(key: str):
    return lambda snapshot, layout: strip_fields(getattr(layout, key))


def joint_fields(time_ns: int, values: Mapping[str, float]) -> Fields:
    """
    Return a sensor_msgs/JointState by name: positions [rad; throttle 0..1].

    Velocity and effort are 0: they are not computed, and not left empty (see the top).
    """
    zeros = np.zeros(len(values))
    return {'header': header(time_ns, ''), 'name': list(values),
            'position': np.array(list(values.values()), dtype=np.float64),
            'velocity': zeros, 'effort': zeros.copy()}


def command_values(controls, layout: Layout) -> dict[str, float]:
    """Return `state.Controls` by name [rad; throttle 0..1]."""
    values = dict(zip(layout.control_names, controls.deflections.tolist()))
    if layout.engines:
        values[THROTTLE] = float(controls.throttle)
    return values


class Level(enum.IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True, slots=True)
class Condition:
    """One diagnostic: how it stands, under which name, why, and its values by key."""

    level: Level
    name: str
    message: str
    values: Mapping[str, Any]


def diagnostics_fields(time_ns: int, hardware: str, conditions: list[Condition]) -> Fields:
    """Return a diagnostic_msgs/DiagnosticArray."""
    return {'header': header(time_ns, ''), 'status': [
        {'level': int(condition.level), 'name': condition.name, 'message': condition.message,
         'hardware_id': hardware,
         'values': [{'key': key, 'value': _text(value)}
                    for key, value in condition.values.items()]}
        for condition in conditions]}


def _text(value: Any) -> str:
    """Return a value as a diagnostic shows it: plotting tools read numbers from it."""
    if isinstance(value, bool):
        return 'true' if value else 'false'
    if isinstance(value, float):
        return f'{value:.6g}'
    return str(value)


class SolverTally:
    """What the solver did since the start of the flight, counted step by step."""

    def __init__(self) -> None:
        self.steps = 0
        self.iterations_sum = 0
        self.iterations_max = 0
        self.residual_max = 0.0
        self.stalled_max = 0
        self.statuses = dict.fromkeys(Status, 0)

    def add(self, snapshot: Snapshot) -> None:
        """Count one step."""
        self.steps += 1
        self.iterations_sum += snapshot.iterations
        self.iterations_max = max(self.iterations_max, snapshot.iterations)
        if snapshot.status is not Status.DIVERGED:
            self.residual_max = max(self.residual_max, snapshot.max_residual)
            self.stalled_max = max(self.stalled_max, int(np.count_nonzero(
                snapshot.strips.stalled)))
        self.statuses[snapshot.status] += 1

    def condition(self, name: str, snapshot: Snapshot, closure: str) -> Condition:
        """Return the solver's diagnostic; the status is that of the latest step."""
        level = {Status.CONVERGED: Level.OK, Status.NOT_CONVERGED: Level.WARN,
                 Status.DIVERGED: Level.ERROR}[snapshot.status]
        return Condition(level, name, snapshot.status.value, {
            'closure': closure,
            'steps': self.steps,
            'iterations_mean': self.iterations_sum / max(self.steps, 1),
            'iterations_max': self.iterations_max,
            'residual_now': float(snapshot.max_residual),
            'residual_max': float(self.residual_max),
            'converged': self.statuses[Status.CONVERGED],
            'not_converged': self.statuses[Status.NOT_CONVERGED],
            'diverged': self.statuses[Status.DIVERGED],
            'stalled_strips_now': int(np.count_nonzero(snapshot.strips.stalled)),
            'stalled_strips_max': self.stalled_max})


_LATCHED = Qos(depth=1, latched=True)
_ARRAY = 'std_msgs/msg/Float64MultiArray'
_FLOAT = 'std_msgs/msg/Float64'

CLOCK = Topic(
    '/clock', 'rosgraph_msgs/msg/Clock', Rate.CLOCK,
    'simulated time = steps x dt; also while paused, then with the same stamp',
    lambda s, _: {'clock': stamp(s.time_ns)}, Qos(depth=1, reliable=False))
AIRSPEED = Topic('air_data/airspeed', _FLOAT, Rate.STATE, 'true airspeed [m/s]',
                 _number('airspeed'))
JOINT_STATES = Topic(
    'joint_states', 'sensor_msgs/msg/JointState', Rate.STATE,
    'actual deflections by name [rad], throttle 0..1; velocity and effort are 0 (not computed)',
    lambda s, layout: joint_fields(s.time_ns, command_values(s.controls, layout)))
DIAGNOSTICS = Topic('/diagnostics', 'diagnostic_msgs/msg/DiagnosticArray', Rate.DIAGNOSTICS,
                    'real-time factor, lag, solver, commands: how the simulator does')

PUBLISHED: tuple[Topic, ...] = (
    CLOCK,
    Topic('pose', 'geometry_msgs/msg/PoseStamped', Rate.STATE,
          'base_link in map [m]; quaternion FLU to ENU', _pose),
    Topic('odom', 'nav_msgs/msg/Odometry', Rate.STATE,
          'pose in map [m]; twist in base_link, over the ground [m/s, rad/s]', _odom),
    Topic('twist', 'geometry_msgs/msg/TwistStamped', Rate.STATE,
          'velocity over the ground and rates, in base_link [m/s, rad/s]',
          _pair('twist', 'linear', 'angular',
                lambda s: (s.body.velocity_B, s.body.rates_B))),
    Topic('twist/air', 'geometry_msgs/msg/TwistStamped', Rate.STATE,
          'velocity through the air and rates, in base_link [m/s, rad/s]',
          _pair('twist', 'linear', 'angular', lambda s: (s.velocity_air_B, s.body.rates_B))),
    Topic('accel', 'geometry_msgs/msg/AccelStamped', Rate.STATE,
          'd(velocity)/dt seen from map, gravity included, and d(rates)/dt, in base_link '
          '[m/s^2, rad/s^2]',
          _pair('accel', 'linear', 'angular', lambda s: (s.acceleration_B, s.rate_change_B))),
    Topic('wrench', 'geometry_msgs/msg/WrenchStamped', Rate.STATE,
          'aerodynamic force and moment about the centre of gravity, in base_link, without '
          'gravity and thrust [N, N m]',
          _pair('wrench', 'force', 'torque', lambda s: (s.force_B, s.moment_B))),
    Topic('wrench/propulsion', 'geometry_msgs/msg/WrenchStamped', Rate.STATE,
          'thrust and its moment about the centre of gravity, in base_link [N, N m]',
          _pair('wrench', 'force', 'torque', lambda s: (s.thrust_B, s.thrust_moment_B))),
    AIRSPEED,
    Topic('air_data/alpha', _FLOAT, Rate.STATE, 'angle of attack [rad]', _number('alpha')),
    Topic('air_data/beta', _FLOAT, Rate.STATE,
          'angle of sideslip, positive with the wind from the right [rad]', _number('beta')),
    Topic('air_data/load_factor', _FLOAT, Rate.STATE, 'load factor, 1 in level flight [-]',
          _number('load_factor')),
    JOINT_STATES,
    Topic('wind/applied', 'geometry_msgs/msg/Vector3Stamped', Rate.WIND,
          'velocity of the air in map, where it blows TO [m/s]', _wind),
    Topic('strip_cl', _ARRAY, Rate.STRIPS, 'section lift coefficients [-]', _strips('cl')),
    Topic('strip_alpha', _ARRAY, Rate.STRIPS,
          'angles of attack at which the sections work [rad]', _strips('alpha')),
    Topic('strip_decambering', _ARRAY, Rate.STRIPS, 'decambering angles [rad]',
          _strips('delta')),
    Topic('strip_cd', _ARRAY, Rate.STRIPS, 'section drag coefficients [-]', _strips('cd')),
    Topic('strip_cm', _ARRAY, Rate.STRIPS,
          'section moment coefficients about the quarter chord, nose-up [-]', _strips('cm')),
    Topic('strip_gamma', _ARRAY, Rate.STRIPS, 'strip circulations [m^2/s]',
          _strips('circulation')),
    Topic('strip_stalled', _ARRAY, Rate.STRIPS,
          '1 where a section works past its greatest or least lift, else 0; 0 throughout without '
          'decambering, where lift has no greatest value', _strips('stalled')),
    Topic('strip_y', _ARRAY, Rate.ONCE, 'where the strips are, y in base_link (left) [m]',
          _places('strip_y'), _LATCHED),
    Topic('strip_chord', _ARRAY, Rate.ONCE, 'chords of the strips [m]',
          _places('strip_chord'), _LATCHED),
    Topic('strip_cl_max', _ARRAY, Rate.ONCE, 'greatest lift coefficients of the sections [-]',
          _places('strip_cl_max'), _LATCHED),
    DIAGNOSTICS,
)


class Schedule:
    """Which topics are due at a step, at rates [Hz] of simulated time; 0 switches one off."""

    def __init__(self, rates: Mapping[Rate, float]) -> None:
        self._topics = {
            rate: tuple(t for t in PUBLISHED if t.rate is rate and t.fields is not None)
            for rate in Rate if rate is not Rate.ONCE and rates.get(rate, rate.default) > 0.0}
        self._period_ns = {
            rate: max(1, round(1e9 / rates.get(rate, rate.default))) for rate in self._topics}
        self._last: dict[Rate, int] = {}

    def due(self, time_ns: int) -> list[Topic]:
        """Return the topics of the periods that have begun since the last call."""
        topics: list[Topic] = []
        for rate, period_ns in self._period_ns.items():
            period = time_ns // period_ns
            if self._last.get(rate) != period:
                self._last[rate] = period
                topics.extend(self._topics[rate])
        return topics
