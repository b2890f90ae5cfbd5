# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What is not installed is said once, and everything else goes on.

What is offered where simulation_interfaces is installed: `test_simulation_interfaces`.
"""

import ast
import importlib
import inspect

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed')

from processes import Reports
from std_srvs.srv import Trigger

from poststall_sim.ros import optional

pytestmark = [pytest.mark.ros, pytest.mark.timeout(300)]


@pytest.mark.skipif(not optional.missing(), reason='everything is installed here')
def test_what_is_missing_is_said_once_and_left_out(start, probe):
    simulator = start('simulator', ros=['-p', 'start_paused:=true'])
    assert probe.call(Trigger, 'step').success
    said = f'not installed here, so left out: {", ".join(optional.missing())}'
    assert simulator.says().count(said) == 1
    assert '[WARN]' not in simulator.says()
    assert Reports(probe).value('flight', 'optional_parts_missing') == ', '.join(
        optional.missing())

    def offered():
        return {name for name, _ in probe.node.get_service_names_and_types()}
    wanted = {'/step', '/pause', '/reset', '/trim', '/engage', '/save_state', '/load_state'}
    interfaces = optional.INTERFACES not in optional.missing()
    if interfaces:
        wanted.add('/step_simulation')
    probe.spin_until(lambda: wanted <= offered(), 'the services')
    assert ('/step_simulation' in offered()) == interfaces


def test_what_only_a_full_installation_runs_names_nothing_that_we_do_not_have():
    """It does not run here, so that nothing else would tell of a function that has moved."""
    tree = ast.parse(inspect.getsource(optional))
    modules = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module.startswith('poststall_sim'):
            owner = importlib.import_module(node.module)
            for each in node.names:
                assert hasattr(owner, each.name), f'{node.module} has no {each.name}'
                modules[each.asname or each.name] = getattr(owner, each.name)
    used = [node for node in ast.walk(tree) if isinstance(node, ast.Attribute)
            and isinstance(node.value, ast.Name) and inspect.ismodule(modules.get(node.value.id))]
    assert len(used) > 5
    for node in used:
        assert hasattr(modules[node.value.id], node.attr), ast.unparse(node)
