# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
An hour of the simulator node, a stall in each minute: it ends as fast and small as it began.

As fast as it goes, in a process of its own; heard are odom and the diagnostics. What a step costs
is held against a yardstick that cannot have grown: the same aircraft begun anew again and again
in this process. So the neighbours' load, which an hour does not keep, is in both.
`make soak ARGS='-k an_hour --minutes 4'` is a quick look.
"""

import math
import time
from pathlib import Path

import load
import numpy as np
import pytest
import wings

pytest.importorskip('rclpy', reason='rclpy is not installed')

from nav_msgs.msg import Odometry
from processes import Reports, cpu_seconds, nanoseconds, resident_MB
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from poststall_sim import simulation

MINUTES, WARM_UP = 60, 2
"""Simulated minutes in all, and those of which nothing is asked but that they are flown."""
MINUTE_NS = 60_000_000_000
DT_NS = 8_000_000
TOLERANCE = 1e-4
"""Residual at which a step has converged [rad], as told to the node."""
PULL_NS = 20_000_000_000
"""In each minute the stick is back from here until the stall shows."""
STALLED = 10
"""Strips of 33 that make a stall."""
MOST_MB, MOST_SLOWER = 10.0, 1.10
"""A tenth is left to noise: what a busy machine does to one process and not to the other."""
FRESH_STEPS, EVERY_NS = 50, 6_000_000_000
"""Steps of the yardstick, and how often in a minute: what neighbours do changes in a minute."""

pytestmark = [
    pytest.mark.ros, pytest.mark.soak, pytest.mark.timeout(7200),
    pytest.mark.skipif(not Path('/proc/self/statm').exists(), reason='no /proc to read')]


class Books:
    """The solver's diagnostics, each report held against the one before."""

    def __init__(self, reports):
        self._reports = reports
        self._before = 0
        self.seen = self.stalled = self.not_converged = 0

    def check(self):
        """Look at the latest report, if there is a new one."""
        if not self._reports.heard:
            return
        time_ns = nanoseconds(self._reports.heard[-1].header.stamp)
        steps, converged, not_converged, residual, stalled = (
            self._reports.number('solver', key) for key in (
                'steps', 'converged', 'not_converged', 'residual_now', 'stalled_strips_now'))
        # Each step that time has taken is in one of two counts, for none diverged.
        assert steps * DT_NS == time_ns
        assert converged + not_converged == steps
        status = self._reports.message('solver')
        assert status == ('converged' if residual <= TOLERANCE else 'not converged')
        # The step that is shown is a new one: it must have been counted since.
        if steps > self._before and status == 'not converged':
            assert not_converged > self.not_converged
        assert self._reports.value('flight', 'paused') == 'false'
        self.seen += len(self._reports.heard)
        self._before, self.not_converged = steps, not_converged
        self.stalled = max(self.stalled, stalled)
        self._reports.heard.clear()


class Pilot:
    """Hear odom, move the stick, and count."""

    def __init__(self, probe):
        self._odoms = probe.collect(Odometry, 'odom')
        self._publisher = probe.publisher(JointState, 'autopilot/surface_cmd')
        self._trim = self._where_controls_are(probe)
        self.time_ns = self.heard = 0

    @staticmethod
    def _where_controls_are(probe):
        heard = []
        subscription = probe.node.create_subscription(
            JointState, 'joint_states', heard.append, 10)
        probe.spin_until(lambda: heard, 'joint_states')
        probe.node.destroy_subscription(subscription)
        return dict(zip(heard[-1].name, heard[-1].position))

    def fly(self, pull):
        """Look at what has come, and answer with the stick where it is to be."""
        for odom in self._odoms:
            assert all(map(math.isfinite, values(odom)))
            assert nanoseconds(odom.header.stamp) >= self.time_ns
            self.time_ns = nanoseconds(odom.header.stamp)
        if self._odoms:
            self._publisher.publish(JointState(name=['elevator', 'aileron'], position=[
                self._trim['elevator'] - 0.3 * pull, self._trim['aileron'] + 0.05 * pull]))
        self.heard += len(self._odoms)
        self._odoms.clear()


class Yardstick:
    """A flight of the same aircraft in this process, begun anew each time it is looked at."""

    def __init__(self):
        self._flight = simulation.start(
            wings.shipped_aircraft('trainer'), airspeed=12.0, altitude=2000.0, dt=DT_NS * 1e-9)

    def step_us(self):
        """Return the CPU time of one of its steps."""
        self._flight.reset(time_ns=0)
        begin = time.thread_time()
        for _ in range(FRESH_STEPS):
            self._flight.step(self._flight.trim)
        return 1e6 * (time.thread_time() - begin) / FRESH_STEPS


def values(odom):
    """Return all numbers of an odometry."""
    pose, twist = odom.pose.pose, odom.twist.twist
    return [getattr(vector, axis) for vector, axes in (
        (pose.position, 'xyz'), (pose.orientation, 'xyzw'), (twist.linear, 'xyz'),
        (twist.angular, 'xyz')) for axis in axes]


def test_an_hour_ends_as_fast_and_as_small_as_it_began(request, start, probe, capsys):
    """Memory within 10 MB and CPU time of a step within 1.1 after the warm-up; no NaN."""
    minutes = round(request.config.getoption('--minutes') or MINUTES)
    assert minutes >= WARM_UP + 2, 'there must be a first and a last minute after the warm-up'
    node = start('simulator', ros=(
        '-p', 'real_time_factor:=0.0', '-p', f'dt:={DT_NS * 1e-9}',
        '-p', f'decambering.tolerance:={TOLERANCE}', '-p', 'initial.altitude:=2000.0',
        '-p', 'rates.diagnostics:=10.0'))
    books, pilot = Books(Reports(probe)), Pilot(probe)
    began, pid, yardstick = time.monotonic(), node.process.pid, Yardstick()
    costs, fresh, minute_fresh, memory, seen = [], [], [], [], []

    def flown(begin_ns):
        stalled, passed = books.stalled > STALLED, pilot.time_ns - begin_ns
        if passed >= len(minute_fresh) * EVERY_NS:
            minute_fresh.append(yardstick.step_us())
        # Told by what is seen, not by the time: on a busy machine this process may come late.
        pilot.fly(pull=passed >= PULL_NS and not stalled)
        books.check()
        return passed >= MINUTE_NS and stalled

    for minute in range(1, minutes + 1):
        cpu, begin_ns, books.stalled = cpu_seconds(pid), pilot.time_ns, 0
        minute_fresh.clear()
        probe.spin_until(lambda begin_ns=begin_ns: flown(begin_ns), f'minute {minute}',
                         limit=600.0)
        costs.append((cpu_seconds(pid) - cpu) / (pilot.time_ns - begin_ns) * DT_NS * 1e6)
        memory.append(resident_MB(pid))
        fresh.append(np.mean(minute_fresh))
        seen.append(load.machine())
        assert probe.call(Trigger, 'trim').success
    quarter = max(1, (minutes - WARM_UP) // 4)
    first, last = (np.array([np.median(values[part]) for values in (
        np.array(costs), np.array(fresh), np.array(costs) / fresh)])
        for part in (slice(WARM_UP, WARM_UP + quarter), slice(-quarter, None)))
    with capsys.disabled():
        print(f'\n{minutes} simulated minutes in {(time.monotonic() - began) / 60.0:.1f}: CPU '
              f'time of a step {first[0]:.0f} us in the first quarter after {WARM_UP} minutes, '
              f'{last[0]:.0f} us in the last, of a fresh flight {first[1]:.0f} and {last[1]:.0f}, '
              f'so that it grew by {100.0 * (last[2] / first[2] - 1.0):.1f} % '
              f'({load.told(seen)}); memory {memory[WARM_UP]:.1f} MB, then '
              f'{min(memory[WARM_UP:]):.1f} to {max(memory[WARM_UP:]):.1f}; {pilot.heard} odom, '
              f'{books.seen} reports, {books.not_converged:.0f} steps not converged')
    assert max(memory[WARM_UP:]) - memory[WARM_UP] < MOST_MB
    assert last[2] < MOST_SLOWER * first[2]
