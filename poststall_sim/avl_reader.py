# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
An aircraft from AVL's geometry and mass files.

What the files do not say is assumed, and said in ``Aircraft.assumptions``: the flow past stall,
how far controls go, and without a mass file the masses. Controls keep the names and signs of the
file, in small letters; elev, ail and rudd become elevator, aileron and rudder.
"""

import math
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from poststall_sim import avl_controls, avl_file, avl_mass, avl_sections
from poststall_sim.aircraft import (
    Aircraft,
    Airfoil,
    MassProperties,
    Reference,
    Section,
    Surface,
    usual_radii,
)
from poststall_sim.avl_controls import Flap, as_name
from poststall_sim.avl_file import AvlFile, Sheet, Station
from poststall_sim.controls import Control, Effector
from poststall_sim.frames import FloatArray
from poststall_sim.sizing import rounded

TRAVEL = math.radians(30.0)
"""Assumed of the largest deflection of what a control moves."""
DENSE = 10.0
"""Assumed mass over area to the power 3/2 [kg/m^3]; 6 of model aeroplanes, 16 of light ones."""
_DEFAULT_STRIPS = 8

Sections = tuple[Section, ...]


def aircraft(path: str | os.PathLike[str],
             mass_path: str | os.PathLike[str] | None = None) -> Aircraft:
    """
    Read an aircraft from an AVL geometry file.

    mass_path : its mass file; by default the one of the same name beside it, if there is one.
    """
    read, path = avl_file.read(path), Path(path)
    beside = path.with_suffix('.mass')
    if mass_path is None and beside.is_file():
        mass_path = beside
    masses = None if mass_path is None else avl_mass.read(mass_path)
    return _Reading(read, path.parent, 1.0 if masses is None else masses.length).aircraft(
        None if masses is None else masses.mass)


def spaced(strips: int, spacing: float) -> FloatArray:
    """
    Return strip edges and between them control points (2 strips + 1,) from 0 to 1, as AVL has it.

    0 and +-3 are equal, +-1 cosine, 2 sine (close at the start), -2 close at the end, what lies
    between is mixed: AVL User Primer, `Spacing distributions`.
    """
    share = np.linspace(0.0, 1.0, 2 * strips + 1)
    cosine = 0.5 - 0.5 * np.cos(math.pi * share)
    sine = 1.0 - np.cos(0.5 * math.pi * share) if spacing >= 0.0 else \
        np.sin(0.5 * math.pi * share)
    known = (share, cosine, sine, share)
    size = min(abs(spacing), 3.0)
    i = min(int(size), 2)
    return (i + 1 - size) * known[i] + (size - i) * known[i + 1]


def stretched(cuts: FloatArray, sections: FloatArray) -> FloatArray | None:
    """Return `spaced` stretched so that each section is the edge next to it, None if two are."""
    nearest = [2 * int(np.argmin(np.abs(cuts[::2] - share))) for share in sections]
    if len(set(nearest)) < len(nearest):
        return None
    return np.interp(cuts, cuts[nearest], sections)


def _cut(edges: FloatArray) -> dict[str, tuple[float, ...]]:
    """Return strip edges and, unless they are in the middles, the points between them."""
    ends, points = edges[::2], edges[1::2]
    middles = np.allclose(points, 0.5 * (ends[1:] + ends[:-1]), rtol=0.0, atol=1e-12)
    return {'edges': tuple(ends.tolist()), 'points': () if middles else tuple(points.tolist())}


def _cosines(sheet: Sheet) -> list[float]:
    """Return the cosine of the quarter chord's sweep at each section, the mean of both sides."""
    quarter = np.array([np.add(station.leading_edge, [0.25 * station.chord, 0.0, 0.0])
                        for station in sheet.stations]) * sheet.scale
    steps = np.diff(quarter, axis=0)
    cosine = np.hypot(steps[:, 1], steps[:, 2]) / np.linalg.norm(steps, axis=1)
    return [float(np.mean(cosine[max(i - 1, 0):i + 1])) for i in range(len(quarter))]


class _Reading:
    """One AVL file on its way into records; its lengths times ``length`` are metres."""

    def __init__(self, read: AvlFile, folder: Path, length: float) -> None:
        self.file, self.folder, self.length = read, folder, length
        self.airfoils: dict[str, Airfoil] = {}
        self.known: dict[tuple, str] = {}
        self.moved: list[tuple[str, Effector]] = []
        self.taken: set[str] = set()
        self.assumptions: list[str] = list(read.left_out)

    def aircraft(self, mass: MassProperties | None) -> Aircraft:
        """Return the aircraft."""
        file, length = self.file, self.length
        if file.symmetry[1] != 0 or file.symmetry[0] not in (0, 1):
            raise file.where.error('iYsym must be 0 or 1 and iZsym 0: an antisymmetric flow or a '
                                   'ground plane is not part of an aircraft')
        if file.mach != 0.0:
            self.assumptions.append(f'Mach {file.mach:g} is left out: the flow is incompressible')
        area, chord, span = file.reference
        reference = file.where.build(Reference, area=area * length ** 2, chord=chord * length,
                                     span=span * length)
        surfaces = tuple(surface for sheet in file.sheets for surface in self._surfaces(sheet))
        self.assumptions.append(
            'sections separate from '
            f'{math.degrees(avl_sections.STALL):g} deg on as one generic plate: put section '
            'tables in their place for what they do past the stall')
        if not any(airfoil.cd.min() > 0.0 for airfoil in self.airfoils.values()):
            self.assumptions.append('no profile drag before the stall: the file has neither CDp '
                                    'nor CDCL')
        if mass is None:
            mass = self._mass(surfaces, reference)
        return file.where.build(
            Aircraft, name=as_name(file.title), surfaces=surfaces,
            airfoils=tuple(self.airfoils.values()), reference=reference, mass=mass,
            controls=self._controls(), assumptions=tuple(self.assumptions))

    def _mass(self, surfaces: Sequence[Surface], reference: Reference) -> MassProperties:
        """Return masses of an ordinary aircraft of this size, balanced at Xref."""
        mass = rounded(DENSE * reference.area ** 1.5)
        edges = np.array([x for surface in surfaces for section in surface.sections
                          for x in (section.leading_edge_G[0],
                                    section.leading_edge_G[0] + section.chord)])
        # A nose ahead of the wing; shorter than half its span no radii fit a rigid body.
        long = max(1.3 * float(np.ptp(edges)), 0.5 * reference.span)
        self.assumptions.append(
            f'no mass file: assumed {mass:.3g} kg, balanced at Xref Yref Zref, with inertias of '
            'an ordinary aircraft')
        return self.file.where.build(
            MassProperties, mass=mass,
            cg_G=tuple(self.length * x for x in self.file.origin),
            inertia_B=np.diag([rounded(mass * radius ** 2) for radius in
                               usual_radii(reference.span, long)]))

    def _controls(self) -> tuple[Control, ...]:
        """Return the controls with their effectors, both sides of one in one where alike."""
        controls = []
        for name in dict.fromkeys(name for name, _ in self.moved):
            effectors = avl_controls.joined([each for key, each in self.moved if key == name])
            limit = min(TRAVEL / max(abs(each.gain) for each in effectors), 0.5 * math.pi)
            controls.append(Control(name, (-limit, limit), effectors))
        if controls:
            self.assumptions.append(f'controls deflect by {math.degrees(TRAVEL):g} deg at most: '
                                    'AVL has no limits')
        return tuple(controls)

    def _surfaces(self, sheet: Sheet) -> list[Surface]:
        """Return the surface or surfaces of a sheet in our order, and keep what they move."""
        name = self._surface_name(sheet.name)
        sections, places = self._sections(sheet)
        edges = self._strips(sheet, places)
        flaps = avl_controls.flaps(sheet, sections, places, edges)
        self.assumptions += [
            f'surface {sheet.name}: {each} moves nothing, as in AVL, for it stands at one section '
            'alone: give it at both ends of its flap' for each in avl_controls.alone(sheet)]
        plane = 0.0 if sheet.image is None and self.file.symmetry[0] else sheet.image
        ends = [sections[i].leading_edge_G[1] for i in (0, -1)]
        if plane is not None:
            plane *= self.length
            at_plane = [abs(y - plane) < 1e-9 * self.length for y in ends]
            if all(at_plane) and sheet.image is not None:
                raise sheet.where.error(f'surface {sheet.name}: lies in the plane y = {plane:g} '
                                        'of its YDUPLICATE')
            if all(at_plane):
                plane = None   # a fin of a half model
            elif plane == 0.0 and any(at_plane):
                return [self._mirrored(sheet, name, sections, edges, flaps, at_plane[1])]
        found = [self._drawn(sheet, name, sections, edges, flaps)]
        if plane is not None:
            image = tuple(replace(s, leading_edge_G=(
                s.leading_edge_G[0], 2.0 * plane - s.leading_edge_G[1], s.leading_edge_G[2]))
                for s in sections)
            found.append(self._drawn(sheet, f'{name}_image', image, edges,
                                     [flap.image() for flap in flaps]))
        return found

    def _drawn(self, sheet: Sheet, name: str, sections: Sections, edges: FloatArray,
               flaps: list[Flap]) -> Surface:
        """Return a surface of its own, left to right, an upright one from below."""
        first, last = sections[0].leading_edge_G, sections[-1].leading_edge_G
        across, up = last[1] - first[1], last[2] - first[2]
        backwards = across < 0.0 if abs(across) >= abs(up) else up < 0.0
        if backwards:
            sections, edges = sections[::-1], 1.0 - edges[::-1]
        for flap in flaps:
            self._move(flap, name, 0, backwards)
        return sheet.where.build(Surface, name=name, sections=sections, flat=True,
                                 strips=len(edges) // 2, **_cut(edges))

    def _mirrored(self, sheet: Sheet, name: str, sections: Sections, edges: FloatArray,
                  flaps: list[Flap], backwards: bool) -> Surface:
        """Return a symmetric surface from one side of it, backwards: drawn from tip to root."""
        if backwards:
            sections, edges = sections[::-1], 1.0 - edges[::-1]
        side = 1 if sections[-1].leading_edge_G[1] > 0.0 else -1
        half = tuple(replace(s, leading_edge_G=(
            s.leading_edge_G[0], side * s.leading_edge_G[1] if i else 0.0, s.leading_edge_G[2]))
            for i, s in enumerate(sections))
        for flap in flaps:
            self._move(flap, name, side, backwards)
            self._move(flap.image(), name, -side, backwards)
        return sheet.where.build(
            Surface, name=name, sections=half, strips=len(edges) - 1, symmetric=True, flat=True,
            **_cut(edges))

    def _move(self, flap: Flap, surface: str, side: int, backwards: bool) -> None:
        """Keep what a flap moves; an image with a SgnDup of 0 stands still."""
        if flap.gain != 0.0:
            self.moved.append((flap.control, flap.effector(surface, side, backwards)))

    def _sections(self, sheet: Sheet) -> tuple[tuple[Section, ...], FloatArray]:
        """Return the sections in the order of the file and their place along the span, 0..1."""
        scale, shift = (self.length * np.array(each) for each in (sheet.scale, sheet.shift))
        across = np.array([station.leading_edge[1:] for station in sheet.stations]) * scale[1:]
        steps = np.linalg.norm(np.diff(across, axis=0), axis=1)
        if not steps.min() > 0.0:
            raise sheet.where.error(f'surface {sheet.name}: two neighbouring sections stand at '
                                    'the same y and z')
        sections = tuple(station.where.build(
            Section, leading_edge_G=tuple(map(
                float, np.array(station.leading_edge) * scale + shift)),
            chord=station.chord * float(scale[0]), airfoil=self._airfoil(sheet, station, cosine),
            twist=math.radians(station.incidence + sheet.incidence))
            for station, cosine in zip(sheet.stations, _cosines(sheet)))
        return sections, np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])

    def _strips(self, sheet: Sheet, places: FloatArray) -> FloatArray:
        """Return edges and points of the strips by turns, 0..1 in the order of the file."""
        if sheet.strips:
            found = stretched(spaced(sheet.strips, sheet.spacing), places)
            if found is None:
                raise sheet.where.error(f'surface {sheet.name}: Nspan {sheet.strips} is too few '
                                        f'for {len(places)} sections')
            edges = found
        elif all(station.strips for station in sheet.stations[:-1]):
            parts = [low + (high - low) * spaced(station.strips, station.spacing)[:-1]
                     for low, high, station in zip(places, places[1:], sheet.stations)]
            edges = np.append(np.concatenate(parts), 1.0)
        else:
            self.assumptions.append(f'surface {sheet.name}: no Nspan, {_DEFAULT_STRIPS} strips '
                                    'between sections')
            return np.append(np.concatenate([
                np.linspace(low, high, 2 * _DEFAULT_STRIPS, endpoint=False)
                for low, high in zip(places, places[1:])]), 1.0)
        edges[0], edges[-1] = 0.0, 1.0
        return edges

    def _airfoil(self, sheet: Sheet, station: Station, cosine: float) -> str:
        """
        Return the name of a section's curves, made when they are first asked for.

        AVL's airfoils stand along x, ours across the quarter chord, of which cosine is that of
        the sweep: there the same camber line is steeper.
        """
        kind, what = station.airfoil
        drag = station.drag or sheet.drag or (self._constant_drag(),)
        key = (kind, what, station.slope, drag, sheet.rows, sheet.row_spacing,
               cosine if kind != 'none' else 1.0)
        if key in self.known:
            return self.known[key]
        base, points, line = 'flat', what, np.zeros_like
        if kind == 'NACA':
            base, points = f'naca{what}', avl_sections.naca(what, station.where)
        elif kind == 'AFILE':
            base = as_name(Path(what).stem)
            if not (self.folder / what).is_file():
                raise station.airfoil_where.error(
                    f'AFILE must be the name of a file with x/c y/c in each line, looked for from '
                    f'the folder of the .avl file, got {what}, which is not there')
            points = avl_sections.coordinates(self.folder / what)
        elif kind == 'AIRFOIL':
            base = 'section'
        if kind != 'none':
            line = avl_sections.camber(points, station.where)
        name, more = base, 2
        while name in self.airfoils:
            name, more = f'{base}_{more}', more + 1
        flat = avl_sections.thin_airfoil(line, max(sheet.rows, 1), sheet.row_spacing)
        self.airfoils[name] = avl_sections.section(name, flat.swept(cosine), station.slope, drag)
        self.known[key] = name
        return name

    def _constant_drag(self) -> float:
        """Return CDp, which is made with Sref, as the cd of all strips alike."""
        area = sum(
            (1.0 if sheet.image is None and not self.file.symmetry[0] else 2.0)
            * 0.5 * (a.chord + b.chord) * sheet.scale[0] * math.hypot(
                *(sheet.scale[k] * (b.leading_edge[k] - a.leading_edge[k]) for k in (1, 2)))
            for sheet in self.file.sheets for a, b in zip(sheet.stations, sheet.stations[1:]))
        return self.file.drag * self.file.reference[0] / area

    def _surface_name(self, title: str) -> str:
        name, more = as_name(title), 2
        while name in self.taken or f'{name}_image' in self.taken:
            name, more = f'{as_name(title)}_{more}', more + 1
        self.taken |= {name, f'{name}_image'}
        return name
