# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A node that hears every topic of a simulator as bytes, and does nothing else."""

import rclpy

from poststall_sim import topics
from poststall_sim.ros import messages


def main():
    rclpy.init()
    node = rclpy.create_node('listener')
    for topic in topics.PUBLISHED:
        if messages.available(topic.type):
            node.create_subscription(
                messages.message_class(topic.type), topic.name, lambda data: None,
                messages.qos_profile(topic.qos), raw=True)
    node.get_logger().info('listens')
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
