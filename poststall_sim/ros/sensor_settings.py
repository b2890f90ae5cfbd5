# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The parameters of the sensors: off unless they have a rate."""

from dataclasses import dataclass

import numpy as np

from poststall_sim import topics
from poststall_sim.fields import Layout
from poststall_sim.instruments import Instruments
from poststall_sim.ros.parameters import entry, rate_entry
from poststall_sim.sensors import Errors, Origin
from poststall_sim.topics import Rate, Topic

_DELAY = 'Delay [s of simulated time] from a sample, whose time is in the stamp, to its message'


@dataclass(frozen=True, slots=True)
class SensorSettings:
    """Parameters of the sensors: rates, delays, standard deviations of white noise, biases."""

    seed: int = entry('sensors.seed', 1, 'Seed of the noise [-]: the same seed, the same noise',
                      low=0, high=2**31 - 1)
    imu_rate: float = rate_entry(Rate.SENSED_IMU, 'sensors/imu; 0 = off')
    imu_delay: float = entry('sensors.imu.delay', 0.0, _DELAY, low=0.0, high=10.0)
    accel_noise: float = entry(
        'sensors.imu.accel_noise', 0.05, 'Noise of specific force [m/s^2]', low=0.0, high=100.0)
    accel_bias: tuple[float, ...] = entry(
        'sensors.imu.accel_bias', (0.0, 0.0, 0.0), 'Bias of specific force, forward, left, up '
        '[m/s^2]', low=-100.0, high=100.0)
    gyro_noise: float = entry(
        'sensors.imu.gyro_noise', 0.005, 'Noise of rates [rad/s]', low=0.0, high=10.0)
    gyro_bias: tuple[float, ...] = entry(
        'sensors.imu.gyro_bias', (0.0, 0.0, 0.0), 'Bias of rates about forward, left, up [rad/s]',
        low=-10.0, high=10.0)
    gps_rate: float = rate_entry(Rate.GPS, 'sensors/gps; 0 = off')
    gps_delay: float = entry('sensors.gps.delay', 0.1, _DELAY, low=0.0, high=10.0)
    gps_noise: tuple[float, ...] = entry(
        'sensors.gps.noise', (1.0, 1.0, 2.0), 'Noise of position, east, north, up [m]',
        low=0.0, high=1000.0)
    gps_bias: tuple[float, ...] = entry(
        'sensors.gps.bias', (0.0, 0.0, 0.0), 'Bias of position, east, north, up [m]',
        low=-1000.0, high=1000.0)
    pitot_rate: float = rate_entry(Rate.PITOT, 'sensors/pitot; 0 = off')
    pitot_delay: float = entry('sensors.pitot.delay', 0.0, _DELAY, low=0.0, high=10.0)
    pitot_noise: float = entry(
        'sensors.pitot.noise', 2.0, 'Noise of dynamic pressure [Pa]', low=0.0, high=1e4)
    pitot_bias: float = entry(
        'sensors.pitot.bias', 0.0, 'Bias of dynamic pressure [Pa]', low=-1e4, high=1e4)
    barometer_rate: float = rate_entry(Rate.BAROMETER, 'sensors/barometer; 0 = off')
    barometer_delay: float = entry('sensors.barometer.delay', 0.0, _DELAY, low=0.0, high=10.0)
    barometer_noise: float = entry(
        'sensors.barometer.noise', 5.0, 'Noise of static pressure [Pa]', low=0.0, high=1e4)
    barometer_bias: float = entry(
        'sensors.barometer.bias', 0.0, 'Bias of static pressure [Pa]', low=-1e4, high=1e4)
    latitude: float = entry(
        'origin.latitude', 0.0, "Latitude of the map's origin [deg]", low=-89.0, high=89.0)
    longitude: float = entry(
        'origin.longitude', 0.0, "Longitude of the map's origin [deg]", low=-180.0, high=180.0)
    altitude: float = entry(
        'origin.altitude', 0.0, "Altitude of the map's origin that GPS adds [m]; the air is that "
        'of the altitude above the map', low=-500.0, high=9000.0)

    @property
    def rates(self) -> dict[Rate, float]:
        """Rates of the sensors [Hz], 0 = off."""
        return {Rate.SENSED_IMU: self.imu_rate, Rate.GPS: self.gps_rate,
                Rate.PITOT: self.pitot_rate, Rate.BAROMETER: self.barometer_rate}

    def instruments(self, layout: Layout) -> Instruments:
        """Return the sensors that are on."""
        given: dict[Topic, tuple] = {
            topics.SENSED_IMU: (
                np.repeat([self.accel_noise, self.gyro_noise], 3),
                [*self.accel_bias, *self.gyro_bias], self.imu_delay),
            topics.GPS: (self.gps_noise, self.gps_bias, self.gps_delay),
            topics.PITOT: ([self.pitot_noise], [self.pitot_bias], self.pitot_delay),
            topics.BAROMETER: (
                [self.barometer_noise], [self.barometer_bias], self.barometer_delay)}
        errors = {topic: Errors(self.rates[topic.rate], *values)
                  for topic, values in given.items() if self.rates[topic.rate] > 0.0}
        return Instruments(
            errors, Origin(self.latitude, self.longitude, self.altitude), self.seed, layout)
