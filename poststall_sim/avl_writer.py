# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
An aircraft as the text of an AVL geometry file: the lattice and the controls it has here.

What AVL does not know is left out: section curves past the stall, limits of controls, engines.
Chords that twist turned (surfaces that are not ``flat``) become incidences of flat panels.
"""

import math
import re

import numpy as np

from poststall_sim import avl_sections
from poststall_sim.aero import polars, stations
from poststall_sim.aero.polars import SectionPolar
from poststall_sim.aircraft import Aircraft, ConfigError, Surface
from poststall_sim.avl_reader import spaced, stretched
from poststall_sim.frames import FloatArray, control_sign
from poststall_sim.reader import Place

_SPACINGS = (0.0, 1.0, -1.0, 2.0, -2.0, *(k / 4.0 for k in range(-11, 12)))
_SAME = 1e-9


def text(aircraft: Aircraft, rows: int) -> str:
    """Return an aircraft as an AVL file with so many panels along every chord."""
    reference, cg = aircraft.reference, aircraft.mass.cg_G
    lines = [aircraft.name, '0.0  ! Mach', '0 0 0.0  ! iYsym iZsym Zsym',
             _row(reference.area, reference.chord, reference.span) + '  ! Sref Cref Bref',
             _row(*cg) + '  ! Xref Yref Zref', '0.0  ! CDp']
    sections = {airfoil.name: polars.section_polar(airfoil) for airfoil in aircraft.airfoils}
    for surface in aircraft.surfaces:
        lines += _surface(aircraft, surface, sections, rows)
    return '\n'.join([*lines, ''])


def _row(*values: float) -> str:
    return ' '.join(f'{value + 0.0:.17g}' for value in values)


def _surface(aircraft: Aircraft, surface: Surface, sections: dict[str, SectionPolar],
             rows: int) -> list[str]:
    cuts = _cuts(surface)
    places = np.array(surface.section_shares)
    moved = {control.name: _moved(control, surface, cuts) for control in aircraft.controls
             if any(each.surface == surface.name for each in control.effectors)}
    for gain, hinge, _ in moved.values():
        places = _with_ends(places, cuts, gain, hinge)
    whole = [sp for sp in _SPACINGS if _fits(_attempt(len(cuts) // 2, sp, places), cuts)]
    lines = ['SURFACE', surface.name, f'{rows} 0.0' + (
        f' {len(cuts) // 2} {whole[0]:.17g}' if whole else '')]
    lines += ['YDUPLICATE', '0.0'] if surface.symmetric else []
    spacings = [[0, 0.0]] * len(places) if whole else None
    if spacings is None:
        spacings = _intervals(places, cuts)
        if spacings is None:   # a section at every strip: any cut can be had so
            places = cuts[::2]
            spacings = _intervals(places, cuts)
    for i, share in enumerate(places):
        lines += _section(surface, float(share), sections, spacings[i] if spacings else [1, 0.0])
        for name, (gain, hinge, image) in moved.items():
            ends = _at(name, i, places, cuts, gain, hinge)
            if ends is not None:
                lines += ['CONTROL', f'{name} {_row(*ends)} 0 0 0 {_row(image)}']
    return lines


def _cuts(surface: Surface) -> FloatArray:
    """Return edges and points of the strips by turns, along the (half) span, 0 to 1."""
    _, place = stations.of_surface(surface)
    edges = stations.strip_edges(surface, place) / place[-1]
    points = (1.0 - (at := stations.collocation_shares(surface))) * edges[:-1] + at * edges[1:]
    cuts = np.empty(2 * surface.strips + 1)
    cuts[::2], cuts[1::2] = edges, points
    return 2.0 * cuts[surface.strips:] - 1.0 if surface.symmetric else cuts


def _attempt(strips: int, spacing: float, places: FloatArray) -> FloatArray | None:
    return stretched(spaced(strips, spacing), places)


def _fits(found: FloatArray | None, cuts: FloatArray) -> bool:
    return found is not None and bool(np.abs(found - cuts).max() < 1e-12)


def _intervals(places: FloatArray, cuts: FloatArray) -> list[list] | None:
    """Return Nspan and Sspace behind each section that make these cuts, if there are any."""
    result: list[list] = []
    for low, high in zip(places, places[1:]):
        inner = cuts[(cuts > low - 1e-12) & (cuts < high + 1e-12)]
        strips = len(inner) // 2
        share = (inner - low) / (high - low)
        # Of a single strip the point alone says it: equal and sine spacing mixed.
        off = 0.5 - share[1]
        tries = (*_SPACINGS, math.copysign(3.0 - abs(off) / (math.sqrt(0.5) - 0.5), off)) \
            if strips == 1 else _SPACINGS
        fitting = [sp for sp in tries if _fits(spaced(strips, sp), share)]
        if not fitting:
            return None
        result.append([strips, fitting[0]])
    return [*result, [0, 0.0]]


def _moved(control, surface: Surface, cuts: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return gain and hinge of each strip in AVL's terms, and SgnDup."""
    middles = 0.5 * (cuts[2::2] + cuts[:-2:2])
    gain = {side: np.zeros_like(middles) for side in (1, -1)}
    hinge = np.zeros_like(middles)
    first, last = (np.array(s.leading_edge_G) for s in (surface.sections[0],
                                                         surface.sections[-1]))
    normal = np.cross([1.0, 0.0, 0.0], last - first)
    same = control_sign(normal)
    mirror = same * control_sign(normal * [1.0, -1.0, 1.0])
    for each in control.effectors:
        if each.surface != surface.name:
            continue
        ends = [cuts[2 * int(np.argmin(np.abs(cuts[::2] - x)))] for x in each.span]
        under = (middles > ends[0]) & (middles < ends[1])
        if np.any(under & (hinge != each.hinge) & ((gain[1] != 0.0) | (gain[-1] != 0.0))):
            raise ConfigError(f'control {control.name}: AVL has one hinge at a place of surface '
                              f'{surface.name}')
        hinge[under] = each.hinge
        for side in (1, -1):
            if each.side in (0, side):
                gain[side][under] += each.gain * same
    if not surface.symmetric:
        return gain[1], hinge, 1.0
    there = gain[1] != 0.0
    image = mirror * gain[-1][there][0] / gain[1][there][0] if there.any() else 0.0
    if np.abs(gain[-1] - mirror * image * gain[1]).max() > _SAME:
        raise ConfigError(f'control {control.name}: AVL moves the left side of surface '
                          f'{surface.name} as a multiple of the right one')
    return gain[1], hinge, float(image)


def _with_ends(places: FloatArray, cuts: FloatArray, gain: FloatArray,
               hinge: FloatArray) -> FloatArray:
    """Return the sections' places with those where a control begins, ends or has a kink."""
    edges, middles = cuts[::2], 0.5 * (cuts[2::2] + cuts[:-2:2])
    values = np.stack([gain, hinge])
    # A step in the value, or, on both sides of a strip, another slope.
    slope = np.diff(values) / np.diff(middles)
    there = gain != 0.0
    ends = [edges[k + 1] for k in range(len(middles) - 1) if there[k] != there[k + 1]]
    kinks = [edges[k + 1] for k in range(len(middles) - 2)
             if there[k:k + 3].all() and np.abs(slope[:, k + 1] - slope[:, k]).max() > _SAME]
    more = [x for x in (*ends, *kinks) if np.abs(places - x).min() > _SAME]
    return np.sort(np.concatenate([places, more]))


def _at(name: str, i: int, places: FloatArray, cuts: FloatArray, gain: FloatArray,
        hinge: FloatArray) -> FloatArray | None:
    """Return gain and hinge of a control at a section, None where it is on neither side."""
    middles = 0.5 * (cuts[2::2] + cuts[:-2:2])
    found = []
    for low, high in zip(places[max(i - 1, 0):i + 1], places[max(i - 1, 0) + 1:i + 2]):
        under = (middles > low) & (middles < high)
        if not gain[under].any():
            continue
        values = np.stack([gain[under], hinge[under]])
        if np.ptp(values, axis=1).max() > 0.0:
            line = np.polynomial.polynomial.polyfit(middles[under], values.T, 1)
            found.append(line[0] + line[1] * places[i])
        else:
            found.append(values[:, 0])
    if len(found) == 2 and np.abs(found[0] - found[1]).max() > 1e-6:
        raise ConfigError(f'control {name}: AVL has no step of gain or hinge along a surface')
    return found[0] if found else None


def _section(surface: Surface, share: float, sections: dict[str, SectionPolar],
             spacing: list) -> list[str]:
    """Return a section where one is or between two, as lofting puts it."""
    shares = np.array(surface.section_shares)
    i = min(max(int(np.searchsorted(shares, share, side='right')) - 1, 0), len(shares) - 2)
    part = (share - shares[i]) / (shares[i + 1] - shares[i])
    a, b = surface.sections[i:i + 2]
    place = (1.0 - part) * np.array(a.leading_edge_G) + part * np.array(b.leading_edge_G)
    chord = (1.0 - part) * a.chord + part * b.chord
    twist = a.twist if a.twist == b.twist else math.atan2(
        *((1.0 - part) * a.chord * f(a.twist) + part * b.chord * f(b.twist)
          for f in (math.sin, math.cos)))
    name = b.airfoil if part > 0.5 else a.airfoil
    curve = sections[a.airfoil] if part == 0.0 or a.airfoil == b.airfoil else \
        polars.mixture(sections[a.airfoil], sections[b.airfoil], part)
    return ['SECTION', f'{_row(*place, chord, math.degrees(twist))} '
            f'{spacing[0]} {spacing[1]:.17g}', *_airfoil(name, curve)]


def _airfoil(name: str, curve: SectionPolar) -> list[str]:
    """Return the camber line, slope and drag of a section's curves where they are attached."""
    at = curve.at(np.array([curve.zero_lift]))[0]
    lines: list[str] = []
    digits = re.match(r'naca(\d{4,5})(?!\d)', name)
    known = digits and avl_sections.thin_airfoil(
        avl_sections.naca(digits[1], Place(name))).zero_lift
    if digits and abs(known - curve.zero_lift) < 1e-6:
        lines = ['NACA', digits[1]]
    elif abs(curve.zero_lift) > 1e-6 or abs(at[2]) > 1e-6:
        lines = ['AIRFOIL', *(_row(*point) for point in
                              avl_sections.outline(curve.zero_lift, float(at[2])))]
    if abs(slope := at[3] / (2.0 * math.pi) - 1.0) > 1e-3:
        lines += ['CLAF', _row(1.0 + slope)]
    angles = curve.zero_lift + np.array([0.8 * (curve.stall_low - curve.zero_lift), 0.0,
                                         0.8 * (curve.stall_high - curve.zero_lift)])
    values = curve.at(angles)
    if values[:, 1].max() > 0.0:
        lines += ['CDCL', _row(*values[:, :2].ravel())]
    return lines
