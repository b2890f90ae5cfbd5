# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The autopilot node: an example to copy, which flies by public topics only.

It hears ``imu``, ``twist/air``, ``joint_states`` and ``strip_stalled`` and answers each state with
a full command on ``autopilot/surface_cmd``. What it does with them stands in `autopilot_law`:
put a law of your own there.
"""

import sys
from typing import Any

import numpy as np
from geometry_msgs.msg import TwistStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64MultiArray

from poststall_sim import autopilot_law, frames
from poststall_sim.autopilot_law import Answer, Memory, Seen
from poststall_sim.ros import arguments, declaration, messages, process
from poststall_sim.ros.autopilot_settings import AutopilotSettings

AGAIN_PERIOD = 0.2
"""In lock-step a command is sent again this often [s of wall time]: one may have got lost."""
LONGEST = 0.1
"""No more than this is taken to lie between two states [s], however long nothing was heard."""


def seen_in(imu: Imu, air: TwistStamped, stalled: float) -> Seen:
    """Return what the law sees, in B, of messages in FLU and ENU; stalled : share 0..1."""
    q, rates, velocity = imu.orientation, imu.angular_velocity, air.twist.linear
    roll, pitch, _ = frames.euler_from_quaternion(
        frames.quaternion_from_enu_flu(np.array([q.x, q.y, q.z, q.w])))
    p, q, r = frames.swap_body_flu(np.array([rates.x, rates.y, rates.z])).tolist()
    airspeed, alpha, beta = frames.flow_angles(
        frames.swap_body_flu(np.array([velocity.x, velocity.y, velocity.z])))
    return Seen(roll=float(roll), pitch=float(pitch), p=p, q=q, r=r, airspeed=airspeed,
                alpha=alpha, beta=beta, stalled=stalled)


class AutopilotNode(Node):
    """
    Answer each state with a command that bears the state's stamp.

    A state is there when ``imu`` and ``twist/air`` of one stamp are; the share of stalled strips,
    which has no stamp, is the latest. In lock-step, where the simulator waits after each state,
    the state's own is waited for, so that the same flight gives the same commands: with
    ``step_count`` 1 and nobody who begins to listen meanwhile, for whom it would be said again.
    The controls begin where the first ``joint_states`` has them; those that the law does not move
    stay there.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__('autopilot', **node_options)
        settings = declaration.declare(self, AutopilotSettings)
        self._law, self._lockstep = settings.law, settings.lockstep
        declaration.follow(self, declaration.Followed(settings, self._on_settings))
        self._start: dict[str, float] = {}
        self._memory = Memory()
        self._imu: Imu | None = None
        self._air: TwistStamped | None = None
        self._answered: Imu | None = None
        self._share = 0.0
        self._heard_share = not self._lockstep
        self._kept_waiting: Imu | None = None
        self._time_ns: int | None = None
        self._command: JointState | None = None

        self._commands = self.create_publisher(JointState, 'autopilot/surface_cmd', 10)
        self.create_subscription(JointState, 'joint_states', self._on_joint_states, 10)
        self.create_subscription(Imu, 'imu', self._on_imu, 10)
        self.create_subscription(TwistStamped, 'twist/air', self._on_air, 10)
        self.create_subscription(Float64MultiArray, 'strip_stalled', self._on_stalled, 10)
        if self._lockstep:
            self.create_timer(AGAIN_PERIOD, self._again,
                              clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.get_logger().info('waiting for the simulator')

    def _on_settings(self, settings: AutopilotSettings, named: frozenset[str]) -> None:
        self._law = settings.law

    def _on_joint_states(self, message: JointState) -> None:
        """Take from the first message what the controls are and where they stand."""
        if not self._start:
            self._start = dict(zip(message.name, message.position))
            self._forget()
            self.get_logger().info(f'flies {", ".join(self._start)}')
            self._answer()

    def _on_imu(self, message: Imu) -> None:
        if message != self._answered:   # it is said again whenever somebody else begins to listen
            self._imu = message
            self._answer()

    def _on_air(self, message: TwistStamped) -> None:
        self._air = message
        self._answer()

    def _on_stalled(self, message: Float64MultiArray) -> None:
        self._share = float(np.mean(message.data)) if message.data else 0.0
        self._heard_share = True
        self._answer()

    def _forget(self) -> None:
        """Begin as if nothing had been flown yet."""
        self._memory = Memory(**{name: self._start.get(name, 0.0)
                                 for name in ('aileron', 'elevator', 'throttle')})

    def _answer(self) -> None:
        """Answer the present state, once all of it is there."""
        imu, air = self._imu, self._air
        if not self._start or not self._heard_share or imu is None or air is None \
                or imu.header.stamp != air.header.stamp:
            return
        time_ns = messages.nanoseconds(imu.header.stamp)
        since = 0.0 if self._time_ns is None else (time_ns - self._time_ns) * 1e-9
        if since < 0.0:
            self.get_logger().info('simulated time jumped back: beginning anew')
            self._forget()
        before = self._memory.recovering
        answer, self._memory = autopilot_law.answer(
            self._law, self._memory, seen_in(imu, air, self._share),
            min(max(since, 0.0), LONGEST))
        self._time_ns, self._answered, self._imu, self._air = time_ns, imu, None, None
        self._heard_share = not self._lockstep
        if self._memory.recovering is not before:
            self.get_logger().info(
                f'{"recovered" if before else "stalled"} at {time_ns * 1e-9:.3f} s')
        self._command = self._filled(answer, imu)
        self._send()

    def _filled(self, answer: Answer, imu: Imu) -> JointState:
        """Return the command of every control there is, with the stamp of the state."""
        position = [getattr(answer, name, value) for name, value in self._start.items()]
        command = JointState(name=list(self._start), position=position)
        command.header.stamp = imu.header.stamp
        return command

    def _again(self) -> None:
        """Send again; a state whose share was taken for that of one before does without."""
        if self._imu is not None and self._imu is self._kept_waiting:
            self._heard_share = True
            self._answer()
        self._kept_waiting = self._imu
        self._send()

    def _send(self) -> None:
        if self._command is not None:
            self._commands.publish(self._command)


def main(args: list[str] | None = None) -> int:
    """Fly whatever simulator is heard until told to stop; return the exit code."""
    arguments.heed(
        'autopilot', 'Hold pitch, bank and airspeed, and leave a stall: an example to copy.',
        (AutopilotSettings,), args)
    return process.run('autopilot', AutopilotNode, args)


if __name__ == '__main__':
    sys.exit(main())
