# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Many flights, polars, trims or modes from one file; and figures of what came out."""

import argparse
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from poststall_sim import atomic_file, terminal
from poststall_sim import option_values as values
from poststall_sim.commands.solver import Command


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    campaign = command('campaign', 'thousands of flights, on this machine or on a Dask cluster',
                       'upset_recovery --output upset', None, of_aircraft=False)
    campaign.add_argument('what', nargs='+', metavar='FILE',
                          help='a file, or a name in config/campaigns; or: plot FOLDER, to draw '
                          'what came out')
    campaign.add_argument('--output', type=values.folder, metavar='DIR',
                          help='where the table goes (default: the name of the campaign), or '
                          'its figures (default: figures in its folder)')
    campaign.add_argument('--resume', action='store_true',
                          help='go on with what is in the folder already')
    campaign.add_argument('--check', action='store_true',
                          help='only check the definition, every case of it')
    where = campaign.add_mutually_exclusive_group()
    where.add_argument('--scheduler', metavar='ADDRESS',
                       help='of a Dask cluster that is there, tcp://host:8786; where it loses its '
                       'workers, others are waited for')
    where.add_argument('--workers', type=values.whole_within((1, 1024)), metavar='N',
                       help='processes on this machine (default: one a core)')
    return campaign


def run(arguments: argparse.Namespace) -> int:
    """Check and compute a campaign, or draw one; return the exit code."""
    from poststall_sim.aircraft import ConfigError
    if arguments.what[0] == 'plot' and len(arguments.what) == 2:
        return _draw(arguments)
    if len(arguments.what) != 1:
        raise ConfigError(f'expected a file, or plot and a folder, got {arguments.what}')
    from poststall_sim import definition
    from poststall_sim.campaign import cases, engine, job
    from poststall_sim.campaign import definition as campaigns
    path = definition.find(definition.Kind.CAMPAIGN, arguments.what[0])
    # Functions that fly may stand beside the file.
    sys.path.insert(0, str(path.absolute().parent))
    campaign = campaigns.campaign(path)
    total = cases.check(campaign)
    if arguments.check:
        terminal.say(f'{campaign.name}: {total} cases, each of them can be')
        terminal.write_json(arguments.json, {
            'campaign': campaign.name, 'kind': campaign.kind, 'cases': total})
        return 0
    folder = arguments.output or Path(campaign.name)
    try:
        result = job.run(campaign, folder, watch=_watch, scheduler=arguments.scheduler,
                         workers=arguments.workers, resume=arguments.resume, told=terminal.say,
                         warned=terminal.warn)
    except (engine.EngineError, OSError, atomic_file.NotWrittenError) as error:
        raise OSError(f'{error}; {_left(folder)}') from None
    except KeyboardInterrupt:
        terminal.complain(f'interrupted; {_left(folder)}')
        return 130
    terminal.print_rows(f'{campaign.name}: {result["cases"]} cases', [
        *((status, count) for status, count in result['ends'].items()),
        ('processor time', f'{result["cpu_s_per_case"]:.3g} s a case, '
         f'{result["cpu_hours_per_thousand"]:.3g} h a thousand'), ('table', folder)])
    terminal.write_json(arguments.json, result)
    return 0


def _left(folder: Path) -> str:
    """Return what a campaign that did not end has left, and how to go on."""
    from poststall_sim.campaign import table
    if table.begun(folder):
        return f'what has come is in {folder}: go on with --resume'
    return 'nothing has come: give the same command again'


def _watch(items: Iterable, total: int) -> Iterator:
    return terminal.watched(items, total, 'campaign')


def _draw(arguments: argparse.Namespace) -> int:
    from poststall_sim import plots
    from poststall_sim.campaign import table
    from poststall_sim.jobs import NoResultError
    folder = Path(arguments.what[1])
    definition, rows = table.read(folder)
    output = arguments.output or folder / 'figures'
    drawn = plots.campaign_figures(definition, rows, output)
    if not drawn:
        raise NoResultError(f'{folder}: nothing to draw, no quantity differs between its rows, '
                            f'{len(rows["case"])} of them')
    for path in drawn:
        terminal.drawn(path)
    terminal.write_json(arguments.json, {
        'campaign': definition['name'], 'rows': len(rows['case']),
        'figures': [str(path) for path in drawn]})
    return 0
