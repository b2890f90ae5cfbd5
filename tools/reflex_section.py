#!/usr/bin/env python3
# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Make the section of the flying wing: the NACA 0012 with its rear quarter turned up for good.

    tools/reflex_section.py                 # config/airfoils/naca0012_reflex_re3e5.csv

The table of the NACA 0012 is shifted by what thin-airfoil theory says of a kinked mean line
(H. Glauert, The Elements of Aerofoil and Airscrew Theory, 1926, ch. XI), with the kink at x_h:

    cos(t) = 1 - 2 x_h,   alpha_0L = u (1 - (t - sin t) / pi),   cm = u/2 sin t (1 - cos t)

for a rear part turned up by u. Both fade out where the flow is separated, over `FADE`.
"""

import math
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

FOLDER = Path(__file__).resolve().parents[1] / 'config' / 'airfoils'
BASE, NAME = 'naca0012_re3e5', 'naca0012_reflex_re3e5'
KINK = 0.75
TURNED_UP = 3.0
"""[deg]; about what a reflexed section for flying wings has, cm = 0.03."""
FADE = (20.0, 50.0)
"""Incidences [deg] from which and up to which the mean line is forgotten."""


def mean_line():
    """Return the angle of zero lift [deg] and the moment about the quarter chord."""
    t, u = math.acos(1.0 - 2.0 * KINK), math.radians(TURNED_UP)
    alpha_0l = u * (1.0 - (t - math.sin(t)) / math.pi)
    return math.degrees(alpha_0l), 0.5 * u * math.sin(t) * (1.0 - math.cos(t))


def remembered(alpha):
    """Return the share of the mean line's effect at an incidence [deg]: 1 attached, 0 beyond."""
    x = np.clip((np.abs(alpha) - FADE[0]) / (FADE[1] - FADE[0]), 0.0, 1.0)
    return 1.0 - x**2 * (3.0 - 2.0 * x)


def reflexed(table):
    """Return the table (alpha, cl, cd, cm as rows) of the reflexed section."""
    alpha, *curves = table
    alpha_0l, moment = mean_line()
    weight = remembered(alpha)
    cl, cd, cm = (PchipInterpolator(alpha, curve)(alpha - weight * alpha_0l) for curve in curves)
    return np.round(np.vstack([alpha, cl, cd, cm + weight * moment]), 5) + 0.0


def measured_notes(table):
    """Return comment lines with the characteristics of the finished table."""
    alpha, cl = table[0], table[1]
    near = np.abs(alpha) <= 10.0
    lines = [f'measured: alpha_0L {np.interp(0.0, cl[near], alpha[near]):.3f} deg']
    for name, side in (('clmax', 1.0), ('clmin', -1.0)):
        i = int(np.argmax(np.where(np.abs(alpha) < 20.0, side * cl, -np.inf)))
        middle = 0.5 * (alpha[1:] + alpha[:-1])
        slope = np.where((side * middle > 0.0) & (np.abs(middle) < 40.0),
                         np.diff(cl) / np.diff(alpha), np.inf)
        lines.append(f'measured: {name} {cl[i]:.4f} at {alpha[i]:g} deg; steepest fall beyond '
                     f'{slope.min():.4f} per deg at {middle[np.argmin(slope)]:g} deg')
    return lines


def main():
    """Read the base table, turn its tail up, write the new one with both histories."""
    lines = (FOLDER / f'{BASE}.csv').read_text(encoding='utf-8').splitlines()
    comments = [line.removeprefix('# ') for line in lines if line.startswith('#')]
    table = np.array([line.split(',') for line in lines[len(comments) + 1:]], dtype=float).T
    made = reflexed(table)
    alpha_0l, moment = mean_line()
    notes = [
        *comments[:2],
        f'NACA 0012 with the rear {1.0 - KINK:.0%} of its chord turned up by {TURNED_UP:g} deg, '
        'for flying wings',
        f'made by tools/reflex_section.py from {BASE}.csv, whose own lines follow: its alpha '
        f'shifted by {alpha_0l:.3f} deg',
        f'  and its cm by {moment:.4f} (thin-airfoil theory of the kinked mean line), both '
        f'fading out from {FADE[0]:g} to {FADE[1]:g} deg,',
        '  where the flow is separated; clmax stays that of the NACA 0012, a tenth or so too '
        'high for a reflexed section',
        *(f'  | {line}' for line in comments[2:]
          if not line.startswith(('measured', 'reynolds'))),
        *measured_notes(made), *(line for line in comments if line.startswith('reynolds'))]
    with (FOLDER / f'{NAME}.csv').open('w', encoding='utf-8', newline='\n') as file:
        file.writelines(f'# {line}\n' for line in notes)
        file.write('alpha_deg,cl,cd,cm\n')
        for row in made.T:
            file.write(f'{row[0]:.1f},' + ','.join(f'{value:.5f}' for value in row[1:]) + '\n')
    print(NAME, *measured_notes(made), sep='\n  ')


if __name__ == '__main__':
    main()
