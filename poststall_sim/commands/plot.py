# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The figures of a flight from its bag."""

import argparse
from pathlib import Path

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.commands import series, solver
from poststall_sim.commands.solver import Command


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    plot = command('plot', 'draw the figures of a flight from its bag',
                   'flight --output figures', None)
    plot.add_argument('bag', type=Path, metavar='BAG', help="a rosbag2 folder, anyone's")
    plot.add_argument('--output', type=values.folder, metavar='DIR',
                      help='where the figures go (default: BAG_figures beside the bag)')
    return plot


def run(arguments: argparse.Namespace) -> int:
    """Draw the figures of a bag and return the exit code."""
    from poststall_sim import recording
    from poststall_sim.aircraft import ConfigError
    from poststall_sim.plots import bag as bags
    from poststall_sim.plots import flight as figures
    bag = series.bag(arguments.bag)
    output = arguments.output or bag.resolve().with_name(f'{bag.resolve().name}_figures')
    try:
        flight = bags.flight_data(bag, solver.aircraft(arguments) if arguments.aircraft else None)
        with terminal.patience('drawing'):
            drawn = figures.draw_flight(flight, output)
    except recording.BagError as error:
        raise ConfigError(str(error)) from None
    for path in drawn:
        terminal.drawn(path)
    for note in flight.notes:
        terminal.complain(note)
    terminal.write_json(arguments.json, {
        'bag': str(bag), 'name': flight.name, 'figures': [str(path) for path in drawn],
        'notes': list(flight.notes), 'flight': bags.extremes(flight)})
    return 0
