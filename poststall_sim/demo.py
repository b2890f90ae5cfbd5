# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The demonstration: a flight through the stall over DDS, recorded, read back and drawn.

    python -m poststall_sim.demo [--seconds N] [--output DIR] [--rate F]

Simulator, pilot and recorder are processes that meet on loopback in a ROS domain of their own;
all that is told and drawn at the end comes from the bag.
"""

import argparse
import json
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim import definition, jobs, plots, recording, simulation, topics
from poststall_sim import option_values as values
from poststall_sim.aero.model import Settings
from poststall_sim.aircraft import Aircraft, ConfigError
from poststall_sim.definition import Kind
from poststall_sim.plots.bag import FlightData, flight_data
from poststall_sim.scenario import Scenario
from poststall_sim.threads import one_blas_thread

START_LIMIT = 240.0
"""How long the processes may take to be ready, compiling on a slow machine included [s]."""
STALL_LIMIT = 30.0
"""How long simulated time may stand still in flight [s]."""
STOP_LIMIT = 20.0
"""How long a process may take to stop [s]."""


class DemoError(Exception):
    """Why the demonstration cannot go on, and the ``child`` whose output may say more."""

    def __init__(self, text: str, child: 'Child | None' = None) -> None:
        super().__init__(text)
        self.child = child


class Child:
    """A process of the demonstration, its output in a file."""

    def __init__(self, name: str, command: list[str], log: Path, env: dict[str, str]) -> None:
        self.name = name
        self.log = log
        with open(log, 'wb') as output:
            # In a session of its own: Ctrl-C reaches us, and we stop the children in order.
            self.process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
                env=env, start_new_session=True)

    def says(self) -> str:
        """Return the output so far."""
        return self.log.read_text(errors='replace')

    def require_alive(self) -> None:
        """Raise `DemoError` if the process has ended."""
        if self.process.poll() is not None:
            raise DemoError(f'the {self.name} ended early with exit code '
                            f'{self.process.returncode}', self)

    def stop(self) -> int:
        """Ask the process to end as Ctrl-C would, insist in the end; return its exit code."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            if self.process.poll() is None:
                self.process.send_signal(number)
                try:
                    self.process.wait(STOP_LIMIT)
                except subprocess.TimeoutExpired:
                    continue
        return self.process.wait()


def free_domain() -> int:
    """Return a ROS domain id in which nobody on this machine talks."""
    for domain in random.sample(range(1, 101), 100):
        try:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as trial:
                trial.bind(('', 7400 + 250 * domain + 10))   # its first participant's port
        except OSError:
            continue
        return domain
    raise DemoError('no free ROS domain on this machine')


def ros2_environment(env: dict[str, str]) -> dict[str, str]:
    """Return the environment in which a ``ros2`` on the PATH runs, as it was when sourced."""
    env = dict(env)
    for name in ('PYTHONPATH', 'LD_LIBRARY_PATH', 'AMENT_PREFIX_PATH'):
        if env.get(f'SOURCED_{name}'):
            env[name] = env[f'SOURCED_{name}']
    return env


def has_ros2_bag(env: dict[str, str]) -> bool:
    """Tell whether ``ros2 bag record`` is there, works and writes MCAP."""
    if shutil.which('ros2') is None:
        return False
    try:
        answer = subprocess.run(['ros2', 'bag', 'record', '--help'], env=ros2_environment(env),
                                timeout=60, stdin=subprocess.DEVNULL, capture_output=True)
    except (OSError, subprocess.TimeoutExpired):
        return False
    return answer.returncode == 0 and b'mcap' in answer.stdout


class Observer:
    """Our own eyes in the ROS graph: simulated time, diagnostics, who listens, the pause."""

    def __init__(self) -> None:
        import rclpy
        from rclpy.signals import SignalHandlerOptions

        from poststall_sim.ros import messages

        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        self._rclpy = rclpy
        self._node = rclpy.create_node('demo')
        self.time: float | None = None
        self.diagnostics: dict[str, dict[str, str]] = {}
        self.reports = 0
        for topic, heard in ((topics.CLOCK, self._on_clock),
                             (topics.DIAGNOSTICS, self._on_diagnostics)):
            self._node.create_subscription(
                messages.message_class(topic.type), topic.name, heard,
                messages.qos_profile(topic.qos))

    def _on_clock(self, message: Any) -> None:
        self.time = message.clock.sec + 1e-9 * message.clock.nanosec

    def _on_diagnostics(self, message: Any) -> None:
        self.reports += 1
        for status in message.status:
            self.diagnostics[status.name] = {item.key: item.value for item in status.values}

    @property
    def paused_reason(self) -> str:
        """Why the flight does not go on, empty if it does."""
        return self.diagnostics.get('simulator: flight', {}).get('paused_reason', '')

    def recorded_by(self, node_name: str) -> bool:
        """Tell whether a node subscribes to all that the simulator publishes."""
        from poststall_sim.ros import messages

        return all(
            any(info.node_name == node_name
                for info in self._node.get_subscriptions_info_by_topic(topic.name))
            for topic in topics.PUBLISHED if topic.by_default
            and topic.everywhere and messages.available(topic.type))

    def wait(self, what: str, done: Callable[[], bool], children: list[Child],
             limit: float) -> None:
        """Spin until ``done``; raise `DemoError` when a child ends or the limit [s] passes."""
        end = time.monotonic() + limit
        while not done():
            for child in children:
                child.require_alive()
            if time.monotonic() > end:
                raise DemoError(f'waited {limit:g} s for {what}', children[-1])
            self._rclpy.spin_once(self._node, timeout_sec=0.05)

    def pause(self, paused: bool, children: list[Child]) -> None:
        """Pause the simulator or let it fly, and wait for its answer."""
        from std_srvs.srv import SetBool

        client = self._node.create_client(SetBool, 'pause')
        self.wait('the pause service', client.service_is_ready, children, START_LIMIT)
        answer = client.call_async(SetBool.Request(data=paused))
        self.wait('the answer of the pause service', answer.done, children, START_LIMIT)
        if not answer.result().success:
            raise DemoError(f'the simulator does not fly: {answer.result().message}', children[0])

    def close(self) -> None:
        """Leave the graph."""
        self._node.destroy_node()
        self._rclpy.try_shutdown()


@contextmanager
def progress_bar(total: float, what: str = 'flying') -> Iterator[Callable[[float], None]]:
    """Show a bar of simulated seconds, if tqdm is there."""
    try:
        from tqdm import tqdm
    except ImportError:
        yield lambda now: None
        return
    with tqdm(total=round(total, 1), unit='s', desc=what, mininterval=0.5,
              bar_format='{desc} {percentage:3.0f}%|{bar}| {n:.1f}/{total:.1f} s of simulated '
                         'time [{elapsed}<{remaining}]') as bar:
        def show(now: float) -> None:
            bar.update(min(now, total) - bar.n)
        yield show


def _seconds(options: argparse.Namespace, scenario: Scenario) -> float:
    """Return how much of the scenario is flown [s]."""
    return min(options.seconds or scenario.duration, scenario.duration)


def fly(options: argparse.Namespace, bag: Path) -> None:
    """Fly the scenario over DDS and record it; raise `DemoError` if anything fails."""
    scenario = definition.scenario(definition.find(Kind.SCENARIO, options.scenario))
    seconds = _seconds(options, scenario)
    env = {**os.environ, 'ROS_DOMAIN_ID': str(free_domain()),
           'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST', 'PYTHONUNBUFFERED': '1'}
    os.environ.update(env)
    python = [sys.executable, '-m']
    children: list[Child] = []

    def start(name: str, command: list[str], child_env: dict[str, str] = env) -> Child:
        children.append(Child(name, command, options.output / f'{name}.log', child_env))
        return children[-1]

    observer = Observer()
    try:
        print('starting simulator, recorder and pilot (the first start compiles, up to a minute)')
        simulator = start('simulator', [
            *python, 'poststall_sim.ros.simulator', '--ros-args',
            '-p', f'aircraft:={options.aircraft}', '-p', 'start_paused:=true',
            '-p', f'real_time_factor:={options.rate:.6f}', '-p', 'rates.diagnostics:=2.0',
            '-p', f'initial.airspeed:={scenario.airspeed:.9f}',
            '-p', f'initial.altitude:={scenario.altitude:.9f}'])
        foreign = has_ros2_bag(env)
        if foreign:   # not --use-sim-time: it would wait for a simulated time above 0
            recorder = start('recorder', [
                'ros2', 'bag', 'record', '--all', '--storage', 'mcap',
                '--storage-preset-profile', 'zstd_fast', '--output', str(bag)],
                ros2_environment(env))
        else:
            recorder = start('recorder', [
                *python, 'poststall_sim.ros.recorder', '--output', str(bag)])
        pilot = start('pilot', [
            *python, 'poststall_sim.ros.pilot', '--ros-args',
            '-p', f'scenario:={options.scenario}', '-p', 'unpause:=false',
            '-p', 'exit_when_done:=true'])
        observer.wait('the simulator', lambda: observer.time is not None, children, START_LIMIT)
        observer.wait(
            'the recorder', lambda: (observer.recorded_by('rosbag2_recorder') if foreign
                                     else ' ready: ' in recorder.says()), children, START_LIMIT)
        observer.wait('the pilot', lambda: 'scenario begins' in pilot.says(), children,
                      START_LIMIT)
        observer.pause(False, children)

        with progress_bar(seconds) as show:
            while pilot.process.poll() is None and observer.time < seconds:
                observer.wait('time to pass', lambda before=observer.time: (
                    observer.time != before or observer.paused_reason),
                    [recorder, simulator], STALL_LIMIT)
                show(observer.time)
                if observer.paused_reason:
                    raise DemoError(f'the flight ended at {observer.time:.2f} s of {seconds:g} '
                                    f's: {observer.paused_reason}', simulator)
            show(min(observer.time, seconds))
        if pilot.stop() != 0:
            raise DemoError(f'the pilot ended with exit code {pilot.process.returncode}', pilot)
        observer.pause(True, [simulator, recorder])
        reports = observer.reports
        observer.wait('the last diagnostics', lambda: observer.reports > reports + 1,
                      [simulator, recorder], STOP_LIMIT)
        for child in (recorder, simulator):
            if child.stop() != 0:
                raise DemoError(f'the {child.name} ended with exit code '
                                f'{child.process.returncode}', child)
    finally:
        observer.close()
        for child in reversed(children):
            child.stop()


def what_happened(flight: FlightData) -> dict[str, Any]:
    """Return what a recorded flight did, in numbers: the stall, the loss of lift, the end."""
    strips = flight.strips
    worst = strips.deepest() or 0
    deepest = int(np.argmax(flight.alpha))
    best = int(np.argmax(flight.lift[:deepest + 1]))
    least = best + int(np.argmin(flight.lift[best:deepest + 1]))
    altitude = flight.position[:, 2]
    return {
        'wing_strips': strips.wing.stop - strips.wing.start,
        'wing_strips_stalled_most': int(strips.stalled[worst, strips.wing].sum()),
        'time_of_most_s': float(strips.time[worst]),
        'alpha_max_deg': float(np.degrees(flight.alpha[deepest])),
        'time_of_alpha_max_s': float(flight.time[deepest]),
        'cl_max': float(flight.lift[best]),
        'cl_after': float(flight.lift[least]),
        'cl_fall': float(1.0 - flight.lift[least] / flight.lift[best]),
        'altitude_lost_m': float((np.maximum.accumulate(altitude) - altitude).max()),
        'strips_stalled_at_end': int(strips.stalled[-1].sum())}


def summary(bag: Path, aircraft: Aircraft) -> dict[str, Any]:
    """Return how the simulator did and what the flight was, all from the bag."""
    reports = recording.read(bag)['/diagnostics'].diagnostics()
    pace = {key: float(reports['simulator: pace'][key]) for key in (
        'real_time_factor_asked', 'real_time_factor', 'steps', 'late_ticks', 'lag_max_ms',
        'lost_time_s', 'headroom')}
    solver = {key: float(reports['simulator: solver'][key]) for key in (
        'iterations_mean', 'iterations_max', 'residual_max', 'not_converged')}
    return {**pace, **solver, 'late_share': pace['late_ticks'] / max(pace['steps'], 1.0),
            'flight': what_happened(flight_data(bag, aircraft)), 'bag': str(bag)}


def tell(facts: dict[str, Any], bag: Path, figures: list[Path]) -> None:
    """Print the summary."""
    flight, left = facts['flight'], facts['flight']['strips_stalled_at_end']
    rows = [
        ('real-time factor', f'{facts["real_time_factor"]:.3f} (asked: '
         f'{facts["real_time_factor_asked"]:g})'),
        ('steps', f'{facts["steps"]:.0f}; late {facts["late_ticks"]:.0f} '
         f'({100 * facts["late_share"]:.2f} %), largest lag {facts["lag_max_ms"]:.1f} ms, '
         f'lost {facts["lost_time_s"]:g} s'),
        ('headroom', f'{facts["headroom"]:.1f} s of simulated time per second of computing'),
        ('iterations', f'mean {facts["iterations_mean"]:.2f}, max {facts["iterations_max"]:.0f}; '
         f'steps not converged: {facts["not_converged"]:.0f}'),
        ('largest residual', f'{facts["residual_max"]:.2g}'),
        ('flight', f'{flight["wing_strips_stalled_most"]} of {flight["wing_strips"]} wing strips '
         f'stalled at most, at {flight["time_of_most_s"]:.1f} s; CL fell by '
         f'{100 * flight["cl_fall"]:.0f} % ({flight["cl_max"]:.2f} to {flight["cl_after"]:.2f}) '
         f'while alpha rose to {flight["alpha_max_deg"]:.0f} deg; '
         f'{flight["altitude_lost_m"]:.0f} m lost; '
         f'{f"{left} strips still stalled" if left else "all strips attached"} at the end'),
        ('bag', bag), *(('figure', figure) for figure in figures)]
    for name, text in rows:
        print(f'{name:17} {text}')


def compare(options: argparse.Namespace, aircraft: Aircraft, bag: Path) -> dict[str, Any]:
    """Fly the scenario once more with attached flow at any angle, without ROS; record it."""
    scenario = definition.scenario(definition.find(Kind.SCENARIO, options.scenario))
    flight = simulation.start(aircraft, Settings(decambering=False),
                              airspeed=scenario.airspeed, altitude=scenario.altitude)
    seconds = _seconds(options, scenario)
    with recording.FlightRecorder(bag, flight, scenario.name) as recorder, \
            progress_bar(seconds, 'flying with attached flow') as show:
        for snapshot in jobs.fly(flight, scenario, seconds, recorder):
            show(snapshot.time)
    return {**what_happened(flight_data(bag, aircraft)), 'bag': str(bag)}


def main(args: list[str] | None = None) -> int:
    """Fly, record, read back, draw and tell; return the exit code."""
    parser = argparse.ArgumentParser(prog='demo', description=__doc__.strip().split('\n')[0])
    parser.add_argument('--aircraft', default='trainer', help='name or file')
    parser.add_argument('--scenario', default='stall_and_recovery', help='name or file')
    parser.add_argument('--seconds', type=values.positive, metavar='N',
                        help='end after N simulated seconds (default: the whole scenario)')
    parser.add_argument('--output', type=Path, default=Path('demo_output'), metavar='DIR')
    parser.add_argument('--rate', type=float, default=1.0, metavar='F',
                        help='real-time factor, 0 = as fast as possible (default: 1)')
    parser.add_argument('--no-compare', dest='compare', action='store_false',
                        help='leave out the same flight with decambering switched off')
    options = parser.parse_args(args)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    one_blas_thread()
    try:
        aircraft = definition.aircraft(definition.find(Kind.AIRCRAFT, options.aircraft))
        options.output.mkdir(parents=True, exist_ok=True)
        bag = recording.free_path(options.output / 'bag')
        fly(options, bag)
        facts = summary(bag, aircraft)
        figures = plots.flight_figures(bag, options.output)
        facts['figures'] = [str(figure) for figure in figures]
        tell(facts, bag, figures)
        if options.compare:
            other = recording.free_path(options.output / 'bag_attached_flow')
            facts['attached_flow'] = without = compare(options, aircraft, other)
            print(f'{"attached flow":17} CL fell by {100 * without["cl_fall"]:.0f} % while alpha '
                  f'rose to {without["alpha_max_deg"]:.0f} deg; bag {other}')
        (options.output / 'summary.json').write_text(json.dumps(facts, indent=2) + '\n')
    except KeyboardInterrupt:
        print('stopped', file=sys.stderr)
        return 130
    except (DemoError, ConfigError, recording.BagError, ImportError, OSError) as error:
        print(f'the demo failed: {error}', file=sys.stderr)
        child = getattr(error, 'child', None)
        if child is not None:
            print(f'the last lines of the {child.name} ({child.log}):', file=sys.stderr)
            print('\n'.join(f'  {line}' for line in child.says().splitlines()[-15:]),
                  file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
