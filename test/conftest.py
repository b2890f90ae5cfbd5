# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Nodes as processes in a domain of their own, and a probe that talks to them."""

import pytest
from processes import Probe, Running, free_domain


def _starter(folder):
    """Yield a function that starts nodes in one domain; what still runs at the end is killed."""
    domain, running = free_domain(), []

    def start(module, *arguments, ros=()):
        if ros:
            arguments += ('--ros-args', *ros)
        running.append(Running(
            module, *arguments, domain=domain, log=folder / f'{module}{len(running)}.log'))
        return running[-1]

    start.domain = domain
    yield start
    for process in running:
        process.kill()


@pytest.fixture
def start(tmp_path):
    """Start nodes in one domain; what still runs at the end is killed."""
    yield from _starter(tmp_path)


@pytest.fixture
def probe(start):
    probe = Probe(start.domain)
    yield probe
    probe.close()


@pytest.fixture
def another_graph(tmp_path):
    """Return the same as `start` and `probe`, in a domain of their own."""
    folder = tmp_path / 'another'
    folder.mkdir()
    for start in _starter(folder):
        probe = Probe(start.domain)
        yield start, probe
        probe.close()
