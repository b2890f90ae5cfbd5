# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What the simulator hears: commands of every form, the stick, the wind, states to go to."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from geometry_msgs.msg import PoseWithCovarianceStamped, Vector3Stamped
from nav_msgs.msg import Odometry
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState, Joy
from std_msgs.msg import Float64MultiArray

from poststall_sim import inlets
from poststall_sim.aircraft import ConfigError
from poststall_sim.reader import plain
from poststall_sim.ros import joy, messages
from poststall_sim.ros.commands import Refusal, RefusedCommand, Source, Turns
from poststall_sim.topics import Topic

if TYPE_CHECKING:
    from poststall_sim.ros.simulator import SimulatorNode

WARNED_NAMES = 100
"""So many unknown names are warned of, each once."""


class Inbox:
    """The subscriptions of a simulator: each message is read, judged, counted and passed on."""

    def __init__(self, node: SimulatorNode) -> None:
        self._node = node
        self._warned: set[str] = set()
        self._buttons, self._lever = joy.Buttons(), joy.Lever()
        self.turns = Turns()
        self._commands = [
            (topic, self._listen(topic, JointState,
                                 lambda message, source=source: self._on_joints(source, message)))
            for topic, source in ((inlets.AUTOPILOT, Source.AUTOPILOT),
                                  (inlets.PILOT, Source.PILOT))]
        self._commands.append((inlets.SURFACES, self._listen(
            inlets.SURFACES, Float64MultiArray, self._on_array)))
        if node.settings.joy_enabled:
            self._commands.append((inlets.JOY, self._listen(inlets.JOY, Joy, self._on_joy)))
        self._listen(inlets.WIND, Vector3Stamped, self._on_wind)
        self._listen(inlets.INITIAL_POSE, PoseWithCovarianceStamped, self._on_initial_pose)
        self._listen(inlets.SET_STATE, Odometry, self._on_state)

    def _listen(self, topic: Topic, kind: type, callback) -> Subscription:
        return self._node.create_subscription(
            kind, topic.name, callback, messages.qos_profile(topic.qos))

    def hear_commands(self) -> None:
        """
        Take the commands that have arrived, in order, of each topic a history at most.

        An executor brings one of each topic at a turn; where a turn flies many steps, what waits
        behind it would grow old. Who sends more than can be read must not keep the step from being
        taken: half of what it lasts, and the message begun, goes to a topic, no more.
        """
        for topic, subscription in self._commands:
            until_ns = time.monotonic_ns() + self._node.flight.dt_ns // 2
            with subscription.handle:
                for _ in range(topic.qos.depth):
                    taken = subscription.handle.take_message(
                        subscription.msg_type, subscription.raw)
                    if taken is None:
                        break
                    subscription.callback(taken[0])
                    if time.monotonic_ns() > until_ns:
                        break

    def _on_joints(self, source: Source, message: JointState) -> None:
        try:
            commands = messages.commands_from_joint_state(
                message, self._node.layout.command_names)
            self._receive(source, commands.values, messages.nanoseconds(message.header.stamp))
        except RefusedCommand as error:
            self._refuse(source, error)
            return
        for name in commands.unknown:
            self._node.health.unknown_names += 1
            if len(self._warned) < WARNED_NAMES and (shown := plain(name)) not in self._warned:
                self._warned.add(shown)
                self._node.get_logger().warning(
                    f'{source.value}: there is no control {shown}, it is ignored; there are '
                    f'{", ".join(self._node.layout.command_names)}')

    def _on_array(self, message: Float64MultiArray) -> None:
        try:
            commands = messages.commands_from_array(message, self._node.layout.command_names)
            self._receive(Source.AUTOPILOT, commands.values, None)
        except RefusedCommand as error:
            self._refuse(Source.AUTOPILOT, error)

    def _on_joy(self, message: Joy) -> None:
        node = self._node
        try:
            # Before the buttons, of which none acts in a message that is refused.
            where = joy.positions(message, node.settings, node.desk.trim)
            for name in self._buttons.pressed(message, node.settings):
                done, text = {'pause': lambda: node.operations.pause(not node.paused),
                              'reset': node.operations.reset,
                              'trim': node.operations.trim}[name]()
                node.get_logger().info(f'joy: {name}: {"" if done else "refused: "}{text}')
            # A stick lives in wall time: its stamps say nothing of the flight's.
            self._receive(Source.PILOT, joy.commands(
                where, node.settings, node.desk.trim, self._lever), None, turn=False)
        except RefusedCommand as error:
            self._refuse(Source.PILOT, error)

    def _receive(self, source: Source, values: dict[str, float], stamp_ns: int | None, *,
                 turn: bool = True) -> None:
        """
        Pass a command on; under lock-step `command` a full one makes the flight advance.

        stamp_ns : None where the message has no header, as an array: it is always new;
        turn : whether it may make the flight advance.
        """
        node, time_ns = self._node, self._node.flight.snapshot.time_ns
        settings = node.settings
        in_turn = turn and settings.lockstep == 'command'
        if not values:
            return
        if in_turn and stamp_ns is not None:
            if stamp_ns > time_ns:
                raise RefusedCommand(Refusal.AHEAD, (
                    f'stamped {1e-9 * (stamp_ns - time_ns):.3f} s ahead of simulated time: under '
                    'lock-step a command bears the time of the state that it answers'))
            if not self.turns.is_new(source, stamp_ns):
                if stamp_ns == 0:
                    node.get_logger().warning(
                        f'{source.value}: a command without a stamp passes for an old one under '
                        'lock-step: stamp it with the time of the state that it answers',
                        throttle_duration_sec=5)
                return
        node.desk.admit(source, stamp_ns or 0, time_ns, timeout=settings.command_timeout)
        beyond = node.desk.receive(source, values, time_ns)
        if beyond:
            node.get_logger().warning(
                f'{source.value}: {", ".join(beyond)} beyond limits, cut', throttle_duration_sec=5)
        if in_turn and not node.paused and len(values) == len(node.layout.command_names) \
                and node.desk.listens_to(source, settings.command_source):
            if stamp_ns is not None:
                self.turns.take(source, stamp_ns)
                if stamp_ns < time_ns:
                    return   # another's command of that state has made the flight advance
            node.advance(settings.step_count)

    def _refuse(self, source: Source, error: RefusedCommand) -> None:
        self._node.health.refused[error.refusal] += 1
        self._node.get_logger().warning(
            f'{source.value}: command refused: {error}', throttle_duration_sec=1)

    def _on_wind(self, message: Vector3Stamped) -> None:
        try:
            self._node.flight.wind_N = messages.wind_from_vector(
                message, map_frame=self._node.layout.map_frame)
        except messages.RefusedState as error:
            self._refuse_state(inlets.WIND, error)

    def _on_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        try:
            messages.require_frame(
                message.header.frame_id, self._node.layout.map_frame, 'frame_id')
            text = self._node.operations.begin_at(*messages.place_from_pose(message.pose.pose))
        except (messages.RefusedState, ConfigError) as error:
            self._refuse_state(inlets.INITIAL_POSE, error)
        else:
            self._node.get_logger().info(text)

    def _on_state(self, message: Odometry) -> None:
        layout = self._node.layout
        try:
            text = self._node.operations.go_to(messages.body_from_odometry(
                message, map_frame=layout.map_frame, base_frame=layout.base_frame))
        except (messages.RefusedState, ConfigError) as error:
            self._refuse_state(inlets.SET_STATE, error)
        else:
            self._node.get_logger().info(text)

    def _refuse_state(self, topic: Topic, error: ValueError) -> None:
        self._node.health.refused_states += 1
        self._node.get_logger().warning(f'{topic.name} refused: {error}', throttle_duration_sec=1)
