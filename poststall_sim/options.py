# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The options of the command `poststall`: what can be asked for.

Angles stay in degrees here; `cli` turns them into radians.
"""

import argparse
import re
from pathlib import Path
from typing import Any

from poststall_sim import __version__
from poststall_sim import option_values as values
from poststall_sim.aero import model as models
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.wake import Shape

_NEGATIVE = re.compile(r'-[\d.]')
_ALTITUDE = (-500.0, 20_000.0)
_CLIMB = (-90.0, 90.0)
_DURATION = (1e-3, 1e6)
_RATE = (-10.0, 10.0)
_STEP = (1e-5, 1.0)
_ROWS = (2, 2000)
_STALLABLE = (-40.0, 50.0)
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
        prog='poststall',
        description='Flight past the stall: polars, trims, modes, flights, figures.',
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
        sub.add_argument('--json', type=values.output, metavar='FILE',
                         help='write the result as JSON')
        return sub

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
    polar.add_argument('--altitude', type=values.within(_ALTITUDE), default=0.0, metavar='M',
                       help='(default 0)')
    polar.add_argument('--sweep', choices=('up', 'updown'), default='up',
                       help='updown: through the angles and back, which shows hysteresis')
    polar.add_argument('--starts', type=values.count, default=0, metavar='N',
                       help='at each point count the distinct solutions that N random starts '
                       'lead to')
    polar.add_argument('--seed', type=values.count, metavar='N',
                       help='of the random starts (default 0)')
    polar.add_argument('--plot', type=values.figure, metavar='FILE',
                         help='draw it: PNG, SVG or PDF')

    trim = command('trim', 'straight flight in balance, powered or gliding',
                   '--airspeed 9:25:2 --plot trim.png', 'trainer')
    trim.add_argument('--airspeed', type=values.span_within(values.AIRSPEED),
                      metavar='V or A:B:STEP', help='powered, with elevator and throttle; '
                      'gliding if there is no engine [m/s]')
    trim.add_argument('--alpha', type=values.span, metavar='A:B:STEP',
                      help='gliding without thrust, at angles of attack [deg]')
    trim.add_argument('--altitude', type=values.within(_ALTITUDE), default=0.0, metavar='M',
                      help='(default 0)')
    trim.add_argument('--climb', type=values.within(_CLIMB), metavar='DEG',
                      help='climb angle of the powered trims (default 0)')
    trim.add_argument('--plot', type=values.figure, metavar='FILE',
                        help='draw it: PNG, SVG or PDF')

    modes = command('modes', 'modes of trimmed flight along the angle of attack',
                    'trainer --alpha 1:25:1 --decambering all --plot modes.png', 'trainer')
    _add_modes(modes)

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

    for sub in (polar, trim, modes, fly):
        group = sub.add_argument_group('solver')
        group.add_argument('--panels', type=values.count, metavar='N',
                           help='panels along every chord (default 4)')
        group.add_argument('--strips', type=values.by_surface(values.count), action='append',
                           default=[], metavar='N or NAME=N',
                           help='strips of every surface, or of one: instead of those of the '
                           'definition; may be given again')
        group.add_argument('--closure', choices=('nonlocal', 'local'),
                           help='how the section angle is found (default nonlocal; local if a '
                           'scheme is named)' if sub is polar else
                           'how the section angle is found (default nonlocal)')
        group.add_argument('--ell', type=values.by_surface(values.number), action='append',
                           default=[], metavar='CHORDS or NAME=CHORDS',
                           help='averaging length of the non-local closure, of all surfaces or '
                           'of one (default 1)')
        group.add_argument('--no-decambering', action='store_true',
                           help='attached flow at any angle')
        if sub is polar:
            _add_study(group)
        if sub is fly:
            _add_time(group)

    plot = command('plot', 'draw the figures of a flight from its bag',
                   'flight --output figures', None)
    plot.add_argument('bag', type=Path, metavar='BAG', help="a rosbag2 folder, anyone's")
    plot.add_argument('--output', type=values.folder, metavar='DIR',
                      help='where the figures go (default: BAG_figures beside the bag)')
    return parser


def _add_modes(modes: argparse.ArgumentParser) -> None:
    """Add which flights are trimmed, and what moves when they are disturbed a little."""
    modes.add_argument('aircraft', nargs='?', default=argparse.SUPPRESS, metavar='AIRCRAFT',
                       help='the same as --aircraft')
    modes.add_argument('--alpha', type=values.span_within(_STALLABLE),
                       default=values.span('1:25:1'), metavar='A:B:STEP',
                       help='angles of attack [deg], in this order (default 1:25:1)')
    modes.add_argument('--altitude', type=values.within(_ALTITUDE), default=0.0, metavar='M',
                       help='(default 0)')
    path = modes.add_mutually_exclusive_group()
    path.add_argument('--level', dest='climb', action='store_const', const=0.0,
                      help='in level flight with the engine, instead of gliding')
    path.add_argument('--climb', type=values.within(_CLIMB), metavar='DEG',
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
    modes.add_argument('--plot', type=values.figure, metavar='FILE',
                       help='draw them: PNG, SVG or PDF')


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
    group.add_argument('--angle-form', choices=('exact', 'linear'), default='exact',
                       help="linear: the dissertation's small angles (default exact)")
    group.add_argument('--tolerance', type=values.positive, metavar='X',
                       help='of the residual: rad, local closure cl (default 1e-5)')
    group.add_argument('--limit', type=values.count, metavar='N',
                       help='iterations at most (default 200)')
