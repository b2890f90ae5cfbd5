# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The sensors of an aircraft and what their messages say, in ROS axes."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from poststall_sim import fields, topics
from poststall_sim.fields import Fields, Layout
from poststall_sim.frames import FloatArray, swap_body_flu, swap_ned_enu
from poststall_sim.sensors import Errors, Origin, Reading, Sensor, geodetic, pitot_pressure
from poststall_sim.state import Snapshot
from poststall_sim.topics import Topic

NO_ATTITUDE = -1.0
"""First entry of a covariance whose quantity is not measured (sensor_msgs/Imu)."""
DIAGONAL_KNOWN, FIX, GPS_SERVICE = 2, 0, 1
"""As sensor_msgs/NavSatFix and NavSatStatus number them."""

NUMBERS = (topics.SENSED_IMU, topics.GPS, topics.PITOT, topics.BAROMETER)
"""Their places decide which random numbers they get: new ones go to the end."""


def _inertial(snapshot: Snapshot) -> FloatArray:
    return np.concatenate([swap_body_flu(snapshot.specific_force_B),
                           swap_body_flu(snapshot.body.rates_B)])


_TRUTH: dict[Topic, Callable[[Snapshot], FloatArray]] = {
    topics.SENSED_IMU: _inertial,
    topics.GPS: lambda snapshot: swap_ned_enu(snapshot.body.position_N),
    topics.PITOT: lambda snapshot: np.array(
        [pitot_pressure(snapshot.density, snapshot.velocity_air_B)]),
    topics.BAROMETER: lambda snapshot: np.array([snapshot.air.pressure])}


class Instruments:
    """The sensors that are switched on, by topic, and where the map's origin is on the earth."""

    def __init__(self, errors: Mapping[Topic, Errors], origin: Origin, seed: int,
                 layout: Layout) -> None:
        self._sensors = {topic: Sensor(given, seed, NUMBERS.index(topic))
                         for topic, given in errors.items()}
        self._origin, self._layout = origin, layout

    def step(self, snapshot: Snapshot) -> Iterator[tuple[Topic, Fields]]:
        """Yield what the sensors say now; stamps are those of the samples."""
        for topic, sensor in self._sensors.items():
            for reading in sensor.step(snapshot.time_ns, _TRUTH[topic](snapshot)):
                yield topic, {
                    'header': fields.header(reading.time_ns, self._layout.base_frame),
                    **self._said(topic, reading, sensor.errors.noise)}

    def _said(self, topic: Topic, reading: Reading, noise: FloatArray) -> Fields:
        values = reading.values.tolist()
        if topic is topics.SENSED_IMU:
            unknown = np.zeros(9)
            unknown[0] = NO_ATTITUDE
            return {'orientation_covariance': unknown,
                    'linear_acceleration': dict(zip('xyz', values[:3])),
                    'linear_acceleration_covariance': fields.covariance(noise[:3]),
                    'angular_velocity': dict(zip('xyz', values[3:])),
                    'angular_velocity_covariance': fields.covariance(noise[3:])}
        if topic is topics.GPS:
            latitude, longitude, altitude = geodetic(self._origin, reading.values)
            return {'status': {'status': FIX, 'service': GPS_SERVICE},
                    'latitude': latitude, 'longitude': longitude, 'altitude': altitude,
                    'position_covariance': fields.covariance(noise),
                    'position_covariance_type': DIAGONAL_KNOWN}
        return {'fluid_pressure': values[0], 'variance': float(noise[0]) ** 2}
