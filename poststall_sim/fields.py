# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What messages say, as plain fields: nested dicts of floats, ints, strings and arrays.

Spelt as in the message definitions, in ROS axes (REP-103: map is ENU, base_link is FLU with its
origin at the centre of gravity). What a message has and the fields do not name stays zero. No
float64 array is ever empty: Fast-CDR pads after an empty float64 sequence, and readers that do
not expect that refuse the message.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np

from poststall_sim import frames
from poststall_sim.frames import FloatArray
from poststall_sim.state import Snapshot

Fields = dict[str, Any]

THROTTLE = 'throttle'
"""The name under which commands and joint_states carry the throttle, 0..1."""

_DISCHARGING = 2
"""POWER_SUPPLY_STATUS_DISCHARGING of sensor_msgs/BatteryState."""

NED, FRD = '_ned', '_frd'
"""What the frames of aviation are called after those of ROS."""


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """
    What stays the same during a flight: names, strip geometry, frames.

    control_names : in the order of the deflections; movable_names : of the parts that they move;
    engines : whether there is a throttle; strip_names : one per strip; strip_place : (n, 3) their
    quarter chords in base_link [m]; strip_chord : (n,) [m]; strip_cl_max : (n,) each section's
    greatest lift; limits : (low, high) by control [rad]; map_frame, base_frame : frame ids;
    battery_capacity : of all batteries together [A h], 0 where there is none.
    """

    control_names: tuple[str, ...]
    movable_names: tuple[str, ...]
    engines: bool
    strip_names: tuple[str, ...]
    strip_place: FloatArray
    strip_chord: FloatArray
    strip_cl_max: FloatArray
    limits: tuple[tuple[float, float], ...]
    map_frame: str = 'map'
    base_frame: str = 'base_link'
    battery_capacity: float = 0.0

    @property
    def strip_y(self) -> FloatArray:
        """Where the strips are along the span (n,), to the left [m]."""
        return self.strip_place[:, 1].copy()

    @property
    def command_names(self) -> tuple[str, ...]:
        """Names that a command may hold: the controls, then the throttle if there is one."""
        return self.control_names + ((THROTTLE,) if self.engines else ())

    @property
    def command_limits(self) -> tuple[tuple[float, float], ...]:
        """Limits in the order of `command_names` [rad; throttle 0..1]."""
        return self.limits + (((0.0, 1.0),) if self.engines else ())


Making = Callable[[Snapshot, Layout], Fields]


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


def covariance(deviations: Sequence[float]) -> FloatArray:
    """Return a 3 x 3 covariance, row by row (9,), of independent errors; 0 where not known."""
    return np.diag(np.square(np.array(deviations, dtype=np.float64))).ravel()


def pose(snapshot: Snapshot, layout: Layout) -> Fields:
    """Return a geometry_msgs/PoseStamped."""
    return {'header': header(snapshot.time_ns, layout.map_frame), 'pose': pose_fields(snapshot)}


def odom(snapshot: Snapshot, layout: Layout) -> Fields:
    """Return a nav_msgs/Odometry."""
    return {'header': header(snapshot.time_ns, layout.map_frame),
            'child_frame_id': layout.base_frame,
            'pose': {'pose': pose_fields(snapshot)},
            'twist': {'twist': {'linear': body_xyz(snapshot.body.velocity_B),
                                'angular': body_xyz(snapshot.body.rates_B)}}}


def odom_ned(snapshot: Snapshot, layout: Layout) -> Fields:
    """Return a nav_msgs/Odometry in the axes of aviation: no component is turned."""
    body = snapshot.body
    w, x, y, z = body.q_NB.tolist()
    return {'header': header(snapshot.time_ns, layout.map_frame + NED),
            'child_frame_id': layout.base_frame + FRD,
            'pose': {'pose': {'position': _xyz(body.position_N),
                              'orientation': {'x': x, 'y': y, 'z': z, 'w': w}}},
            'twist': {'twist': {'linear': _xyz(body.velocity_B), 'angular': _xyz(body.rates_B)}}}


def wrench_frd(snapshot: Snapshot, layout: Layout) -> Fields:
    """Return the aerodynamic geometry_msgs/WrenchStamped in B."""
    return {'header': header(snapshot.time_ns, layout.base_frame + FRD),
            'wrench': {'force': _xyz(snapshot.force_B), 'torque': _xyz(snapshot.moment_B)}}


def imu(snapshot: Snapshot, layout: Layout) -> Fields:
    """Return a sensor_msgs/Imu without errors: its accelerometer reads +g at rest (REP-145)."""
    return {'header': header(snapshot.time_ns, layout.base_frame),
            'orientation': pose_fields(snapshot)['orientation'],
            'angular_velocity': body_xyz(snapshot.body.rates_B),
            'linear_acceleration': body_xyz(snapshot.specific_force_B)}


def pair(key: str, first: str, second: str,
         values: Callable[[Snapshot], tuple[FloatArray, FloatArray]]) -> Making:
    """Return what makes a stamped message that holds two vectors given in B."""
    def make(snapshot: Snapshot, layout: Layout) -> Fields:
        one, two = values(snapshot)
        return {'header': header(snapshot.time_ns, layout.base_frame),
                key: {first: body_xyz(one), second: body_xyz(two)}}
    return make


def wind(snapshot: Snapshot, layout: Layout) -> Fields:
    """Return the wind as a geometry_msgs/Vector3Stamped."""
    return {'header': header(snapshot.time_ns, layout.map_frame),
            'vector': map_xyz(snapshot.wind_N)}


def battery(snapshot: Snapshot, layout: Layout) -> Fields:
    """
    Return a sensor_msgs/BatteryState of all batteries: currents together, the least of the rest.

    Numbers are rounded to the float32 of the message.
    """
    engines = snapshot.engines
    powered = engines.voltage > 0.0
    share = float(engines.charge.min(initial=1.0))

    def single(value: float) -> float:
        return float(np.float32(value))
    return {'header': header(snapshot.time_ns, ''), 'present': True,
            'voltage': single(engines.voltage[powered].min(initial=np.inf))
            if powered.any() else 0.0,
            'current': single(-engines.current.sum()), 'percentage': single(share),
            'charge': single(share * layout.battery_capacity),
            'capacity': single(layout.battery_capacity),
            'design_capacity': single(layout.battery_capacity),
            'power_supply_status': _DISCHARGING}


def number(key: str) -> Making:
    """Return what makes a std_msgs/Float64 of a snapshot's number."""
    return lambda snapshot, layout: {'data': float(getattr(snapshot, key))}


def strips(key: str) -> Making:
    """Return what makes a Float64MultiArray of a quantity of the strips."""
    values = attrgetter('strips.' + key)
    return lambda snapshot, layout: strip_fields(values(snapshot))


def places(key: str) -> Making:
    """Return what makes a Float64MultiArray of something in the layout."""
    return lambda snapshot, layout: strip_fields(getattr(layout, key))


CLOUD = ('x', 'y', 'z', 'cl', 'cd', 'cm', 'alpha', 'decambering', 'stalled')
"""What each point of the cloud of strips has, all float32."""


def cloud(snapshot: Snapshot, layout: Layout) -> Fields:
    """Return a sensor_msgs/PointCloud2 of all strips, each at its quarter chord."""
    found = snapshot.strips
    values = np.column_stack([
        layout.strip_place, found.cl, found.cd, found.cm, found.alpha, found.delta,
        found.stalled]).astype('<f4')
    points, step = len(values), 4 * len(CLOUD)
    return {'header': header(snapshot.time_ns, layout.base_frame), 'height': 1, 'width': points,
            'fields': [{'name': name, 'offset': 4 * i, 'datatype': 7, 'count': 1}
                       for i, name in enumerate(CLOUD)],
            'is_bigendian': False, 'point_step': step, 'row_step': points * step,
            'data': values.reshape(-1).view(np.uint8), 'is_dense': True}


def transform(snapshot: Snapshot, layout: Layout) -> Fields:
    """Return the tf2_msgs/TFMessage of base_link in map."""
    pose = pose_fields(snapshot)
    return {'transforms': [{
        'header': header(snapshot.time_ns, layout.map_frame), 'child_frame_id': layout.base_frame,
        'transform': {'translation': pose['position'], 'rotation': pose['orientation']}}]}


def static_transforms(snapshot: Snapshot, layout: Layout) -> Fields:
    """Return the tf2_msgs/TFMessage of the axes of aviation in those of ROS."""
    half = float(np.sqrt(0.5))
    return {'transforms': [
        {'header': header(snapshot.time_ns, layout.map_frame),
         'child_frame_id': layout.map_frame + NED,
         'transform': {'rotation': {'x': half, 'y': half, 'z': 0.0, 'w': 0.0}}},
        {'header': header(snapshot.time_ns, layout.base_frame),
         'child_frame_id': layout.base_frame + FRD,
         'transform': {'rotation': {'x': 1.0, 'y': 0.0, 'z': 0.0, 'w': 0.0}}}]}


def joint_fields(time_ns: int, values: Mapping[str, float],
                 rates: Mapping[str, float] | None = None) -> Fields:
    """
    Return a sensor_msgs/JointState by name: positions [rad; throttle 0..1], their rates [1/s].

    Effort is 0, and so is a velocity that is not known: not left empty (see the top).
    """
    zeros = np.zeros(len(values))
    return {'header': header(time_ns, ''), 'name': list(values),
            'position': np.array(list(values.values()), dtype=np.float64),
            'velocity': zeros.copy() if rates is None else np.array(
                [rates[name] for name in values], dtype=np.float64),
            'effort': zeros}


def command_values(controls, layout: Layout) -> dict[str, float]:
    """Return `state.Controls` by name [rad; throttle 0..1]."""
    values = dict(zip(layout.control_names, controls.deflections.tolist()))
    if layout.engines:
        values[THROTTLE] = float(controls.throttle)
    return values


def _xyz(vector: FloatArray) -> Fields:
    return dict(zip('xyz', vector.tolist()))
