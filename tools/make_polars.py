#!/usr/bin/env python3
# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Make the section polars in config/airfoils: cl, cd, cm over +-180 deg.

This runs when a polar is made, never when the simulator flies. It asks NeuralFoil for the attached
part (the extra `polars` of this package); what makes curves over a full turn of that is
`poststall_sim.extension`, which `poststall airfoil --extend` uses on polars of other origin.

    tools/make_polars.py                    # all recipes, into config/airfoils
    tools/make_polars.py naca0012_re3e5 --output /tmp --plot /tmp --measured points.csv
"""

import argparse
import math
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter1d

from poststall_sim import (
    airfoil_report,
    airfoil_study,
    airfoil_writer,
    extension,
    plots,
    polar_import,
)
from poststall_sim.aircraft import Airfoil, ConfigError

STEP = 0.05          # of NeuralFoil's angles [deg]
RAW_LIMIT = 30.0     # it is asked within +- this [deg]
MIN_CONFIDENCE = 0.7
MODEL_SIZE = 'xlarge'
WING = 12.0, 20      # aspect ratio and strips that the steepest fall is held against
OUTPUT = Path(__file__).resolve().parents[1] / 'config' / 'airfoils'


@dataclass(frozen=True)
class Stall:
    """
    What the curve has to do on one side of zero incidence; all signs as on the positive side.

    Exactly one of `alpha_clmax` and `decambering` is given, see `extension.Stall`; angles [deg].
    """

    clmax: float
    attached_to: float
    separated_from: float
    softness: float
    steepest_fall: float
    alpha_clmax: float | None = None
    decambering: tuple[float, float] | None = None
    why: str = ''

    @property
    def in_radians(self) -> extension.Stall:
        """Return it as the extension takes it."""
        return extension.Stall(
            clmax=self.clmax, attached_to=math.radians(self.attached_to),
            separated_from=math.radians(self.separated_from),
            softness=math.radians(self.softness),
            alpha_clmax=None if self.alpha_clmax is None else math.radians(self.alpha_clmax),
            decambering=None if self.decambering is None
            else tuple(math.radians(each) for each in self.decambering))


@dataclass(frozen=True)
class Recipe:
    """
    One polar. Without `negative`, the section is symmetric and mirrored exactly.

    aspect_ratio : of a wing whose finite span is to be in the separated part, see
    `extension.viterna`.
    """

    airfoil: str
    reynolds: float
    n_crit: float
    positive: Stall
    negative: Stall | None = None
    attached_smoothing: float = 1.5
    cd90: float = 2.02
    reversed_attached: float = 6.0
    reversed_separated: float = 18.0
    aspect_ratio: float | None = None


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
    'naca0012_re3e6': Recipe(
        airfoil='naca0012', reynolds=3e6, n_crit=5.0,
        positive=Stall(
            clmax=1.40, attached_to=11.0, separated_from=26.0, softness=1.5,
            steepest_fall=-0.08, alpha_clmax=15.0,
            why='a tail behind a propeller; wind tunnels give about 1.5 at 16 deg with a smooth '
                'section and 1.0 with a rough one, NeuralFoil gives 1.67 at 18.5'),
    ),
}


def ask_neuralfoil(recipe: Recipe) -> extension.Points:
    """Return what NeuralFoil says within +-RAW_LIMIT, trusted as far as it is confident."""
    import aerosandbox
    import neuralfoil
    alpha = STEP * np.arange(-round(RAW_LIMIT / STEP), round(RAW_LIMIT / STEP) + 1)
    answer = neuralfoil.get_aero_from_airfoil(
        aerosandbox.Airfoil(recipe.airfoil), alpha=alpha, Re=recipe.reynolds,
        n_crit=recipe.n_crit, model_size=MODEL_SIZE)
    curves = np.array([answer[name] for name in ('CL', 'CD', 'CM')])
    # Laminar bubbles that come and go within a degree give lift slopes up to 9 per rad.
    curves = gaussian_filter1d(curves, recipe.attached_smoothing / STEP, axis=1, mode='nearest')
    doubtful = np.asarray(answer['analysis_confidence']) < MIN_CONFIDENCE
    trusted = [min([RAW_LIMIT, *(side * alpha[doubtful & (side * alpha > 0.0)])]) - 1.0
               for side in (-1.0, 1.0)]
    if recipe.negative is None:
        trusted[0] = trusted[1]
    return extension.Points(np.radians(alpha), *curves,
                            (-math.radians(trusted[0]), math.radians(trusted[1])))


def make_polar(recipe: Recipe, name: str) -> tuple[Airfoil, list[str]]:
    """Return the curves and the lines that tell how they were made."""
    found = extension.extend(
        ask_neuralfoil(recipe), recipe.positive.in_radians,
        None if recipe.negative is None else recipe.negative.in_radians,
        separated=extension.Separated(
            recipe.cd90, recipe.aspect_ratio, math.radians(recipe.reversed_attached),
            math.radians(recipe.reversed_separated)),
        name=name, reynolds=recipe.reynolds)
    notes = stall_notes('positive', recipe.positive, found.solved[1])
    if recipe.negative is None:
        notes.append('negative stall: mirror image; cl and cm are odd, cd is even')
    else:
        notes += stall_notes('negative', recipe.negative, found.solved[0])
    for side, stall in ((1.0, recipe.positive), (-1.0, recipe.negative or recipe.positive)):
        fall = steepest_fall(found.airfoil, side)[0]
        if fall < stall.steepest_fall:
            raise ConfigError(
                f'{recipe.airfoil}: falls by {fall:.3f} per deg on the side of {side:+.0f}, '
                f'the bound is {stall.steepest_fall}')
    return found.airfoil, notes


def steepest_fall(airfoil: Airfoil, side: float) -> tuple[float, float]:
    """Return the steepest loss of |cl| [1/deg] between rows, up to 40 deg, and its angle."""
    alpha, cl = np.degrees(airfoil.alpha), np.round(airfoil.cl, 5)
    middle = 0.5 * (alpha[1:] + alpha[:-1])
    slope = np.where((side * middle > 0.0) & (np.abs(middle) < 40.0), np.diff(cl) / np.diff(alpha),
                     np.inf)
    return float(slope.min()), float(middle[np.argmin(slope)])


def stall_notes(side: str, stall: Stall, solved: tuple[float, float]) -> list[str]:
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
        f'  solved: levels off over {math.degrees(solved[0]):.3f} deg, blend starts at '
        f'{math.degrees(solved[1]):.3f} deg; steepest fall allowed {stall.steepest_fall:g} per '
        'deg',
        f'  reason: {stall.why}',
    ]


def measured_notes(airfoil: Airfoil) -> list[str]:
    """Return comment lines with the characteristics of the finished table."""
    alpha, cl = np.degrees(airfoil.alpha), np.round(airfoil.cl, 5)
    near = (alpha >= -4.001) & (alpha <= 6.001)
    slope = np.polyfit(airfoil.alpha[near], cl[near], 1)[0]
    within = np.abs(alpha) <= 10.001
    zero_lift = np.interp(0.0, cl[within], alpha[within])
    lines = [f'measured: alpha_0L {zero_lift:.3f} deg; '
             f'lift slope from -4 to 6 deg {slope:.3f} per rad; least cd {airfoil.cd.min():.5f}']
    for name, side in (('clmax', 1.0), ('clmin', -1.0)):
        i = int(np.argmax(np.where(np.abs(alpha) < 20.0, side * cl, -np.inf)))
        fall, at = steepest_fall(airfoil, side)
        lines.append(
            f'measured: {name} {cl[i]:.4f} at {alpha[i]:g} deg; steepest fall beyond '
            f'{fall:.4f} per deg = {np.degrees(fall):.2f} per rad at {at:g} deg')
    return lines


def notes_of(recipe: Recipe, airfoil: Airfoil, notes: list[str]) -> list[str]:
    """Return all comment lines of a file."""
    separated = [
        'separated: CN and CT of K. V. Truong, J. Renewable Sustainable Energy 12, 033303 (2020),'
        ' fitted to the NACA 0012,',
        f'  constants as in AeroSandbox (MIT, P. Sharpe), CN scaled to cd(90 deg) = '
        f'{recipe.cd90:g} (NACA TN 3361, rough);']
    if recipe.aspect_ratio is not None:
        separated = [
            'separated: Viterna and Corrigan (1981) for a wing of aspect ratio '
            f'{recipe.aspect_ratio:g}, CDmax = 1.1 + 0.018 AR;']
    return [
        'Copyright 2026 the poststall_sim developers',
        'SPDX-License-Identifier: Apache-2.0',
        f'{recipe.airfoil.replace("naca", "NACA ")} at Reynolds number {recipe.reynolds:.0f}, '
        'from -180 to 180 deg; cm about the quarter chord, nose up positive',
        'made by tools/make_polars.py; the lines below are the recipe and what came out of it',
        f'attached: NeuralFoil {version("neuralfoil")} (MIT, P. Sharpe), model {MODEL_SIZE}, '
        f'n_crit {recipe.n_crit:g}, free transition;',
        f'  smoothed over {recipe.attached_smoothing:g} deg; not used where its confidence '
        f'is below {MIN_CONFIDENCE:g}',
        *separated,
        '  cm from a centre of pressure moving from 0.4 c at 0 to 0.5 c at 90 and 0.6 c '
        'at 180 deg',
        f'reversed flow: attached within {recipe.reversed_attached:g} deg of 180, separated '
        f'beyond {recipe.reversed_separated:g} deg; slope 2 pi at 0.75 c,',
        '  cd = 2 cd(0) + 4 sin^2 alpha, camber left out',
        *notes,
        *measured_notes(airfoil),
        'credit: the attached part is the output of NeuralFoil, whose licence does not restrict '
        'its output; the rest is computed here',
    ]


def plot_polar(path: Path, recipe: Recipe, airfoil: Airfoil, notes: list[str],
               measured: Path | None) -> None:
    """Draw one table, with NeuralFoil's own answer and with measured points."""
    raw = ask_neuralfoil(recipe)
    points = polar_import.Imported(polar_import.Format.CSV, raw.alpha[::10], raw.cl[::10],
                                   raw.cd[::10], raw.cm[::10], recipe.reynolds)
    study = airfoil_study.Study(airfoil, points, tuple(notes), extended=True)
    result = airfoil_study.result(study, aspect_ratio=WING[0], strips=WING[1])
    if measured is not None:
        result = airfoil_study.with_measured(result, measured)
    plots.airfoil_figure(result, path)


def watched(names: list[str]) -> Iterable[str]:
    """Return the names behind a progress bar, where tqdm is there."""
    try:
        from tqdm import tqdm
    except ImportError:
        return names
    return tqdm(names, desc='polars', unit='polar')


def main() -> None:
    """Make the polars named on the command line, or all."""
    parser = argparse.ArgumentParser(description='Make the section polars of config/airfoils.')
    parser.add_argument('names', nargs='*', metavar='NAME',
                        help=f'recipes to make (default: all of {", ".join(RECIPES)})')
    parser.add_argument('--output', type=Path, default=OUTPUT, metavar='DIR',
                        help='where the CSV files go (default: config/airfoils)')
    parser.add_argument('--plot', type=Path, metavar='DIR', help='also draw each polar here')
    parser.add_argument('--measured', type=Path, metavar='FILE',
                        help='points to draw beside the curves: a CSV with alpha, cl and more')
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.names) - set(RECIPES))
    if unknown:
        parser.error(f'no recipe for {", ".join(unknown)}; there are {", ".join(RECIPES)}')

    arguments.output.mkdir(parents=True, exist_ok=True)
    report = []
    for name in watched(arguments.names or list(RECIPES)):
        recipe = RECIPES[name]
        airfoil, notes = make_polar(recipe, name)
        path = arguments.output / f'{name}.csv'
        airfoil_writer.write(path, airfoil, notes_of(recipe, airfoil, notes))
        limit = airfoil_report.steepest_unique_fall(airfoil, aspect_ratio=WING[0], strips=WING[1])
        report += [path.name, *measured_notes(airfoil),
                   f'one answer on a wing of aspect ratio {WING[0]:g} with {WING[1]} strips down '
                   f'to {math.radians(limit):.3f} per deg']
        if arguments.plot:
            arguments.plot.mkdir(parents=True, exist_ok=True)
            plot_polar(arguments.plot / f'{name}.png', recipe, airfoil, notes,
                       arguments.measured)
    print('\n  '.join(report))


if __name__ == '__main__':
    main()
