# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Flight in balance: straight or turning, powered or gliding, with controls that are stuck."""

import argparse
import math
from collections.abc import Iterable

import numpy as np

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.commands import solver
from poststall_sim.commands.solver import Command

_TURN, _BANK, _SIDESLIP, _FACTOR = (-360.0, 360.0), (-80.0, 80.0), (-35.0, 35.0), (-10.0, 20.0)
_MANOEUVRE = ('turn', 'bank', 'sideslip', 'pull_up', 'coordinated', 'hold', 'fail', 'throttle')


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    trim = command('trim', 'flight in balance: straight, turning, pulling up, with stuck controls',
                   '--alpha 1:25:1 --plot trim.png', 'trainer')
    trim.add_argument('--airspeed', type=values.span_within(values.AIRSPEED),
                      metavar='V or A:B:STEP', help='powered, with elevator and throttle; '
                      'gliding if there is no engine [m/s]')
    trim.add_argument('--alpha', type=values.span, metavar='A:B:STEP',
                      help='at angles of attack [deg]: gliding without thrust, unless --climb or '
                      '--throttle is given')
    trim.add_argument('--altitude', type=values.within(values.ALTITUDE), default=0.0, metavar='M',
                      help='(default 0)')
    trim.add_argument('--climb', type=values.within(values.CLIMB), metavar='DEG',
                      help='climb angle of the powered trims (default 0)')
    trim.add_argument('--failed', default='', metavar='NAME,...',
                      help='engines that do not work')
    trim.add_argument('--all', action='store_true', help='all straight trims that an airspeed '
                      'has, before and past the stall, by continuation in the angle of attack')
    group = trim.add_argument_group('manoeuvres', 'all six balances at once, within the limits '
                                    'of the controls')
    group.add_argument('--turn', type=values.within(_TURN), metavar='DEG/S',
                       help='turn the heading, to the right positive; balanced with the wake '
                       'of the turn, which curves with it, as --pull-up is')
    group.add_argument('--bank', type=values.within(_BANK), metavar='DEG',
                       help='at this bank; without --turn or --sideslip the turn is found')
    group.add_argument('--coordinated', action='store_true',
                       help='no side force is felt, and the sideslip is found')
    group.add_argument('--sideslip', type=values.within(_SIDESLIP), metavar='DEG',
                       help='steady, with the wind from the right positive')
    group.add_argument('--pull-up', type=values.within(_FACTOR), metavar='N',
                       help='at the lowest point of a pull-up with this load factor')
    group.add_argument('--hold', type=values.deflection, action=values.Deflections, default={},
                       metavar='NAME=DEG', help='a control that does not move, stuck or set; '
                       'again for another one. With a stuck elevator the airspeed of level '
                       'flight is found or, at a given --airspeed or --alpha, the climb angle')
    group.add_argument('--fail', type=values.failure, action='append', default=[],
                       metavar='NAME:KIND[=DEG]', help='what has failed: a part, or all that a '
                       'control moves, as aileron_right:stuck=5, rudder:float or flap:lost, or an '
                       'engine, left:off; again for another one')
    group.add_argument('--throttle', type=values.within((0.0, 1.0)), metavar='X',
                       help='at this throttle, and the climb angle is found')
    trim.add_argument('--plot', type=values.figure, nargs='?', metavar='FILE',
                        const='trim.png',
                        help='draw it: PNG, SVG or PDF (default trim.png)')
    trim.add_argument('--save', type=values.output, metavar='FILE',
                      help='write a flight that begins in this trim, its wake behind it: for '
                      "`poststall fly --resume`, or the node's flight_file and load_state")
    solver.add_options(trim)
    return trim


def run(arguments: argparse.Namespace) -> int:
    """Print the trims; write or draw them as asked; return the exit code."""
    from poststall_sim import jobs
    _refuse_idle(arguments)
    model = solver.model(arguments)
    flights = list(_found(arguments, model))
    found = [row for _, row in flights]
    result = {**solver.head(arguments, model), 'axes': jobs.AXES, 'strip_axes': jobs.STRIP_AXES,
              'altitude_m': arguments.altitude, 'trims': found}
    terminal.print_table(*_table(found))
    terminal.write_json(arguments.json, result)
    if arguments.plot:
        from poststall_sim import plots
        terminal.drawn(plots.trim_figure(result, arguments.plot))
    if not any(each['trimmed'] for each in found):
        raise jobs.NoResultError(
            f'no trim: {found[-1]["message"]}' if found else
            f'no trim at {", ".join(f"{each:g}" for each in arguments.airspeed)} m/s at any angle '
            'of attack that was looked at')
    if arguments.save:
        _save(arguments, model, flights[0][0])
    return 0


def _save(arguments: argparse.Namespace, model, trim) -> None:
    """Write the flight that begins in a trim."""
    from poststall_sim import failure_reader, flight_file, simulation
    flight = simulation.trimmed(
        model, trim, altitude=arguments.altitude, failed=_failed(arguments, model),
        broken=failure_reader.by_name(arguments.fail))
    flight_file.save_state(flight, arguments.save)
    terminal.say(f'saved {arguments.save}: a flight in this trim, in steps of '
                 f'{1e-6 * flight.dt_ns:g} ms')


def _refuse_idle(arguments: argparse.Namespace) -> None:
    """Refuse options that would have no effect."""
    from poststall_sim.aircraft import ConfigError
    manoeuvre = _manoeuvre(arguments)
    opened = arguments.hold or arguments.fail
    if arguments.airspeed is None and arguments.alpha is None and not opened:
        raise ConfigError('trim needs --airspeed (powered), --alpha (glide) or both')
    if arguments.all and (manoeuvre or arguments.alpha or not arguments.airspeed):
        raise ConfigError('--all is of straight flight at an airspeed: it goes with --airspeed '
                          'and without manoeuvres and --alpha')
    asked = [arguments.airspeed or [], arguments.alpha or []]
    if arguments.save and (arguments.all or max(map(len, asked)) > 1
                           or all(asked) and not manoeuvre):
        raise ConfigError('--save is of one flight: give one airspeed or angle of attack, and '
                          'not --all')
    if arguments.save and arguments.altitude <= 0.0:
        raise ConfigError(f'--save at an altitude of {arguments.altitude:g} m: the flight would '
                          'end on the ground as it begins: give --altitude')
    if arguments.climb is not None and arguments.throttle is not None:
        raise ConfigError('--climb and --throttle: give one, the other is found')
    if arguments.failed and (arguments.all or arguments.alpha and not manoeuvre):
        raise ConfigError('--failed is of flight at an airspeed and of manoeuvres')
    if arguments.pull_up is not None and not arguments.airspeed:
        raise ConfigError('--pull-up is of an airspeed: give --airspeed')
    if manoeuvre and arguments.airspeed and arguments.alpha and not opened:
        raise ConfigError('a manoeuvre has an airspeed or an angle of attack: give one of them')


def _manoeuvre(arguments: argparse.Namespace) -> list[str]:
    """Return the names of the options given that ask for more than straight flight."""
    return [name for name in _MANOEUVRE if values.given(getattr(arguments, name))]


def _found(arguments: argparse.Namespace, model) -> Iterable:
    """Yield the trims that are asked for, behind progress bars."""
    from poststall_sim import trim_jobs
    from poststall_sim.aircraft import ConfigError
    failed = _failed(arguments, model)
    if not set(model.aircraft.engine_names) - failed:
        for option, given in (('climb', arguments.climb is not None),
                              ('throttle', arguments.throttle)):
            if given:
                raise ConfigError(f'{model.aircraft.name} has no engine'
                                  f'{" that works" if failed else ""}: --{option} has no effect')
    altitude, climb = arguments.altitude, math.radians(arguments.climb or 0.0)
    if _manoeuvre(arguments):
        tasks = list(_tasks(arguments, model))
        yield from terminal.watched(
            trim_jobs.manoeuvres(model, tasks, altitude=altitude), len(tasks), 'trim')
        return
    if arguments.all:
        for airspeed in arguments.airspeed:
            ticks = iter(terminal.watched(range(2 * len(trim_jobs.SEARCHED)),
                                          2 * len(trim_jobs.SEARCHED), f'{airspeed:g} m/s'))
            yield from trim_jobs.all_trims(model, airspeed, altitude=altitude, climb_angle=climb,
                                           told=lambda: next(ticks))   # noqa: B023
        return
    if arguments.airspeed:
        yield from terminal.watched(
            trim_jobs.straight_trims(model, arguments.airspeed, altitude=altitude,
                                     climb_angle=climb, failed=failed),
            len(arguments.airspeed), 'trim')
    if arguments.alpha:
        powered = arguments.climb is not None and not arguments.airspeed
        yield from terminal.watched(
            trim_jobs.along_alpha(model, np.radians(arguments.alpha), altitude=altitude,
                                  climb_angle=climb if powered else None),
            len(arguments.alpha), 'trim' if powered else 'glide')


def _failed(arguments: argparse.Namespace, model) -> frozenset[str]:
    """Return the names of the engines that do not work."""
    from poststall_sim import failure_reader, failures
    failed = frozenset(arguments.failed.split(',') if arguments.failed else ()) \
        | failures.engines_off(failure_reader.by_name(arguments.fail))
    model.aircraft.require_engines(failed)
    return failed


def _tasks(arguments: argparse.Namespace, model) -> Iterable:
    """Yield what the steady flights are asked to be."""
    from poststall_sim import failure_reader, failures, jobs, trim_jobs
    from poststall_sim.aircraft import ConfigError
    from poststall_sim.manoeuvre import Task
    from poststall_sim.topics import THROTTLE
    from poststall_sim.trim import PITCH_CONTROL

    def radians(value: float | None) -> float | None:
        return None if value is None else math.radians(value)

    if THROTTLE in arguments.hold:
        raise ConfigError('--hold is of controls, in degrees: a throttle that does not move is '
                          '--throttle X, 0 to 1')
    for name, value in arguments.hold.items():
        if name not in model.aircraft.control_names and name in failures.names(model.aircraft):
            raise ConfigError(f'--hold is of controls, {name} is a part that one moves: it is '
                              f'stuck by --fail {name}:stuck={value:g}')
    held = {name: math.radians(value) for name, value in arguments.hold.items()}
    jobs.deflections(model.aircraft, held)   # refuses those beyond their limits
    broken = failure_reader.by_name(arguments.fail)
    parts = failures.of_parts(model.aircraft, broken)
    stuck = PITCH_CONTROL in (*held, *failures.dead(model.aircraft, parts))
    off = _failed(arguments, model)
    throttle = arguments.throttle
    gliding = not set(model.aircraft.engine_names) - off or (
        throttle is None and arguments.climb is None and arguments.airspeed is None
        and arguments.alpha is not None and not stuck)
    # An elevator that is stuck leaves one to be found beside the throttle: the airspeed, or where
    # that or the angle of attack is given, the climb angle.
    climbing = arguments.climb is not None or not (
        stuck and (arguments.airspeed or arguments.alpha))
    turn = radians(arguments.turn)
    if turn is None and (arguments.bank is None or arguments.sideslip is not None):
        turn = 0.0
    for airspeed in arguments.airspeed or [None]:
        for alpha in arguments.alpha or [None]:
            task = Task(
                airspeed=airspeed, alpha=radians(alpha), throttle=0.0 if gliding else throttle,
                climb_angle=None if gliding or throttle is not None or not climbing else
                radians(arguments.climb or 0.0),
                beta=radians(arguments.sideslip), bank=radians(arguments.bank), turn_rate=turn,
                coordinated=arguments.coordinated, held=held, failed=off, failures=broken)
            yield task if arguments.pull_up is None else \
                trim_jobs.pulling(task, arguments.pull_up)


def _table(found: list[dict]) -> tuple[tuple[str, ...], list[list[str]]]:
    """Return the head and the cells of the table; what is 0 everywhere is left out."""
    columns = [('V [m/s]', 'airspeed_m_s', 3), ('alpha [deg]', 'alpha_deg', 3),
               ('beta [deg]', 'beta_deg', 3), ('bank [deg]', 'bank_deg', 3),
               ('turn [deg/s]', 'turn_rate_deg_s', 3), ('pull [deg/s]', 'pull_rate_deg_s', 3),
               ('throttle', 'throttle', 4), ('climb [deg]', 'climb_angle_deg', 3),
               ('sink [m/s]', 'sink_rate_m_s', 3)]
    shown = [column for column in columns if column[1] not in (
        'beta_deg', 'bank_deg', 'turn_rate_deg_s', 'pull_rate_deg_s')
        or any(abs(each[column[1]]) > 5e-4 for each in found)]
    controls = [name for name in (found[0]['controls'] if found else {})
                if name == 'elevator_deg' or any(
                    abs(each['controls'][name]) > 5e-4 for each in found)]
    # A part that has a control of its own name stands where that does.
    parts = [name for name in (found[0].get('failed_parts', {}) if found else {})
             if name not in controls]
    head = ('', *(title for title, _, _ in shown), *(f'{name.removesuffix("_deg")} [deg]'
                                                     for name in (*controls, *parts)),
            'residual', '')
    return head, [
        [each['kind'], *(f'{each[key]:z.{digits}f}' for _, key, digits in shown),
         *(f'{each["controls"][name]:z.3f}' for name in controls),
         *(f'{each["failed_parts"][name]:z.3f}' for name in parts), f'{each["residual"]:.0e}',
         each['message']] for each in found]
