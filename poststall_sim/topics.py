# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The one table of topics: names, types, QoS, rates, and how a snapshot fills each of them.

The simulator node, the recorder without a ROS graph and the interface documentation are all
made from `PUBLISHED`; what the simulator hears stands in `inlets`, what a topic's message says in
`fields`.
"""

import enum
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from poststall_sim import fields, frames
from poststall_sim.engines import ElectricMotor, Propeller
from poststall_sim.fields import (
    THROTTLE,
    Fields,
    Layout,
    Making,
    command_values,
    header,
    joint_fields,
    stamp,
)
from poststall_sim.state import Snapshot, Status

SIMULATED, SAMPLED = 'simulated time', 'simulated time in which samples are taken'


class Rate(enum.Enum):
    """How often a topic is published: rate parameter, default [Hz], what the rate counts."""

    CLOCK = ('rates.clock', 100.0, SIMULATED)
    STATE = ('rates.state', 50.0, SIMULATED)
    STRIPS = ('rates.strips', 20.0, SIMULATED)
    WIND = ('rates.wind', 5.0, SIMULATED)
    BATTERY = ('rates.battery', 5.0, SIMULATED)
    TF = ('rates.tf', 50.0, SIMULATED)
    VIEWS = ('rates.views', 5.0, SIMULATED)
    PATH = ('rates.path', 1.0, SIMULATED)
    NED = ('rates.ned', 50.0, SIMULATED)
    SENSED_IMU = ('sensors.imu.rate', 0.0, SAMPLED)
    GPS = ('sensors.gps.rate', 0.0, SAMPLED)
    PITOT = ('sensors.pitot.rate', 0.0, SAMPLED)
    BAROMETER = ('sensors.barometer.rate', 0.0, SAMPLED)
    DIAGNOSTICS = ('rates.diagnostics', 1.0, 'wall time')
    ONCE = ('', 0.0, '')

    def __init__(self, parameter: str, default: float, counts: str) -> None:
        self.parameter = parameter   # empty for what is published once
        self.default = default
        self.counts = counts

    @property
    def shows_state(self) -> bool:
        """Tell whether its topics show the present state, whenever that is asked of them."""
        return self.counts in (SIMULATED, '')


class Switch(enum.Enum):
    """What a parameter of its own switches on and off, whatever the rate: name, default."""

    TF = ('publish_tf', True)
    MARKERS = ('publish_markers', True)
    NED = ('publish_ned', False)

    def __init__(self, parameter: str, default: bool) -> None:
        self.parameter = parameter
        self.default = default


@dataclass(frozen=True, slots=True)
class Qos:
    """Quality of service: history depth, reliable or best effort, latched or not."""

    depth: int = 10
    reliable: bool = True
    latched: bool = False


def layout(flight, *, map_frame: str = 'map', base_frame: str = 'base_link') -> Layout:
    """Return the layout of a `simulation.Flight`."""
    aircraft, lattice = flight.model.aircraft, flight.model.lattice
    arm_G = lattice.quarter_chord - np.array(aircraft.mass.cg_G)
    return Layout(
        control_names=tuple(aircraft.control_names),
        movable_names=tuple(part.name for part in aircraft.movables),
        engines=bool(aircraft.engines),
        strip_names=tuple(lattice.strip_names),
        strip_place=frames.swap_body_flu(frames.geometry_to_body(arm_G)),
        strip_chord=np.array(lattice.strip_chord, dtype=np.float64),
        strip_cl_max=lattice.greatest_lift,
        limits=tuple(control.limits for control in aircraft.controls),
        map_frame=map_frame, base_frame=base_frame,
        battery_capacity=sum(
            engine.drive.battery.capacity for engine in aircraft.engines
            if isinstance(engine, Propeller) and isinstance(engine.drive, ElectricMotor)) / 3600.0)


def _always(layout: Layout) -> bool:
    return True


@dataclass(frozen=True, slots=True)
class Topic:
    """
    One row of the table.

    name : relative to the node's namespace unless it starts with a slash; type : ROS name of
    the message; fields : snapshot and layout to plain fields, None where they take more than a
    snapshot (see `diagnostics_fields`, `views`, `instruments`); bulk : of so many elements that
    it is written as bytes (see `cdr`) and not filled into a message; shown_by : whether an
    aircraft of a layout has what it shows; common : most of them have; switch : what has to be
    on beside a rate above 0.
    """

    name: str
    type: str
    rate: Rate
    meaning: str
    fields: Making | None = None
    qos: Qos = Qos()
    bulk: bool = False
    shown_by: Callable[[Layout], bool] = _always
    common: bool = True
    switch: Switch | None = None

    @property
    def everywhere(self) -> bool:
        """Tell whether any aircraft has what it shows."""
        return self.shown_by is _always

    @property
    def switched_on(self) -> bool:
        """Tell whether its switch, if it has one, is on by default."""
        return self.switch is None or self.switch.default

    @property
    def by_default(self) -> bool:
        """Tell whether it is published, of most aircraft, unless a parameter says otherwise."""
        return self.common and self.switched_on and (
            self.rate is Rate.ONCE or self.rate.default > 0.0)


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


_SENSOR = Qos(depth=5, reliable=False)
_LATCHED = Qos(depth=1, latched=True)
_ARRAY = 'std_msgs/msg/Float64MultiArray'
_FLOAT = 'std_msgs/msg/Float64'

CLOCK = Topic(
    '/clock', 'rosgraph_msgs/msg/Clock', Rate.CLOCK,
    'simulated time = steps x dt; also while paused, then with the same stamp',
    lambda s, _: {'clock': stamp(s.time_ns)}, Qos(depth=1, reliable=False))
AIRSPEED = Topic('air_data/airspeed', _FLOAT, Rate.STATE, 'true airspeed [m/s]',
                 fields.number('airspeed'))
JOINT_STATES = Topic(
    'joint_states', 'sensor_msgs/msg/JointState', Rate.STATE,
    f'actual deflections by name [rad], {THROTTLE} 0..1; velocity their rates [1/s]; effort is 0 '
    '(not computed)',
    lambda s, layout: joint_fields(s.time_ns, command_values(s.controls, layout),
                                   command_values(s.control_rates, layout)),
    shown_by=lambda layout: bool(layout.command_names))   # else its arrays would be empty
JOINT_TARGETS = Topic(
    'joint_targets', 'sensor_msgs/msg/JointState', Rate.STATE,
    'what the controls are told, within their limits, by the names of joint_states [rad]; '
    'velocity and effort are 0',
    lambda s, layout: joint_fields(s.time_ns, command_values(s.commanded, layout)),
    shown_by=lambda layout: bool(layout.command_names))
SURFACE_STATES = Topic(
    'surface_states', 'sensor_msgs/msg/JointState', Rate.STATE,
    'angles of the movable parts by name, trailing edge down (left) positive [rad], with what has '
    'failed; velocity their rates [rad/s]; effort is 0',
    lambda s, layout: joint_fields(
        s.time_ns, dict(zip(layout.movable_names, s.angles.tolist())),
        dict(zip(layout.movable_names, s.angle_rates.tolist()))),
    shown_by=lambda layout: bool(layout.movable_names))
BATTERY = Topic(
    'battery', 'sensor_msgs/msg/BatteryState', Rate.BATTERY,
    'of electric engines: current of all batteries, charge and voltage of the least full, '
    'capacity [A, 0..1, V, A h]', fields.battery,
    shown_by=lambda layout: layout.battery_capacity > 0.0, common=False)
DIAGNOSTICS = Topic('/diagnostics', 'diagnostic_msgs/msg/DiagnosticArray', Rate.DIAGNOSTICS,
                    'real-time factor, lag, solver, commands: how the simulator does')
MARKERS = Topic(
    'markers', 'visualization_msgs/msg/MarkerArray', Rate.VIEWS,
    'body, strips (blue, of negative lift violet, stalled red), controls as they stand and lift '
    'of each strip, in base_link; wake, in map',
    qos=Qos(depth=1), bulk=True, switch=Switch.MARKERS)
PATH = Topic('path', 'nav_msgs/msg/Path', Rate.PATH,
             'where base_link has been since the start, in map, thinned to 500 poses at most',
             qos=Qos(depth=1, latched=True), bulk=True)

SENSED_IMU = Topic('sensors/imu', 'sensor_msgs/msg/Imu', Rate.SENSED_IMU,
                   'specific force and rates with errors, in base_link; no attitude '
                   '[m/s^2, rad/s]', qos=_SENSOR)
GPS = Topic('sensors/gps', 'sensor_msgs/msg/NavSatFix', Rate.GPS,
            'position with errors, from the parameters origin.* [deg, m]', qos=_SENSOR)
PITOT = Topic('sensors/pitot', 'sensor_msgs/msg/FluidPressure', Rate.PITOT,
              'dynamic pressure of the air from ahead, with errors [Pa]', qos=_SENSOR)
BAROMETER = Topic('sensors/barometer', 'sensor_msgs/msg/FluidPressure', Rate.BAROMETER,
                  'static pressure with errors [Pa]', qos=_SENSOR)

PUBLISHED: tuple[Topic, ...] = (
    CLOCK,
    Topic('pose', 'geometry_msgs/msg/PoseStamped', Rate.STATE,
          'base_link in map [m]; quaternion FLU to ENU', fields.pose),
    Topic('odom', 'nav_msgs/msg/Odometry', Rate.STATE,
          'pose in map [m]; twist in base_link, over the ground [m/s, rad/s]', fields.odom),
    Topic('twist', 'geometry_msgs/msg/TwistStamped', Rate.STATE,
          'velocity over the ground and rates, in base_link [m/s, rad/s]',
          fields.pair('twist', 'linear', 'angular',
                lambda s: (s.body.velocity_B, s.body.rates_B))),
    Topic('twist/air', 'geometry_msgs/msg/TwistStamped', Rate.STATE,
          'velocity through the air and rates, in base_link [m/s, rad/s]',
          fields.pair('twist', 'linear', 'angular', lambda s: (s.velocity_air_B, s.body.rates_B))),
    Topic('accel', 'geometry_msgs/msg/AccelStamped', Rate.STATE,
          'd(velocity)/dt seen from map, gravity included, and d(rates)/dt, in base_link '
          '[m/s^2, rad/s^2]',
          fields.pair('accel', 'linear', 'angular',
                      lambda s: (s.acceleration_B, s.rate_change_B))),
    Topic('imu', 'sensor_msgs/msg/Imu', Rate.STATE,
          'specific force (+g upwards in level flight), rates and attitude, in base_link, without '
          'errors [m/s^2, rad/s]', fields.imu),
    Topic('wrench', 'geometry_msgs/msg/WrenchStamped', Rate.STATE,
          'aerodynamic force and moment about the centre of gravity, in base_link, without '
          'gravity and thrust [N, N m]',
          fields.pair('wrench', 'force', 'torque', lambda s: (s.force_B, s.moment_B))),
    Topic('wrench/propulsion', 'geometry_msgs/msg/WrenchStamped', Rate.STATE,
          'what the engines do: force, and moment about the centre of gravity with torque and '
          'gyroscopic moment, in base_link [N, N m]',
          fields.pair('wrench', 'force', 'torque', lambda s: (s.thrust_B, s.thrust_moment_B))),
    AIRSPEED,
    Topic('air_data/alpha', _FLOAT, Rate.STATE, 'angle of attack [rad]', fields.number('alpha')),
    Topic('air_data/beta', _FLOAT, Rate.STATE,
          'angle of sideslip, positive with the wind from the right [rad]', fields.number('beta')),
    Topic('air_data/load_factor', _FLOAT, Rate.STATE, 'load factor, 1 in level flight [-]',
          fields.number('load_factor')),
    JOINT_STATES,
    BATTERY,
    JOINT_TARGETS,
    SURFACE_STATES,
    Topic('wind/applied', 'geometry_msgs/msg/Vector3Stamped', Rate.WIND,
          'velocity of the air in map at base_link, gusts and turbulence included, where it blows '
          'TO [m/s]', fields.wind),
    Topic('strip_cl', _ARRAY, Rate.STRIPS, 'section lift coefficients [-]', fields.strips('cl')),
    Topic('strip_alpha', _ARRAY, Rate.STRIPS,
          'angles of attack at which the sections work [rad]', fields.strips('alpha')),
    Topic('strip_decambering', _ARRAY, Rate.STRIPS, 'decambering angles [rad]',
          fields.strips('delta')),
    Topic('strip_cd', _ARRAY, Rate.STRIPS, 'section drag coefficients [-]', fields.strips('cd')),
    Topic('strip_cm', _ARRAY, Rate.STRIPS,
          'section moment coefficients about the quarter chord, nose-up [-]', fields.strips('cm')),
    Topic('strip_gamma', _ARRAY, Rate.STRIPS, 'strip circulations [m^2/s]',
          fields.strips('circulation')),
    Topic('strip_stalled', _ARRAY, Rate.STRIPS,
          '1 where a section works past its greatest or least lift, else 0; 0 throughout without '
          'decambering, where lift has no greatest value', fields.strips('stalled')),
    Topic('strips', 'sensor_msgs/msg/PointCloud2', Rate.VIEWS,
          'all strips at their quarter chords, in base_link: x y z cl cd cm alpha decambering '
          'stalled', fields.cloud, Qos(depth=5, reliable=False)),
    MARKERS,
    PATH,
    Topic('/tf', 'tf2_msgs/msg/TFMessage', Rate.TF, 'base_link in map', fields.transform,
          Qos(depth=100), switch=Switch.TF),
    Topic('/tf_static', 'tf2_msgs/msg/TFMessage', Rate.ONCE,
          'map_ned in map and base_link_frd in base_link', fields.static_transforms, _LATCHED,
          switch=Switch.TF),
    Topic('odom_ned', 'nav_msgs/msg/Odometry', Rate.NED,
          'odom in the axes of aviation: base_link_frd in map_ned [m, m/s, rad/s]',
          fields.odom_ned, switch=Switch.NED),
    Topic('wrench_frd', 'geometry_msgs/msg/WrenchStamped', Rate.NED,
          'wrench in base_link_frd [N, N m]', fields.wrench_frd, switch=Switch.NED),
    Topic('strip_y', _ARRAY, Rate.ONCE, 'where the strips are, y in base_link (left) [m]',
          fields.places('strip_y'), _LATCHED),
    Topic('strip_chord', _ARRAY, Rate.ONCE, 'chords of the strips [m]',
          fields.places('strip_chord'), _LATCHED),
    Topic('strip_cl_max', _ARRAY, Rate.ONCE, 'greatest lift coefficients of the sections [-]',
          fields.places('strip_cl_max'), _LATCHED),
    SENSED_IMU,
    GPS,
    PITOT,
    BAROMETER,
    DIAGNOSTICS,
)


class Schedule:
    """Which topics are due at a step, at rates [Hz] of simulated time; 0 switches one off."""

    def __init__(self, rates: Mapping[Rate, float]) -> None:
        self._topics = {
            rate: tuple(t for t in PUBLISHED if t.rate is rate)
            for rate in Rate if rate.counts == SIMULATED
            and rates.get(rate, rate.default) > 0.0}
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
