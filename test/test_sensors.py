# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Sensors: bias, deviation, delay, rate and colour of their errors, and what they measure.

Seeds are fixed, so that the statistics are the same at every run; bounds are four standard errors
of the statistic in question.
"""

import math

import numpy as np
import pytest
from instants import a_layout, a_snapshot

from poststall_sim import topics
from poststall_sim.aircraft import ConfigError
from poststall_sim.instruments import Instruments
from poststall_sim.sensors import Errors, Origin, Sensor, geodetic, pitot_pressure

DT_NS = 5_000_000
SAMPLES = 20_000
NOISE, BIAS = np.array([0.05, 2.0]), np.array([0.3, -7.0])
ORIGIN = Origin(47.0, 11.0, 600.0)


def readings(errors, *, seed=1, number=0, steps=SAMPLES, truth=None):
    sensor = Sensor(errors, seed, number)
    still = np.zeros(len(errors.noise))
    return [(k * DT_NS, reading) for k in range(steps) for reading in sensor.step(
        k * DT_NS, still if truth is None else truth(k * DT_NS))]


@pytest.fixture(scope='module')
def errors():
    """Return the errors of many samples of a quantity that is 0."""
    found = readings(Errors(200.0, NOISE, BIAS))
    assert len(found) == SAMPLES
    return np.array([reading.values for _, reading in found])


def test_their_mean_is_the_bias(errors):
    assert np.abs(errors.mean(axis=0) - BIAS) == pytest.approx(
        np.zeros(2), abs=4.0 * NOISE.max() / math.sqrt(SAMPLES))
    assert (np.abs(errors.mean(axis=0) - BIAS) < 4.0 * NOISE / math.sqrt(SAMPLES)).all()


def test_their_standard_deviation_is_the_noise(errors):
    """The standard error of a standard deviation is sigma / sqrt(2 n)."""
    assert errors.std(axis=0) == pytest.approx(NOISE, rel=4.0 / math.sqrt(2.0 * SAMPLES))


def test_they_are_normal(errors):
    """Skewness and excess kurtosis are 0 within four times sqrt(6/n) and sqrt(24/n)."""
    z = (errors - errors.mean(axis=0)) / errors.std(axis=0)
    assert (np.abs((z ** 3).mean(axis=0)) < 4.0 * math.sqrt(6.0 / SAMPLES)).all()
    assert (np.abs((z ** 4).mean(axis=0) - 3.0) < 4.0 * math.sqrt(24.0 / SAMPLES)).all()


def test_their_spectrum_is_white(errors):
    """
    As much power in each of ten bands; no sample knows of those before.

    Power in a band of m lines is the mean of m exponentials, so that its standard error is
    1 / sqrt(m) of it.
    """
    z = errors - errors.mean(axis=0)
    power = np.abs(np.fft.rfft(z, axis=0)[1:]) ** 2
    bands = power[:10 * (len(power) // 10)].reshape(10, -1, 2).mean(axis=1)
    assert bands / power.mean(axis=0) == pytest.approx(
        np.ones((10, 2)), abs=4.0 / math.sqrt(len(power) / 10))
    for lag in range(1, 21):
        correlation = (z[lag:] * z[:-lag]).mean(axis=0) / z.var(axis=0)
        assert (np.abs(correlation) < 4.0 / math.sqrt(SAMPLES)).all(), lag


def test_components_and_sensors_have_noise_of_their_own(errors):
    z = (errors - BIAS) / NOISE
    assert abs((z[:, 0] * z[:, 1]).mean()) < 4.0 / math.sqrt(SAMPLES)
    other = np.array([r.values for _, r in readings(Errors(200.0, NOISE, BIAS), number=1)])
    assert (np.abs((z * (other - BIAS) / NOISE).mean(axis=0)) < 4.0 / math.sqrt(SAMPLES)).all()


def test_the_same_seed_gives_the_same_readings_and_another_one_others():
    given = Errors(50.0, NOISE, BIAS, delay=0.02)
    first, again, other = (readings(given, seed=seed, steps=400) for seed in (3, 3, 4))
    assert [r.values.tolist() for _, r in first] == [r.values.tolist() for _, r in again]
    assert all((a.values != b.values).all() for (_, a), (_, b) in zip(first, other))


@pytest.mark.parametrize(('delay', 'steps'), [
    (0.0, 0), (0.005, 1), (0.013, 3), (0.1, 20)])   # 13 ms are out at the third step of 5 ms
def test_a_reading_comes_a_whole_number_of_steps_after_its_sample(delay, steps):
    found = readings(Errors(200.0, np.zeros(1), np.zeros(1), delay), steps=100,
                     truth=lambda time_ns: np.array([float(time_ns)]))
    assert len(found) == 100 - steps
    for now_ns, reading in found:
        assert now_ns - reading.time_ns == steps * DT_NS
        assert reading.values[0] == reading.time_ns    # what it was then


@pytest.mark.parametrize('rate', [5.0, 30.0, 100.0, 200.0])
def test_samples_come_at_their_rate_on_average_and_at_most_every_step(rate):
    found = readings(Errors(rate, np.zeros(1), np.zeros(1)), steps=2000)
    assert len(found) == pytest.approx(10.0 * rate, abs=1)
    gaps = np.diff([reading.time_ns for _, reading in found])
    assert np.ptp(gaps) <= DT_NS
    fast = readings(Errors(1000.0, np.zeros(1), np.zeros(1)), steps=100)
    assert len(fast) == 100


def test_time_that_is_set_back_takes_what_was_on_its_way():
    sensor = Sensor(Errors(200.0, np.zeros(1), np.zeros(1), delay=0.01), 1, 0)
    for k in range(10):
        sensor.step(k * DT_NS, np.zeros(1))
    again = [reading.time_ns for k in range(4) for reading in sensor.step(k * DT_NS, np.ones(1))]
    assert again == [0, DT_NS]


@pytest.mark.parametrize('given', [
    {'rate': 0.0}, {'rate': 1e-300}, {'delay': -1.0}, {'noise': np.array([-1.0])}])
def test_what_no_sensor_does_is_refused(given):
    with pytest.raises(ConfigError, match='a sensor needs'):
        Errors(**{'rate': 10.0, 'noise': np.zeros(1), 'bias': np.zeros(1), **given})


@pytest.mark.parametrize(('latitude', 'metres_north', 'metres_east'), [
    (0.0, 110_574.3, 111_319.5), (45.0, 111_131.7, 78_846.8), (60.0, 111_412.2, 55_800.0)])
def test_a_degree_has_its_length_on_the_ellipsoid(latitude, metres_north, metres_east):
    """Lengths of a degree on WGS 84, as tabulated by the (U.S.) National Geospatial Agency."""
    origin = Origin(latitude, 10.0, 0.0)
    north = geodetic(origin, np.array([0.0, 1000.0, 5.0]))
    east = geodetic(origin, np.array([1000.0, 0.0, 0.0]))
    assert 1000.0 / (north[0] - latitude) == pytest.approx(metres_north, rel=2e-5)
    assert 1000.0 / (east[1] - 10.0) == pytest.approx(metres_east, rel=2e-5)
    assert north[1:] == (10.0, 5.0) and east[0] == latitude


def test_longitude_goes_on_beyond_the_date_line():
    assert geodetic(Origin(0.0, 179.9999, 0.0), np.array([100.0, 0.0, 0.0]))[1] == pytest.approx(
        -179.9992017, abs=1e-6)


def test_a_pitot_feels_the_air_from_ahead_only():
    assert pitot_pressure(1.2, np.array([10.0, 5.0, 5.0])) == pytest.approx(60.0)
    assert pitot_pressure(1.2, np.array([-10.0, 0.0, 0.0])) == 0.0


def measured(snapshot, *, noise=0.0):
    sizes = {topics.SENSED_IMU: 6, topics.GPS: 3, topics.PITOT: 1, topics.BAROMETER: 1}
    errors = {topic: Errors(100.0, np.full(n, noise), np.arange(float(n)))
              for topic, n in sizes.items()}
    return dict(Instruments(errors, ORIGIN, 1, a_layout()).step(snapshot))


def test_messages_say_what_is_measured_where_and_how_sure():
    snapshot = a_snapshot(euler_deg=(0, 0, 90))
    found = measured(snapshot)
    assert {said['header']['frame_id'] for said in found.values()} == {'base_link'}
    assert {said['header']['stamp']['nanosec'] for said in found.values()} == {500_000_000}

    # Level, to the east: acceleration_B (0.4, 0.5, 0.6) less g down; biases 0..5 in FLU.
    imu = found[topics.SENSED_IMU]
    assert imu['linear_acceleration'] == pytest.approx(
        {'x': 0.4, 'y': -0.5 + 1.0, 'z': -0.6 + 9.80665 + 2.0})
    assert imu['angular_velocity'] == pytest.approx(
        {'x': 0.1 + 3.0, 'y': -0.2 + 4.0, 'z': -0.3 + 5.0})
    assert imu['orientation_covariance'][0] == -1.0 and 'orientation' not in imu

    # At 20 m east, 10 m north, 30 m up; biases 0, 1, 2 m.
    gps = found[topics.GPS]
    assert (gps['latitude'] - 47.0) * 111_165.0 == pytest.approx(11.0, rel=1e-3)
    assert (gps['longitude'] - 11.0) * 76_057.0 == pytest.approx(20.0, rel=1e-3)
    assert gps['altitude'] == pytest.approx(632.0)
    assert found[topics.PITOT]['fluid_pressure'] == pytest.approx(0.5 * 1.2 * 14.0 ** 2)
    # 30 m up: 101325 Pa less 12.01 Pa/m at sea level.
    assert found[topics.BAROMETER]['fluid_pressure'] == pytest.approx(101325.0 - 360.0, abs=1.0)

    unsure = measured(snapshot, noise=0.5)
    for key in ('linear_acceleration_covariance', 'angular_velocity_covariance'):
        assert unsure[topics.SENSED_IMU][key].reshape(3, 3) == pytest.approx(0.25 * np.eye(3))
    assert unsure[topics.GPS]['position_covariance'].reshape(3, 3) == pytest.approx(
        0.25 * np.eye(3))
    assert unsure[topics.PITOT]['variance'] == unsure[topics.BAROMETER]['variance'] == 0.25


def test_messages_of_sensors_hold_what_was_said():
    """Over the wire of either library, covariances of a fixed length included."""
    pytest.importorskip('rclpy', reason='rclpy is not installed')
    from rclpy.serialization import deserialize_message, serialize_message

    from poststall_sim.ros.messages import message, message_class
    for topic, said in measured(a_snapshot(), noise=0.5).items():
        found = deserialize_message(
            serialize_message(message(topic.type, said)), message_class(topic.type))
        assert found.header.frame_id == 'base_link'
        for key, value in said.items():
            if isinstance(value, np.ndarray):
                assert list(getattr(found, key)) == value.tolist()
            elif isinstance(value, float | int):
                assert getattr(found, key) == value
