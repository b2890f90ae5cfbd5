# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The air of a running simulator: its parameters, the gust that is asked for, what shows."""

import math

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import Odometry
from processes import Reports, nanoseconds, send_until
from std_srvs.srv import Trigger

from poststall_sim.turbulence import Severity, intensity

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]


def test_turbulence_shear_and_a_gust_at_run_time(start, probe):
    start('simulator', ros=[
        '-p', 'start_paused:=true', '-p', 'rates.wind:=1000.0', '-p', 'rates.state:=1000.0',
        '-p', 'rates.diagnostics:=20.0', '-p', 'atmosphere.temperature_offset:=20.0',
        '-p', 'wind.turbulence.intensity:=light', '-p', 'wind.turbulence.seed:=3'])
    winds = probe.collect(Vector3Stamped, 'wind/applied', 1000)
    odoms = probe.collect(Odometry, 'odom', 1000)
    reports = Reports(probe)
    probe.spin_until(lambda: winds and odoms, 'the first state')

    def flown(steps):
        """Return the winds (steps, 3) that were met on the way, east, north, up, and the odom."""
        assert probe.set_parameter('step_count', steps).successful
        winds.clear()
        answer = probe.call(Trigger, 'step')
        assert answer.success
        time_ns = round(1e9 * float(answer.message.split()[-2]))
        probe.spin_until(lambda: winds and odoms and all(
            nanoseconds(heard[-1].header.stamp) == time_ns for heard in (winds, odoms)),
            'the last step')
        met = np.array([[w.vector.x, w.vector.y, w.vector.z] for w in winds])
        return met[-steps:], odoms[-1].pose.pose

    # The same seed, the same winds and the same flight to the last bit, after a reset as before.
    first, there = flown(60)
    assert 0.05 < np.abs(first[:, 2]).max() < 5.0 * intensity(Severity.LIGHT, 150.0)
    probe.call(Trigger, 'reset')
    second, again = flown(60)
    assert np.array_equal(first, second) and there == again
    assert probe.set_parameter('wind.turbulence.seed', 4).successful
    probe.call(Trigger, 'reset')
    assert not np.array_equal(flown(60)[0], first)

    # Calm, but for a gust of 2 m/s upwards whose greatest is 8 m ahead.
    assert probe.set_parameter('wind.turbulence.intensity', 'none').successful
    probe.call(Trigger, 'reset')
    assert not flown(5)[0].any()
    assert probe.set_parameter('wind.gust.length', 4.0).successful
    assert probe.set_parameter('wind.gust.distance', 4.0).successful
    answer = probe.call(Trigger, 'gust')
    assert answer.success and '0, 0, 2 m/s east, north, up, 4 m long, 4 m ahead' in answer.message
    met, _ = flown(120)
    assert met[:20].max() == 0.0 and met[:, 2].max() == pytest.approx(2.0, abs=0.02)
    assert np.abs(met[:, :2]).max() == 0.0
    probe.call(Trigger, 'reset')
    assert not flown(120)[0].any()   # a flight that begins again does not meet it

    # 3 m/s at 6.1 m and sheared by (h / 6.1 m)^0.143 to 150 m.
    assert probe.set_parameter('wind.velocity', [3.0, 0.0, 0.0]).successful
    assert probe.set_parameter('wind.shear.law', 'power').successful
    probe.call(Trigger, 'reset')
    assert flown(1)[0][0, 0] == pytest.approx(3.0 * (150.0 / 6.096) ** 0.143, rel=1e-3)

    assert not probe.set_parameter('wind.shear.law', 'linear').successful
    assert not probe.set_parameter('wind.turbulence.intensity', 'rough').successful
    assert not probe.set_parameter('atmosphere.temperature_offset', 0.0).successful   # read-only
    # 12 m/s where sound goes at sqrt(1.4 287.05 (287.2 + 20)) = 351.3 m/s.
    assert reports.number('flight', 'mach') == pytest.approx(12.0 / 351.3, rel=0.05)
    assert reports.value('flight', 'outside_the_method') == ''
    assert math.isfinite(reports.number('flight', 'alpha_rad'))

    # A parameter asks for what it says, also where a message has set another wind since.
    blowing = probe.publisher(Vector3Stamped, 'wind')
    other = Vector3Stamped()
    other.vector.y = 7.0
    assert probe.set_parameter('wind.shear.law', 'none').successful
    send_until(probe, blowing, other, lambda: flown(1)[0][0, 1] == pytest.approx(7.0), 'the wind')
    assert probe.set_parameter('wind.velocity', [3.0, 0.0, 0.0]).successful
    assert flown(1)[0][0] == pytest.approx([3.0, 0.0, 0.0])
    assert probe.set_parameter('wind.velocity', [0, 0, 0]).successful   # whole numbers will do
    assert probe.set_parameter('wind.turbulence.sigma', 1).successful
    assert np.abs(flown(10)[0]).max() > 0.05


def test_a_fall_on_its_back_is_said_to_be_outside_the_method(start, probe):
    """At 100 deg to the flight path the diagnostics warn, and the flight goes on."""
    start('simulator', ros=['-p', 'start_paused:=true', '-p', 'rates.diagnostics:=20.0'])
    reports = Reports(probe)
    state = probe.publisher(Odometry, 'set_state')
    message = Odometry()
    message.header.frame_id, message.child_frame_id = 'map', 'base_link'
    message.pose.pose.position.z = 500.0
    message.pose.pose.orientation.w = 1.0
    message.twist.twist.linear.x, message.twist.twist.linear.z = -2.0, -11.0

    def warned():
        state.publish(message)
        return 'alpha 1' in (reports.value('flight', 'outside_the_method') or '')
    probe.spin_until(warned, 'the warning')
    reports.wait_for('flight', 'outside_the_method', 'alpha 100 deg, beyond 40')
    assert reports.level('flight') == 1
    assert reports.message('flight') == 'outside the method: alpha 100 deg, beyond 40'
