# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A process that calls services of a simulator, all at once: ``caller.py SEED COUNT``.

It says ``ready``, waits for a line, calls, and says what was answered, as a line of JSON.
"""

import json
import random
import sys
import time

import rclpy
from processes import LIMIT
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from std_srvs.srv import SetBool, Trigger


def is_answered(executor, client):
    """
    Tell whether a call is answered within a second.

    The first may not be: a server drops the answer to a caller whom it has not discovered yet.
    """
    future, end = client.call_async(client.srv_type.Request()), time.monotonic() + 1.0
    while not future.done() and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.02)
    return future.done()


def main(seed, count):
    rclpy.init()
    node = rclpy.create_node(f'caller{seed}')
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    # Fast DDS brings the answers of all callers to each of them: ten would be a short history.
    clients = [node.create_client(kind, name, qos_profile=QoSProfile(depth=1000))
               for kind, name in ((Trigger, 'reset'), (SetBool, 'pause'), (Trigger, 'step'))]
    while not all(client.service_is_ready() for client in clients):
        executor.spin_once(timeout_sec=0.02)
    for client in clients:
        while not is_answered(executor, client):
            pass
    print('ready', flush=True)
    sys.stdin.readline()
    choose, futures = random.Random(seed), []
    for _ in range(count):
        client = choose.choice(clients)
        request = client.srv_type.Request()
        if client.srv_type is SetBool:
            request.data = choose.random() < 0.5
        futures.append(client.call_async(request))
    end = time.monotonic() + 0.25 * LIMIT
    while time.monotonic() < end and not all(future.done() for future in futures):
        executor.spin_once(timeout_sec=0.02)
    answers = [future.result() for future in futures if future.done()]
    print(json.dumps({'answered': len(answers), 'refused': sorted(
        {answer.message for answer in answers if not answer.success})}), flush=True)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main(*(int(argument) for argument in sys.argv[1:]))
