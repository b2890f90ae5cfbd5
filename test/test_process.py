# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What ends a node and what does not, turn by turn."""

import time

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

import rclpy
from processes import free_domain
from rclpy.executors import SingleThreadedExecutor

from poststall_sim.ros import messages, process

pytestmark = [pytest.mark.ros, pytest.mark.timeout(60)]


@pytest.fixture
def turns():
    """Return what makes a node that calls something once, and what gives that one turn."""
    context = rclpy.Context()
    context.init(args=[], domain_id=free_domain())
    executor = SingleThreadedExecutor(context=context)
    node = rclpy.create_node('turner', context=context)
    executor.add_node(node)

    def turn(callback):
        called = []

        def once():
            timer.cancel()
            called.append(callback)
            callback()
        timer = node.create_timer(0.0, once)
        end = time.monotonic() + 10.0
        while not called:
            assert time.monotonic() < end
            process.turn(executor, node, 0.1)

    turn.context, turn.executor, turn.node = context, executor, node
    yield turn
    executor.shutdown()
    node.destroy_node()
    context.try_shutdown()


def test_what_no_code_of_ours_has_a_part_in_is_counted_and_logged_once(turns, capfd):
    def stumble():
        raise TypeError('of nobody')

    before = process.dropped()
    for _ in range(3):
        turns(stumble)
    assert process.dropped() == before + 3
    assert capfd.readouterr().err.count('it is dropped: TypeError in test_process.py') == 1


def test_what_has_passed_code_of_ours_goes_on(turns):
    before = process.dropped()
    with pytest.raises(ModuleNotFoundError, match='no_such_package'):
        turns(lambda: messages.message_class('no_such_package/msg/Word'))
    assert process.dropped() == before


def test_what_waiting_raises_goes_on_for_the_next_turn_would_do_no_better(turns):
    turns.context.shutdown()
    with pytest.raises(RuntimeError, match='context'):
        process.turn(turns.executor, turns.node, 0.1)
