# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A scenario flown as fast as it goes, and recorded."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.aero import model as models
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.wake import Shape
from poststall_sim.commands import series, solver
from poststall_sim.commands.solver import Command
from poststall_sim.frames import swap_ned_enu
from poststall_sim.turbulence import Severity, Spectrum, Turbulence, intensity, military
from poststall_sim.weather import Gust, Weather

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
                     help="instead of the scenario's; counted from its start, also with --resume")
    fly.add_argument('--airspeed', type=values.within(values.AIRSPEED), metavar='M/S',
                     help="at which it starts, trimmed; instead of the scenario's")
    fly.add_argument('--altitude', type=values.within(values.HEIGHT), metavar='M', help='likewise')
    fly.add_argument('--wind', type=values.wind, metavar='E,N,U',
                     help='velocity of the air, where it blows to: east, north, up [m/s], as '
                     "the node's wind.velocity; instead of the scenario's")
    fly.add_argument('--fail', type=values.fault, action='append', default=[],
                     metavar='NAME:KIND[=DEG][@S]',
                     help='a part that fails, all that a control moves or an engine, after so '
                     'many seconds: elevator:stuck, rudder:stuck=-5@8, aileron_right:float, '
                     "flap:lost, engine_1:off@3; may be given again, and adds to the scenario's")
    fly.add_argument('--turbulence', type=values.turbulence, metavar='LEVEL',
                     help='light, moderate or severe by MIL-F-8785C, or the root mean square of '
                     "its vertical part [m/s]; Dryden's spectrum; instead of the scenario's")
    fly.add_argument('--seed', type=values.count, metavar='N',
                     help='of the turbulence: the same seed, the same flight (default 0)')
    fly.add_argument('--gust', type=values.gust, action='append', default=[],
                     metavar='E,N,U:LENGTH:BEGIN',
                     help='a gust of that velocity [m/s] in 1-cosine form, its greatest a length '
                     '[m] behind its begin, so far north of the start [m]; may be given again, '
                     'with those of the scenario')
    fly.add_argument('--save', type=values.output, metavar='FILE',
                     help='write the flight as it ends, wake and all, to go on with later')
    fly.add_argument('--resume', type=Path, metavar='FILE',
                     help='go on from a saved flight, at its time in the scenario, instead of '
                     'starting in trim')
    series.add_files(fly)
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
    from poststall_sim import definition, flight_export, flight_file, jobs, simulation, trim_jobs
    from poststall_sim.aircraft import ConfigError
    scenario = definition.scenario(
        definition.find(definition.Kind.SCENARIO, arguments.scenario))
    scenario = replace(scenario, faults=(*scenario.faults, *arguments.fail))
    duration = arguments.duration or scenario.duration
    airspeed = arguments.airspeed or scenario.airspeed
    altitude = arguments.altitude or scenario.altitude
    for name, value, limits in (('airspeed_m_s', airspeed, values.AIRSPEED),
                                ('altitude_m', altitude, values.HEIGHT)):
        if complaint := values.refused(value, limits):
            raise ConfigError(f'scenario {scenario.name}: {name} {complaint}')
    # Refuses what is wrong with the definition.
    model = solver.model(arguments, scenario.atmosphere)
    flyable = jobs.fitted(model.aircraft, scenario)
    if flyable.channels != scenario.channels:
        terminal.complain(f'{model.aircraft.name} has no engine: the throttle of {scenario.name} '
                          'is left out')
    scenario = flyable
    jobs.require_controls(model.aircraft, scenario)
    if late := [fault.name for fault in scenario.faults if fault.time >= duration]:
        raise ConfigError(f'{", ".join(late)}: fails after the end of the flight, at {duration:g} '
                          's: give --duration')
    if arguments.resume:
        for name in ('airspeed', 'altitude', 'wind', 'turbulence', 'seed', 'gust',
                     'temperature_offset', 'qnh'):
            if values.given(getattr(arguments, name)):
                raise ConfigError(f'--{name.replace("_", "-")} has no effect with --resume: the '
                                  'flight goes on as saved')
        flight = jobs.resumed(model, arguments.resume, duration)
    else:
        weather = _weather(arguments, scenario.weather, altitude)
        try:
            flight = simulation.start(
                model.aircraft, model.settings, airspeed=airspeed, altitude=altitude,
                atmosphere=model.atmosphere, weather=weather)
        except ConfigError as error:
            raise jobs.NoResultError(trim_jobs.explained(str(error))) from None
    with _recorder(arguments.record, flight, scenario.name) as recorder:
        log = jobs.FlightLog(flight)   # from here on it counts the wall time
        collector = flight_export.Collector(flight, log) \
            if arguments.csv or arguments.mat else None
        for snapshot in terminal.watched(jobs.fly(flight, scenario, duration, recorder),
                                 round(duration * 1e9 / flight.dt_ns), 'fly'):
            log.add(snapshot)
            if collector is not None:
                collector.add(snapshot)
    if arguments.save:
        flight_file.save_state(flight, arguments.save)
    written = [] if collector is None else series.write_files(arguments, collector.series())
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
            *(('outside the method', f'{each["worst"]}, from {each["from_s"]:.2f} s on, '
               f'{each["steps"]} steps') for each in summary['outside_the_method']),
            *([('failed', ', '.join(summary['failed']))] if summary['failed'] else []),
            *([('bag', bag)] if bag else []),
            *([('saved', arguments.save)] if arguments.save else []),
            *(('time series', path) for path in written)))
    terminal.write_json(arguments.json, {
        **solver.head(arguments, model), 'scenario': scenario.name, 'airspeed_m_s': airspeed,
        'altitude_m': altitude, 'wind_enu_m_s': swap_ned_enu(flight.wind_N).tolist(),
        'turbulence': _told(flight.weather.turbulence), 'gusts': len(flight.weather.gusts),
        'bag': str(bag) if bag else None, 'summary': summary, 'series': log.series})
    if flight.paused_reason:
        if flight.paused_reason.startswith('diverged'):
            raise jobs.NoResultError(flight.paused_reason)
        terminal.complain(f'the flight ended early: {flight.paused_reason}')
    return 0


def _weather(arguments: argparse.Namespace, weather: Weather, altitude: float) -> Weather:
    """Return the weather of a scenario with what the options say instead or besides."""
    from poststall_sim.aircraft import ConfigError
    if arguments.wind is not None:
        weather = replace(weather, wind_N=swap_ned_enu(arguments.wind))
    north = np.array([1.0, 0.0, 0.0])
    weather = replace(weather, gusts=(*weather.gusts, *(
        Gust(swap_ned_enu(velocity), length, begin, north)
        for velocity, length, begin in arguments.gust)))
    level, seed = arguments.turbulence, arguments.seed
    if level is not None:
        vertical = intensity(Severity[level.upper()], altitude) if isinstance(level, str) \
            else level
        weather = replace(weather, turbulence=military(
            Spectrum.DRYDEN, vertical, altitude=altitude, seed=seed or 0))
    elif seed is not None:
        if weather.turbulence is None:
            raise ConfigError('--seed is of the turbulence: give --turbulence')
        weather = replace(weather, turbulence=replace(weather.turbulence, seed=seed))
    return weather


def _told(turbulence: Turbulence | None) -> dict | None:
    """Return the turbulence as the JSON has it."""
    return turbulence and {
        'spectrum': turbulence.spectrum.value, 'horizontal_m_s': turbulence.horizontal,
        'vertical_m_s': turbulence.vertical, 'horizontal_scale_m': turbulence.horizontal_scale,
        'vertical_scale_m': turbulence.vertical_scale, 'seed': turbulence.seed}


@contextmanager
def _recorder(path: Path | None, flight, scenario: str) -> Iterator:
    """Give a recorder of the flight, None without a path."""
    if path is None:
        yield None
        return
    from poststall_sim import recording
    from poststall_sim.aircraft import ConfigError
    try:
        recorder = recording.FlightRecorder(path, flight, scenario)
    except recording.BagError as error:
        raise ConfigError(str(error)) from None
    with recorder:
        yield recorder
