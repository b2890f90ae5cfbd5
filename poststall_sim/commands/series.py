# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What commands on a flight share: the bag it is in, the files its time series go to."""

import argparse
from pathlib import Path

from poststall_sim import option_values as values


def add_files(command: argparse.ArgumentParser) -> None:
    """Add the files that a flight's time series can be written to."""
    command.add_argument('--csv', type=values.output, metavar='FILE',
                         help='write the time series as CSV, the unit in each head')
    command.add_argument('--mat', type=values.output, metavar='FILE',
                         help='write them for MATLAB, and those of the strips')


def write_files(arguments: argparse.Namespace, series) -> list[Path]:
    """Write the time series as asked and return the files."""
    from poststall_sim import time_series
    if arguments.csv:
        time_series.write_csv(arguments.csv, series)
    if arguments.mat:
        time_series.write_mat(arguments.mat, series)
    return [path for path in (arguments.csv, arguments.mat) if path]


def bag(path: Path) -> Path:
    """Return the bag that is named; refuse what is none."""
    from poststall_sim.aircraft import ConfigError
    if not path.exists():
        raise ConfigError(f'there is no bag {path}')
    if path.is_dir() and not (path / 'metadata.yaml').is_file():
        raise ConfigError(f'{path} is not a bag: it has no metadata.yaml')
    return path
