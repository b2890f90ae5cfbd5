# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A grid of steady coefficients in a folder, and tables of it for other simulators."""

import argparse
from collections import Counter

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.commands import solver
from poststall_sim.commands.solver import Command

_RATE = (-10.0, 10.0)
_FORMATS = ('csv', 'jsbsim', 'gz')
AERODYNAMICS, PLUGIN = 'aerodynamics.xml', 'advanced_lift_drag.sdf'


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    database = command(
        'database', 'steady coefficients over a grid, as CSV and for JSBSim and Gazebo',
        '--alpha -10:30:2 --beta -10:10:5 --deflect elevator=-20:20:10 --output trainer_tables '
        '--format csv,jsbsim', 'trainer')
    database.add_argument('--alpha', type=values.span, required=True, metavar='A:B:STEP',
                          help='angles of attack [deg]; each starts from the one before')
    database.add_argument('--beta', type=values.span, default=[0.0], metavar='A:B:STEP',
                          help='sideslips [deg] (default 0)')
    for name, what in (('p', 'roll rates p b/2V'), ('q', 'pitch rates q c/2V'),
                       ('r', 'yaw rates r b/2V')):
        database.add_argument(f'--{name}', type=values.span_within(_RATE), metavar='A:B:STEP',
                              help=f'{what} about the body axis through the CG (default 0)')
    database.add_argument('--deflect', type=values.deflections, action=values.Deflections,
                          default={}, metavar='NAME=A:B:STEP',
                          help='deflections of a control [deg]; again for another one')
    database.add_argument('--full', action='store_true',
                          help='every combination; otherwise alpha and sideslip are combined, '
                          'and each rate and control is moved alone, at no sideslip')
    database.add_argument('--output', type=values.folder, required=True, metavar='DIR',
                          help='where it is written, row by row')
    database.add_argument('--format', type=values.some_of(_FORMATS), default=['csv'],
                          metavar='F[,F...]', help='csv (always there), jsbsim: tables that are '
                          'added up, gz: parameters of AdvancedLiftDrag')
    database.add_argument('--resume', action='store_true',
                          help='go on with the database in the folder, if there is one')
    database.add_argument('--airspeed', type=values.within(values.AIRSPEED), default=15.0,
                          metavar='M/S', help='(default 15)')
    database.add_argument('--altitude', type=values.within(values.ALTITUDE), default=0.0,
                          metavar='M', help='(default 0)')
    solver.add_options(database)
    return database


def run(arguments: argparse.Namespace) -> int:
    """Compute what is missing and write it as asked; return the exit code."""
    from poststall_sim import aero_database, gazebo_writer, jobs, jsbsim_writer, lift_drag_fit
    from poststall_sim.aircraft import ConfigError
    grid = aero_database.Grid(
        arguments.alpha, arguments.beta,
        {name: found for name in 'pqr' if (found := getattr(arguments, name))},
        arguments.deflect, arguments.full)
    tabled = [each for each in arguments.format if each != 'csv']
    if tabled:
        grid.require_tables()
    if 'gz' in tabled and len(set(arguments.alpha)) < lift_drag_fit.LEAST_ANGLES:
        raise ConfigError(f'--format gz needs at least {lift_drag_fit.LEAST_ANGLES} angles of '
                          f'attack, got {len(set(arguments.alpha))}')
    model = solver.model(arguments)
    database = aero_database.Database(
        arguments.output, model, grid, airspeed=arguments.airspeed, altitude=arguments.altitude,
        resume=arguments.resume)
    before = database.done
    list(terminal.watched(database.run(), database.rows - before, 'database'))
    statuses = Counter(database.statuses())
    written = [arguments.output / aero_database.TABLE]
    result = {
        **solver.head(arguments, model), 'axes': jobs.AXES, 'rows': database.rows,
        'rows_before': before, 'statuses': dict(statuses)}
    errors: list[tuple[str, object]] = []
    if tabled:
        tables = database.build_up()
    if 'jsbsim' in tabled:
        written.append(arguments.output / AERODYNAMICS)
        jsbsim_writer.write(written[-1], tables)
    if 'gz' in tabled:
        written.append(arguments.output / PLUGIN)
        fit = lift_drag_fit.fit(tables)
        gazebo_writer.write(written[-1], tables, fit)
        result['gz'] = {
            'parameters': dict(fit.values), 'controls_per_deg': dict(fit.controls),
            'rms_up_to_stall_and_all': {key: list(each) for key, each in fit.rms.items()},
            'worst_up_to_stall_and_all': {key: list(each) for key, each in fit.worst.items()}}
        errors = [(f'gz, {key}', f'left up to the stall rms {fit.rms[key][0]:.4f}, worst '
                   f'{fit.worst[key][0]:.4f}; over all angles {fit.rms[key][1]:.4f}, '
                   f'{fit.worst[key][1]:.4f}') for key in fit.rms]
    result['files'] = [str(path) for path in written]
    terminal.print_rows(
        f'{model.aircraft.name}: {database.rows} conditions, {before} of them from before', (
            *(('file', path) for path in written),
            ('status', ', '.join(f'{n} {each}' for each, n in statuses.items())), *errors))
    terminal.write_json(arguments.json, result)
    bad = database.rows - statuses['converged']
    if bad == database.rows:
        raise jobs.NoResultError(f'none of {database.rows} conditions converged')
    if bad:
        terminal.complain(f'{bad} of {database.rows} conditions did not converge')
    return 0
