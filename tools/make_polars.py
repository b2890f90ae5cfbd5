#!/usr/bin/env python3
# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Make the section polars in config/airfoils: cl, cd, cm over +-180 deg.

This runs when a polar is made, never when the simulator flies. It needs `neuralfoil`, `scipy`
and `matplotlib` besides numpy:

    tools/make_polars.py                    # all recipes, into config/airfoils
    tools/make_polars.py naca0012_re3e5 --output /tmp --plot /tmp

A polar is put together from three pieces, on each half (alpha >= 0 and alpha <= 0) separately:

* attached: NeuralFoil up to `attached_to`, then levelling off exponentially to a plateau;
* separated: normal and axial force fitted to a NACA 0012 by Truong (`separated_flow`);
* reversed: a thin section with its sharp edge first, near 180 deg (`reversed_flow`).

The weight that leads from attached to separated is a smoothstep, widened by a Gaussian. The
plateau and the start of that smoothstep are solved for, so that the finished curve meets the
recipe's targets: clmax and either its angle or a given decambering at a given angle.
"""

import argparse
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import aerosandbox
import neuralfoil
import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import least_squares

STEP = 0.05          # of the working grid [deg]; every printed angle is a multiple of it
RAW_LIMIT = 30.0     # NeuralFoil is asked within +- this [deg]
MIN_CONFIDENCE = 0.7
PEAK_WITHIN = 20.0   # a second peak, separated, lies near 45 deg
MODEL_SIZE = 'xlarge'
OUTPUT = Path(__file__).resolve().parents[1] / 'config' / 'airfoils'


@dataclass(frozen=True)
class Stall:
    """
    What the curve has to do on one side of zero incidence; all signs as on the positive side.

    Exactly one of `alpha_clmax` and `decambering` is given. `decambering` is a pair of alpha and
    d [deg] in the linear form, cl(alpha) = 2 pi (alpha - alpha_0L + d).

    """

    clmax: float
    attached_to: float
    separated_from: float
    softness: float
    steepest_fall: float
    alpha_clmax: float | None = None
    decambering: tuple[float, float] | None = None
    why: str = ''


@dataclass(frozen=True)
class Recipe:
    """One polar. Without `negative`, the section is symmetric and mirrored exactly."""

    airfoil: str
    reynolds: float
    n_crit: float
    positive: Stall
    negative: Stall | None = None
    attached_smoothing: float = 1.5
    cd90: float = 2.02
    reversed_attached: float = 6.0
    reversed_separated: float = 18.0


RECIPES = {
    'naca4415_re3e6': Recipe(
        airfoil='naca4415', reynolds=3e6, n_crit=9.0,
        positive=Stall(
            clmax=1.65, attached_to=11.0, separated_from=30.0, softness=3.5,
            steepest_fall=-0.08, decambering=(20.0, -9.65),
            why='decambering at 20 deg of a published two-dimensional RANS solution; clmax about '
                'as in Theory of Wing Sections, NeuralFoil gives 1.82 at 18 deg'),
        negative=Stall(
            clmax=1.05, attached_to=12.0, separated_from=23.0, softness=1.5,
            steepest_fall=-0.08, alpha_clmax=16.0,
            why='reduced like the positive side; NeuralFoil gives -1.42 at -18.5 deg'),
    ),
    'naca4415_re4e5': Recipe(
        airfoil='naca4415', reynolds=4e5, n_crit=5.0,
        positive=Stall(
            clmax=1.38, attached_to=8.0, separated_from=25.0, softness=1.0,
            steepest_fall=-0.08, alpha_clmax=14.0,
            why='wind tunnels give about 1.35 at Re 1e6; NeuralFoil is 5 to 15 % high for this '
                'section, gives 1.50 at 15.5 deg and hardly a stall'),
        negative=Stall(
            clmax=0.90, attached_to=11.0, separated_from=21.0, softness=0.8,
            steepest_fall=-0.08, alpha_clmax=15.0,
            why='reduced like the positive side; NeuralFoil gives -0.99 at -14 deg'),
    ),
    'naca0012_re3e5': Recipe(
        airfoil='naca0012', reynolds=3e5, n_crit=3.0,
        positive=Stall(
            clmax=1.10, attached_to=9.0, separated_from=20.0, softness=1.0,
            steepest_fall=-0.08, alpha_clmax=12.5,
            why='a tail in the turbulent wake of a wing; NeuralFoil gives 1.24 at 14.5 deg'),
    ),
}


def smoothstep(x):
    """Return 0 below 0, 1 above 1, and 3 x^2 - 2 x^3 between."""
    x = np.clip(x, 0.0, 1.0)
    return x**2 * (3.0 - 2.0 * x)


def level_off(alpha, values, limit, length):
    """
    Keep `values` up to `limit` and let them run into a plateau beyond, with continuous slope.

        y = y_limit + y'_limit length (1 - exp(-(alpha - limit) / length))

    """
    i = np.searchsorted(alpha, limit)
    slope = (values[i + 1] - values[i - 1]) / (alpha[i + 1] - alpha[i - 1])
    beyond = np.maximum(alpha - alpha[i], 0.0)
    return np.where(
        alpha <= alpha[i], values,
        values[i] - slope * length * np.expm1(-beyond / length))


def separated_flow(alpha, cd90):
    """
    Return cl, cd, cm of a fully separated section, 0 <= alpha <= 180 deg.

    CN and CT (forward) after Truong's fit to the NACA 0012; CN is scaled to reach `cd90`:

        CN = (2.08 + 0.0836 cos a + 0.406 cos^2 a) sin a
        CT = (0.09 - 0.178 cos a - 0.298 cos^3 a) sin^2 a
        cm = -CN (x_cp - 1/4),  x_cp = 0.5 - 0.1 (1 - 2 a / pi)

    References
    ----------
    K. V. Truong, An analytical model for airfoil aerodynamic characteristics over the entire
    360 deg angle of attack range, J. Renewable Sustainable Energy 12, 033303, 2020; constants as
    in AeroSandbox (MIT).

    """
    a = np.radians(alpha)
    cos, sin = np.cos(a), np.sin(a)
    cn = cd90 / 2.08 * (2.08 + 0.0836 * cos + 0.406 * cos**2) * sin
    ct = (0.09 - 0.178 * cos - 0.298 * cos**3) * sin**2
    x_cp = 0.5 - 0.1 * (1.0 - 2.0 * a / np.pi)
    return cn * cos + ct * sin, cn * sin - ct * cos, -cn * (x_cp - 0.25)


def reversed_flow(alpha, cd0):
    """
    Return cl, cd, cm of a section flying tail first, attached, for alpha near 180 deg.

    Lift 2 pi sin a at 0.75 c; twice the drag of forward flight at zero incidence, and two thirds
    of the leading-edge suction lost, 4 sin^2 a. Camber is left out.
    """
    a = np.radians(alpha)
    # sin(pi - a) and not sin(a): zero to the last bit at 180 deg
    sin, cos = np.sin(np.pi - a), np.cos(a)
    cl = -2.0 * np.pi * sin
    cd = 2.0 * cd0 + 4.0 * sin**2
    cn = cl * cos + cd * sin
    return cl, cd, -0.5 * cn


def measure_peak(alpha, cl):
    """Return clmax and its angle [deg], by a parabola through the three highest points."""
    i = int(np.argmax(np.where(alpha < PEAK_WITHIN, cl, -np.inf)))
    left, mid, right = cl[i - 1:i + 2]
    shift = 0.5 * (left - right) / (left - 2.0 * mid + right)
    return mid - 0.25 * (left - right) * shift, alpha[i] + shift * (alpha[1] - alpha[0])


def zero_lift_angle(alpha, cl):
    """Return the angle of zero lift within +-10 deg [deg]."""
    near = np.abs(alpha) <= 10.0
    return float(np.interp(0.0, cl[near], alpha[near]))


def ask_neuralfoil(recipe):
    """Return alpha, cl, cd, cm and confidence on the working grid within +-RAW_LIMIT."""
    alpha = STEP * np.arange(-round(RAW_LIMIT / STEP), round(RAW_LIMIT / STEP) + 1)
    answer = neuralfoil.get_aero_from_airfoil(
        aerosandbox.Airfoil(recipe.airfoil), alpha=alpha, Re=recipe.reynolds,
        n_crit=recipe.n_crit, model_size=MODEL_SIZE)
    curves = np.array([answer[name] for name in ('CL', 'CD', 'CM')])
    # Laminar bubbles that come and go within a degree give lift slopes up to 9 per rad.
    curves = gaussian_filter1d(curves, recipe.attached_smoothing / STEP, axis=1, mode='nearest')
    return alpha, *curves, np.asarray(answer['analysis_confidence'])


def make_half(recipe, stall, raw, alpha_0l):
    """Return alpha, cl, cd, cm from 0 to 180 deg and the solved length and blend start [deg]."""
    alpha = STEP * np.arange(round(180.0 / STEP) + 1)
    raw_alpha, confidence = raw[0], raw[4]
    doubtful = raw_alpha[(confidence < MIN_CONFIDENCE) & (raw_alpha > 0.0)]
    trusted_to = doubtful[0] - 1.0 if doubtful.size else RAW_LIMIT - 1.0
    if stall.attached_to > trusted_to:
        raise ValueError(
            f'attached_to = {stall.attached_to} deg, but NeuralFoil is confident only '
            f'to {trusted_to:.1f} deg')
    raw_cl, raw_cd, raw_cm = (np.interp(alpha, raw_alpha, y) for y in raw[1:4])
    # Beyond trust drag goes on rising and the moment stays; the blend soon takes over both.
    attached_cd = level_off(alpha, raw_cd, trusted_to, 20.0)
    attached_cm = level_off(alpha, raw_cm, trusted_to, 2.0)
    separated = separated_flow(alpha, recipe.cd90)
    back = reversed_flow(alpha, attached_cd[0])
    back_weight = smoothstep(
        (alpha - 180.0 + recipe.reversed_separated)
        / (recipe.reversed_separated - recipe.reversed_attached))

    def curves(unknowns):
        length, blend_start = unknowns
        attached = level_off(alpha, raw_cl, stall.attached_to, length), attached_cd, attached_cm
        weight = gaussian_filter1d(
            smoothstep((alpha - blend_start) / (stall.separated_from - blend_start)),
            stall.softness / STEP, mode='nearest')
        forward = [a + weight * (s - a) for a, s in zip(attached, separated)]
        return [f + back_weight * (b - f) for f, b in zip(forward, back)]

    def misses(unknowns):
        cl = curves(unknowns)[0]
        clmax, alpha_clmax = measure_peak(alpha, cl)
        if stall.decambering is None:
            return clmax - stall.clmax, 0.1 * (alpha_clmax - stall.alpha_clmax)
        at, d = stall.decambering
        wanted = 2.0 * np.pi * np.radians(at - alpha_0l + d)
        return clmax - stall.clmax, np.interp(at, alpha, cl) - wanted

    # Short lengths first: they keep the drag low until the lift falls.
    for length in (2.0, 5.0, 20.0):
        solution = least_squares(
            misses, (length, stall.alpha_clmax or stall.decambering[0]),
            diff_step=1e-4, x_scale=(5.0, 1.0), xtol=1e-12, ftol=1e-12,
            bounds=((0.3, stall.attached_to - 4.0), (100.0, stall.separated_from - 1.0)))
        if np.abs(solution.fun).max() < 1e-5:
            break
    else:
        raise ValueError(
            f'{recipe.airfoil}: no curve meets the targets of {stall}; the last attempt is off '
            f'by {solution.fun} with length and blend start {solution.x}')
    return alpha, curves(solution.x), solution.x


def mirror(alpha, cl, cd, cm):
    """Return the section upside down: cl and cm odd, cd even."""
    return -alpha[::-1], -cl[::-1], cd[::-1], -cm[::-1]


def make_polar(recipe):
    """Return the table (alpha, cl, cd, cm as rows) and the lines that tell how it was made."""
    raw = ask_neuralfoil(recipe)
    alpha_0l = zero_lift_angle(raw[0], raw[1])
    if recipe.negative is None:
        raw = (raw[0], *(0.5 * (a + b) for a, b in zip(raw[1:4], mirror(*raw[:4])[1:])), raw[4])
        alpha_0l = 0.0
    alpha, upper, solved = make_half(recipe, recipe.positive, raw, alpha_0l)
    notes = stall_notes('positive', recipe.positive, solved)
    if recipe.negative is None:
        lower = upper
        notes.append('negative stall: mirror image; cl and cm are odd, cd is even')
    else:
        upside_down = (*mirror(*raw[:4]), raw[4][::-1])
        _, lower, solved = make_half(recipe, recipe.negative, upside_down, -alpha_0l)
        notes += stall_notes('negative', recipe.negative, solved)
    table = np.vstack([alpha, *upper])
    table = np.hstack([np.vstack(mirror(alpha, *lower))[:, :-1], table])
    printed = np.round(table[:, printed_rows(table[0])], 5) + 0.0   # + 0.0: no minus zeros
    for side, stall in ((1.0, recipe.positive), (-1.0, recipe.negative or recipe.positive)):
        fall = steepest_fall(printed[0], printed[1], side)[0]
        if fall < stall.steepest_fall:
            raise ValueError(
                f'{recipe.airfoil}: falls by {fall:.3f} per deg on the side of {side:+.0f}, '
                f'the bound is {stall.steepest_fall}')
    return printed, notes


def printed_rows(alpha):
    """Choose every half degree within +-40 deg, and every degree beyond."""
    step = np.where(np.abs(alpha) < 40.0 + 0.5 * STEP, 0.5, 1.0)
    return np.abs(alpha / step - np.round(alpha / step)) < 0.1 * STEP


def steepest_fall(alpha, cl, side):
    """Return the steepest loss of |cl| [1/deg] on one side, up to 40 deg, and its angle."""
    middle = 0.5 * (alpha[1:] + alpha[:-1])
    slope = np.where((side * middle > 0.0) & (np.abs(middle) < 40.0), np.diff(cl) / np.diff(alpha),
                     np.inf)
    return float(slope.min()), float(middle[np.argmin(slope)])


def stall_notes(side, stall, solved):
    """Return comment lines for one side's recipe."""
    if stall.decambering is None:
        target = f'alpha of clmax {stall.alpha_clmax:g} deg'
    else:
        at, d = stall.decambering
        target = f'decambering d({at:g} deg) = {d:g} deg, cl = 2 pi (alpha - alpha_0L + d)'
    return [
        f'{side} stall (signs as if positive): NeuralFoil to {stall.attached_to:g} deg; '
        f'separated from {stall.separated_from:g} deg;',
        f'  stall softness {stall.softness:g} deg; targets: clmax {stall.clmax:g}, {target};',
        f'  solved: levels off over {solved[0]:.3f} deg, blend starts at {solved[1]:.3f} deg; '
        f'steepest fall allowed {stall.steepest_fall:g} per deg',
        f'  reason: {stall.why}',
    ]


def measured_notes(table):
    """Return comment lines with the characteristics of the finished table."""
    alpha, cl, cd, _ = table
    near = (alpha >= -4.0) & (alpha <= 6.0)
    slope = np.polyfit(np.radians(alpha[near]), cl[near], 1)[0]
    lines = [f'measured: alpha_0L {zero_lift_angle(alpha, cl):.3f} deg; '
             f'lift slope from -4 to 6 deg {slope:.3f} per rad; least cd {cd.min():.5f}']
    for name, side in (('clmax', 1.0), ('clmin', -1.0)):
        i = int(np.argmax(np.where(np.abs(alpha) < PEAK_WITHIN, side * cl, -np.inf)))
        fall, at = steepest_fall(alpha, cl, side)
        lines.append(
            f'measured: {name} {cl[i]:.4f} at {alpha[i]:g} deg; steepest fall beyond '
            f'{fall:.4f} per deg = {np.degrees(fall):.2f} per rad at {at:g} deg')
    return lines


def write_polar(path, recipe, table, notes):
    """Write one table with its comment lines."""
    lines = [
        'Copyright 2026 the poststall_sim developers',
        'SPDX-License-Identifier: Apache-2.0',
        f'{recipe.airfoil.replace("naca", "NACA ")} at Reynolds number {recipe.reynolds:.0f}, '
        'from -180 to 180 deg; cm about the quarter chord, nose up positive',
        'made by tools/make_polars.py; the lines below are the recipe and what came out of it',
        f'attached: NeuralFoil {version("neuralfoil")} (MIT, P. Sharpe), model {MODEL_SIZE}, '
        f'n_crit {recipe.n_crit:g}, free transition;',
        f'  smoothed over {recipe.attached_smoothing:g} deg; not used where its confidence '
        f'is below {MIN_CONFIDENCE:g}',
        'separated: CN and CT of K. V. Truong, J. Renewable Sustainable Energy 12, 033303 (2020),'
        ' fitted to the NACA 0012,',
        f'  constants as in AeroSandbox (MIT, P. Sharpe), CN scaled to cd(90 deg) = '
        f'{recipe.cd90:g} (NACA TN 3361, rough);',
        '  cm from a centre of pressure moving from 0.4 c at 0 to 0.5 c at 90 and 0.6 c '
        'at 180 deg',
        f'reversed flow: attached within {recipe.reversed_attached:g} deg of 180, separated '
        f'beyond {recipe.reversed_separated:g} deg; slope 2 pi at 0.75 c,',
        '  cd = 2 cd(0) + 4 sin^2 alpha, camber left out',
        *notes,
        *measured_notes(table),
        'credit: the attached part is the output of NeuralFoil, whose licence does not restrict '
        'its output; the rest is computed here',
    ]
    with path.open('w', encoding='utf-8', newline='\n') as file:
        file.writelines(f'# {line}\n' for line in lines)
        file.write('alpha_deg,cl,cd,cm\n')
        for alpha, cl, cd, cm in table.T:
            file.write(f'{alpha:.1f},{cl:.5f},{cd:.5f},{cm:.5f}\n')


def plot_polar(path, name, recipe, table):
    """Draw one table over the full circle and around the stall, with NeuralFoil's own answer."""
    import matplotlib
    matplotlib.use('Agg')
    import matplotlib.pyplot as plt

    raw = ask_neuralfoil(recipe)
    figure, axes = plt.subplots(3, 2, figsize=(13, 11), layout='constrained')
    for row, (label, column) in enumerate((('cl', 1), ('cd', 2), ('cm', 3))):
        for ax, limits in zip(axes[row], ((-180.0, 180.0), (-25.0, 45.0))):
            shown = (table[0] >= limits[0]) & (table[0] <= limits[1])
            asked = (raw[0] >= limits[0]) & (raw[0] <= limits[1])
            ax.plot(raw[0][asked], raw[column][asked], color='0.7', label='NeuralFoil, smoothed')
            ax.plot(table[0][shown], table[column][shown], '.-', ms=3, lw=1, label='polar')
            ax.set(xlabel='alpha [deg]', ylabel=label)
            ax.grid(alpha=0.3)
    axes[0, 0].legend()
    figure.suptitle(name)
    figure.savefig(path, dpi=90)
    plt.close(figure)


def main():
    """Make the polars named on the command line, or all."""
    parser = argparse.ArgumentParser(description='Make the section polars of config/airfoils.')
    parser.add_argument('names', nargs='*', metavar='NAME',
                        help=f'recipes to make (default: all of {", ".join(RECIPES)})')
    parser.add_argument('--output', type=Path, default=OUTPUT, metavar='DIR',
                        help='where the CSV files go (default: config/airfoils)')
    parser.add_argument('--plot', type=Path, metavar='DIR', help='also draw each polar here')
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.names) - set(RECIPES))
    if unknown:
        parser.error(f'no recipe for {", ".join(unknown)}; there are {", ".join(RECIPES)}')

    arguments.output.mkdir(parents=True, exist_ok=True)
    for name in arguments.names or RECIPES:
        recipe = RECIPES[name]
        table, notes = make_polar(recipe)
        path = arguments.output / f'{name}.csv'
        write_polar(path, recipe, table, notes)
        print(path.name, *measured_notes(table), sep='\n  ')
        if arguments.plot:
            arguments.plot.mkdir(parents=True, exist_ok=True)
            plot_polar(arguments.plot / f'{name}.png', name, recipe, table)


if __name__ == '__main__':
    main()
