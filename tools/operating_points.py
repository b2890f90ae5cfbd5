# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Figures of single sections: operating points, loadings that add up, trajectories, iterates."""

import math
from pathlib import Path

import numpy as np
from tqdm import tqdm
from wing_tail import DEG, LOCAL, at, model, path, scheme, section

from poststall_sim.aero import model as models
from poststall_sim.aero import polars, superposition
from poststall_sim.aero.schemes import Scheme, Start
from poststall_sim.plots import decambering as plots
from poststall_sim.plots import style
from poststall_sim.plots.decambering import Curve, Kind, Panel, draw
from poststall_sim.state import Status

SECTION_5, SECTION_23 = 4, 22
LETTERS = 'ABCD'


def figure_2_1(file: Path) -> None:
    """Draw the two-dimensional decambering of the NACA 4415."""
    curve = section()
    alpha = math.radians(20.0)
    delta = curve.at(alpha)[0] / (2.0 * math.pi) - (alpha - curve.zero_lift)
    x = 0.5 * (1.0 - np.cos(np.linspace(0.0, math.pi, 200)))
    camber = np.where(x < 0.4, 0.04 / 0.16 * (0.8 * x - x ** 2),
                      0.04 / 0.36 * (0.2 + 0.8 * x - x ** 2))
    slope = np.arctan(np.where(x < 0.4, 0.5 * (0.4 - x), 2.0 * 0.04 / 0.36 * (0.4 - x)))
    half = 0.75 * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x ** 2 + 0.2843 * x ** 3
                   - 0.1015 * x ** 4)
    across, up = half * np.sin(slope), half * np.cos(slope)
    outline = (np.concatenate([(x - across)[::-1], x + across]),
               np.concatenate([(camber + up)[::-1], camber - up]))
    plots.draw_section(file, curve, (2.0, 20.0), math.degrees(delta), (outline, (x, camber)))


def crossing(curve: polars.SectionPolar, alpha: float, cl: float,
             sigma: float) -> tuple[float, float]:
    """Return where the trajectory of a point first meets the curve, (alpha [deg], cl)."""
    change = np.radians(np.arange(0.0, -40.0, -0.002))
    angles = math.radians(alpha) + (sigma / (2.0 * math.pi) - 1.0) * change
    lift = cl + sigma * change
    first = np.flatnonzero(lift - curve.at(angles)[:, 0] <= 0.0)[0]
    return math.degrees(angles[first]), lift[first]


def figure_2_3(file: Path) -> None:
    """Draw operating points of section 5, its perturbation and target."""
    curve = section()
    undecambered = scheme('D')
    low, high = ((a[0, SECTION_5], c[0, SECTION_5]) for a, c in
                 (path(undecambered, angle, 0) for angle in (2.0, 25.0)))
    sigma = undecambered.trajectory[Scheme.D][SECTION_5]
    step = math.radians(-4.0)
    shifted = (high[0] + math.degrees((sigma / (2.0 * math.pi) - 1.0) * step),
               high[1] + sigma * step)
    target = crossing(curve, *high, sigma)
    points = [Curve(label, np.array([x]), np.array([y]), colour, '', 'o', size=6.5, top=5)
              for label, (x, y), colour in (
                  ('potential flow, wing at 2' + DEG, low, style.ATTACHED),
                  ('start s, wing at 25' + DEG, high, style.STALLED),
                  ('perturbed p, all strips by -4' + DEG, shifted, '#E69F00'),
                  ('target t', target, style.SECOND))]
    line = Curve('trajectory', np.array([high[0], target[0]]), np.array([high[1], target[1]]),
                 style.STALLED, width=1.2)
    verticals = [Curve('', np.array([a, a]), np.array([-1.0, 4.0]), style.FAINT, width=1.0,
                       top=0) for a in (2.0, 25.0)]
    draw(file, [Panel(
        Kind.SECTION, 'Section 5 of the wing', (
            *plots.section_curves(curve, deltas=(0.0, -4.0)), line, *points, *verticals),
        limits=(-10.0, 40.0, -0.6, 3.2),
        texts=tuple((x + 0.7, y + 0.1, name) for name, (x, y) in
                    (('s', high), ('p', shifted), ('t', target))))], height=4.2)


def figure_2_4(file: Path) -> None:
    """Draw the initial operating points of all strips of the wing."""
    panels = []
    for letter, alpha in zip('ab', (5.0, 25.0)):
        angles, lift = path(scheme('D'), alpha, 0)
        panels.append(Panel(
            Kind.SECTION, rf'({letter}) wing $\alpha$ = {alpha:g}' + DEG, (
                *plots.section_curves(section(), low=0.0),
                Curve('initial operating points, 20 strips', angles[0, :20], lift[0, :20],
                      style.ATTACHED, '', 'o', size=4.5)), limits=(0.0, 40.0, 0.0, 3.2)))
    draw(file, panels, shared=True)


def figure_3_1(file: Path) -> None:
    """Draw superposition against the direct solution, wing and tail."""
    chosen = model(**LOCAL)
    lattice = chosen.lattice
    far = models.far_normalwash(lattice, np.array([1.0, 0.0, 0.0]))
    response = models.steady_response(chosen.bound, far, chosen.te_rows)
    slopes = superposition.lift_slopes(lattice, response)
    parts = superposition.loadings(lattice, slopes, chosen.aircraft.reference.area)
    place = lattice.quarter_chord[:, 1]

    def both(label: str, lift: np.ndarray, **looks) -> list[Curve]:
        looks.setdefault('size', 3.0)
        return [Curve(label * (grid.name == 'wing'), place[grid.strips], lift[grid.strips],
                      **looks) for grid in lattice.grids]

    def pair(j: int) -> np.ndarray:
        return math.radians(1.0) * (parts.basic[:, j - 1] + parts.basic[:, 20 - j])

    elementary = (
        *both('additional loading $C_{l,a1}$', parts.additional, marker='o'),
        *both(f'basic loading, 1{DEG} at strips 2 and 19 (x 3)', 3.0 * pair(2),
              colour=style.ATTACHED, marker='o'),
        *both(f'basic loading, 1{DEG} at strips 10 and 11 (x 3)', 3.0 * pair(10),
              colour=style.STALLED, marker='o'))
    total, worst = [], 0.0
    delta = np.zeros(lattice.strips)
    for name, turn, colour in (('no decambering', 0.0, style.ATTACHED),
                               (f'-3{DEG} at strips 10 and 11', -3.0, style.STALLED)):
        delta[[9, 10]] = math.radians(turn)
        summed = parts.lift(math.radians(10.0), delta - lattice.zero_lift)[0]
        wash = (math.radians(10.0) + delta - lattice.zero_lift)[lattice.panel_strip]
        rings = np.linalg.solve(chosen.bound + far @ chosen.te_rows, -wash)
        direct = 2.0 * rings[lattice.te_panel] / lattice.strip_chord
        worst = max(worst, np.abs(direct - summed).max())
        total += both(f'direct, {name}', direct, colour=colour, line='', marker='s', size=6.0,
                      hollow=True)
        total += both(f'superposition, {name}', summed, colour=colour, width=1.2)
    tqdm.write(f'figure 3.1: superposition less direct solution at most {worst:.1e}')
    draw(file, [Panel(Kind.SPAN, '(a) elementary loadings', elementary),
                Panel(Kind.SPAN, r'(b) total loading, $\alpha$ = 10' + DEG, tuple(total))],
         height=3.8)


def figure_3_2(file: Path) -> None:
    """Draw the trajectory lines of the four schemes from the same point of section 5."""
    curve = section()
    angles, lift = path(scheme('C'), 20.0, 1)
    alpha, cl = angles[:, SECTION_5], lift[:, SECTION_5]
    # The first two iterates of scheme C: cl over alpha is its line, as in equation 3.8.
    slope = (cl[1] - cl[0]) / math.radians(alpha[1] - alpha[0])
    slopes = {'C': slope / (slope / (2.0 * math.pi) - 1.0)}
    for letter in 'ABD':
        slopes[letter] = scheme(letter).trajectory[Scheme(letter)][SECTION_5]
    lines = []
    for letter in LETTERS:
        ends = np.array([(alpha[0], cl[0]), crossing(curve, alpha[0], cl[0], slopes[letter])])
        lines.append(Curve(f'scheme {letter}', ends[:, 0], ends[:, 1],
                           plots.SCHEME_COLOURS[letter], marker='o', size=4.5, top=4))
    start = Curve(f'start, wing at 20{DEG}', alpha[:1], cl[:1], style.INK, '', 's', size=6.0,
                  top=5)
    curves = (*plots.section_curves(curve, low=0.0), *lines, start)
    draw(file, [Panel(Kind.SECTION, 'Section 5', curves, limits=(0.0, 40.0, 0.4, 2.6)),
                Panel(Kind.SECTION, 'its targets', curves, limits=(16.0, 19.0, 1.55, 2.35))])


def _evolution(letter: str, alpha: float, start: Start, steps: int, title: str,
               limits: tuple, strip: int = SECTION_5) -> Panel:
    """Return how a strip goes from iterate to iterate, and how it ends."""
    chosen = scheme(letter, start)
    found = at(chosen, alpha)
    n = min(found.aero.iterations, steps)
    before = at(chosen, alpha - 1.0).aero.strips.delta if start is Start.GIVEN else None
    angles, lift = path(chosen, alpha, n, before)
    good = found.aero.status is Status.CONVERGED
    colour = plots.SCHEME_COLOURS[letter]
    end = f'{found.aero.iterations} iterations' if good else 'not converged'
    return Panel(Kind.SECTION, f'{title}: {end}', (
        *plots.section_curves(section(), low=0.0),
        Curve('', angles[:, strip], lift[:, strip], colour, marker='o', size=3.5, width=0.9,
              top=4),
        Curve('start', angles[:1, strip], lift[:1, strip], style.INK, '', 's', size=6.0, top=5),
        *([Curve('end', angles[-1:, strip], lift[-1:, strip], style.INK, '', '*', size=9.0,
                 top=6)] if good and n == found.aero.iterations else [])), limits=limits)


def figure_3_4(file: Path) -> None:
    """Draw how section 5 comes to its curve at 16 degrees, no under-relaxation."""
    draw(file, [_evolution(letter, 16.0, Start.ZERO, 60, f'Scheme {letter}',
                           (8.0, 20.0, 1.0, 2.0)) for letter in LETTERS], columns=2, height=3.1)


def figure_3_5(file: Path) -> None:
    """Draw why scheme C fails: section 23, on the tail."""
    alpha = 14.0
    angles, lift = path(scheme('C'), alpha, 5)
    x, y = angles[:, SECTION_23], lift[:, SECTION_23]
    far = np.array([-30.0, 30.0])
    curves = (
        *plots.section_curves(section()),
        Curve('trajectory line through s and p', x[0] + far,
              y[0] + far * (y[1] - y[0]) / (x[1] - x[0]), plots.SCHEME_COLOURS['C'], width=1.2),
        Curve('iterates that follow', x[1:], y[1:], style.STALLED, (0, (2, 2)), '^', width=0.8,
              size=5.0),
        Curve('s, no decambering', x[:1], y[:1], style.INK, '', 's', size=6.0, top=5),
        Curve('p, after the first iteration', x[1:2], y[1:2], style.ATTACHED, '', 'o', size=6.0,
              top=5))
    title = rf'Section 23, wing $\alpha$ = {alpha:g}' + DEG
    draw(file, [Panel(Kind.SECTION, title, curves, limits=(-10.0, 30.0, -0.6, 3.4)),
                Panel(Kind.SECTION, 's and p', curves, limits=(6.8, 8.2, 1.18, 1.36),
                      texts=((7.28, 1.292, 's'), (7.63, 1.318, 'p')))], height=3.8)


def figure_3_6(file: Path) -> None:
    """Draw what the initial decambering does to the way of schemes A and D."""
    draw(file, [_evolution(name[0], 24.0, start, 200, name, (8.0, 30.0, 0.9, 2.8))
                for name, start in (('D0', Start.ZERO), ('D1', Start.SCHEME_A),
                                    ('D raised', Start.GIVEN), ('A0', Start.ZERO),
                                    ('A raised', Start.GIVEN))], columns=3, height=3.0)
