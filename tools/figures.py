#!/usr/bin/env python3
# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Draw the figures and tables of the documentation and README.md.

What is computed is the package's, and so is what draws (`poststall_sim.plots`); here stands which
wing, which angles, which solver. In chapters 2 and 3 the configuration is the dissertation's
Figure 2.2 (config/aircraft/wing_tail.yaml), the lattice its Weissinger arrangement with small
angles, the closure the local one, unless a figure says other. Tables stand between marks in the
pages and are written anew there.
"""

import argparse
import math
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import demo_flight
import diagrams
import drawings
import moving_picture
import numpy as np
import operating_points
import pictures
import reference_cases
import reference_figures
import rolling_wing
import trainer_modes
import wakes
from PIL import Image
from screenshots import Missing
from tqdm import tqdm
from wing_tail import (
    AIR,
    ALPHAS,
    DEG,
    LOCAL,
    NONLOCAL,
    at,
    lift_curve,
    loading,
    model,
    named,
    nonlocal_reference,
    path,
    scheme,
    section_reference,
    wing_lift,
)

from poststall_sim import polar
from poststall_sim.aero.schemes import Scheme, Start
from poststall_sim.plots import decambering as plots
from poststall_sim.plots import style
from poststall_sim.plots.decambering import Curve, Kind, Panel, draw
from poststall_sim.state import Status

STARTS = (('D', '-', '', 3), ('D0', (0, (5, 2)), '', 4), ('D1', (0, (1, 1.5)), '', 5))
START_COLOURS = {'D': '#D55E00', 'D0': '#0072B2', 'D1': '#222222'}
SWEEPS = (0.0, 10.0, 20.0, 30.0)
RANDOM_STARTS = 500


def figure_3_3(file: Path) -> None:
    """Draw lift curves by the four schemes, from no decambering."""
    curves = [section_reference()]
    for letter, (line, marker) in zip(operating_points.LETTERS, (
            ('-', 'o'), ('', 's'), ('', 'D'), ((0, (4, 2)), ''))):
        curves.append(lift_curve(
            f'scheme {letter}', scheme(letter), colour=plots.SCHEME_COLOURS[letter], line=line,
            marker=marker, size=3.5 if letter == 'A' else 5.0, top=4 if letter in 'AD' else 3))
    texts = []
    for letter, height in (('B', 0.52), ('C', 0.36)):
        failed = ALPHAS[np.isnan(curves[1 + operating_points.LETTERS.index(letter)].y)]
        said = f'at {_runs(failed)}{DEG}' if failed.size else 'nowhere'
        texts.append((13.0, height, f'scheme {letter} fails {said}'))
    draw(file, [Panel(Kind.LIFT, 'Wing lift, schemes A to D', (*curves, nonlocal_reference()),
                      limits=(0.0, 40.0, 0.2, 1.8), texts=tuple(texts))], height=4.4)


def _runs(values: np.ndarray) -> str:
    """Return whole numbers as text, neighbours joined: 8, 11 to 29."""
    groups = np.split(values, np.flatnonzero(np.diff(values) > 1.5) + 1)
    return ', '.join(f'{g[0]:g}' if g.size == 1 else f'{g[0]:g} to {g[-1]:g}' for g in groups)


def figure_3_7(file: Path) -> None:
    """Draw lift curves by the starts of scheme D, and one iteration of scheme A."""
    curves = [section_reference()]
    chosen = scheme('A')
    once = [polar.surface_lift(chosen, path(chosen, a, 1)[1][1], 'wing') for a in ALPHAS]
    curves.append(Curve('one iteration of scheme A', ALPHAS, np.array(once),
                        plots.SCHEME_COLOURS['A'], '', 'x', size=4.0))
    for name, line, marker, top in STARTS:
        curves.append(lift_curve(name, named(name), colour=START_COLOURS[name], line=line,
                                 marker=marker, top=top))
    draw(file, [Panel(Kind.LIFT, 'Wing lift by the start of scheme D', (
        *curves, nonlocal_reference()), limits=(0.0, 40.0, 0.2, 2.2))], height=4.4)


def _start_loadings(alphas: Sequence[float], low: float = 0.0, **lattice) -> list[Panel]:
    """Return the loadings by scheme D from its three starts."""
    panels = []
    for alpha in alphas:
        chosen = model(**lattice, **NONLOCAL)
        smooth = Curve('non-local closure (this package)', *loading(chosen, at(chosen, alpha)),
                       plots.NONLOCAL_COLOUR, (0, (6, 2)), width=1.3, top=2)
        curves = []
        for (name, line, _, top), mark in zip(STARTS, ('o', 's', '^')):
            found = at(named(name, **lattice), alpha)
            label = name if found.aero.status is Status.CONVERGED else f'{name}, not converged'
            curves.append(Curve(label, *loading(named(name, **lattice), found),
                                START_COLOURS[name], line, mark, width=1.1, size=3.0, top=top))
        panels.append(Panel(Kind.LOADING, rf'$\alpha$ = {alpha:g}' + DEG, (*curves, smooth),
                            limits=(-1.0, 1.0, low, 1.8)))
    return panels


def figure_3_8(file: Path) -> None:
    """Draw loadings from the three starts, at and past the start of the stall."""
    draw(file, _start_loadings((14.0, 20.0), low=0.8), shared=True)


def figure_3_9(file: Path) -> None:
    """Draw loadings on 20 and on 80 strips."""
    panels = []
    for alpha in (24.0, 26.0):
        curves = []
        for strips, colour, width, marker in ((80, '#56B4E9', 0.9, ''),
                                              (20, style.STALLED, 1.4, 'o')):
            chosen = scheme('D', strips=strips)
            found = at(chosen, alpha)
            end = '' if found.aero.status is Status.CONVERGED else ', not converged'
            curves.append(Curve(f'D0, {strips} strips{end}', *loading(chosen, found), colour,
                                marker=marker, width=width, size=3.5))
        for strips, line in ((80, '-'), (20, (0, (5, 2)))):
            chosen = model(strips=strips, **NONLOCAL)
            curves.append(Curve(f'non-local closure, {strips} strips',
                                *loading(chosen, at(chosen, alpha)), plots.NONLOCAL_COLOUR, line,
                                width=1.3, top=4))
        panels.append(Panel(Kind.LOADING, rf'$\alpha$ = {alpha:g}' + DEG, tuple(curves),
                            limits=(-1.0, 1.0, -1.4, 2.0)))
    draw(file, panels, shared=True)


def figure_3_11(file: Path) -> None:
    """Draw loadings from the three starts, deep in the stall."""
    draw(file, _start_loadings((24.0, 26.0), low=0.8), shared=True)


def figure_3_12(file: Path) -> None:
    """Draw lift curves of swept wings by the starts of scheme D."""
    panels = []
    for angle in SWEEPS:
        lattice = {'tail': False, 'sweep': angle}
        curves = [lift_curve(name, named(name, **lattice), colour=START_COLOURS[name], line=line,
                             top=top, width=1.3) for name, line, _, top in STARTS]
        panels.append(Panel(
            Kind.LIFT, f'Sweep {angle:g}{DEG}', (
                section_reference(), *curves, nonlocal_reference(**lattice)),
            limits=(0.0, 40.0, 0.2, 1.8)))
    draw(file, panels, columns=2, height=2.9)


def figure_3_14(file: Path) -> None:
    """Draw loadings of swept wings, attached and stalled."""
    panels = []
    for angle in SWEEPS:
        pair = _start_loadings((4.0, 26.0), tail=False, sweep=angle)
        panels += [replace(each, title=f'Sweep {angle:g}{DEG}, {each.title}') for each in pair]
    draw(file, panels, columns=2, height=2.3, shared=True)


def table_3_1() -> str:
    """Return the iterations of schemes A to D from no decambering, as a markdown table."""
    alphas, tolerances = (16.0, 24.0, 30.0), (1e-2, 1e-4)
    lines = ['| scheme | D | ' + ' | '.join(
        f'{a:g}{DEG}, tol {t:g}' for t in tolerances for a in alphas) + ' |',
        '|---|---|' + '---|' * 6]
    for letter in operating_points.LETTERS:
        for damping in (1.0, 0.6):
            cells = []
            for tolerance in tolerances:
                chosen = model(**LOCAL | {'tolerance': tolerance}, scheme=Scheme(letter),
                               start=Start.ZERO, damping=damping, symmetric=True)
                for alpha in alphas:
                    aero = at(chosen, alpha).aero
                    cells.append(str(aero.iterations) if aero.status is Status.CONVERGED
                                 else 'fails')
            lines.append(f'| {letter} | {damping:g} | ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines)


CURVES = (('naca4415_re3e6', 'soft stall (re3e6)', style.ATTACHED),
          ('naca4415_re4e5', 'ordinary stall (re4e5)', style.STALLED))


def figure_solutions(file: Path) -> None:
    """Draw how many solutions the closures have, what they lift, and what that remembers."""
    counts, lifts, bands, generator = [], [], [], np.random.default_rng(0)
    for airfoil, name, colour in CURVES:
        for closure, settings in (('local', LOCAL), ('non-local', NONLOCAL)):
            chosen = model(airfoil=airfoil, tail=False, **settings)
            found = [polar.distinct_solutions(
                chosen, polar.Condition(math.radians(a)), starts=RANDOM_STARTS,
                generator=generator, **AIR) for a in ALPHAS]
            number = np.array([len(each.points) for each in found])
            lift = [[polar.surface_lift(chosen, p.aero.strips.cl, 'wing') for p in each.points]
                    for each in found]
            low, high = (np.array([f(each) for each in lift]) for f in (min, max))
            tqdm.write(f'figure solutions: {closure}, {name}: at most {number.max()} solutions, '
                       f'{sum(each.failed for each in found)} starts failed')
            if closure == 'local':
                counts.append(Curve(f'local, {name}', ALPHAS, number, colour, marker='o',
                                    width=1.1, size=3.5, top=4))
                lifts += [Curve('', ALPHAS, each, colour, width=0.9) for each in (low, high)]
                bands.append((ALPHAS, low, high, colour))
            else:
                looks = {'colour': plots.NONLOCAL_COLOUR, 'width': 1.8, 'top': 5,
                         'line': (0, (5, 2)) if airfoil == CURVES[0][0] else (0, (1, 1.2))}
                counts.append(Curve(f'non-local, {name}', ALPHAS, number, **looks))
                lifts.append(Curve('', ALPHAS, high, **looks))
    loops = []
    for closure, settings, colour in (('local', LOCAL, plots.SCHEME_COLOURS['C']),
                                      ('non-local', NONLOCAL, plots.NONLOCAL_COLOUR)):
        chosen = model(airfoil=CURVES[1][0], tail=False, **settings)
        lift = wing_lift(chosen, list(polar.up_and_down(
            chosen, [polar.Condition(math.radians(a)) for a in ALPHAS], **AIR)))
        n = len(ALPHAS)
        loops += [Curve(f'{closure}, alpha raised', ALPHAS, lift[:n], colour),
                  Curve(f'{closure}, alpha lowered', ALPHAS[::-1], lift[n - 1:], colour,
                        (0, (2, 1.5)))]
    limits = (8.0, 40.0, 0.8, 1.75)
    draw(file, [
        Panel(Kind.COUNT, f'(a) from {RANDOM_STARTS} random starts', tuple(counts),
              limits=(0.0, 40.0, 0.8, RANDOM_STARTS * 1.3), log=True),
        Panel(Kind.LIFT, '(b) what they lift', tuple(lifts), limits=limits, bands=tuple(bands)),
        Panel(Kind.LIFT, '(c) hysteresis, re4e5', tuple(loops), limits=limits)], height=3.8)


def figure_strips(file: Path) -> None:
    """Draw local against non-local on 20, 40 and 80 strips."""
    looks = ((80, style.STALLED, '-', 0.9), (40, style.SECOND, (0, (5, 2)), 1.5),
             (20, style.ATTACHED, (0, (1, 1.2)), 2.0))
    panels = []
    for name, of in (('local closure, D0', lambda n: scheme('D', strips=n, tail=False)),
                     ('non-local closure', lambda n: model(strips=n, tail=False, **NONLOCAL))):
        for kind, title in ((Kind.LIFT, f'Lift, {name}'),
                            (Kind.LOADING, rf'Loading at $\alpha$ = 24{DEG}, {name}')):
            curves = []
            for n, colour, line, width in looks:
                curve = lift_curve('', of(n)) if kind is Kind.LIFT else \
                    Curve('', *loading(of(n), at(of(n), 24.0)))
                curves.append(replace(curve, label=f'{n} strips', colour=colour, line=line,
                                      width=width))
            panels.append(Panel(kind, title, tuple(curves), limits=(
                (0.0, 40.0, 0.2, 1.8) if kind is Kind.LIFT else (-1.0, 1.0, None, None))))
    draw(file, panels, columns=2, height=3.2)


def _number(name: str) -> tuple[float, ...]:
    """Return what puts figures in the order of the dissertation, our own last."""
    return tuple(int(part) if part.isdigit() else math.inf for part in name.split('_'))


DRAWN = (operating_points, drawings, diagrams, demo_flight, wakes, rolling_wing, trainer_modes,
         reference_figures)
FIGURES: dict[str, Callable[[Path], None]] = dict(sorted(
    ((name.removeprefix('figure_'), found)
     for each in (*(vars(module) for module in DRAWN), globals())
     for name, found in each.items() if name.startswith('figure_')),
    key=lambda item: _number(item[0])))
TABLES: dict[str, Callable[[], str]] = {
    '3.1': table_3_1, '4.1': demo_flight.table_aircraft, '5.3': trainer_modes.table_5_3,
    'wakes': wakes.table_wakes, 'summary': reference_cases.table_summary,
    'cases': reference_cases.table_cases, 'tests': reference_cases.table_tests}
PICTURES: dict[str, Callable[[Path], None]] = {
    name.removeprefix('picture_'): found for name, found in vars(pictures).items()
    if name.startswith('picture_')}
"""What goes to docs/images."""
EXAMPLES: dict[str, Callable[[Path], None]] = {
    f'example_{path.stem}': partial(pictures.example, path.stem)
    for path in sorted(pictures.EXAMPLES.glob('*.py')) if path.stem != 'figures'}
"""What goes there as the examples write it, in few colours as it is."""
PAGES = ('report', 'watch')
"""Those of them that a browser draws."""
MOVING = 'moving'
"""The name of the README's moving picture among the figures to draw."""
DRAWABLE = (*FIGURES, *PICTURES, *EXAMPLES, MOVING, 'table')


def _shrink(file: Path, rounds: int = 0) -> None:
    """
    Store a figure with a palette: a third of the size, and no difference to be seen.

    rounds : of k-means, for pictures with more greys and blends than a figure has.
    """
    with Image.open(file) as image:
        small = image.convert('RGB').quantize(
            256, Image.Quantize.MAXCOVERAGE, kmeans=rounds, dither=Image.Dither.NONE)
    small.save(file, optimize=True)


def _write_tables(docs: Path) -> None:
    """Write the tables anew where their marks stand, in the pages and in the README."""
    for page in (*sorted(docs.glob('*.md')), docs.parent / 'README.md'):
        if not page.exists():
            continue
        text = page.read_text(encoding='utf-8')
        written = re.sub(r'(<!-- table ([\w.]+) -->\n)(?:(?!<!--).)*(<!-- end -->)',
                         lambda found: f'{found[1]}{TABLES[found[2]]()}\n{found[3]}', text,
                         flags=re.DOTALL)
        if written != text:
            page.write_text(written, encoding='utf-8')


def main() -> int:
    """Draw all figures, or those named."""
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('names', nargs='*', metavar='NAME',
                        help=f'what to draw: {", ".join(DRAWABLE)} (default all)')
    parser.add_argument('--docs', type=Path, metavar='DIR',
                        default=Path(__file__).resolve().parents[1] / 'docs')
    arguments = parser.parse_args()
    if unknown := set(arguments.names).difference(DRAWABLE):
        parser.error(f'no figure {", ".join(sorted(unknown))}, there are {", ".join(DRAWABLE)}')
    missing = False
    for name in tqdm(arguments.names or DRAWABLE, desc='figures'):
        try:
            _draw(name, arguments.docs)
        except Missing as error:
            tqdm.write(f'{name}: not drawn, it {error}')
            missing = True
    return int(missing)


def _draw(name: str, docs: Path) -> None:
    """Draw one of `DRAWABLE`."""
    if name == 'table':
        _write_tables(docs)
    elif name == MOVING:
        moving_picture.moving_picture(docs / 'images' / 'flight.gif')
    elif name in EXAMPLES:
        EXAMPLES[name](docs / 'images' / f'{name}.png')
    else:
        file = docs / 'images' / f'{name}.png' if name in PICTURES else \
            docs / 'figures' / f'figure_{name}.png'
        (PICTURES | FIGURES)[name](file)
        _shrink(file, rounds=3 if name in PAGES else 0)


if __name__ == '__main__':
    sys.exit(main())
