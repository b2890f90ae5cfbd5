# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What one may ask of the benchmarks."""


def pytest_addoption(parser):
    parser.addoption('--flows', type=int, metavar='N',
                     help='cold starts: no more than N flows a row, for a quick look')
