# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
How long from a command that is published to the joint_states that show it.

The simulator in real time, every state published (rates.state = 1/dt), the trainer's controls
without lag; dt as it flies with by itself, and shorter. Commands come at random moments of a
step, from a process that does nothing else. Wall clock; asked are two steps and 3 ms in
the median: a command waits half a step on average for the next, and its state comes at the
end of that one.

The steps take turns, `ROUNDS` of them, and the median of a step is that of its rounds' medians: a
neighbour who comes and goes spoils a round, not all. One who stays spoils them: what the machine
was like is printed beside the clocks, and written to `results/latency.json` with them.
"""

import random
import time

import load
import numpy as np
import pytest
from report import holds, keep

pytest.importorskip('rclpy', reason='rclpy is not installed')

from processes import send_until
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool

STEPS_MS = (8.0, 5.0, 4.0)
ROUNDS, COMMANDS = 5, 60
MARGIN_MS = 3.0
ASKED = {f'median, dt {dt:g} ms [ms]': ('<=', 2.0 * dt + MARGIN_MS) for dt in STEPS_MS}
SWING = 0.01
"""The elevator goes so far from trim [rad], to and fro: the flight stays where it is."""

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]


def latencies(probe):
    """Return the latency of each command of a round [ms]."""
    heard = []
    subscription = probe.node.create_subscription(JointState, 'joint_states', heard.append, 10)
    probe.spin_until(lambda: heard, 'joint_states')
    publisher = probe.publisher(JointState, 'autopilot/surface_cmd')
    trim = dict(zip(heard[-1].name, heard[-1].position))['elevator']

    def shown(position):
        latest = heard[-1]
        return latest.position[list(latest.name).index('elevator')] == position

    send_until(probe, publisher, JointState(name=['elevator'], position=[trim + SWING]),
               lambda: shown(trim + SWING), 'the first command')
    taken = np.empty(COMMANDS)
    for k in range(COMMANDS):
        until = time.monotonic() + random.uniform(0.0, 0.02)
        probe.spin_until(lambda until=until: time.monotonic() > until)
        position = trim + SWING * (-1.0 if k % 2 == 0 else 1.0)
        command = JointState(name=['elevator'], position=[position])
        begin = time.perf_counter()
        publisher.publish(command)
        probe.spin_until(lambda position=position: shown(position), 'the command', limit=5.0)
        taken[k] = 1e3 * (time.perf_counter() - begin)
        heard[:] = heard[-1:]
    probe.node.destroy_subscription(subscription)
    probe.node.destroy_publisher(publisher)
    return taken


def test_latency_from_a_command_to_the_deflection(graph, capsys):
    probes, rounds, seen = {}, {key: [] for key in ASKED}, []
    for dt, key in zip(STEPS_MS, ASKED):
        start, probes[key] = graph(f'dt_{dt:g}')
        start('simulator', ros=('-p', 'start_paused:=true', '-p', f'dt:={1e-3 * dt}',
                                '-p', f'rates.state:={1e3 / dt}')).wait_for('ready')
    for _ in range(ROUNDS):
        seen.append(load.machine())
        for key, probe in probes.items():
            assert probe.call(SetBool, 'pause', data=False).success
            rounds[key].append(latencies(probe))
            assert probe.call(SetBool, 'pause', data=True).success
    measured = {key: {
        'median': float(np.median([np.median(taken) for taken in found])),
        **{name: float(np.percentile(np.concatenate(found), share))
           for name, share in (('p10', 10), ('p95', 95), ('max', 100))}}
        for key, found in rounds.items()}
    with capsys.disabled():
        print(f'\ncommand to deflection ({load.told(seen)})')
        for key, asked in ASKED.items():
            print(f'{key} ' + ', '.join(
                f'{name} {value:.1f}' for name, value in measured[key].items())
                + f'; asked {asked[0]} {asked[1]:g}: '
                + ('ok' if holds(asked, measured[key]['median']) else 'NOT'))
    keep('latency', ASKED, commands=ROUNDS * COMMANDS, milliseconds=measured, loads=seen)
    for key, asked in ASKED.items():
        assert holds(asked, measured[key]['median']), key
