# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The node behind the live page: hears one simulator's public topics, and commands as a pilot."""

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import GetParameters
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.exceptions import InvalidNamespaceException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.validate_namespace import validate_namespace
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger

from poststall_sim import definition, inlets, topics
from poststall_sim.aircraft import Aircraft, ConfigError
from poststall_sim.ros import messages, process
from poststall_sim.watch import scene as scenes
from poststall_sim.watch.scene import Scene

LOOK_PERIOD = 0.5
"""How often to look whether the simulator is there [s of wall time]."""

DRAWN = {'body': 'shape', 'strips': 'shape', 'controls': 'moving', 'lift': 'moving'}
"""The markers that the page draws: those that stay, and those that move, in base_link."""

_TOPICS = {topic.name: topic for topic in topics.PUBLISHED}
_NUMBERS = {'air_data/airspeed': 'airspeed', 'air_data/alpha': 'alpha', 'air_data/beta': 'beta',
            'air_data/load_factor': 'load_factor'}
_STRIPS = {'strip_cl': 'cl', 'strip_stalled': 'stalled'}
_PLACES = ('strip_y', 'strip_cl_max')


class WatchNode(Node):
    """
    Hear the simulator of one namespace and put what it says into a scene.

    Limits of the controls and names of the strips are in no topic: the simulator is asked for the
    parameters that say which aircraft it flies. An aircraft that is not known here is watched as
    any other; it can be flown where it is given.

    aircraft : whose controls they are, instead of the one that the simulator names.
    """

    def __init__(self, namespace: str, aircraft: Aircraft | None, **node_options: Any) -> None:
        super().__init__('watch', namespace=namespace, **node_options)
        self.scene = Scene(self.get_namespace())
        self._aircraft = aircraft
        self._places: dict[str, list[float]] = {}
        self._names: list[str] = []   # of the strips; they and their places come in any order
        self._known: tuple[str, str] | None = None   # node and aircraft that were asked about
        self._time_ns = 0
        self._odom = self._listen('odom', self._on_odom)
        for name, key in _NUMBERS.items():
            self._listen(name, lambda message, key=key: self.scene.values(**{key: message.data}))
        for name, key in (('joint_states', 'controls'), ('joint_targets', 'targets')):
            self._listen(name, lambda message, key=key: self.scene.values(
                **{key: dict(zip(message.name, message.position))}))
        for name, key in _STRIPS.items():
            self._listen(name, lambda message, key=key: self.scene.values(
                **{key: list(message.data)}))
        for name in _PLACES:
            self._listen(name, lambda message, name=name: self._on_place(name, message))
        self._listen('markers', self._on_markers)
        self._listen(topics.DIAGNOSTICS.name, self._on_diagnostics)
        self._message = JointState()
        self._commands = self.create_publisher(JointState, inlets.PILOT.name, messages.qos_profile(
            topics.Qos(depth=inlets.PILOT.qos.depth)))
        self._pause = self.create_client(SetBool, 'pause')
        self._triggers = {name: self.create_client(Trigger, name) for name in ('reset', 'trim')}
        self.create_timer(LOOK_PERIOD, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _listen(self, name: str, heard: Callable[[Any], None]) -> str:
        topic = _TOPICS[name]
        # rclpy goes through all event handlers at each wake, some hundred times a second here.
        return self.create_subscription(
            messages.message_class(topic.type), name, heard, messages.qos_profile(topic.qos),
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False)).topic_name

    def _look(self) -> None:
        publishers = self.count_publishers(self._odom)
        if not publishers:
            self._known = None   # the next one may have other strips
        self.scene.look(time.monotonic(), publishers, self._odom)

    def _on_odom(self, message: Odometry) -> None:
        self._time_ns = messages.nanoseconds(message.header.stamp)
        place, turn = message.pose.pose.position, message.pose.pose.orientation
        velocity = message.twist.twist.linear
        self.scene.pose(
            time.monotonic(), 1e-9 * self._time_ns, (place.x, place.y, place.z),
            (turn.x, turn.y, turn.z, turn.w), (velocity.x, velocity.y, velocity.z))

    def _on_place(self, name: str, message: Any) -> None:
        self._places[name] = list(message.data)
        self._describe_strips()

    def _on_markers(self, message: Any) -> None:
        found: dict[str, dict[str, np.ndarray]] = {}
        for marker in message.markers:
            if part := DRAWN.get(marker.ns):
                found.setdefault(part, {})[marker.ns] = np.array(
                    [(point.x, point.y, point.z) for point in marker.points])
        for part, points in found.items():
            self.scene.shape(part, **points)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        """Take what the simulator of this namespace says: others report on the same topic."""
        found, node, aircraft = {}, '', ''
        for status in message.status:
            name, separator, what = status.name.rpartition(': ')
            if separator and '/' + name.rpartition('/')[0] == self.get_namespace():
                found[what] = (status.level[0], status.message,
                               {item.key: item.value for item in status.values})
                node, aircraft = '/' + name, status.hardware_id
        if 'flight' not in found:
            return
        self.scene.report(found)
        if (node, aircraft) != self._known:
            self._ask(node, aircraft)

    def _ask(self, node: str, aircraft: str) -> None:
        """Ask a simulator what it flies; until it answers, it is asked after each report."""
        client = self.create_client(GetParameters, f'{node}/get_parameters')
        if not client.service_is_ready():
            self.destroy_client(client)
            return
        self._known = node, aircraft

        def answered(future: Any) -> None:
            self.destroy_client(client)
            # Another's node may bear such a name and have no such parameters: it gives none.
            if future.cancelled() or future.exception() or len(future.result().values) != 2:
                self._known = None
                return
            name, strips = future.result().values
            self._describe(aircraft, name.string_value)
            self._names = list(strips.string_array_value)
            self._describe_strips()
        client.call_async(GetParameters.Request(
            names=['aircraft', 'strip_names'])).add_done_callback(answered)

    def _describe(self, name: str, file: str) -> None:
        try:
            found = self._aircraft or definition.aircraft(
                definition.find(definition.Kind.AIRCRAFT, file))
        except ConfigError as error:
            self.get_logger().warning(
                f'it can be watched, not flown: the limits of its controls are not known '
                f'({error}): name its file with --aircraft')
            self.scene.setup(aircraft=name, limits={})
            return
        limits = {control.name: control.limits for control in found.controls}
        self.scene.setup(aircraft=name, limits=limits | (
            {topics.THROTTLE: (0.0, 1.0)} if found.engines else {}))

    def _describe_strips(self) -> None:
        """Say where the strips are, and of which surfaces, once that is known."""
        y, cl_max = (self._places.get(name) for name in _PLACES)
        if y is None or cl_max is None or len(y) != len(cl_max):
            return
        names = self._names if len(self._names) == len(y) else ['strips_1'] * len(y)
        self.scene.setup(strips={'y': y, 'cl_max': cl_max, 'groups': scenes.groups(names, y)})

    def command(self, values: Mapping[str, float]) -> None:
        """Command controls by name [rad; throttle 0..1], as of the latest state that was heard."""
        self._commands.publish(messages.fill(
            self._message, topics.joint_fields(self._time_ns, values)))

    def act(self, action: str, answered: Callable[[bool, str], None]) -> None:
        """Ask the simulator to pause, fly on, reset or trim."""
        client, request = (
            (self._pause, SetBool.Request(data=action == 'pause')) if action not in self._triggers
            else (self._triggers[action], Trigger.Request()))
        if not client.service_is_ready():
            answered(False, f'nobody offers the service {client.service_name}')
            return
        client.call_async(request).add_done_callback(
            lambda future: answered(future.result().success, future.result().message))


@contextmanager
def watching(namespace: str, aircraft: Aircraft | None) -> Iterator[
        tuple[WatchNode, Future[None]]]:
    """
    Give the node, which hears the simulator of a namespace until the block ends.

    Beside it what the thread that hears comes to: an exception, should one end it before that.

    Raises
    ------
    ConfigError
        When there can be no such namespace.

    """
    try:
        validate_namespace('/' + namespace.strip('/'))
    except InvalidNamespaceException as error:
        raise ConfigError(f'--namespace {namespace}: {str(error).splitlines()[0]}') from None
    # Signals are the server's, which ends the block.
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = WatchNode(namespace.strip('/'), aircraft)
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        ended = threading.Event()
        with ThreadPoolExecutor(1, 'watch') as pool:
            listening = pool.submit(_spin, executor, node, ended)
            try:
                yield node, listening
            finally:
                ended.set()
                executor.shutdown()
        node.destroy_node()
    finally:
        rclpy.try_shutdown()


def _spin(executor: SingleThreadedExecutor, node: WatchNode, ended: threading.Event) -> None:
    while not ended.is_set():
        process.turn(executor, node, None)
