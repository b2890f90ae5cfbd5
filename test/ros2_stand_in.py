# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A little of the command `ros2`, over the same DDS, where there is none: pip has not got it.

    ros2 run poststall_sim NODE [ARGUMENTS]
    ros2 param set NODE NAME VALUE
    ros2 service call NAME TYPE [REQUEST]
    ros2 topic echo NAME --once
"""

import importlib
import os
import sys
import time
from pathlib import Path

LIMIT = 120.0
"""How long a node may take to come up, compiling included [s]."""
PATIENCE = 10.0
"""So long is an answer awaited before the service is asked again [s]."""


def main(words):
    """Do what the real one would and return its exit code."""
    if words[:2] == ['run', 'poststall_sim']:
        script = Path(sys.executable).with_name(words[2])
        os.execv(script, [str(script), *words[3:]])
    does = {('param', 'set'): set_parameter, ('service', 'call'): call,
            ('topic', 'echo'): echo}.get(tuple(words[:2]))
    if does is None:
        print(f'ros2 {" ".join(words)}: needs an installed ROS 2', file=sys.stderr)
        return 1
    import rclpy
    rclpy.init(args=[])
    node = rclpy.create_node('stand_in')
    try:
        return does(node, *words[2:])
    finally:
        node.destroy_node()
        rclpy.shutdown()


def set_parameter(node, name, parameter, value):
    from rcl_interfaces.msg import Parameter
    from rcl_interfaces.srv import SetParameters
    from rclpy.parameter import get_parameter_value
    answer = ask(node, SetParameters, f'{name}/set_parameters', SetParameters.Request(
        parameters=[Parameter(name=parameter, value=get_parameter_value(value))])).results[0]
    print('Set parameter successful' if answer.successful
          else f'Setting parameter failed: {answer.reason}')
    return 0 if answer.successful else 1


def call(node, name, kind, request='{}'):
    import yaml
    kind = named(kind)
    answer = ask(node, kind, name, kind.Request(**yaml.safe_load(request)))
    print(f'response:\n{answer}')
    return 0 if answer.success else 1


def echo(node, name, *options):
    import rclpy.qos
    assert '--once' in options, 'this one listens once'
    heard = []
    until(node, lambda: node.get_publishers_info_by_topic(name), f'somebody on {name}')
    kind = named(node.get_publishers_info_by_topic(name)[0].topic_type)
    node.create_subscription(kind, name, heard.append, rclpy.qos.qos_profile_sensor_data)
    until(node, lambda: heard, f'a message on {name}')
    print(heard[0])
    return 0


def named(kind):
    """Return the class of a message or service by its ROS name."""
    package, folder, name = kind.split('/')
    return getattr(importlib.import_module(f'{package}.{folder}'), name)


def ask(node, kind, name, request):
    """
    Return the answer of a service.

    It is asked again where none comes: a server drops the answer to somebody whom it has not
    discovered yet. The real one waits for ever then, and whoever sits before it types it again.
    """
    client = node.create_client(kind, name)
    if not client.wait_for_service(timeout_sec=LIMIT):
        raise SystemExit(f'no service {name} in {LIMIT:g} s')
    asked = []

    def answered():
        if not asked or time.monotonic() > asked[-1][0] + PATIENCE:
            asked.append((time.monotonic(), client.call_async(request)))
        return next((future for _, future in asked if future.done()), None)
    return until(node, answered, f'an answer of {name}').result()


def until(node, done, what):
    """Spin until ``done`` gives something true, and return it."""
    import rclpy
    end = time.monotonic() + LIMIT
    while not (result := done()):
        if time.monotonic() > end:
            raise SystemExit(f'waited {LIMIT:g} s for {what}')
        rclpy.spin_once(node, timeout_sec=0.05)
    return result


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
