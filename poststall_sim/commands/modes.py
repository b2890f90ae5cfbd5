# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Modes of trimmed flight along the angle of attack."""

import argparse
import math

import numpy as np

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.aero import model as models
from poststall_sim.commands import solver
from poststall_sim.commands.solver import Command

_STEP = (1e-5, 1.0)
_ROWS = (2, 2000)
_STALLABLE = (-40.0, 50.0)


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    modes = command('modes', 'modes of trimmed flight along the angle of attack',
                    'trainer --alpha 1:25:1 --decambering all --plot modes.png', 'trainer')
    _add_modes(modes)
    solver.add_options(modes)
    return modes


def _add_modes(modes: argparse.ArgumentParser) -> None:
    """Add which flights are trimmed, and what moves when they are disturbed a little."""
    modes.add_argument('aircraft', nargs='?', default=argparse.SUPPRESS, metavar='AIRCRAFT',
                       help='the same as --aircraft')
    modes.add_argument('--alpha', type=values.span_within(_STALLABLE),
                       default=values.span('1:25:1'), metavar='A:B:STEP',
                       help='angles of attack [deg], in this order (default 1:25:1)')
    modes.add_argument('--altitude', type=values.within(values.ALTITUDE), default=0.0, metavar='M',
                       help='(default 0)')
    path = modes.add_mutually_exclusive_group()
    path.add_argument('--level', dest='climb', action='store_const', const=0.0,
                      help='in level flight with the engine, instead of gliding')
    path.add_argument('--climb', type=values.within(values.CLIMB), metavar='DEG',
                      help='along this climb angle with the engine')
    modes.add_argument('--decambering', choices=('fixed', 'variable', 'lagged', 'all'),
                       help='how the decambering follows: not at all, at once (default), by the '
                       'lag law, or each of them')
    modes.add_argument('--lag', type=values.number, metavar='CHORDS', help='time constant of the '
                       f'lagged decambering (default {models.DEFAULTS.lag:g})')
    modes.add_argument('--wake', type=values.whole_within(_ROWS), metavar='ROWS',
                       help='rows of wake in the linear model (default: those of a flight)')
    modes.add_argument('--frozen-wake', action='store_true', help='leave the wake behind the body '
                       'as in steady flight, instead of in the air')
    modes.add_argument('--dt', type=values.within(_STEP), metavar='S',
                       help="step of the linear model [s] (default: a flight's at this airspeed)")
    modes.add_argument('--quasi-steady', action='store_true', help='besides, the modes of the '
                       'classical equations with derivatives of steady loads')
    modes.add_argument('--export', type=values.state_space, metavar='FILE',
                       help='write the linear system at the last angle as state space: .npz '
                       'or .mat')
    modes.add_argument('--order', type=values.count, metavar='N', help='with so many states for '
                       'the air instead of all')
    modes.add_argument('--plot', type=values.figure, nargs='?', metavar='FILE',
                       const='modes.png',
                       help='draw them: PNG, SVG or PDF (default modes.png)')


def run(arguments: argparse.Namespace) -> int:
    """Print the modes; write, draw or export them as asked; return the exit code."""
    from poststall_sim import jobs, modal_analysis
    from poststall_sim.aircraft import ConfigError
    kinds = modal_analysis.decamberings(
        arguments.decambering or ('fixed' if arguments.no_decambering else 'variable'))
    if arguments.no_decambering and arguments.decambering:
        raise ConfigError('--decambering has no effect with --no-decambering')
    if arguments.lag is not None and modal_analysis.LAGGED not in kinds:
        raise ConfigError('--lag is for --decambering lagged or all')
    if arguments.export and len(kinds) > 1:
        raise ConfigError('--export writes one system: give --decambering fixed, variable or '
                          'lagged')
    if arguments.order is not None and not arguments.export:
        raise ConfigError('--order is for --export')
    model = solver.model(arguments)
    flown = {'altitude': arguments.altitude, 'dt': arguments.dt, 'rows': arguments.wake,
             'climb_angle': None if arguments.climb is None else math.radians(arguments.climb)}
    alphas = np.radians(arguments.alpha)
    found = terminal.watched(
        modal_analysis.modes(
            model, alphas, kinds=kinds, quasi_steady=arguments.quasi_steady, **flown),
        len(alphas), 'modes')
    result = {**solver.head(arguments, model), 'axes': jobs.AXES, 'strip_axes': jobs.STRIP_AXES,
              'mode_units': modal_analysis.UNITS, 'altitude_m': arguments.altitude,
              'slipstream': modal_analysis.slipstream(model.aircraft) or None,
              'climb_deg': arguments.climb, 'lag_chords': model.settings.lag,
              'wake': model.settings.wake.value,
              'points': [point for points in found for point in points]}
    head, rows = modal_analysis.table(result['points'])
    terminal.print_table(head, rows)
    if any(modal_analysis.MARK in cell for row in rows for cell in row):
        terminal.say(f'{modal_analysis.MARK} less than half of the mode is the body, the rest is '
                     'wake')
    if result['slipstream']:
        terminal.say(result['slipstream'])
    terminal.write_json(arguments.json, result)
    if arguments.plot:
        from poststall_sim import plots
        terminal.drawn(plots.modes_figure(result, arguments.plot))
    points = result['points']
    bad = [point for point in points if point['status'] != 'converged']
    if len(bad) == len(points):
        raise jobs.NoResultError(f'no modes: {bad[-1]["message"]}')
    if bad:
        terminal.complain(f'{len(bad)} of {len(points)} points have no modes, see the last column')
    if arguments.export:
        terminal.say(modal_analysis.export(
            arguments.export, model, alphas, kind=kinds[0], order=arguments.order, **flown))
    return 0
