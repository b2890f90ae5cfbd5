# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Stability and control derivatives at angles of attack, past the stall too."""

import argparse
import math
from dataclasses import replace

import numpy as np

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.aero import model as models
from poststall_sim.commands import solver
from poststall_sim.commands.solver import Command


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    derivatives = command(
        'derivatives', 'stability and control derivatives, past the stall too',
        '--alpha 2:22:4 --plot derivatives.png', 'trainer')
    derivatives.add_argument('--alpha', type=values.span, required=True, metavar='A[:B:STEP]',
                             help='angles of attack [deg], in this order: each starts from the '
                             'one before')
    derivatives.add_argument('--beta', type=values.within((-60.0, 60.0)), default=0.0,
                             metavar='DEG',
                             help='sideslip, positive with the wind from the right (default 0)')
    derivatives.add_argument('--deflect', type=values.deflection, action=values.Deflections,
                             default={}, metavar='NAME=DEG',
                             help='a control; again for another one')
    derivatives.add_argument('--airspeed', type=values.within(values.AIRSPEED), default=15.0,
                             metavar='M/S', help='(default 15)')
    derivatives.add_argument('--altitude', type=values.within(values.ALTITUDE), default=0.0,
                             metavar='M', help='(default 0)')
    derivatives.add_argument('--reference', type=values.reference, default=None,
                             metavar='cg|X,Y,Z',
                             help='what moments and rates are about: the centre of gravity '
                             '(default), or a point of the drawing [m]')
    derivatives.add_argument('--axes', choices=('body', 'stability'), default='body',
                             help='of rolling and yawing moments and rates: those of the body '
                             '(default), or turned by alpha into the wind')
    derivatives.add_argument('--plot', type=values.figure, nargs='?', metavar='FILE',
                             const='derivatives.png',
                             help='draw them over the angle of attack: PNG, SVG or PDF '
                             '(default derivatives.png)')
    solver.add_as_avl(solver.add_options(derivatives))
    return derivatives


def run(arguments: argparse.Namespace) -> int:
    """Print a block for each angle; write or draw them as asked; return the exit code."""
    from poststall_sim import derivative_analysis, jobs
    model = solver.model(arguments)
    head = solver.head(arguments, model)
    mass = model.aircraft.mass
    about = mass.cg_G if arguments.reference is None else arguments.reference
    if about != mass.cg_G:
        model = models.build(
            replace(model.aircraft, mass=replace(mass, cg_G=about)), model.settings,
            model.atmosphere)
    axes = derivative_analysis.Axes(arguments.axes)
    about_axes = derivative_analysis.AXES[axes]
    deflected = jobs.deflections(model.aircraft, {
        name: math.radians(value) for name, value in arguments.deflect.items()})
    points = list(terminal.watched(
        derivative_analysis.along(
            model, np.radians(arguments.alpha), beta=math.radians(arguments.beta),
            deflected=deflected, airspeed=arguments.airspeed, altitude=arguments.altitude,
            axes=axes),
        len(arguments.alpha), 'derivatives'))
    for point in points:
        title, columns, rows = derivative_analysis.block(point)
        terminal.say(title)
        terminal.print_table(columns, rows)
        terminal.say('')
    terminal.say(f'{about_axes}; {derivative_analysis.UNITS.partition(";")[0]}')
    result = {
        **head, 'axes': about_axes, 'units': derivative_analysis.UNITS,
        'left_out': derivative_analysis.LEFT_OUT, 'moment_reference_m': list(about),
        'airspeed_m_s': arguments.airspeed, 'altitude_m': arguments.altitude,
        'beta_deg': arguments.beta, 'deflections_deg': arguments.deflect, 'points': points}
    terminal.write_json(arguments.json, result)
    if arguments.plot:
        from poststall_sim import plots
        terminal.drawn(plots.derivatives_figure(result, arguments.plot))
    if all(point['status'] != 'converged' for point in points):
        raise jobs.NoResultError(f'no derivatives: {points[-1]["message"]}')
    return 0
