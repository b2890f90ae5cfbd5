# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Nodes as processes in a ROS domain of their own, and a node here that watches them."""

import pytest
from processes import Probe, Running, free_domain


@pytest.fixture
def start(tmp_path):
    """Start nodes in one domain; what still runs at the end is killed."""
    domain, running = free_domain(), []

    def start(module, *arguments, ros=()):
        if ros:
            arguments += ('--ros-args', *ros)
        running.append(Running(
            module, *arguments, domain=domain, log=tmp_path / f'{module}{len(running)}.log'))
        return running[-1]

    start.domain = domain
    yield start
    for process in running:
        process.kill()


@pytest.fixture
def probe(start):
    probe = Probe(start.domain)
    yield probe
    probe.close()
