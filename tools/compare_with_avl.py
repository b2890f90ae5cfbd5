# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Random aircraft through AVL and through the lattice here: how far apart they are.

Wants OptVL, which brings AVL as a library (`pip install optvl`, GPL). Both read the same .avl
file, have the same strips and panels and print the same coefficients; see docs/avl.md for what
is left between them. The figures there are those of

    python tools/compare_with_avl.py
    python tools/compare_with_avl.py --every-edge
"""

import argparse
import math
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from poststall_sim import definition, derivative_analysis
from poststall_sim.aero import model as models

LIMITS = {
    'CL': 0.5, 'Cm': 1.0, 'CDi_far': 2.0, 'CDi_near': None, 'CL_alpha': 0.5, 'Cm_alpha': None,
    **dict.fromkeys(('CY_beta', 'Cl_beta', 'Cn_beta')),
    **dict.fromkeys(('Cl_p', 'Cn_p', 'CL_q', 'Cm_q', 'Cl_r', 'Cn_r'), 1.0),
    **dict.fromkeys(('CL_flap', 'Cm_flap', 'Cl_aileron', 'Cn_aileron', 'CL_elevator',
                     'Cm_elevator', 'CY_rudder', 'Cl_rudder', 'Cn_rudder'), 2.0)}
"""Agreement that is wanted [%], None where none was set."""
FLOORS = {'Cm': 0.02, 'Cm_alpha': 0.2, 'Cl_r': 0.02, 'Cn_r': 0.002, 'Cn_p': 0.005,
          'Cn_aileron': 0.002, 'Cm_flap': 0.05, 'Cl_rudder': 0.005, 'Cl_beta': 0.01,
          'Cn_beta': 0.005, 'CY_beta': 0.02}
"""Differences of large numbers that are smaller are left out: per cent of them say nothing."""
LEAST = 1e-3


@dataclass(frozen=True)
class Case:
    """An AVL file's text, its panels along the chord and an angle of attack [deg]."""

    text: str
    rows: int
    alpha: float


def _control(name: str, hinge: float, vector: str, image: float) -> str:
    return f'CONTROL\n{name} 1.0 {hinge:.3f} {vector} {image:g}\n'


def _surface(name: str, strips: str, shift: tuple[float, ...], sections: list[str], *,
             mirrored: bool, incidence: float = 0.0) -> str:
    head = f'SURFACE\n{name}\n{strips}\n' + ('YDUPLICATE\n0\n' if mirrored else '')
    return head + f'TRANSLATE\n{_row(*shift)}\nANGLE\n{incidence}\n' + ''.join(sections)


def _row(*values: float) -> str:
    return ' '.join(repr(float(value)) for value in values)


def _section(values: tuple[float, ...], *controls: str) -> str:
    return f'SECTION\n{_row(*values)}\n' + ''.join(controls)


def random_case(seed: int) -> Case:
    """Return a wing alone, with a tail, with tail and fin, or with a V-tail, by turns."""
    draw = np.random.default_rng(seed)
    span, ratio, taper = draw.uniform(2, 12), draw.uniform(4, 12), draw.uniform(0.4, 1.0)
    sweep, dihedral = np.radians([draw.uniform(-10, 35), draw.uniform(-3, 7)])
    half, mean = 0.5 * span, span / ratio
    root = 2.0 * mean / (1.0 + taper)
    tip = root * taper
    x, z = 0.25 * (root - tip) + half * math.tan(sweep), half * math.tan(dihedral)
    at, twist = draw.uniform(0.5, 0.7), draw.uniform(-4, 2)
    rows = int(draw.choice([4, 6, 8]))
    spacing = draw.choice([0.0, 0.0, 1.0, -2.0])
    flap = _control('flap', 0.7, '0 1 0', 1)
    aileron = _control('aileron', draw.uniform(0.7, 0.8), '0 0 0', -1)
    text = (f'random {seed}\n0.0\n0 0 0\n{_row(span * mean, mean, span)}\n'
            f'{_row(0.3 * root, 0, 0)}\n0.0\n')
    text += _surface(
        'Wing', f'{rows} 0.0 {draw.choice([8, 10, 14])} {spacing}', (0, 0, 0), [
            _section((0, 0, 0, root, 0), flap),
            _section((x * at, half * at, z * at, root + (tip - root) * at, twist * at),
                     flap, aileron),
            _section((x, half, z, tip, twist), aileron)],
        mirrored=True, incidence=draw.uniform(-1, 3))
    arm, rise = draw.uniform(2.2, 4) * mean, draw.uniform(-0.4, 1.2) * mean
    reach, chord = 0.5 * span * draw.uniform(0.25, 0.4), mean * draw.uniform(0.5, 0.8)
    end, back = chord * draw.uniform(0.5, 1.0), reach * draw.uniform(0, 0.4)
    turned, slope = draw.uniform(-2, 1), math.radians(draw.uniform(25, 42))
    across = '0 1 0' if seed % 2 else '0 0 0'
    elevator = _control('elevator', 0.6, across, 1)
    strips = f'{rows} 0.0 6 0.0'
    if seed % 4 in (1, 2):
        text += _surface('Tail', strips, (arm, 0, rise), [
            _section((0, 0, 0, chord, 0), elevator),
            _section((back, reach, 0, end, 0), elevator)], mirrored=True, incidence=turned)
    if seed % 4 == 2:
        rudder = _control('rudder', 0.55, '0 0 1' if seed % 3 else '0 0 0', 1)
        text += _surface('Fin', strips, (0.97 * arm, 0, rise + 0.05 * mean), [
            _section((0, 0, 0, 1.2 * chord, 0), rudder),
            _section((0.3 * mean, 0, 1.1 * mean, 0.8 * chord, 0), rudder)], mirrored=False)
    if seed % 4 == 3:
        moved = elevator + _control('rudder', 0.6, '0 0 0', -1)
        text += _surface('Vtail', strips, (arm, 0, rise), [
            _section((0, 0, 0, chord, 0), moved),
            _section((back, reach * math.cos(slope), reach * math.sin(slope), end, 0), moved)],
            mirrored=True, incidence=turned)
    return Case(text, rows, float(draw.uniform(0, 6)))


def avl(path: Path, alpha: float, *, legs: bool, cores: bool) -> dict[str, float]:
    """Return what AVL says; legs: trailing legs carry forces, cores: between surfaces."""
    from optvl import OVLSolver
    solver = OVLSolver(geo_file=str(path))
    if not cores:
        solver.set_avl_fort_arr('CASE_R', 'VRCOREW', 0.0)
    solver.set_avl_fort_arr('PLOT_L', 'LTRFORCE', int(legs))
    solver.set_variable('alpha', alpha)
    solver.execute_run()
    total = solver.get_total_forces()
    found = {'CL': total['CL'], 'Cm': total['Cm'], 'CDi_far': total['CDff'],
             'CDi_near': total['CDi']}
    # Of the moments both kinds are there: with a prime those about stability axes.
    for key, value in solver.get_stab_derivs().items():
        if key.startswith('d'):
            found[_key(key)] = value
    controls = solver.get_control_stab_derivs()
    found |= {_key(key): value * 180.0 / math.pi for key, value in controls.items()
              if key.partition('/')[0] not in ('dCl', 'dCn')}
    return {key: float(value) for key, value in found.items()}


def _key(key: str) -> str:
    above, _, below = key[1:].partition('/d')
    return f'{above.strip(chr(39))}_{below.strip(chr(39)).lower()}'


def ours(path: Path, case: Case, *, every_edge: bool) -> dict[str, float]:
    """Return the same from the lattice here."""
    model = models.build(definition.aircraft(path), models.Settings(
        chordwise=case.rows, decambering=False, unsteady=False, axial_wake=True,
        as_avl=not every_edge))
    point, = derivative_analysis.along(
        model, [math.radians(case.alpha)], beta=0.0,
        deflected=np.zeros(len(model.aircraft.controls)), airspeed=20.0, altitude=0.0,
        axes=derivative_analysis.Axes.STABILITY)
    coefficients = point['coefficients']
    return {'CL': coefficients['CL'], 'Cm': coefficients['Cm'], 'CDi_far': point['CDi_far'],
            'CDi_near': coefficients['CD'], **point['derivatives']}


def compared(case: Case, folder: Path, arguments: argparse.Namespace) -> dict[str, float]:
    """Return how far ours is from AVL [%], of what is large enough to be told."""
    path = folder / 'random.avl'
    path.write_text(case.text)
    there = avl(path, case.alpha, legs=arguments.every_edge, cores=arguments.cores)
    here = ours(path, case, every_edge=arguments.every_edge)
    return {key: 100.0 * (here[key] / there[key] - 1.0) for key in LIMITS
            if key in there and key in here and abs(there[key]) > FLOORS.get(key, LEAST * (
                0.1 if key.startswith('CDi') else 1.0))}


def main() -> int:
    """Print medians and largest differences; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.strip().partition('\n')[0])
    parser.add_argument('--aircraft', type=int, default=20, metavar='N',
                        help='how many (default 20)')
    parser.add_argument('--seed', type=int, default=0, help='of the first one (default 0)')
    parser.add_argument('--every-edge', action='store_true',
                        help='forces of every edge here, and those of trailing legs in AVL '
                        '(LTRFORCE), instead of those of bound vortices alone')
    parser.add_argument('--cores', action='store_true',
                        help="leave AVL's cores of two strip widths between surfaces")
    parser.add_argument('--verbose', action='store_true', help='what is beyond, by aircraft')
    arguments = parser.parse_args()
    try:
        import optvl  # noqa: F401
    except ImportError:
        sys.exit('compare_with_avl: wants AVL as a library: pip install optvl')
    found: dict[str, list[tuple[float, int]]] = {key: [] for key in LIMITS}
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(arguments.seed, arguments.seed + arguments.aircraft):
            off = compared(random_case(seed), Path(folder), arguments)
            for key, value in off.items():
                found[key].append((abs(value), seed))
            beyond = [f'{key} {value:+.2f} %' for key, value in off.items()
                      if LIMITS[key] and abs(value) > LIMITS[key]]
            if arguments.verbose and beyond:
                print(f'aircraft {seed}: {", ".join(beyond)}')
    print(f'{"[%]":12s} {"of":>4s} {"median":>8s} {"largest":>8s} {"aircraft":>9s} {"limit":>6s}')
    good = True
    for key, each in found.items():
        if not each:
            continue
        worst, seed = max(each)
        limit = LIMITS[key]
        within = limit is None or worst <= limit
        good = good and within
        print(f'{key:12s} {len(each):4d} {np.median([x for x, _ in each]):8.2f} {worst:8.2f} '
              f'{seed:9d} {"" if limit is None else f"{limit:g}":>6s}'
              f'{"" if within else "  beyond"}')
    return 0 if good else 1


if __name__ == '__main__':
    sys.exit(main())
