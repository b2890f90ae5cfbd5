# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A flight or a polar as one HTML page."""

import argparse
import json
from pathlib import Path
from typing import Any

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.commands import series, solver
from poststall_sim.commands.solver import Command

_OF = 'a report is of a bag, or of what fly or polar wrote as JSON'
_BAGS = ('.mcap', '.db3', '.bag')


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    report = command('report', 'make one HTML page of a flight or a polar, to be read offline',
                     'flight --output flight.html', None)
    report.add_argument('source', type=Path, metavar='BAG|JSON',
                        help="a rosbag2 folder, anyone's, or what fly or polar wrote as JSON")
    report.add_argument('--output', type=values.page, metavar='FILE',
                        help='the page (default: the name of the source with .html, beside it)')
    return report


def run(arguments: argparse.Namespace) -> int:
    """Write the page and return the exit code."""
    from poststall_sim.aircraft import ConfigError
    from poststall_sim.report import page
    source = arguments.source
    if not source.exists():
        raise ConfigError(f'there is no bag or JSON {source}')
    if source.is_file() and source.suffix not in ('.json', *_BAGS):
        raise ConfigError(f'{source}: {_OF}')
    with terminal.patience('putting the page together'):
        data = _of_json(arguments) if source.suffix == '.json' else _of_bag(arguments)
        whole = source.resolve()   # a folder's name may have a dot in it
        output = arguments.output or whole.with_name(
            f'{whole.name if whole.is_dir() else whole.stem}.html')
        page.write(data, output)
    terminal.say(f'page {output}, {output.stat().st_size / 1e6:.1f} MB')
    for note in data['notes']:
        terminal.complain(note)
    terminal.write_json(arguments.json, {
        'source': str(source), 'page': str(output), 'title': data['title'],
        'events': data['events'], 'notes': data['notes']})
    return 0


def _of_bag(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the page of a bag."""
    from poststall_sim import recording
    from poststall_sim.aircraft import ConfigError
    from poststall_sim.plots import bag as bags
    from poststall_sim.report import flight as flights
    bag = series.bag(arguments.source)
    try:
        flight = bags.flight_data(
            bag, solver.aircraft(arguments) if arguments.aircraft else None)
    except recording.BagError as error:
        raise ConfigError(str(error)) from None
    return flights.of_bag(bag, flight)


def _of_json(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the page of a flight's or a polar's JSON."""
    from poststall_sim.aircraft import ConfigError
    from poststall_sim.report import flight as flights
    from poststall_sim.report import polar as polars
    path = arguments.source
    refusal = f'{path}: {_OF}'
    try:
        result = json.loads(path.read_text())
    except ValueError:
        raise ConfigError(refusal) from None
    keys = set(result) if isinstance(result, dict) else set()
    if {'aircraft', 'series', 'summary'} <= keys:
        make = flights.of_json
    elif {'aircraft', 'points', 'sweep', 'deflections_deg'} <= keys:
        make = polars.of_json
    else:
        raise ConfigError(refusal)
    aircraft = _aircraft(arguments, str(result['aircraft']))
    try:
        return make(result, aircraft)
    except (LookupError, TypeError, AttributeError, ValueError) as error:
        raise ConfigError(f'{path} is not whole, or of another version: {error}') from None


def _aircraft(arguments: argparse.Namespace, name: str):
    """Return the aircraft that the options name, else the one with this name, if it is known."""
    from poststall_sim import definition
    from poststall_sim.aircraft import ConfigError
    if arguments.aircraft:
        return solver.aircraft(arguments)
    try:
        return definition.aircraft(definition.find(definition.Kind.AIRCRAFT, name))
    except ConfigError:
        return None
