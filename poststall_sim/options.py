# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The options of the command `poststall`: what can be asked for, and text turned into numbers.

Angles stay in degrees here; `cli` turns them into radians.
"""

import argparse
import math
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from poststall_sim import __version__
from poststall_sim.aero import model as models
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.wake import Shape

_NEGATIVE = re.compile(r'-[\d.]')
_MOST_POINTS = 10_000
_FIGURES = ('.png', '.svg', '.pdf')

AIRSPEED = (0.1, 400.0)
"""Of a flight, a trim or a polar [m/s]; as the node's initial.airspeed."""
HEIGHT = (0.1, 20_000.0)
"""Where a flight can start [m]; as the node's initial.altitude."""
_ALTITUDE = (-500.0, 20_000.0)
_WIND = (-100.0, 100.0)
_CLIMB = (-90.0, 90.0)
_DURATION = (1e-3, 1e6)
_RATE = (-10.0, 10.0)
_EXIT_CODES = 'exit codes: 0 a result; 1 none (no trim, not converged, diverged); 2 bad input'


def parse(argv: list[str]) -> argparse.Namespace:
    """Return the options; the attribute ``command`` says what to do with them."""
    return _parser().parse_args(_joined(argv))


def _joined(argv: list[str]) -> list[str]:
    """Return the arguments with negative values joined to their option: ``--alpha -4:20:1``."""
    result: list[str] = []
    for word in argv:
        previous = result[-1] if result else ''
        if _NEGATIVE.match(word) and previous.startswith('--') and '=' not in previous:
            result[-1] = f'{previous}={word}'
        else:
            result.append(word)
    return result


class _Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> Any:
        self.exit(2, f'{self.prog}: {message} (see {self.prog} --help)\n')


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog='poststall', description='Flight past the stall: polars, trims, flights, figures.',
        epilog=f'example: poststall polar --aircraft trainer --alpha -4:30:1\n\n{_EXIT_CODES}',
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--version', action='version', version=f'poststall_sim {__version__}')
    commands = parser.add_subparsers(title='commands', required=True, metavar='COMMAND',
                                     parser_class=_Parser)

    def command(name: str, what: str, example: str, aircraft: str | None):
        sub = commands.add_parser(
            name, help=what, description=f'{what[0].upper()}{what[1:]}.',
            epilog=f'example: poststall {name} {example}\n\n{_EXIT_CODES}',
            formatter_class=argparse.RawDescriptionHelpFormatter)
        sub.set_defaults(command=name)
        sub.add_argument('--aircraft', default=aircraft, metavar='NAME_OR_FILE',
                         help='aircraft: a file, or a name in config/aircraft'
                         + (f' (default {aircraft})' if aircraft else
                            ' (default: the one the bag names)'))
        sub.add_argument('--json', type=_output, metavar='FILE', help='write the result as JSON')
        return sub

    polar = command('polar', 'steady coefficients over the angle of attack',
                    '--alpha -4:30:1 --deflect elevator=-5 --plot polar.png', 'trainer')
    polar.add_argument('--alpha', type=_span, default=_span('-4:24:1'), metavar='A:B:STEP',
                       help='angles of attack [deg], in this order: each starts from the one '
                       'before (default -4:24:1)')
    polar.add_argument('--beta', type=_number, default=0.0, metavar='DEG',
                       help='sideslip, positive with the wind from the right (default 0)')
    for name, what in (('p', 'roll rate p b/2V'), ('q', 'pitch rate q c/2V'),
                       ('r', 'yaw rate r b/2V')):
        polar.add_argument(f'--{name}', type=_within(_RATE), default=0.0, metavar='X',
                           help=f'{what} about the body axis through the CG (default 0)')
    polar.add_argument('--deflect', type=_deflection, action=_Deflections, default={},
                       metavar='NAME=DEG', help='a control; again for another one')
    polar.add_argument('--airspeed', type=_within(AIRSPEED), default=15.0, metavar='M/S',
                       help='(default 15)')
    polar.add_argument('--altitude', type=_within(_ALTITUDE), default=0.0, metavar='M',
                       help='(default 0)')
    polar.add_argument('--sweep', choices=('up', 'updown'), default='up',
                       help='updown: through the angles and back, which shows hysteresis')
    polar.add_argument('--starts', type=_count, default=0, metavar='N',
                       help='at each point count the distinct solutions that N random starts '
                       'lead to')
    polar.add_argument('--seed', type=_count, metavar='N',
                       help='of the random starts (default 0)')
    polar.add_argument('--plot', type=_figure, metavar='FILE', help='draw it: PNG, SVG or PDF')

    trim = command('trim', 'straight flight in balance, powered or gliding',
                   '--airspeed 9:25:2 --plot trim.png', 'trainer')
    trim.add_argument('--airspeed', type=_airspeeds, metavar='V or A:B:STEP',
                      help='powered, with elevator and throttle; gliding if there is no '
                      'engine [m/s]')
    trim.add_argument('--alpha', type=_span, metavar='A:B:STEP',
                      help='gliding without thrust, at angles of attack [deg]')
    trim.add_argument('--altitude', type=_within(_ALTITUDE), default=0.0, metavar='M',
                      help='(default 0)')
    trim.add_argument('--climb', type=_within(_CLIMB), metavar='DEG',
                      help='climb angle of the powered trims (default 0)')
    trim.add_argument('--plot', type=_figure, metavar='FILE', help='draw it: PNG, SVG or PDF')

    fly = command('fly', 'fly a scenario as fast as it goes, and record it',
                  '--scenario stall_and_recovery --record flight', 'trainer')
    fly.add_argument('--scenario', default='stall_and_recovery', metavar='NAME_OR_FILE',
                     help='a file, or a name in config/scenarios (default stall_and_recovery)')
    fly.add_argument('--record', type=Path, metavar='DIR',
                     help='write a rosbag2 folder, the same topics as the node')
    fly.add_argument('--duration', type=_within(_DURATION), metavar='S',
                     help="instead of the scenario's")
    fly.add_argument('--airspeed', type=_within(AIRSPEED), metavar='M/S',
                     help="at which it starts, trimmed; instead of the scenario's")
    fly.add_argument('--altitude', type=_within(HEIGHT), metavar='M', help='likewise')
    fly.add_argument('--wind', type=_wind, metavar='E,N,U',
                     help='velocity of the air, where it blows to: east, north, up [m/s], as '
                     "the node's wind.velocity")
    fly.add_argument('--save', type=_output, metavar='FILE',
                     help='write the flight as it ends, wake and all, to go on with later')
    fly.add_argument('--resume', type=Path, metavar='FILE',
                     help='go on from a saved flight, at its time in the scenario, instead of '
                     'starting in trim')

    for sub in (polar, trim, fly):
        group = sub.add_argument_group('solver')
        group.add_argument('--panels', type=_count, metavar='N',
                           help='panels along every chord (default 4)')
        group.add_argument('--strips', type=_by_surface(_count), action='append', default=[],
                           metavar='N or NAME=N', help='strips of every surface, or of one: '
                           'instead of those of the definition; may be given again')
        group.add_argument('--closure', choices=('nonlocal', 'local'),
                           help='how the section angle is found (default nonlocal; local if a '
                           'scheme is named)' if sub is polar else
                           'how the section angle is found (default nonlocal)')
        group.add_argument('--ell', type=_by_surface(_number), action='append', default=[],
                           metavar='CHORDS or NAME=CHORDS', help='averaging length of the '
                           'non-local closure, of all surfaces or of one (default 1)')
        group.add_argument('--no-decambering', action='store_true',
                           help='attached flow at any angle')
        if sub is polar:
            _add_study(group)
        if sub is fly:
            _add_time(group)

    plot = command('plot', 'draw the figures of a flight from its bag',
                   'flight --output figures', None)
    plot.add_argument('bag', type=Path, metavar='BAG', help="a rosbag2 folder, anyone's")
    plot.add_argument('--output', type=_folder, metavar='DIR',
                      help='where the figures go (default: BAG_figures beside the bag)')
    return parser


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
        group.add_argument(f'--{name}', type=_number, metavar='CHORDS',
                           help=f'{what} (default {getattr(models.DEFAULTS, name):g})')


def _add_study(group) -> None:
    """Add what only a steady problem can be asked for."""
    group.add_argument('--scheme', choices=('A', 'B', 'C', 'D', 'robust'),
                       help='how the local closure is solved: a scheme of the dissertation, or '
                       'the one that does not fail (default robust)')
    group.add_argument('--damping', type=_number, metavar='D',
                       help='under-relaxation of schemes A to D, 0 to 1 (default 1)')
    group.add_argument('--symmetric', action='store_true',
                       help='schemes A to D move mirrored strips alike; the other solvers keep '
                       'symmetry anyway')
    group.add_argument('--start', type=_start, default=('previous', None),
                       metavar='zero|schemeA1|previous|given=FILE',
                       help='where each point starts: no decambering, one iteration of scheme '
                       'A, the point before (default), or the nearest one in the JSON of an '
                       'earlier run')
    group.add_argument('--angle-form', choices=('exact', 'linear'), default='exact',
                       help="linear: the dissertation's small angles (default exact)")
    group.add_argument('--tolerance', type=_positive, metavar='X',
                       help='of the residual: rad, local closure cl (default 1e-5)')
    group.add_argument('--limit', type=_count, metavar='N',
                       help='iterations at most (default 200)')


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f'expected a number, got {text!r}')
    return value


def _positive(text: str) -> float:
    value = _number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f'must be above 0, got {text!r}')
    return value


def refused(value: float, limits: tuple[float, float]) -> str | None:
    """Return what is wrong with a value that is not within limits."""
    low, high = limits
    return None if low <= value <= high else f'must be {low:g} to {high:g}, got {value:g}'


def _within(limits: tuple[float, float]) -> Callable[[str], float]:
    """Return a reader of a number within limits."""
    def read(text: str) -> float:
        value = _number(text)
        if complaint := refused(value, limits):
            raise argparse.ArgumentTypeError(complaint)
        return value
    return read


def _count(text: str) -> int:
    if not re.fullmatch(r'\d+', text):
        raise argparse.ArgumentTypeError(f'expected a whole number, got {text!r}')
    return int(text)


def _span(text: str) -> list[float]:
    """Return the values of A, A:B (in steps of 1) or A:B:STEP, both ends included."""
    parts = [_number(part) for part in text.split(':')]
    if len(parts) == 1:
        return parts
    if len(parts) > 3:
        raise argparse.ArgumentTypeError(f'expected A:B:STEP, got {text!r}')
    begin, end = parts[:2]
    step = parts[2] if len(parts) == 3 else math.copysign(1.0, end - begin)
    if step == 0.0 or (end - begin) / step < 0.0:
        raise argparse.ArgumentTypeError(f'the step must lead from A to B, got {text!r}')
    count = math.floor((end - begin) / step + 1e-9) + 1
    if count > _MOST_POINTS:
        raise argparse.ArgumentTypeError(f'{text!r} are {count} points, at most {_MOST_POINTS}')
    return [round(begin + i * step, 12) for i in range(count)]


def _airspeeds(text: str) -> list[float]:
    values = _span(text)
    for value in values:
        if complaint := refused(value, AIRSPEED):
            raise argparse.ArgumentTypeError(complaint)
    return values


class _Deflections(argparse.Action):
    """Gather deflections [deg] by name; a name stands once."""

    def __call__(self, parser, namespace, values, option_string=None) -> None:
        name, value = values
        gathered = getattr(namespace, self.dest)
        if name in gathered:
            raise argparse.ArgumentError(self, f'{name} is given twice')
        setattr(namespace, self.dest, {**gathered, name: value})


def _deflection(text: str) -> tuple[str, float]:
    name, separator, value = text.partition('=')
    if not (separator and name):
        raise argparse.ArgumentTypeError(f'expected NAME=DEG, got {text!r}')
    return name, _number(value)


def _by_surface(number: Callable[[str], float]) -> Callable[[str], dict[str, float]]:
    """Return a reader of N or NAME=N[,NAME=N...]: numbers by surface, '' for all of them."""
    def read(text: str) -> dict[str, float]:
        values = {}
        for part in text.split(','):
            name, separator, value = part.rpartition('=')
            if separator and not name:
                raise argparse.ArgumentTypeError(f'expected N or NAME=N, got {text!r}')
            values[name] = number(value)
        return values
    return read


def _start(text: str) -> tuple[str, Path | None]:
    if text in ('zero', 'schemeA1', 'previous'):
        return text, None
    name, _, path = text.partition('=')
    if name != 'given' or not path:
        raise argparse.ArgumentTypeError(
            f'expected zero, schemeA1, previous or given=FILE, got {text!r}')
    if not Path(path).is_file():
        raise argparse.ArgumentTypeError(f'there is no file {path}')
    return name, Path(path)


def _output(text: str) -> Path:
    """Return a file that can be written; it is looked at before anything is computed."""
    path = Path(text)
    if path.is_dir():
        raise argparse.ArgumentTypeError(f'expected a file, {text!r} is a folder')
    if not path.parent.is_dir():
        raise argparse.ArgumentTypeError(f'there is no folder {path.parent}')
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise argparse.ArgumentTypeError(f'{path} cannot be written')
    return path


def _figure(text: str) -> Path:
    path = _output(text)
    if path.suffix.lower() not in _FIGURES:
        raise argparse.ArgumentTypeError(
            f'expected a name that ends in {", ".join(_FIGURES)}, got {text!r}')
    return path


def _folder(text: str) -> Path:
    """Return a folder that is there or can be made."""
    path = Path(text)
    above = [each for each in (path, *path.parents) if each.exists()]
    if above and not above[0].is_dir():
        raise argparse.ArgumentTypeError(f'expected a folder, {above[0]} is a file')
    return path


def _wind(text: str) -> np.ndarray:
    parts = [_number(part) for part in text.split(',')]
    if len(parts) != 3:
        raise argparse.ArgumentTypeError(f'expected E,N,U, got {text!r}')
    for part in parts:
        if complaint := refused(part, _WIND):
            raise argparse.ArgumentTypeError(f'each {complaint}')
    return np.array(parts)
