# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A node that publishes what a simulator publishes, ready-made: the yardstick of its overhead.

Argument: a file with one message of each topic as bytes, pickled by name. They go out at the
rates of the simulator, from one timer of a step's period; nothing is computed and nothing heard.
What the simulator sends as bytes goes out as bytes here too.
"""

import pickle
import sys
from pathlib import Path

import rclpy
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from poststall_sim import topics
from poststall_sim.ros import messages


class BareNode(Node):
    """Publish the messages of a file over and over."""

    def __init__(self, samples, dt_ns):
        super().__init__('bare')
        self._dt_ns, self._time_ns = dt_ns, 0
        self._outlets = {}
        for topic in topics.PUBLISHED:
            if topic.name not in samples:
                continue
            kind, data = messages.message_class(topic.type), samples[topic.name]
            self._outlets[topic] = (
                self.create_publisher(kind, topic.name, messages.qos_profile(topic.qos)),
                data if topic.bulk else deserialize_message(data, kind))
        for topic in self._outlets:
            self._publish(topic)
        self._schedule = topics.Schedule({})
        self.create_timer(dt_ns * 1e-9, self._step)
        self.create_timer(1.0 / topics.Rate.DIAGNOSTICS.default,
                          lambda: self._publish(topics.DIAGNOSTICS))
        self.get_logger().info('ready')

    def _step(self):
        self._time_ns += self._dt_ns
        for topic in self._schedule.due(self._time_ns):
            if topic in self._outlets:
                self._publish(topic)

    def _publish(self, topic):
        publisher, message = self._outlets[topic]
        publisher.publish(message)


def main():
    rclpy.init()
    try:
        rclpy.spin(BareNode(pickle.loads(Path(sys.argv[1]).read_bytes()), int(sys.argv[2])))
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
