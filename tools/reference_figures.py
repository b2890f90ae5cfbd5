# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The figures of docs/validation.md: what `reference_cases` computes, drawn."""

from pathlib import Path

import numpy as np
import reference_cases as cases
from reference_cases import exact, navion, test_avl, test_turbulence, theory

from poststall_sim.aero.decambering import Closure
from poststall_sim.plots import style
from poststall_sim.plots.decambering import Curve, Kind, Panel, draw
from poststall_sim.turbulence import Spectrum

THEORY = {'colour': style.INK, 'width': 1.3, 'top': 2}


def points(label: str, x, y, colour: str = style.STALLED, marker: str = 'o') -> Curve:
    """Return what the package says, as marks."""
    return Curve(label, np.asarray(x, float), np.asarray(y, float), colour, '', marker, size=5.0,
                 top=4)


def figure_wings(file: Path) -> None:
    """Draw lift slope and damping in roll over the aspect ratio."""
    ratio = np.linspace(0.5, 20.0, 100)
    ours = np.array([1.0, 2.0, 4.0, 6.0, 8.0, 12.0, 16.0, 20.0])
    found = np.array([cases.rectangular(float(each)) for each in ours])
    other = np.array([(a, *values) for a, values in cases.RATIOS.items()])
    slender = ratio[ratio < 2.5]
    looks = {'colour': style.FAINT, 'width': 1.3, 'top': 1}
    draw(file, [
        Panel(Kind.SLOPE, 'Lift of rectangular plates', (
            Curve('Helmbold', ratio, exact.helmbold_slope(ratio), **THEORY),
            Curve('Prandtl', ratio, exact.prandtl_slope(ratio), line='--', **THEORY),
            Curve('slender wing', slender, exact.slender_slope(slender), **looks),
            points('this package, 8 x 40', ours, found[:, 0]),
            Curve('another lattice, 8 x 40', other[:, 0], other[:, 1], style.ATTACHED, '', 's',
                  size=8.0, hollow=True, top=5)), limits=(0.0, 20.5, 0.0, 6.5)),
        Panel(Kind.ROLL_DAMPING, 'Their damping in roll', (
            Curve('lifting line, elliptic', ratio, exact.roll_damping_elliptic(ratio),
                  line=':', **THEORY),
            Curve('slender wing', slender, exact.roll_damping_slender(slender), **looks),
            points('this package, 8 x 40', ours, found[:, 1]),
            Curve('another lattice, 8 x 40', other[:, 0], other[:, 2], style.ATTACHED, '', 's',
                  size=8.0, hollow=True, top=5)), limits=(0.0, 20.5, -1.0, 0.0))], height=3.4)


def figure_avl(file: Path) -> None:
    """Draw what two aircraft differ from AVL, beside what the test allows."""
    with style.canvas(9.2, 3.9, file) as figure:
        for axes, name in zip(figure.subplots(1, 2), test_avl.AVL):
            rows = cases.avl(name)
            allowed = np.array([float(row.asked.split()[0]) for row in rows])
            place = np.arange(len(rows))
            axes.bar(place, 2.0 * allowed, 0.8, -allowed, color='#E6E8EB', label='allowed')
            axes.plot(place, [100.0 * row.off for row in rows], 'o', color=style.STALLED,
                      markersize=5.0, label='this package less AVL')
            axes.set_xticks(place, [row.quantity for row in rows], rotation=60, ha='right',
                            fontsize=7.5)
            axes.set(ylabel='difference [%]', ylim=(-2.4, 2.4))
            axes.set_title(f'{name} aircraft')
        figure.legend(*axes.get_legend_handles_labels(), loc='outside lower center', ncols=2)


def figure_indicial(file: Path) -> None:
    """Draw the lift after a sudden start and on entering a gust."""
    s, marks = np.linspace(0.02, 12.0, 300), np.arange(0.5, 12.1, 0.5)
    draw(file, [Panel(Kind.INDICIAL, title, (
        Curve('closed form', s, closed(s), **THEORY),
        points('this package, 32 panels', marks, march(32, marks))),
        limits=(0.0, 12.0, 0.0, 1.0)) for title, closed, march in (
            ('Sudden start: Wagner', exact.wagner, theory.wagner_march),
            ('Sharp-edged gust: Küssner', exact.kuessner, theory.entering))], height=3.2)


def figure_oscillating(file: Path) -> None:
    """Draw amplitude and phase of the lift of a plate that heaves or pitches."""
    k, panels = np.linspace(0.02, 0.75, 200), []
    for kind, title in ((Kind.AMPLITUDE, 'Amplitude'), (Kind.PHASE, 'Phase')):
        def part(values, kind=kind):
            return np.abs(values) if kind is Kind.AMPLITUDE else np.degrees(np.angle(values))
        curves = []
        for motion, colour in (('plunge', style.ATTACHED), ('pitch', style.STALLED)):
            curves.append(Curve(f'Theodorsen, {motion}', k,
                                part(np.array([theory.theodorsen(each, motion) for each in k])),
                                colour, width=1.3))
            for rows, marker, hollow in ((4, 's', True), (8, 'o', False)):
                found = np.array([cases.oscillating(rows, each, motion)
                                  for each in cases.FREQUENCIES])
                curves.append(Curve(f'{rows} panels, {motion}', np.array(cases.FREQUENCIES),
                                    part(found), colour, '', marker, size=5.0, hollow=hollow,
                                    top=4))
        panels.append(Panel(kind, title, tuple(curves), limits=(0.0, 0.75, None, None)))
    draw(file, panels, height=3.4)


def figure_sections(file: Path) -> None:
    """Draw an infinite wing on its section's curve through a half turn."""
    panels = []
    for k, (kind, name) in enumerate(((Kind.SECTION, 'Lift'), (Kind.SECTION_DRAG, 'Drag'),
                                      (Kind.SECTION_MOMENT, 'Moment'))):
        angles, found, closed = cases.infinite(Closure.NONLOCAL)
        fine = np.linspace(-10.0, 170.0, 721)
        curve = cases.polars.section_polar(cases.wings.shipped('naca4415_re3e6'))
        panels.append(Panel(kind, name, (
            Curve("the section's curve", fine, curve.at(np.radians(fine))[:, k], **THEORY),
            points('infinite wing, non-local closure', angles, found[:, k]),
            Curve('local closure', angles, cases.infinite(Closure.LOCAL)[1][:, k],
                  style.ATTACHED, '', 's', size=7.0, hollow=True, top=5)),
            limits=(-12.0, 172.0, None, None)))
    draw(file, panels, height=3.0)


def figure_bodies(file: Path) -> None:
    """Draw the tumbling brick, and the balance of energy in the demo's stall."""
    time, flown, closed = cases.brick()
    some = slice(None, None, 100)
    rates = [Curve(f'{name}, closed form', time, closed[:, i], colour, width=1.2)
             for i, (name, colour) in enumerate(zip('pqr', (
                 style.ATTACHED, style.STALLED, style.SECOND)))]
    rates += [points('this package' if i == 0 else '', time[some], flown[some, i], style.INK, '.')
              for i in range(3)]
    moments, gained, work, _ = cases.energies()
    draw(file, [
        Panel(Kind.RATES, 'A brick that tumbles without torque', tuple(rates),
              limits=(0.0, 30.0, None, None)),
        Panel(Kind.ENERGY, 'A stall and its recovery', (
            Curve('energy gained by the body', moments, gained, style.ATTACHED, width=2.6),
            Curve('work of air and engine', moments, work, style.INK, (0, (4, 3)), width=1.3,
                  top=5)), limits=(0.0, 13.0, None, None))], height=3.4)


def figure_navion(file: Path) -> None:
    """Draw derivatives over those published, and modes beside those published."""
    ours, modes = cases.navion_numbers()
    with style.canvas(9.2, 4.0, file) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
        place = np.arange(len(navion.TEPER))
        left.axhline(1.0, color=style.INK, linewidth=0.9)
        for values, marker, colour, label in (
                (navion.FLOWN, 's', style.ATTACHED, 'flown (Seckel & Morris) over Teper'),
                (ours, 'o', style.STALLED, 'this package over Teper')):
            left.plot(place, [values[key] / navion.TEPER[key] for key in navion.TEPER], marker,
                      color=colour, markersize=5.0, label=label)
        left.set_xticks(place, list(navion.TEPER), rotation=60, ha='right', fontsize=7.5)
        left.set(ylabel='share of the published value', ylim=(0.0, 2.4))
        left.set_title('Derivatives')
        for values, marker, colour, label in (
                (navion.MODES, 's', style.ATTACHED, 'published (Nelson, of Teper)'),
                (modes, 'o', style.STALLED, 'this package')):
            right.plot([complex(each).real for each in values.values()],
                       [complex(each).imag for each in values.values()], marker, color=colour,
                       markersize=5.5, label=label)
        for name, value in navion.MODES.items():
            right.annotate(name, (complex(value).real, complex(value).imag), xytext=(
                -4.0, -14.0 if name == 'spiral' else 8.0), textcoords='offset points',
                           fontsize=8.0, ha={
                               'roll': 'center', 'Dutch roll': 'left'}.get(name, 'right'))
        right.set(xlabel='real part [1/s]', ylabel='imaginary part [1/s]', ylim=(-0.4, 3.4),
                  xlim=(-11.0, 2.5))
        right.set_title('Modes')
        left.legend(loc='upper left')
        right.legend(loc='upper left')


def figure_turbulence(file: Path) -> None:
    """Draw spectra along a path, the mean of many seeds over the specification's formulas."""
    panels = []
    for spectrum in Spectrum:
        k, found = cases.spectra(spectrum)
        # A line of the mean still scatters; the mean of the lines of a band hardly does.
        edges = np.geomspace(0.009, 0.2, 21)
        bands = [(k >= low) & (k < high) for low, high in zip(edges, edges[1:])]
        bands = [band for band in bands if band.any()]
        fine = np.geomspace(0.009, 0.2, 200)
        curves = []
        for component, name, formula, colour in (
                (0, 'along the path', test_turbulence.longitudinal, style.ATTACHED),
                (2, 'across it', test_turbulence.transverse, style.STALLED)):
            curves.append(Curve(f'formula, {name}', fine, formula(
                spectrum, fine, test_turbulence.SIGMA, test_turbulence.SCALE), colour, width=1.2))
            curves.append(points(
                f'{test_turbulence.SEEDS} seeds, {name}', [k[band].mean() for band in bands],
                [found[component, band].mean() for band in bands], colour))
        panels.append(Panel(Kind.SPECTRUM, cases.SPECTRA[spectrum], tuple(curves),
                            limits=(0.0, 0.2, None, None), log=True))
    draw(file, panels, height=3.2)
