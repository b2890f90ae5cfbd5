# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Straight flight in balance, powered or gliding."""

import argparse
import math

import numpy as np

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.commands import solver
from poststall_sim.commands.solver import Command


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    trim = command('trim', 'straight flight in balance, powered or gliding',
                   '--airspeed 9:25:2 --plot trim.png', 'trainer')
    trim.add_argument('--airspeed', type=values.span_within(values.AIRSPEED),
                      metavar='V or A:B:STEP', help='powered, with elevator and throttle; '
                      'gliding if there is no engine [m/s]')
    trim.add_argument('--alpha', type=values.span, metavar='A:B:STEP',
                      help='gliding without thrust, at angles of attack [deg]')
    trim.add_argument('--altitude', type=values.within(values.ALTITUDE), default=0.0, metavar='M',
                      help='(default 0)')
    trim.add_argument('--climb', type=values.within(values.CLIMB), metavar='DEG',
                      help='climb angle of the powered trims (default 0)')
    trim.add_argument('--failed', default='', metavar='NAME,...',
                      help='engines that do not work')
    trim.add_argument('--plot', type=values.figure, metavar='FILE',
                        help='draw it: PNG, SVG or PDF')
    solver.add_options(trim)
    return trim


def run(arguments: argparse.Namespace) -> int:
    """Print the trims; write or draw them as asked; return the exit code."""
    from poststall_sim import jobs
    from poststall_sim.aircraft import ConfigError
    if arguments.airspeed is None and arguments.alpha is None:
        raise ConfigError('trim needs --airspeed (powered), --alpha (glide) or both')
    if arguments.climb is not None and not arguments.airspeed:
        raise ConfigError('--climb is of the powered trims: give --airspeed')
    model = solver.model(arguments)
    if arguments.climb is not None and not model.aircraft.engines:
        raise ConfigError(f'{model.aircraft.name} has no engine: --climb has no effect')
    failed = frozenset(arguments.failed.split(',') if arguments.failed else ())
    for name in sorted(failed - set(model.aircraft.engine_names)):
        raise ConfigError(model.aircraft.no_engine(name))
    if failed and not arguments.airspeed:
        raise ConfigError('--failed is of the powered trims: give --airspeed')
    trims = []
    if arguments.airspeed:
        trims += terminal.watched(
            jobs.straight_trims(model, arguments.airspeed, altitude=arguments.altitude,
                                climb_angle=math.radians(arguments.climb or 0.0), failed=failed),
            len(arguments.airspeed), 'trim')
    if arguments.alpha:
        trims += terminal.watched(
            jobs.glides(model, np.radians(arguments.alpha), altitude=arguments.altitude),
            len(arguments.alpha), 'glide')
    result = {**solver.head(arguments, model), 'axes': jobs.AXES, 'altitude_m': arguments.altitude,
              'trims': trims}
    terminal.print_table(
        ('', 'V [m/s]', 'alpha', 'elevator', 'throttle', 'climb', 'sink [m/s]', 'residual', ''),
        ([t['kind'], f'{t["airspeed_m_s"]:z.3f}', f'{t["alpha_deg"]:z.3f}',
          f'{t["elevator_deg"]:z.3f}', f'{t["throttle"]:z.4f}', f'{t["climb_angle_deg"]:z.3f}',
          f'{t["sink_rate_m_s"]:z.3f}', f'{t["residual"]:.0e}', t['message']] for t in trims))
    terminal.write_json(arguments.json, result)
    if arguments.plot:
        from poststall_sim import plots
        terminal.drawn(plots.trim_figure(result, arguments.plot))
    if not any(t['trimmed'] for t in trims):
        raise jobs.NoResultError(f'no trim: {trims[-1]["message"]}')
    return 0
