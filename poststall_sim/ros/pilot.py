# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The pilot node: plays a scenario on pilot/surface_cmd, in simulated time."""

import sys
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import SetBool

from poststall_sim import definition, inlets, topics
from poststall_sim.ros import arguments, declaration, messages, process
from poststall_sim.ros.parameters import PilotSettings

LOOK_PERIOD = 0.05
"""Until the scenario begins, the simulator is looked for this often [s of wall time]."""


class PilotNode(Node):
    """
    Play a scenario: its time 0 is the simulated time at which the first command is sent.

    Before that the node waits for /clock, for joint_states (the trim that relative channels are
    added to), for air_data/airspeed and, unless told otherwise, for a simulator that listens;
    then it lets a paused simulator fly. Should time jump back, the scenario begins anew. A
    scenario that moves what the aircraft does not have ends the node; nothing is sent then.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__('pilot', **node_options)
        self._settings = declaration.declare(self, PilotSettings)
        self._scenario = definition.scenario(
            definition.find(definition.Kind.SCENARIO, self._settings.scenario))
        self.exit_code: int | None = None
        self._trim: dict[str, float] | None = None
        self._now_ns: int | None = None
        self._start_ns: int | None = None
        self._sent_ns = 0
        self._done = False

        self._message = JointState()
        self._commands = self.create_publisher(
            JointState, inlets.PILOT.name,
            messages.qos_profile(topics.Qos(depth=inlets.PILOT.qos.depth)))
        self._airspeed: float | None = None
        _, *self._looking_at = [
            self.create_subscription(kind, topic.name, heard, messages.qos_profile(topic.qos))
            for kind, topic, heard in (
                (ClockMessage, topics.CLOCK, self._on_clock),
                (JointState, topics.JOINT_STATES, self._on_joint_states),
                (Float64, topics.AIRSPEED, self._on_airspeed))]
        self._pause = self.create_client(SetBool, 'pause')
        self._unpausing = None
        self._look_timer = self.create_timer(
            LOOK_PERIOD, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.get_logger().info(
            f'scenario {self._scenario.name}, {self._scenario.duration:g} s: waiting for the '
            'simulator')
        if self._scenario.faults:
            self.get_logger().warning(
                "a pilot makes nothing fail: set the simulator's parameter failures for what the "
                'scenario lets fail')

    def _on_joint_states(self, message: JointState) -> None:
        """Take the trim from the first message."""
        if self._trim is None:
            self._trim = dict(zip(message.name, message.position))

    def _on_airspeed(self, message: Float64) -> None:
        self._airspeed = message.data

    def _on_clock(self, message: ClockMessage) -> None:
        time_ns = messages.clock_time(message)
        if time_ns is None:
            return   # nobody's simulated time, and no stamp of a command
        if self._start_ns is not None and self._now_ns is not None and time_ns < self._now_ns:
            self.get_logger().info('simulated time jumped back: the scenario begins anew')
            self._start_ns, self._done = time_ns, False
            self._send(time_ns)
        self._now_ns = time_ns
        if self._start_ns is None or self._done:
            return
        if (time_ns - self._start_ns) * 1e-9 >= self._scenario.duration:
            self._finish(time_ns)
        elif self._period(time_ns) != self._period(self._sent_ns):
            self._send(time_ns)

    def _period(self, time_ns: int) -> int:
        return round(time_ns * self._settings.rate) // 1_000_000_000

    def _look(self) -> None:
        """Begin as soon as time, trim and a listening simulator are there."""
        if self._start_ns is None:
            listening = (self._commands.get_subscription_count() > 0
                         or not self._settings.start_on_match)
            if None in (self._now_ns, self._trim, self._airspeed) or not listening:
                return
            self._begin()
            if self._start_ns is None:
                return   # refused: this node ends, and lets nothing fly
        if self._settings.unpause and self._unpausing is None:
            if not self._pause.service_is_ready():
                return
            self._unpausing = self._pause.call_async(SetBool.Request(data=False))
            self._unpausing.add_done_callback(self._on_unpaused)
        self._look_timer.cancel()

    def _begin(self) -> None:
        if topics.THROTTLE not in self._trim and self._scenario.moves(topics.THROTTLE):
            self.get_logger().warning(
                f'the aircraft has no engine: the throttle of {self._scenario.name} is left out')
            self._scenario = self._scenario.without(topics.THROTTLE)
        strangers = sorted({channel.control for channel in self._scenario.channels}
                           - self._trim.keys())
        if strangers:
            self.get_logger().fatal(
                f'scenario {self._scenario.name} moves {", ".join(strangers)}, which the '
                f'aircraft does not have; it has {", ".join(self._trim)}')
            self.exit_code = process.BAD_INPUT
            return
        self._start_ns = self._now_ns
        self.get_logger().info(f'scenario begins at simulated time {self._now_ns * 1e-9:.3f} s')
        self._send(self._now_ns)
        made_for = self._scenario.airspeed
        if abs(self._airspeed - made_for) > 0.05 * made_for:
            self.get_logger().warning(
                f'{self._scenario.name} is made for {made_for:g} m/s, the aircraft flies at '
                f'{self._airspeed:.1f} m/s: see the parameter initial.airspeed of the simulator')
        for subscription in self._looking_at:
            self.destroy_subscription(subscription)

    def _on_unpaused(self, future: Any) -> None:
        if not future.result().success:
            self.get_logger().error(f'the simulator does not fly: {future.result().message}')

    def _send(self, time_ns: int) -> None:
        self._sent_ns = time_ns
        values = self._scenario.commands((time_ns - self._start_ns) * 1e-9, self._trim)
        if values:
            self._commands.publish(messages.fill(
                self._message, topics.joint_fields(time_ns, values)))

    def _finish(self, time_ns: int) -> None:
        self._done = True
        self._send(time_ns)
        self.get_logger().info('scenario is over')
        if self._settings.exit_when_done:
            self.exit_code = 0


def main(args: list[str] | None = None) -> int:
    """Play the scenario that the parameters name; return the exit code."""
    arguments.heed(
        'pilot', 'Fly a scenario: deflections over simulated time, published as a pilot.',
        (PilotSettings,), args)
    return process.run('pilot', PilotNode, args)


if __name__ == '__main__':
    sys.exit(main())
