# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A scenario flown as fast as it goes, and recorded."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.aero import model as models
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.wake import Shape
from poststall_sim.commands import solver
from poststall_sim.commands.solver import Command

_DURATION = (1e-3, 1e6)


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    fly = command('fly', 'fly a scenario as fast as it goes, and record it',
                  '--scenario stall_and_recovery --record flight', 'trainer')
    fly.add_argument('--scenario', default='stall_and_recovery', metavar='NAME_OR_FILE',
                     help='a file, or a name in config/scenarios (default stall_and_recovery)')
    fly.add_argument('--record', type=Path, metavar='DIR',
                     help='write a rosbag2 folder, the same topics as the node')
    fly.add_argument('--duration', type=values.within(_DURATION), metavar='S',
                     help="instead of the scenario's")
    fly.add_argument('--airspeed', type=values.within(values.AIRSPEED), metavar='M/S',
                     help="at which it starts, trimmed; instead of the scenario's")
    fly.add_argument('--altitude', type=values.within(values.HEIGHT), metavar='M', help='likewise')
    fly.add_argument('--wind', type=values.wind, metavar='E,N,U',
                     help='velocity of the air, where it blows to: east, north, up [m/s], as '
                     "the node's wind.velocity")
    fly.add_argument('--save', type=values.output, metavar='FILE',
                     help='write the flight as it ends, wake and all, to go on with later')
    fly.add_argument('--resume', type=Path, metavar='FILE',
                     help='go on from a saved flight, at its time in the scenario, instead of '
                     'starting in trim')
    _add_time(solver.add_options(fly))
    return fly


def _add_time(group) -> None:
    """Add what only flow in time has: a wake that goes somewhere, a ground, late separation."""
    group.add_argument('--wake', choices=tuple(shape.value for shape in Shape),
                       help='where shed rows go: with the air (default), with what they induce '
                       'as well, or nowhere seen from the body')
    group.add_argument('--ground', action='store_true',
                       help='feel the flat ground at altitude 0')
    group.add_argument('--separation', choices=tuple(law.value for law in Separation),
                       help='at once (default), late with one time constant, or by the law of '
                       'Goman and Khrabrov: dynamic stall')
    for name, what in (('lag', 'time constant under lag'),
                       ('relaxation', 'time in which it relaxes under goman_khrabrov'),
                       ('delay', 'delay in a motion under goman_khrabrov')):
        group.add_argument(f'--{name}', type=values.number, metavar='CHORDS',
                           help=f'{what} (default {getattr(models.DEFAULTS, name):g})')


def run(arguments: argparse.Namespace) -> int:
    """Fly, print what happened; record, save or write it as asked; return the exit code."""
    from poststall_sim import definition, flight_file, jobs, simulation, trim_jobs
    from poststall_sim.aircraft import ConfigError
    from poststall_sim.frames import swap_ned_enu
    scenario = definition.scenario(
        definition.find(definition.Kind.SCENARIO, arguments.scenario))
    duration = arguments.duration or scenario.duration
    airspeed = arguments.airspeed or scenario.airspeed
    altitude = arguments.altitude or scenario.altitude
    for name, value, limits in (('airspeed_m_s', airspeed, values.AIRSPEED),
                                ('altitude_m', altitude, values.HEIGHT)):
        if complaint := values.refused(value, limits):
            raise ConfigError(f'scenario {scenario.name}: {name} {complaint}')
    model = solver.model(arguments)   # refuses what is wrong with the definition
    jobs.require_controls(model.aircraft, scenario)
    if arguments.resume:
        for name in ('airspeed', 'altitude', 'wind'):
            if getattr(arguments, name) is not None:
                raise ConfigError(
                    f'--{name} has no effect with --resume: the flight goes on as saved')
        with terminal.patience():
            flight = jobs.resumed(model, arguments.resume, duration)
    else:
        try:
            with terminal.patience():
                flight = simulation.start(
                    model.aircraft, model.settings, airspeed=airspeed, altitude=altitude,
                    wind_N=np.zeros(3) if arguments.wind is None else
                    swap_ned_enu(arguments.wind))
        except ConfigError as error:
            raise jobs.NoResultError(trim_jobs.explained(str(error))) from None
    with _recorder(arguments.record, flight) as recorder:
        log = jobs.FlightLog(flight)   # from here on it counts the wall time
        for snapshot in terminal.watched(jobs.fly(flight, scenario, duration, recorder),
                                 round(duration * 1e9 / flight.dt_ns), 'fly'):
            log.add(snapshot)
    if arguments.save:
        flight_file.save_state(flight, arguments.save)
    summary = log.summary(flight)
    deepest, bag = summary['deepest_stall'], arguments.record
    terminal.print_rows(
        f'{model.aircraft.name}, {scenario.name}: {summary["flown_s"]:.2f} s flown in '
        f'{summary["wall_time_s"]:.2f} s', (
            ('real-time factor', f'{summary["real_time_factor"]:.2f}'),
            ('steps', f'{summary["steps"]} of {1e3 * summary["dt_s"]:g} ms'),
            ('iterations', f'mean {summary["iterations_mean"]:.2f}, max '
             f'{summary["iterations_max"]}; steps not converged: '
             f'{summary["not_converged_steps"]}'),
            ('largest residual', f'{summary["residual_max"]:.1e}'),
            ('deepest stall', 'none' if not deepest['stalled_wing_strips'] else
             f'{deepest["stalled_wing_strips"]} of {summary["wing_strips"]} wing strips at '
             f'{deepest["time_s"]:.2f} s, alpha {deepest["alpha_deg"]:.1f} deg, '
             f'CL {deepest["CL"]:.2f}'),
            ('stalled at the end', f'{summary["stalled_strips_at_end"]} strips'),
            ('altitude lost', f'{summary["altitude_lost_m"]:.1f} m'),
            *([('bag', bag)] if bag else []),
            *([('saved', arguments.save)] if arguments.save else [])))
    terminal.write_json(arguments.json, {
        **solver.head(arguments, model), 'scenario': scenario.name, 'airspeed_m_s': airspeed,
        'altitude_m': altitude, 'wind_enu_m_s': swap_ned_enu(flight.wind_N).tolist(),
        'bag': str(bag) if bag else None, 'summary': summary, 'series': log.series})
    if flight.paused_reason:
        if flight.paused_reason.startswith('diverged'):
            raise jobs.NoResultError(flight.paused_reason)
        terminal.complain(f'the flight ended early: {flight.paused_reason}')
    return 0


@contextmanager
def _recorder(path: Path | None, flight) -> Iterator:
    """Give a recorder of the flight, None without a path."""
    if path is None:
        yield None
        return
    from poststall_sim import recording
    from poststall_sim.aircraft import ConfigError
    try:
        recorder = recording.FlightRecorder(path, flight)
    except recording.BagError as error:
        raise ConfigError(str(error)) from None
    with recorder:
        yield recorder
