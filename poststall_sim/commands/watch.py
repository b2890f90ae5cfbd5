# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A running simulator in a browser of this machine."""

import argparse
import asyncio
import threading
import webbrowser

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.commands import solver
from poststall_sim.commands.solver import Command

PORTS = (0, 65535)
RATES = (1.0, 60.0)


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    watch = command('watch', 'show a running simulator as a live page in a browser',
                    '--control --open', None, of_aircraft=False)
    watch.add_argument('--namespace', default='/', metavar='NS',
                       help='of the simulator (default /)')
    watch.add_argument('--control', action='store_true',
                       help='let the page fly, by pilot/surface_cmd, and pause, reset, trim')
    watch.add_argument('--aircraft', metavar='NAME_OR_FILE',
                       help='of which the limits of the controls are read (default: the one that '
                       'the simulator names)')
    watch.add_argument('--port', type=values.whole_within(PORTS), default=8080, metavar='N',
                       help='on 127.0.0.1; 0 takes any that is free (default 8080)')
    watch.add_argument('--rate', type=values.within(RATES), default=20.0, metavar='HZ',
                       help='how often the page gets the state (default 20)')
    watch.add_argument('--open', action='store_true', help='open the page in the browser')
    return watch


def run(arguments: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C and return the exit code."""
    try:
        from poststall_sim.watch.server import Server
    except ImportError as error:
        if error.name != 'aiohttp':
            raise
        raise ImportError('the live page needs aiohttp: pip install aiohttp') from error
    try:
        from poststall_sim.ros import watch
    except ImportError as error:
        raise ImportError(
            f'the live page hears ROS 2, which is not here ({error}): source ROS 2 Jazzy, or '
            "pip install '.[ros]' in the checkout") from error
    aircraft = solver.aircraft(arguments) if arguments.aircraft else None
    with watch.watching(arguments.namespace, aircraft) as (simulator, listening):
        server = Server(simulator, control=arguments.control, rate=arguments.rate)

        def ready(url: str) -> None:
            terminal.say(f'{url}  shows the simulator in {simulator.get_namespace()}; '
                         'Ctrl-C ends it')
            terminal.write_json(arguments.json, {
                'url': url, 'namespace': simulator.get_namespace(),
                'control': arguments.control})
            if arguments.open:
                # Some browsers keep whoever opens them waiting, and nobody would serve the page.
                threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()

        asyncio.run(server.serve(arguments.port, ready, listening))
    return 0
