# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
An aircraft as the text of an AVL geometry file: the lattice and the controls it has here.

What AVL does not know is left out: section curves past the stall, limits of controls, engines;
of a section's tables for several Reynolds numbers one is written, see `left_out`.
Chords that twist turned (surfaces that are not ``flat``) become incidences of flat panels.
"""

import math
import re

import numpy as np

from poststall_sim import avl_controls, avl_sections
from poststall_sim.aero import lattice, polars, stations
from poststall_sim.aero.polars import SectionPolar
from poststall_sim.aircraft import Aircraft, Airfoil, ConfigError, Section, Surface
from poststall_sim.avl_reader import spaced, stretched
from poststall_sim.avl_sections import ThinAirfoil
from poststall_sim.controls import Control
from poststall_sim.frames import FloatArray, control_sign
from poststall_sim.reader import Place

_SPACINGS = (0.0, 1.0, -1.0, 2.0, -2.0, *(k / 4.0 for k in range(-11, 12)))
_SAME = 1e-9
_BLURRED = 2.0
"""Strip widths that AVL's vortices are blurred over where they meet another component."""


def text(aircraft: Aircraft, rows: int) -> str:
    """Return an aircraft as an AVL file with so many panels along every chord."""
    reference, cg = aircraft.reference, aircraft.mass.cg_G
    lines = [*(f'# {each}' for each in left_out(aircraft)),
             aircraft.name, '0.0  ! Mach', '0 0 0.0  ! iYsym iZsym Zsym',
             _row(reference.area, reference.chord, reference.span) + '  ! Sref Cref Bref',
             _row(*cg) + '  ! Xref Yref Zref', '0.0  ! CDp']
    sections = {name: polars.section_polar(airfoil)
                for name, airfoil in _written(aircraft).items()}
    for surface, component in zip(aircraft.surfaces, _components(aircraft, rows)):
        lines += _surface(aircraft, surface, sections, rows, component)
    return '\n'.join([*lines, ''])


def left_out(aircraft: Aircraft) -> tuple[str, ...]:
    """Return what of the aircraft's sections AVL has no place for, a sentence each."""
    tables: dict[str, int] = {}
    for airfoil in aircraft.airfoils:
        tables[airfoil.name] = tables.get(airfoil.name, 0) + 1
    return tuple(
        f'airfoil {name}: of its {tables[name]} tables the one '
        + ('for neutral flaps' if airfoil.reynolds is None else
           f'at Reynolds number {airfoil.reynolds:g}') + ' is written, AVL takes one'
        for name, airfoil in _written(aircraft).items() if tables[name] > 1)


def _written(aircraft: Aircraft) -> dict[str, Airfoil]:
    """Return the table of each airfoil: with its flap neutral, at the middle Reynolds number."""
    found: dict[str, list[Airfoil]] = {}
    for airfoil in aircraft.airfoils:
        found.setdefault(airfoil.name, []).append(airfoil)
    result = {}
    for name, tables in found.items():
        neutral = sorted((each for each in tables if each.deflection == 0.0),
                         key=lambda each: each.reynolds or 0.0)
        result[name] = neutral[(len(neutral) - 1) // 2]
    return result


def _components(aircraft: Aircraft, rows: int) -> list[int]:
    """
    Return the number of the component that each surface belongs to.

    AVL blurs vortices over two strip widths where they meet another component, which takes a
    tenth off a fin that stands on a tail: surfaces nearer than that are one, as its primer says
    of T-tails and winglets.
    """
    built = lattice.build(aircraft, rows)
    corners = [built.ring_corners[grid.panels].reshape(-1, 3) for grid in built.grids]
    core = [_BLURRED * float(built.strip_width[grid.strips].mean()) for grid in built.grids]
    found = list(range(1, len(corners) + 1))
    for i, here in enumerate(corners):
        for k, there in enumerate(corners[:i]):
            apart = np.linalg.norm(here[:, None] - there[None, :], axis=-1).min()
            if apart < max(core[i], core[k]):
                found = [found[k] if each == found[i] else each for each in found]
    return found


def _row(*values: float) -> str:
    return ' '.join(f'{value + 0.0:.17g}' for value in values)


def _surface(aircraft: Aircraft, surface: Surface, sections: dict[str, SectionPolar],
             rows: int, component: int) -> list[str]:
    cuts = _cuts(surface)
    places = np.array(surface.section_shares)
    moved = {control.name: _moved(control, surface, cuts) for control in aircraft.controls
             if any(each.surface == surface.name for each in control.effectors)}
    for gain, _, axis, _ in moved.values():
        places = _with_ends(places, cuts, gain, axis)
    whole = [sp for sp in _SPACINGS if _fits(_attempt(len(cuts) // 2, sp, places), cuts)]
    lines = ['SURFACE', surface.name, f'{rows} 0.0' + (
        f' {len(cuts) // 2} {whole[0]:.17g}' if whole else '')]
    lines += ['COMPONENT', str(component), *(
        ['YDUPLICATE', '0.0'] if surface.symmetric else [])]
    spacings = [[0, 0.0]] * len(places) if whole else None
    if spacings is None:
        spacings = _intervals(places, cuts)
        if spacings is None:   # a section at every strip: any cut can be had so
            places = cuts[::2]
            spacings = _intervals(places, cuts)
    hinges = {name: _hinges(name, surface, places, cuts, *turned)
              for name, (*turned, _) in moved.items()}
    for i, share in enumerate(places):
        lines += _section(surface, float(share), sections, rows, spacings[i])
        for name, at in hinges.items():
            if i in at:
                lines += ['CONTROL', f'{name} {at[i]} {_row(moved[name][-1])}']
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


def _moved(control: Control, surface: Surface,
           cuts: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """Return gain, hinge and axis (0 along the hinge) of strips in AVL's terms, and SgnDup."""
    points = cuts[1::2]
    gain = {side: np.zeros_like(points) for side in (1, -1)}
    hinge, axis = np.zeros_like(points), np.zeros((len(points), 3))
    first, last = (np.array(s.leading_edge_G) for s in (surface.sections[0],
                                                        surface.sections[-1]))
    normal = np.cross([1.0, 0.0, 0.0], last - first)
    same = control_sign(normal)
    mirror = same * control_sign(normal * [1.0, -1.0, 1.0])
    for each in control.effectors:
        if each.surface != surface.name:
            continue
        ends = [cuts[2 * int(np.argmin(np.abs(cuts[::2] - x)))] for x in each.span]
        under = (points > ends[0]) & (points < ends[1])
        about = np.array(each.hinge_axis or (0.0, 0.0, 0.0))
        # By the right-hand rule, in the order of the sections.
        about *= math.copysign(1.0, float(about[1:] @ (last - first)[1:]))
        other = (hinge != each.hinge) | np.any(axis != about, axis=1)
        if np.any(under & other & ((gain[1] != 0.0) | (gain[-1] != 0.0))):
            raise ConfigError(f'control {control.name}: AVL has one hinge at a place of surface '
                              f'{surface.name}')
        hinge[under], axis[under] = each.hinge, about
        for side in (1, -1):
            if each.side in (0, side):
                gain[side][under] += each.gain * same
    if not surface.symmetric:
        return gain[1], hinge, axis, 1.0
    there = gain[1] != 0.0
    image = mirror * gain[-1][there][0] / gain[1][there][0] if there.any() else 0.0
    if np.abs(gain[-1] - mirror * image * gain[1]).max() > _SAME:
        raise ConfigError(f'control {control.name}: AVL moves the left side of surface '
                          f'{surface.name} as a multiple of the right one')
    return gain[1], hinge, axis, float(image)


def _with_ends(places: FloatArray, cuts: FloatArray, gain: FloatArray,
               axis: FloatArray) -> FloatArray:
    """Return the sections' places with those where a control or its axis begins or ends."""
    there = np.column_stack([gain != 0.0, axis])
    ends = cuts[2:-1:2][np.any(there[1:] != there[:-1], axis=1)]
    return np.sort(np.concatenate(
        [places, [x for x in ends if np.abs(places - x).min() > _SAME]]))


def _hinges(name: str, surface: Surface, places: FloatArray, cuts: FloatArray, gain: FloatArray,
            hinge: FloatArray, axis: FloatArray) -> dict[int, str]:
    """Return gain, Xhinge and XYZhvec of a control by the number of the section."""
    found: dict[int, list[FloatArray]] = {}
    points = cuts[1::2]
    for i, (low, high) in enumerate(zip(places, places[1:])):
        under = (points > low) & (points < high)
        if gain[under].any():
            ends = [_between(surface, float(x)) for x in (low, high)]
            for k, at in enumerate(_at_ends(ends, (points[under] - low) / (high - low),
                                            gain[under], hinge[under], axis[under][0])):
                found.setdefault(i + k, []).append(at)
    # Between two sections AVL takes the vector of the first one, which may differ from the last.
    if any(not np.abs(at[0] - at[-1])[:2].max() < 1e-6 for at in found.values()):
        raise ConfigError(f'control {name}: AVL has no step of gain or hinge along surface '
                          f'{surface.name}')
    return {i: f'{_row(*at[-1][:2])} {_row(*at[-1][2:])}' for i, at in found.items()}


def _at_ends(ends: list[Section], points: FloatArray, gain: FloatArray, hinge: FloatArray,
             axis: FloatArray) -> list[FloatArray]:
    """Return gain, Xhinge and XYZhvec (5,) at both ends of an interval, linear between them."""
    places = hinge[[0, 0]]
    if np.ptp(hinge) > 0.0:   # straight in space
        chords = np.array([end.chord for end in ends])
        places = _line(points, hinge * (chords[0] + points * (chords[1] - chords[0]))) / chords
    if not axis.any():   # of each strip its own hinge line, in AVL the one through all of them
        line, across = avl_controls.hinge_line(ends, places)
        gain = gain * [avl_controls.hinge_line(ends, [x, x])[0] @ across / (line @ across)
                       for x in hinge]
    return [np.array([g, x, *axis]) for g, x in zip(_line(points, gain), places)]


def _line(points: FloatArray, values: FloatArray) -> FloatArray:
    """Return a linear function's values at 0 and 1, NaN if it is another function."""
    if np.ptp(values) <= 1e-12 * np.abs(values).max():
        return values[[0, 0]]
    rise = (values[-1] - values[0]) / (points[-1] - points[0])
    straight = np.abs(values[0] + rise * (points - points[0]) - values).max() < _SAME
    return values[0] + rise * (np.array([0.0, 1.0]) - points[0]) if straight else \
        np.full(2, math.nan)


def _between(surface: Surface, share: float) -> Section:
    """Return a section where one is or between two, as lofting puts it; its nearest airfoil."""
    i, part = _interval(surface, share)
    a, b = surface.sections[i:i + 2]
    place = (1.0 - part) * np.array(a.leading_edge_G) + part * np.array(b.leading_edge_G)
    twist = a.twist if a.twist == b.twist else math.atan2(
        *((1.0 - part) * a.chord * f(a.twist) + part * b.chord * f(b.twist)
          for f in (math.sin, math.cos)))
    return Section(tuple(map(float, place)), (1.0 - part) * a.chord + part * b.chord,
                   b.airfoil if part > 0.5 else a.airfoil, twist)


def _interval(surface: Surface, share: float) -> tuple[int, float]:
    """Return the section that a place along the span is behind, and how far to the next."""
    shares = surface.section_shares
    i = min(max(int(np.searchsorted(shares, share, side='right')) - 1, 0), len(shares) - 2)
    return i, (share - shares[i]) / (shares[i + 1] - shares[i])


def _section(surface: Surface, share: float, sections: dict[str, SectionPolar], rows: int,
             spacing: list) -> list[str]:
    at, (i, part) = _between(surface, share), _interval(surface, share)
    a, b = (sections[s.airfoil] for s in surface.sections[i:i + 2])
    return ['SECTION', f'{_row(*at.leading_edge_G, at.chord, math.degrees(at.twist))} '
            f'{spacing[0]} {spacing[1]:.17g}',
            *_airfoil(at.airfoil, polars.mixture(a, b, part), _cosine(surface, share), rows)]


def _cosine(surface: Surface, share: float) -> float:
    """Return the cosine of the quarter chord's sweep, the mean of both sides of a section."""
    places = [np.add(s.leading_edge_G, [0.25 * s.chord, 0.0, 0.0]) for s in surface.sections]
    beside = [_interval(surface, min(max(share + off, 0.0), 1.0))[0] for off in (-1e-9, 1e-9)]
    steps = [places[i + 1] - places[i] for i in beside]
    return float(np.mean([math.hypot(*step[1:]) / np.linalg.norm(step) for step in steps]))


def _airfoil(name: str, curve: SectionPolar, cosine: float, rows: int) -> list[str]:
    """Return the camber line, slope and drag of a section's curves where they are attached."""
    at = curve.at(np.array([curve.zero_lift]))[0]
    line = avl_sections.ThinAirfoil(curve.zero_lift, float(at[2])).swept(1.0 / cosine)
    lines: list[str] = []
    digits = re.match(r'naca(\d{4})(?!\d)', name)
    if digits and _is_naca(digits[1], line, rows):
        lines = ['NACA', digits[1]]
    elif abs(line.zero_lift) > 1e-6 or abs(at[2]) > 1e-6:
        lines = ['AIRFOIL', *(_row(*point) for point in
                              avl_sections.outline(line, rows))]
    if abs(slope := at[3] / (2.0 * math.pi) - 1.0) > 1e-3:
        lines += ['CLAF', _row(1.0 + slope)]
    angles = curve.zero_lift + np.array([0.8 * (curve.stall_low - curve.zero_lift), 0.0,
                                         0.8 * (curve.stall_high - curve.zero_lift)])
    values = curve.at(angles)
    if values[:, 1].max() > 0.0:
        lines += ['CDCL', _row(*values[:, :2].ravel())]
    return lines


def _is_naca(digits: str, flat: ThinAirfoil, rows: int) -> bool:
    """Tell whether curves named after a NACA section are those that its camber line gives."""
    where = Place(digits)
    line = avl_sections.camber(avl_sections.naca(digits, where), where)
    return abs(avl_sections.thin_airfoil(line, rows).zero_lift - flat.zero_lift) < 1e-6
