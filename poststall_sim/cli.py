# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The command `poststall`: polars, trims, modes, flights and figures without a ROS graph.

Angles are in degrees here, on the way in and out. Exit codes: 0 a result, 1 none (no trim, not
converged, diverged), 2 bad input, said in one line on stderr.
"""

import argparse
import math
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim import __version__, option_values, options, terminal
from poststall_sim.aero import model as models


def main(argv: list[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    arguments = options.parse(sys.argv[1:] if argv is None else argv)
    from poststall_sim.aircraft import ConfigError
    from poststall_sim.jobs import NoResultError
    try:
        return _COMMANDS[arguments.command](arguments)
    except NoResultError as error:
        terminal.complain(error)
        return 1
    except BrokenPipeError:   # the reader, `head` perhaps, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        terminal.complain('interrupted')
        return 130
    except (ConfigError, ImportError, OSError) as error:
        terminal.complain(error)
        return 2


def _polar(arguments: argparse.Namespace) -> int:
    from poststall_sim import jobs
    from poststall_sim.aircraft import ConfigError
    start, earlier = arguments.start
    up_and_down = arguments.sweep == 'updown'
    if up_and_down and start != 'previous':
        raise ConfigError('--sweep updown hands the decambering on: it goes with --start previous')
    if arguments.seed is not None and not arguments.starts:
        raise ConfigError('--seed is of the random starts: give --starts')
    model = _model(arguments)
    by_name, seed = arguments.deflect, arguments.seed or 0
    rates = (arguments.p, arguments.q, arguments.r)
    conditions = jobs.conditions(
        np.radians(arguments.alpha), beta=math.radians(arguments.beta), rates=rates,
        deflected=jobs.deflections(model, {
            name: math.radians(value) for name, value in by_name.items()}))
    points = list(terminal.watched(
        jobs.polar(model, conditions, airspeed=arguments.airspeed, altitude=arguments.altitude,
                   up_and_down=up_and_down, random_starts=arguments.starts, seed=seed,
                   starts=jobs.given_starts(model, conditions, earlier) if earlier else None),
        len(conditions) * (1 + up_and_down) - up_and_down, 'polar'))
    result = {
        **_head(arguments, model), 'axes': jobs.AXES, 'strip_axes': jobs.STRIP_AXES,
        'airspeed_m_s': arguments.airspeed, 'altitude_m': arguments.altitude,
        'rates': dict(zip(('pb_2V', 'qc_2V', 'rb_2V'), rates)), 'deflections_deg': by_name,
        'start': start, 'sweep': arguments.sweep, 'seed': seed, 'points': points}
    counted = ('solutions',) if arguments.starts else ()
    terminal.print_table(
        ('alpha', *jobs.COEFFICIENTS, 'stalled', 'iterations', 'residual', 'uniqueness',
         *counted, ''), (_polar_row(point) for point in points))
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


def _polar_row(point: dict[str, Any]) -> list[str]:
    """Return the cells of a point in the table."""
    from poststall_sim import jobs
    good = point['status'] == 'converged'
    unique, solutions = point['uniqueness'], point.get('solutions')
    return [
        f'{point["alpha_deg"]:z.2f}', *(f'{point[key]:z.4f}' for key in jobs.COEFFICIENTS),
        f'{point["stalled_strips"]}/{len(point["strips"]["cl"])}', str(point['iterations']),
        f'{point["max_residual"]:.0e}' + ('' if good else '!'),
        '-' if unique is None else f'{unique:z.3f}',
        *([f'{solutions["distinct"]}/{solutions["starts"]}'] if solutions else []),
        ' '.join([point['status'], *point['flags']])]


def _trim(arguments: argparse.Namespace) -> int:
    from poststall_sim import jobs
    from poststall_sim.aircraft import ConfigError
    if arguments.airspeed is None and arguments.alpha is None:
        raise ConfigError('trim needs --airspeed (powered), --alpha (glide) or both')
    if arguments.climb is not None and not arguments.airspeed:
        raise ConfigError('--climb is of the powered trims: give --airspeed')
    model = _model(arguments)
    if arguments.climb is not None and not model.aircraft.engines:
        raise ConfigError(f'{model.aircraft.name} has no engine: --climb has no effect')
    trims = []
    if arguments.airspeed:
        trims += terminal.watched(
            jobs.straight_trims(model, arguments.airspeed, altitude=arguments.altitude,
                                climb_angle=math.radians(arguments.climb or 0.0)),
            len(arguments.airspeed), 'trim')
    if arguments.alpha:
        trims += terminal.watched(
            jobs.glides(model, np.radians(arguments.alpha), altitude=arguments.altitude),
            len(arguments.alpha), 'glide')
    result = {**_head(arguments, model), 'axes': jobs.AXES, 'altitude_m': arguments.altitude,
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


def _modes(arguments: argparse.Namespace) -> int:
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
    model = _model(arguments)
    flown = {'altitude': arguments.altitude, 'dt': arguments.dt, 'rows': arguments.wake,
             'climb_angle': None if arguments.climb is None else math.radians(arguments.climb)}
    alphas = np.radians(arguments.alpha)
    found = terminal.watched(
        modal_analysis.modes(
            model, alphas, kinds=kinds, quasi_steady=arguments.quasi_steady, **flown),
        len(alphas), 'modes')
    result = {**_head(arguments, model), 'axes': jobs.AXES, 'strip_axes': jobs.STRIP_AXES,
              'mode_units': modal_analysis.UNITS, 'altitude_m': arguments.altitude,
              'climb_deg': arguments.climb, 'lag_chords': model.settings.lag,
              'wake': model.settings.wake.value,
              'points': [point for points in found for point in points]}
    head, rows = modal_analysis.table(result['points'])
    terminal.print_table(head, rows)
    if any(modal_analysis.MARK in cell for row in rows for cell in row):
        terminal.say(f'{modal_analysis.MARK} less than half of the mode is the body, the rest is '
                     'wake')
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


def _fly(arguments: argparse.Namespace) -> int:
    from poststall_sim import definition, flight_file, jobs, simulation
    from poststall_sim.aircraft import ConfigError
    from poststall_sim.frames import swap_ned_enu
    scenario = definition.scenario(
        definition.find(definition.Kind.SCENARIO, arguments.scenario))
    duration = arguments.duration or scenario.duration
    airspeed = arguments.airspeed or scenario.airspeed
    altitude = arguments.altitude or scenario.altitude
    for name, value, limits in (('airspeed_m_s', airspeed, option_values.AIRSPEED),
                                ('altitude_m', altitude, option_values.HEIGHT)):
        if complaint := option_values.refused(value, limits):
            raise ConfigError(f'scenario {scenario.name}: {name} {complaint}')
    model = _model(arguments)   # refuses what is wrong with the definition
    jobs.require_controls(model, scenario)
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
            raise jobs.NoResultError(jobs.explained(str(error))) from None
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
        **_head(arguments, model), 'scenario': scenario.name, 'airspeed_m_s': airspeed,
        'altitude_m': altitude, 'wind_enu_m_s': swap_ned_enu(flight.wind_N).tolist(),
        'bag': str(bag) if bag else None, 'summary': summary, 'series': log.series})
    if flight.paused_reason:
        if flight.paused_reason.startswith('diverged'):
            raise jobs.NoResultError(flight.paused_reason)
        terminal.complain(f'the flight ended early: {flight.paused_reason}')
    return 0


def _plot(arguments: argparse.Namespace) -> int:
    from poststall_sim import recording
    from poststall_sim.aircraft import ConfigError
    from poststall_sim.plots import bag as bags
    from poststall_sim.plots import flight as figures
    bag = arguments.bag
    if not bag.exists():
        raise ConfigError(f'there is no bag {bag}')
    if bag.is_dir() and not (bag / 'metadata.yaml').is_file():
        raise ConfigError(f'{bag} is not a bag: it has no metadata.yaml')
    output = arguments.output or bag.resolve().with_name(f'{bag.resolve().name}_figures')
    try:
        flight = bags.flight_data(bag, _aircraft(arguments) if arguments.aircraft else None)
        with terminal.patience('drawing'):
            drawn = figures.draw_flight(flight, output)
    except recording.BagError as error:
        raise ConfigError(str(error)) from None
    for path in drawn:
        terminal.drawn(path)
    for note in flight.notes:
        terminal.complain(note)
    terminal.write_json(arguments.json, {
        'bag': str(bag), 'name': flight.name, 'figures': [str(path) for path in drawn],
        'notes': list(flight.notes), 'flight': bags.extremes(flight)})
    return 0


_COMMANDS = {'polar': _polar, 'trim': _trim, 'modes': _modes, 'fly': _fly, 'plot': _plot}


def _aircraft(arguments: argparse.Namespace):
    from poststall_sim import definition
    return definition.aircraft(definition.find(definition.Kind.AIRCRAFT, arguments.aircraft))


def _model(arguments: argparse.Namespace):
    """Return the model that the options ask for."""
    aircraft = _aircraft(arguments)
    names = [surface.name for surface in aircraft.surfaces]
    strips = _of_surfaces('strips', arguments.strips, names,
                          [surface.strips for surface in aircraft.surfaces])
    aircraft = replace(aircraft, surfaces=tuple(
        replace(surface, strips=int(n)) for surface, n in zip(aircraft.surfaces, strips)))
    ell = _of_surfaces('ell', arguments.ell, names, [models.DEFAULTS.ell] * len(names))
    settings = _settings(arguments, ell[0] if len(set(ell)) == 1 else tuple(ell))
    with terminal.patience():
        return models.build(aircraft, settings)


def _of_surfaces(option: str, given: list[dict[str, float]], names: list[str],
                 defaults: list) -> list:
    """Return a number for each surface: its own, that of all, or its default."""
    from poststall_sim.aircraft import ConfigError
    chosen = {name: value for each in given for name, value in each.items()}
    for name in chosen:
        if name not in ('', *names):
            raise ConfigError(f'--{option}: there is no surface {name!r}, there are '
                              f'{", ".join(names)}')
    return [chosen.get(name, chosen.get('', value)) for name, value in zip(names, defaults)]


def _settings(arguments: argparse.Namespace, ell: float | tuple[float, ...]):
    """Return the settings that the options ask for; refuse what would have no effect."""
    from poststall_sim.aero.decambering import AngleForm, Closure
    from poststall_sim.aero.schemes import Scheme, Start
    from poststall_sim.aero.separation import Separation
    from poststall_sim.aero.wake import Shape
    from poststall_sim.aircraft import ConfigError
    asked = vars(arguments)
    scheme, damping = asked.get('scheme'), asked.get('damping')
    closure = Closure(arguments.closure or ('local' if scheme else 'nonlocal'))
    by_scheme = closure is Closure.LOCAL and scheme in ('A', 'B', 'C', 'D')
    start = asked.get('start', ('previous', None))[0]
    if closure is Closure.NONLOCAL and scheme in ('A', 'B', 'C', 'D'):
        raise ConfigError(f'scheme {scheme} solves the local closure: give --closure local')
    if closure is Closure.LOCAL and arguments.ell:
        raise ConfigError('--ell is for the non-local closure: the local one averages nothing')
    if not by_scheme and damping not in (None, 1.0):
        raise ConfigError('--damping is for schemes A to D: give --scheme')
    if not by_scheme and start == 'schemeA1':
        raise ConfigError('--start schemeA1 is for schemes A to D: give --scheme')
    for name, law in (('lag', 'lag'), ('relaxation', 'goman_khrabrov'),
                      ('delay', 'goman_khrabrov')):
        if asked.get(name) is not None and asked.get('separation', law) != law:
            raise ConfigError(f'--{name} is for --separation {law}')
    if arguments.no_decambering:
        idle = [name for name in ('closure', 'ell', 'scheme', 'damping', 'symmetric', 'tolerance',
                                  'limit', 'starts') if asked.get(name)]
        if idle or start != 'previous':
            raise ConfigError(f'--{(idle or ["start"])[0]} has no effect with --no-decambering')
    given = {'chordwise': arguments.panels, 'damping': damping,
             'tolerance': asked.get('tolerance'), 'limit': asked.get('limit'),
             'scheme': Scheme(scheme) if scheme else None,
             'separation': Separation(asked['separation']) if asked.get('separation') else None,
             'wake': Shape.FROZEN if asked.get('frozen_wake') else
             Shape(asked['wake']) if isinstance(asked.get('wake'), str) else None,
             **{name: asked.get(name) for name in ('lag', 'relaxation', 'delay', 'ground')}}
    return models.Settings(
        closure=closure, ell=ell, decambering=not arguments.no_decambering,
        angle_form=AngleForm(asked.get('angle_form', 'exact')),
        start=Start(start) if start in ('zero', 'schemeA1') else Start.GIVEN,
        symmetric=asked.get('symmetric', False), unsteady='angle_form' not in asked,
        **{key: value for key, value in given.items() if value is not None})


def _head(arguments: argparse.Namespace, model) -> dict[str, Any]:
    """Return what every result begins with: who made it, of what, how."""
    from poststall_sim.aero.decambering import Closure
    reference, settings = model.aircraft.reference, model.settings
    local = settings.closure is Closure.LOCAL
    return {
        'poststall_sim': __version__, 'aircraft': model.aircraft.name,
        'closure': settings.closure.value, 'scheme': settings.scheme.value if local else 'newton',
        'reference': {'area_m2': reference.area, 'chord_m': reference.chord,
                      'span_m': reference.span, 'cg_m': list(model.aircraft.mass.cg_G)},
        'settings': {
            'panels': settings.chordwise, 'closure': settings.closure.value,
            'strips': {grid.name: grid.strips.stop - grid.strips.start
                       for grid in model.lattice.grids},
            'ell_chords': settings.ell, 'decambering': settings.decambering,
            'angle_form': settings.angle_form.value, 'damping': settings.damping,
            'symmetric': settings.symmetric, 'tolerance': settings.tolerance,
            'limit': settings.limit}}


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


if __name__ == '__main__':
    sys.exit(main())
