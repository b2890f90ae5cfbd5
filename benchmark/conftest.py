# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What one may ask of the benchmarks, and graphs of nodes for those that measure nodes."""

import contextlib
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))

from processes import Probe, starter


def pytest_addoption(parser):
    parser.addoption('--flows', type=int, metavar='N',
                     help='cold starts: no more than N flows a row, for a quick look')
    parser.addoption('--flights', type=int, metavar='N', help='campaign: so many flights')
    parser.addoption('--flight-seconds', type=float, metavar='S', help='campaign: of so long')


@pytest.fixture
def graph(tmp_path):
    """Return a function of a name that gives `start` and a probe in a domain of their own."""
    with contextlib.ExitStack() as stack:
        def opened(name):
            folder = tmp_path / name
            folder.mkdir()
            start = stack.enter_context(contextlib.contextmanager(starter)(folder))
            probe = Probe(start.domain)
            stack.callback(probe.close)
            return start, probe
        yield opened
