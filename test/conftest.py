# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Nodes as processes in a domain of their own, and a probe that talks to them."""

import pytest
from processes import Probe, starter


def pytest_addoption(parser):
    parser.addoption('--minutes', type=float, metavar='N',
                     help='soak of the simulator node: simulated minutes, for a quick look')


@pytest.fixture
def start(tmp_path):
    """Start nodes in one domain; what still runs at the end is killed."""
    yield from starter(tmp_path)


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
    for start in starter(folder):
        probe = Probe(start.domain)
        yield start, probe
        probe.close()
