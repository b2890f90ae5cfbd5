# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A section's curves: imported, extended to a full turn, drawn, and how sharp their stall is."""

import argparse
import math
from pathlib import Path

from poststall_sim import option_values as values
from poststall_sim import terminal
from poststall_sim.commands.solver import Command

_LIFT = (0.1, 5.0)
_STALL = (2.0, 19.0)
_EXTENDING = ('clmax', 'alpha_stall', 'clmin', 'alpha_stall_negative', 'softness', 'aspect_ratio',
              'cd90', 'symmetric')


def add(command: Command) -> argparse.ArgumentParser:
    """Add the command and its options; return its parser."""
    airfoil = command('airfoil', "a section's curves: import, extend, draw, and its stall",
                      'naca4415_re4e5 --plot section.png', None, of_aircraft=False)
    airfoil.add_argument('file', metavar='FILE_OR_NAME',
                         help='a polar: a file, or a name in config/airfoils')
    airfoil.add_argument('--import', choices=('xfoil', 'airfoiltools', 'csv'), dest='form',
                         help='whose file it is (default: by how it looks)')
    airfoil.add_argument('--extend', action='store_true',
                         help='make curves over a full turn of what is known near zero incidence')
    group = airfoil.add_argument_group('what --extend aims at')
    group.add_argument('--clmax', type=values.within(_LIFT), metavar='CL',
                       help="greatest lift (default: the points' own)")
    group.add_argument('--alpha-stall', type=values.within(_STALL), metavar='DEG',
                       help="its angle (default: the points' own)")
    group.add_argument('--clmin', type=values.within((-_LIFT[1], -_LIFT[0])), metavar='CL',
                       help="least lift, below 0 (default: the points' own)")
    group.add_argument('--alpha-stall-negative', metavar='DEG',
                       type=values.within((-_STALL[1], -_STALL[0])), help='its angle, below 0')
    group.add_argument('--symmetric', action='store_true',
                       help='the mean with the section upside down, mirrored exactly')
    group.add_argument('--softness', type=values.within((0.0, 10.0)), metavar='DEG',
                       help='how far the stall is spread (default 2)')
    group.add_argument('--cd90', type=values.within((0.5, 3.0)), metavar='CD',
                       help='drag across the flow (default 2.02)')
    group.add_argument('--aspect-ratio', type=values.within((0.5, 1000.0)), metavar='AR',
                       help='separated flow as on a wing of this aspect ratio, CDmax = 1.1 + '
                       '0.018 AR (default: as on the section, two-dimensional)')
    airfoil.add_argument('--wing', type=_wing, default=(12.0, 20), metavar='AR,STRIPS',
                         help='the rectangular wing whose limit the steepest fall of lift is '
                         'held against (default 12,20)')
    airfoil.add_argument('--output', type=values.output, metavar='FILE.csv',
                         help='write the curves as an aircraft reads them')
    airfoil.add_argument('--plot', type=values.figure, nargs='?', metavar='FILE',
                         const='airfoil.png',
                         help='draw them: PNG, SVG or PDF (default airfoil.png)')
    airfoil.add_argument('--measured', type=Path, metavar='FILE.csv',
                         help='points to draw beside them: columns alpha, cl and perhaps cd, cm')
    return airfoil


def _wing(text: str) -> tuple[float, int]:
    ratio, separator, strips = text.partition(',')
    if not separator:
        raise argparse.ArgumentTypeError(f'expected AR,STRIPS, got {text!r}')
    count = values.whole_within((4, 200))(strips)
    if count % 2:
        raise argparse.ArgumentTypeError(f'strips must be even, got {text!r}')
    return values.within((1.0, 100.0))(ratio), count


def run(arguments: argparse.Namespace) -> int:
    """Print what the section is like; write or draw it as asked; return the exit code."""
    from poststall_sim import airfoil_study, airfoil_writer
    from poststall_sim.aircraft import ConfigError
    from poststall_sim.polar_import import Format
    if arguments.measured and not arguments.plot:
        raise ConfigError('--measured is drawn: give --plot')
    study = airfoil_study.read(
        arguments.file, Format(arguments.form) if arguments.form else None, _asked(arguments))
    ratio, strips = arguments.wing
    result = airfoil_study.result(study, aspect_ratio=ratio, strips=strips)
    if arguments.measured:
        result = airfoil_study.with_measured(result, arguments.measured)
    terminal.print_rows(result['airfoil'], _rows(result))
    if arguments.output:
        airfoil_writer.write(arguments.output, study.airfoil, study.notes)
        terminal.say(f'curves {arguments.output}')
    terminal.write_json(arguments.json, result)
    if arguments.plot:
        from poststall_sim import plots
        terminal.drawn(plots.airfoil_figure(result, arguments.plot))
    return 0


def _asked(arguments: argparse.Namespace):
    """Return what is asked of the extension, or None without one."""
    from poststall_sim import airfoil_study, extension
    from poststall_sim.aircraft import ConfigError
    given = {name: getattr(arguments, name) for name in _EXTENDING}
    if not arguments.extend:
        idle = [name for name, value in given.items() if values.given(value)]
        if idle:
            raise ConfigError(f'--{idle[0].replace("_", "-")} is of the extension: give --extend')
        return None
    if given['symmetric'] and (given['clmin'], given['alpha_stall_negative']) != (None, None):
        raise ConfigError('--symmetric has one stall: give --clmax and --alpha-stall')
    if given['aspect_ratio'] is not None and given['cd90'] is not None:
        raise ConfigError('--aspect-ratio says the drag across the flow: give no --cd90')

    def radians(name: str, default: float | None = None) -> float | None:
        value = default if given[name] is None else given[name]
        return None if value is None else math.radians(value)

    return airfoil_study.Extension(
        softness=radians('softness', 2.0), clmax=given['clmax'],
        alpha_clmax=radians('alpha_stall'), clmin=given['clmin'],
        alpha_clmin=radians('alpha_stall_negative'), symmetric=given['symmetric'],
        separated=extension.Separated(
            extension.SECTION.cd90 if given['cd90'] is None else given['cd90'],
            given['aspect_ratio']))


def _rows(result) -> list[tuple[str, str]]:
    rows = [('Reynolds number', f'{result["reynolds"]:.4g}' if result['reynolds'] else 'not said'),
            ('zero-lift angle', f'{result["zero_lift_deg"]:z.3f} deg'),
            ('lift slope', f'{result["lift_slope_per_rad"]:.3f} per rad, -4 to 6 deg'),
            ('least cd', f'{result["least_cd"]:.5f}'),
            ('cm at zero lift', f'{result["cm_at_zero_lift"]:z.4f}')]
    for side in ('positive', 'negative'):
        stall = result[f'{side}_stall']
        soft = stall['softness_deg']
        rows += [(f'{side} stall', f'cl {stall["cl"]:z.3f} at {stall["alpha_deg"]:z.2f} deg; a '
                  f'tenth is lost {"never" if soft is None else f"{soft:.2f} deg later"}'),
                 ('  steepest fall', f'{stall["steepest_fall_per_deg"]:z.4f} per deg at '
                  f'{stall["steepest_at_deg"]:z.1f} deg')]
    wing = result['wing']
    limit = wing['steepest_unique_fall_per_deg']
    over = ' EXCEEDED: a stalled wing may have several solutions' if result['flags'] else ''
    return [*rows, ('one solution to', f'{limit:.4f} per deg (aspect ratio '
                    f'{wing["aspect_ratio"]:g}, {wing["strips"]} strips){over}')]
