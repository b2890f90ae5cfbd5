# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What it costs in real-time factor to publish everything at every step.

Three simulators as fast as they can go, in turns, each heard by a process of its own that does
nothing else: one as it comes; one with every rate at 1/dt, the axes of aviation and all sensors
too; one that also draws its views, markers and path, at every step, which nobody looks at so
often. Simulated time over the CPU time of the simulator, the median of `ROUNDS` turns each: what
the real-time factor is on a core that is free for it. Asserted is that everything but the views
is flown in real time with a margin, and the views too; how much slower that is than as it comes
is printed beside it, and the factor by the wall clock, which neighbours share.

The factors are printed, and written to `results/full_rates.json`, with the machine's load.
"""

import time
from pathlib import Path

import load
import numpy as np
import pytest
from report import holds, keep

pytest.importorskip('rclpy', reason='rclpy is not installed')

from processes import Reports, cpu_seconds, nanoseconds
from std_srvs.srv import SetBool, Trigger

from poststall_sim import topics

LISTENER = Path(__file__).resolve().parent / 'listener.py'
DT_NS = 8_000_000
"""What the trainer flies with by itself at the airspeed it starts with."""
ROUNDS, SECONDS = 5, 3.0
AS_IT_COMES, EVERY_STEP, VIEWS = (
    'as it comes', 'everything at every step', 'the views at every step too')
ASKED = {EVERY_STEP: ('>=', 2.0), VIEWS: ('>=', 1.0)}
RATES = {topic.rate.parameter: 1e9 / DT_NS for topic in topics.PUBLISHED
         if topic.rate not in (topics.Rate.ONCE, topics.Rate.DIAGNOSTICS)}
SELDOM = ('rates.views', 'rates.path')

pytestmark = [pytest.mark.ros, pytest.mark.timeout(600)]


class Flown:
    """A simulator that goes as fast as it can unless it is paused, and who listens to it."""

    def __init__(self, opened, rates):
        start, self._probe = opened
        self._node = start('simulator', ros=(
            '-p', 'real_time_factor:=0.0', '-p', 'start_paused:=true',
            '-p', f'dt:={DT_NS * 1e-9}', '-p', 'initial.altitude:=2000.0',
            '-p', 'rates.diagnostics:=20.0', *(
                part for name, rate in rates.items() for part in ('-p', f'{name}:={rate}'))))
        self._node.wait_for('ready')
        start(LISTENER).wait_for('listens')
        self._reports = Reports(self._probe)
        self._probe.spin_until(lambda: self._probe.node.count_subscribers('/odom'), 'a listener')

    def factors(self):
        """Fly on from the start for a while; return simulated over CPU and over wall time."""
        assert self._probe.call(Trigger, 'reset').success
        assert self._probe.call(SetBool, 'pause', data=False).success
        before, end = self._report(), time.monotonic() + SECONDS
        self._probe.spin_until(lambda: time.monotonic() > end)
        flown, cpu, wall = np.subtract(self._report(), before)
        assert self._probe.call(SetBool, 'pause', data=True).success
        return flown / cpu, flown / wall

    def _report(self):
        """Wait for a report; return its simulated time, CPU time so far and now [s]."""
        self._reports.heard.clear()
        self._probe.spin_until(lambda: self._reports.heard, 'a report')
        return (1e-9 * nanoseconds(self._reports.heard[-1].header.stamp),
                cpu_seconds(self._node.process.pid), time.monotonic())


def test_everything_at_every_step_is_flown_in_real_time(graph, capsys):
    fleet = {name: Flown(graph(name.replace(' ', '_')), rates) for name, rates in (
        (AS_IT_COMES, {}),
        (EVERY_STEP, {name: rate for name, rate in RATES.items() if name not in SELDOM}),
        (VIEWS, RATES))}
    rounds, seen = {name: [] for name in fleet}, []
    for _ in range(ROUNDS):
        seen.append(load.machine())
        for name, one in fleet.items():
            rounds[name].append(one.factors())
    medians = {name: np.median(found, axis=0).tolist() for name, found in rounds.items()}
    with capsys.disabled():
        print(f'\nreal-time factor, by CPU time and by the clock ({load.told(seen)})')
        for name, (by_cpu, by_clock) in medians.items():
            verdict = (f', asked {" ".join(map(str, ASKED[name]))}: '
                       + ('ok' if holds(ASKED[name], by_cpu) else 'NOT') if name in ASKED else '')
            print(f'{name:>30}{by_cpu:7.2f}{by_clock:7.2f}{verdict}')
    keep('full_rates', ASKED, factors=rounds, medians=medians, loads=seen)
    for name, asked in ASKED.items():
        assert holds(asked, medians[name][0]), name
