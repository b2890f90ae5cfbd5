# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Real processes over real DDS for the node tests: start, watch, stop, talk to them."""

import itertools
import os
import random
import resource
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

LIMIT = 120.0
"""How long anything may take before a test gives up [s]; compiling for the first time does."""
PARTICIPANTS = 10
"""Processes of one domain whose ports are looked at."""


def free_domain():
    """Return a ROS domain id in which nobody on this machine talks yet, nor is about to."""
    # Each process that tests run in has domains of its own: between a look and the first word
    # another would find the same one free.
    number = int(os.environ.get('PYTEST_XDIST_WORKER', 'gw0')[2:])
    count = int(os.environ.get('PYTEST_XDIST_WORKER_COUNT', '1'))
    own = range(1 + number, 101, count)
    for domain in random.sample(own, len(own)):
        try:
            # Of whom a run that was killed has left behind, the first may be gone.
            for participant in range(PARTICIPANTS):
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as trial:
                    trial.bind(('', 7400 + 250 * domain + 10 + 2 * participant))
        except OSError:
            continue
        return domain
    raise RuntimeError('no free ROS domain')


def environment(domain):
    """Return the environment of a process in a domain of its own, on this machine only."""
    return {**os.environ, 'ROS_DOMAIN_ID': str(domain),
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}


def cpu_seconds(pid):
    """Return the CPU time that a process has had, all its threads together [s]."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def resident_MB(pid='self'):
    """Return the memory that a process holds now."""
    statm = Path(f'/proc/{pid}/statm').read_text()
    return int(statm.split()[1]) * resource.getpagesize() / 1e6


class Running:
    """A node of ours, or a script, as a process; its output goes to a file."""

    def __init__(self, node, *arguments, domain, log):
        self.log = log
        what = [str(node)] if isinstance(node, Path) else ['-m', f'poststall_sim.ros.{node}']
        with open(log, 'wb') as output:
            self.process = subprocess.Popen(
                [sys.executable, *what, *arguments], env=environment(domain),
                stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
                start_new_session=True)

    def says(self):
        return self.log.read_text(errors='replace')

    def wait_for(self, text):
        """Wait until the output holds a text."""
        end = time.monotonic() + LIMIT
        while text not in self.says():
            assert self.process.poll() is None, f'ended without {text!r}:\n{self.says()}'
            assert time.monotonic() < end, f'no {text!r} in {LIMIT:g} s:\n{self.says()}'
            time.sleep(0.02)

    def send(self, number):
        self.process.send_signal(number)

    def ended(self, limit=20.0):
        """Wait for the end and return the exit code."""
        try:
            return self.process.wait(limit)
        except subprocess.TimeoutExpired:
            raise AssertionError(f'still running after {limit:g} s:\n{self.says()}') from None

    def kill(self):
        """End the process; killed, it would leave shared memory that slows discovery later on."""
        for number in (signal.SIGINT, signal.SIGKILL):
            if self.process.poll() is None:
                self.process.send_signal(number)
                try:
                    self.process.wait(5.0)
                except subprocess.TimeoutExpired:
                    continue


def starter(folder):
    """Yield a function that starts nodes in one domain; what still runs at the end is killed."""
    domain, running = free_domain(), []

    def start(node, *arguments, ros=()):
        if ros:
            arguments += ('--ros-args', *ros)
        name = node.stem if isinstance(node, Path) else node
        running.append(Running(
            node, *arguments, domain=domain, log=folder / f'{name}{len(running)}.log'))
        return running[-1]

    start.domain = domain
    try:
        yield start
    finally:   # also where whoever asked for it has had enough, or met an exception
        for process in running:
            process.kill()


class Probe:
    """A node in this process, in the domain of the processes under test."""

    def __init__(self, domain, namespace=''):
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
        self.context = rclpy.Context()
        self.context.init(args=[], domain_id=domain)
        self.node = rclpy.create_node('probe', context=self.context, namespace=namespace)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def spin_until(self, done, what='that', limit=LIMIT):
        """Spin until ``done`` gives something true, and return it."""
        end = time.monotonic() + limit
        while not (result := done()):
            assert time.monotonic() < end, f'waited {limit:g} s for {what}'
            self.executor.spin_once(timeout_sec=0.02)
        return result

    def collect(self, kind, topic, qos=10):
        """Return a list that the messages of a topic are appended to."""
        heard = []
        self.node.create_subscription(kind, topic, heard.append, qos)
        return heard

    def collect_with_infos(self, kind, topic, qos):
        """Return lists of the messages of a topic and of what the middleware says of each."""
        heard, infos = [], []

        def hear(message, info):
            heard.append(message)
            infos.append(info)
        self.node.create_subscription(kind, topic, hear, qos)
        return heard, infos

    def publisher(self, kind, topic):
        """Return a publisher that somebody listens to."""
        publisher = self.node.create_publisher(kind, topic, 10)
        self.spin_until(publisher.get_subscription_count, f'a listener of {topic}')
        return publisher

    def client(self, kind, service):
        """
        Return a client that gets answers.

        `service_is_ready` says that the client knows the server, not that the server knows it: the
        answer to whom it does not know yet is dropped, and who must not ask twice waits in vain.
        But of who asks it is told in order. So it is asked what may be asked twice, until it
        answers, by a client made after this one: then it knows this one as well.
        """
        from rcl_interfaces.srv import GetParameters

        client = self.node.create_client(kind, service)
        self.spin_until(client.service_is_ready, f'the service {service}')
        name = self.spin_until(lambda: self._node_of(service), f'the node that has {service}')
        younger = self.node.create_client(GetParameters, f'{name}/get_parameters')
        self.spin_until(younger.service_is_ready, f'the parameters of {name}')
        asked, again_at = [], 0.0

        def answered():
            nonlocal again_at
            if time.monotonic() >= again_at:
                asked.append(younger.call_async(GetParameters.Request()))
                again_at = time.monotonic() + 0.5
            return any(future.done() for future in asked)
        self.spin_until(answered, f'any answer of {name}')
        self.node.destroy_client(younger)
        return client

    def _node_of(self, service):
        """Return the full name of the node that has a service, None while the graph does not."""
        from rclpy.node import NodeNameNonExistentError

        service = self.node.resolve_service_name(service)
        for name, namespace in self.node.get_node_names_and_namespaces():
            try:
                offered = self.node.get_service_names_and_types_by_node(name, namespace)
            except NodeNameNonExistentError:   # it has gone meanwhile
                continue
            if service in dict(offered):
                return f'{namespace.rstrip("/")}/{name}'
        return None

    def call(self, kind, service, **request):
        """Call a service, once, and return its answer."""
        client = self.client(kind, service)
        future = client.call_async(kind.Request(**request))
        self.spin_until(future.done, f'an answer of {service}')
        self.node.destroy_client(client)
        return future.result()

    def set_parameter(self, name, value, node='/simulator'):
        """Ask a node for another value of a parameter and return what it says."""
        from rcl_interfaces.srv import SetParameters
        from rclpy.parameter import Parameter

        return self.call(SetParameters, f'{node}/set_parameters', parameters=[
            Parameter(name, value=value).to_parameter_msg()]).results[0]

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()


def nanoseconds(stamp):
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def send_until(probe, publisher, message, done, what):
    """Repeat a command, as an autopilot does, until something shows; best effort may lose one."""
    def again():
        publisher.publish(message)
        return done()
    return probe.spin_until(again, what)


def owed(infos, depth=10):
    """
    Return the numbers of the publications that a reliable topic owed its subscriber for ever.

    Reliable with a history of 10 is a promise of each message until 10 newer ones have been
    published. So one may be missing only where that happened before the subscriber, kept from
    running, received what came next. infos : what rclpy says of each message that came, by one
    publisher, to a subscription deeper than what it is behind by.
    """
    published = {info['publication_sequence_number']: info['source_timestamp'] for info in infos}
    missing = []
    for before, after in itertools.pairwise(infos):
        first, last = (info['publication_sequence_number'] for info in (before, after))
        for number in range(first + 1, last):
            pushed_out = number + depth < last or published.get(
                number + depth, after['received_timestamp'] + 1) <= after['received_timestamp']
            if not pushed_out:
                missing.append(number)
    return missing


class Reports:
    """The diagnostics of a node, and waiting for what they say."""

    def __init__(self, probe, node='simulator'):
        from diagnostic_msgs.msg import DiagnosticArray

        self.probe = probe
        self.node = node
        self.heard = []
        self._published = []
        probe.node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, 10)

    def _hear(self, message, info):
        """Keep what is this node's: others report on the same topic."""
        if any(status.name.startswith(f'{self.node}: ') for status in message.status):
            self.heard.append(message)
            self._published.append((info['source_timestamp'], message))

    def since(self, time_ns):
        """Return how many were published, and not only read, after a wall time [ns]."""
        return sum(published > time_ns for published, _ in self._published)

    def history(self, *wanted):
        """Return of each report the wall time of its publication [s] and numbers, (name, key)."""
        return [(published * 1e-9, *(float(self._value(message, *each)) for each in wanted))
                for published, message in self._published]

    def _find(self, message, name):
        return next(s for s in message.status if s.name == f'{self.node}: {name}')

    def _value(self, message, name, key):
        return next(item.value for item in self._find(message, name).values if item.key == key)

    def _status(self, name):
        self.probe.spin_until(lambda: self.heard, 'diagnostics')
        return self._find(self.heard[-1], name)

    def level(self, name):
        return self._status(name).level[0]

    def message(self, name):
        return self._status(name).message

    def keys(self, name):
        return {item.key for item in self._status(name).values}

    def value(self, name, key):
        return next(item.value for item in self._status(name).values if item.key == key)

    def number(self, name, key):
        return float(self.value(name, key))

    def wait_for(self, name, key, value):
        self.probe.spin_until(lambda: self.value(name, key) == value, f'{name} {key} {value}')


def send_sparingly(reports, publisher, message, done, what):
    """Send what must not come twice: again only after three reports on nothing having happened."""
    def again():
        publisher.publish(message)
        sent_ns = time.time_ns()
        reports.probe.spin_until(
            lambda: done() or reports.since(sent_ns) > 3, f'{what}, or diagnostics')
        return done()
    return reports.probe.spin_until(again, what)


def arrives(reports, publisher, message):
    """Send a command that must not come twice until it counts; discovery may swallow the first."""
    before = reports.number('commands', 'accepted')
    send_sparingly(reports, publisher, message,
                   lambda: reports.number('commands', 'accepted') > before, 'its count')
    assert reports.number('commands', 'accepted') == before + 1
