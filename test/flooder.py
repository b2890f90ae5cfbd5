# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A process that sends huge commands as fast as it can, until it is stopped.

It says ``floods`` once somebody listens.
"""

import rclpy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState


def main():
    rclpy.init()
    node = rclpy.create_node('flooder')
    publisher = node.create_publisher(JointState, 'pilot/surface_cmd', 10)
    names = [f'n{number}' for number in range(5000)]
    data = serialize_message(JointState(name=names, position=[0.1] * len(names)))
    told = False
    while True:
        publisher.publish(data)
        if not told and publisher.get_subscription_count():
            told = True
            print('floods', flush=True)


if __name__ == '__main__':
    main()
