# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The time series of a flight from its bag, as CSV and for MATLAB."""

import argparse
from pathlib import Path

from poststall_sim import terminal
from poststall_sim.commands import series, solver
from poststall_sim.commands.solver import Command


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    export = command('export', 'write the time series of a bag as CSV or for MATLAB',
                     'flight --csv flight.csv --mat flight.mat', None)
    export.add_argument('bag', type=Path, metavar='BAG', help="a rosbag2 folder, anyone's")
    series.add_files(export)
    return export


def run(arguments: argparse.Namespace) -> int:
    """Write what a bag holds and return the exit code."""
    from poststall_sim import bag_export, recording
    from poststall_sim.aircraft import ConfigError
    if not (arguments.csv or arguments.mat):
        raise ConfigError('export writes files: give --csv or --mat')
    bag = series.bag(arguments.bag)
    try:
        with terminal.patience('reading'):
            flight, notes = bag_export.of_bag(
                bag, solver.aircraft(arguments) if arguments.aircraft else None)
    except recording.BagError as error:
        raise ConfigError(str(error)) from None
    written = series.write_files(arguments, flight)
    for path in written:
        terminal.say(f'written {path}')
    for note in notes:
        terminal.complain(note)
    terminal.write_json(arguments.json, {
        'bag': str(bag), 'name': flight.name, 'files': [str(path) for path in written],
        'units': {name: each.unit for name, each in flight.series.items()},
        'notes': list(notes)})
    return 0
