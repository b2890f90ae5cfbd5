# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Steady coefficients over the angle of attack."""

import argparse
import math
from typing import Any

import numpy as np

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.commands import solver
from poststall_sim.commands.solver import Command

_RATE = (-10.0, 10.0)


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    polar = command('polar', 'steady coefficients over the angle of attack',
                    '--alpha -4:30:1 --deflect elevator=-5 --plot polar.png', 'trainer')
    polar.add_argument('--alpha', type=values.span, default=values.span('-4:24:1'),
                       metavar='A:B:STEP',
                       help='angles of attack [deg], in this order: each starts from the one '
                       'before (default -4:24:1)')
    polar.add_argument('--beta', type=values.number, default=0.0, metavar='DEG',
                       help='sideslip, positive with the wind from the right (default 0)')
    for name, what in (('p', 'roll rate p b/2V'), ('q', 'pitch rate q c/2V'),
                       ('r', 'yaw rate r b/2V')):
        polar.add_argument(f'--{name}', type=values.within(_RATE), default=0.0, metavar='X',
                           help=f'{what} about the body axis through the CG (default 0)')
    polar.add_argument('--deflect', type=values.deflection, action=values.Deflections, default={},
                       metavar='NAME=DEG', help='a control; again for another one')
    polar.add_argument('--airspeed', type=values.within(values.AIRSPEED), default=15.0,
                       metavar='M/S', help='(default 15)')
    polar.add_argument('--altitude', type=values.within(values.ALTITUDE), default=0.0, metavar='M',
                       help='(default 0)')
    polar.add_argument('--sweep', choices=('up', 'updown'), default='up',
                       help='updown: through the angles and back, which shows hysteresis')
    polar.add_argument('--starts', type=values.count, default=0, metavar='N',
                       help='at each point count the distinct solutions that N random starts '
                       'lead to')
    polar.add_argument('--seed', type=values.count, metavar='N',
                       help='of the random starts (default 0)')
    polar.add_argument('--plot', type=values.figure, nargs='?', metavar='FILE',
                         const='polar.png',
                         help='draw it: PNG, SVG or PDF (default polar.png)')
    group = solver.add_options(polar, closure='(default nonlocal; local if a scheme is named)')
    solver.add_as_avl(group)
    _add_study(group)
    return polar


def _add_study(group) -> None:
    """Add what only a steady problem can be asked for."""
    group.add_argument('--scheme', choices=('A', 'B', 'C', 'D', 'robust'),
                       help='how the local closure is solved: a scheme of the dissertation, or '
                       'the one that does not fail (default robust)')
    group.add_argument('--damping', type=values.number, metavar='D',
                       help='under-relaxation of schemes A to D, 0 to 1 (default 1)')
    group.add_argument('--symmetric', action='store_true',
                       help='schemes A to D move mirrored strips alike; the other solvers keep '
                       'symmetry anyway')
    group.add_argument('--start', type=values.start, default=('previous', None),
                       metavar='zero|schemeA1|previous|given=FILE',
                       help='where each point starts: no decambering, one iteration of scheme '
                       'A, the point before (default), or the nearest one in the JSON of an '
                       'earlier run')
    group.add_argument('--axial-wake', action='store_true',
                       help='straight wakes along x, as in AVL, instead of with the flow')
    group.add_argument('--angle-form', choices=('exact', 'linear'), default='exact',
                       help="linear: the dissertation's small angles (default exact)")
    group.add_argument('--tolerance', type=values.positive, metavar='X',
                       help='of the residual: rad, local closure cl (default 1e-5)')
    group.add_argument('--limit', type=values.count, metavar='N',
                       help='iterations at most (default 200)')


def run(arguments: argparse.Namespace) -> int:
    """Print the coefficients; write or draw them as asked; return the exit code."""
    from poststall_sim import jobs
    from poststall_sim.aero.decambering import Closure
    from poststall_sim.aircraft import ConfigError
    start, earlier = arguments.start
    up_and_down = arguments.sweep == 'updown'
    if up_and_down and start != 'previous':
        raise ConfigError('--sweep updown hands the decambering on: it goes with --start previous')
    if arguments.seed is not None and not arguments.starts:
        raise ConfigError('--seed is of the random starts: give --starts')
    model = solver.model(arguments)
    by_name, seed = arguments.deflect, arguments.seed or 0
    rates = (arguments.p, arguments.q, arguments.r)
    conditions = jobs.conditions(
        np.radians(arguments.alpha), beta=math.radians(arguments.beta), rates=rates,
        deflected=jobs.deflections(model.aircraft, {
            name: math.radians(value) for name, value in by_name.items()}))
    points = list(terminal.watched(
        jobs.polar(model, conditions, airspeed=arguments.airspeed, altitude=arguments.altitude,
                   up_and_down=up_and_down, random_starts=arguments.starts, seed=seed,
                   starts=jobs.given_starts(model, conditions, earlier) if earlier else None),
        len(conditions) * (1 + up_and_down) - up_and_down, 'polar'))
    # In attached flow, in sideslip or in rotation it would be no flight at the stall.
    straight = model.settings.decambering and not any((arguments.beta, *rates))
    found = jobs.stall(model, points, altitude=arguments.altitude) if straight else None
    result = {
        **solver.head(arguments, model), 'axes': jobs.AXES, 'strip_axes': jobs.STRIP_AXES,
        'airspeed_m_s': arguments.airspeed, 'altitude_m': arguments.altitude,
        'rates': dict(zip(('pb_2V', 'qc_2V', 'rb_2V'), rates)), 'deflections_deg': by_name,
        'start': start, 'sweep': arguments.sweep, 'seed': seed,
        'stall': found and jobs.stalled(found), 'points': points}
    counted = ('solutions',) if arguments.starts else ()
    terminal.print_table(
        ('alpha [deg]', *jobs.COEFFICIENTS, 'CDi_far', 'stalled strips', 'iterations',
         'residual [rad]' if model.settings.closure is Closure.NONLOCAL else 'residual',
         'uniqueness', *counted, ''), (_row(point) for point in points))
    if found:
        terminal.say(jobs.stall_words(found, model, arguments.altitude))
    terminal.write_json(arguments.json, result)
    if arguments.plot:
        from poststall_sim import plots
        terminal.drawn(plots.polar_figure(result, arguments.plot))
    bad = [p for p in points if p['status'] != 'converged']
    if len(bad) == len(points) or any(p['status'] == 'diverged' for p in bad):
        raise jobs.NoResultError(f'{len(bad)} of {len(points)} points did not converge')
    if bad:
        terminal.complain(f'{len(bad)} of {len(points)} points did not converge, marked with !')
    return 0


def _row(point: dict[str, Any]) -> list[str]:
    """Return the cells of a point in the table."""
    from poststall_sim import jobs
    good = point['status'] == 'converged'
    unique, solutions = point['uniqueness'], point.get('solutions')
    return [
        f'{point["alpha_deg"]:z.2f}', *(f'{point[key]:z.4f}' for key in jobs.COEFFICIENTS),
        f'{point["CDi_far"]:.5f}',
        f'{point["stalled_strips"]}/{len(point["strips"]["cl"])}', str(point['iterations']),
        f'{point["max_residual"]:.0e}' + ('' if good else '!'),
        '-' if unique is None else f'{unique:z.3f}',
        *([f'{solutions["distinct"]}/{solutions["starts"]}'] if solutions else []),
        ' '.join([point['status'], *point['flags']])]
