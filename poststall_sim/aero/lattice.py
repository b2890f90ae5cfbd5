# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Aircraft to lattice: rings, collocation points, normals, strips, and what controls turn.

The lattice is flat between leading and trailing edge: zero-lift angle, camber moment and
thickness come from the section curves, so that lift at zero incidence does not depend on the
number of panels. Rings lie a quarter panel behind the panels they belong to (Katz & Plotkin,
Low-Speed Aerodynamics, 2nd ed., sec. 12.3); the last ring ends a quarter panel behind the
trailing edge, where the wake begins.

Orders: surfaces as in the aircraft; strips from left tip to right tip (a fin from its root to
its tip); panels of a surface row by row from the leading edge, each row along the strips.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from poststall_sim.aero import hinges, plate, polars, reynolds, stations
from poststall_sim.aero.flaps import floating_ratio
from poststall_sim.aircraft import Aircraft, ConfigError, Surface
from poststall_sim.frames import FloatArray, control_sign

CORE = 0.05
"""Core of wakes and rings of other surfaces, in strip widths, where nobody says otherwise."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Where one surface stands in the lattice's arrays: rows (chordwise) x columns (strips)."""

    name: str
    rows: int
    panels: slice
    strips: slice
    nodes: slice
    edges: slice


@dataclass(frozen=True, slots=True, eq=False)
class Lattice:
    """
    All surfaces of an aircraft as vortex rings, geometry axes [m, rad].

    Panels (p): ring_corners (p, 4, 3) in the order of positive circulation, collocation,
    normal, tangent (p, 3; tangent points aft, normal x span axis), area (p,), panel_strip (p,),
    panel_share (p,) the share of its strip's circulation that a flat plate in two-dimensional
    flow puts on this ring.

    Strips (n): span_axis, chord_axis, strip_normal, quarter_chord (n, 3), strip_chord (normal to
    the span axis), strip_width, moment_axis (n, 3) of a moment about the span axis: across the
    chord, for a swept strip is cut along x, and so long that it has the whole along the span axis,
    strip_surface, span_place (along the span, for averaging),
    polar_index into curves (k, 3, 2, grid); zero_lift, stall_high, stall_low, separated_high,
    separated_low (n,) see `SectionPolar`; reynolds_range (n, 2) of the sections' tables and
    tables: see `reynolds.StripCurves`;
    te_panel (n,) the ring at the trailing edge, te_node (n,) left node in a row of wake nodes;
    mirror (n,) the strip across the plane y = 0, itself where there is none.

    Edges (s): edge_vector, edge_middle (s, 3) and the rings and the wake row that share each:
    strength = G[edge_plus] - G[edge_minus] + Gw[edge_wake], -1 for none; edge_strip (s, 2)
    strips on both sides.

    Movable parts (k), per unit angle of each: turn (k, p) of a panel's normals about its span axis
    and slant (k, p) about its tangent, see `hinges`; for a flap shift
    (k, n) of the zero-lift angle and load_moment (k, n) of the section's own moment coefficient,
    see `flaps`; pivot (k, n) for an all-moving part, which turns the strip's chord with it.
    floating (k, n) : angle at which a free part stands per angle of attack of the strips; travel
    and stops (k, 2) [rad]; mixing (k, c) angles per unit deflection of the controls. mean_panel :
    chord of the panels, the mean of the strips' [m]; core : of wakes and rings where they meet
    other surfaces, in strip widths.
    """

    grids: tuple[Grid, ...]
    ring_corners: FloatArray
    collocation: FloatArray
    normal: FloatArray
    tangent: FloatArray
    area: FloatArray
    panel_strip: np.ndarray
    panel_share: FloatArray
    wake_nodes: FloatArray
    span_axis: FloatArray
    chord_axis: FloatArray
    strip_normal: FloatArray
    quarter_chord: FloatArray
    strip_chord: FloatArray
    strip_width: FloatArray
    moment_axis: FloatArray
    strip_surface: np.ndarray
    span_place: FloatArray
    curves: FloatArray
    polar_index: np.ndarray
    zero_lift: FloatArray
    stall_high: FloatArray
    stall_low: FloatArray
    reynolds_range: FloatArray
    tables: reynolds.Tables | None
    te_panel: np.ndarray
    te_node: np.ndarray
    mirror: np.ndarray
    edge_vector: FloatArray
    edge_middle: FloatArray
    edge_plus: np.ndarray
    edge_minus: np.ndarray
    edge_wake: np.ndarray
    edge_strip: np.ndarray
    separated_high: FloatArray
    separated_low: FloatArray
    turn: FloatArray
    slant: FloatArray
    shift: FloatArray
    load_moment: FloatArray
    pivot: FloatArray
    floating: FloatArray
    travel: FloatArray
    mixing: FloatArray
    stops: FloatArray
    strip_names: tuple[str, ...]
    mean_panel: float
    core: float = CORE

    @property
    def panels(self) -> int:
        """Return the number of rings."""
        return len(self.area)

    @property
    def greatest_lift(self) -> FloatArray:
        """Return the lift coefficient of each strip's section at its stall (n,)."""
        values = np.empty((self.strips, 4))
        polars.sections(self.curves, self.polar_index, self.stall_high, values)
        return values[:, 0]

    @property
    def strips(self) -> int:
        """Return the number of strips."""
        return len(self.strip_chord)

    def angles(self, deflections: FloatArray) -> FloatArray:
        """Return where deflections (c,) put the movable parts (k,), within their stops [rad]."""
        asked = self.mixing @ deflections
        return np.minimum(np.maximum(asked, self.stops[:, 0]), self.stops[:, 1])

    def angle_rate(self, deflections: FloatArray) -> FloatArray:
        """Return the derivative (k, c) of `angles`: a part that is at a stop stays there."""
        asked = self.mixing @ deflections
        free = (asked > self.stops[:, 0]) & (asked < self.stops[:, 1])
        return self.mixing * free[:, None]

    def floating_angles(self, angles: FloatArray, alpha: FloatArray) -> FloatArray:
        """
        Return where the movable parts (k,) would float, within their travel [rad].

        angles (k,) : of the parts now, alpha (n,) : at which their strips work [rad].
        """
        free = self.floating @ (alpha - angles @ self.pivot)
        return np.minimum(np.maximum(free, self.travel[:, 0]), self.travel[:, 1])

    def at(self, airspeed: float, viscosity: float, angles: FloatArray) -> 'Lattice':
        """
        Return it with the section curves that it flies; itself where sections have one table.

        airspeed [m/s], kinematic viscosity [m^2/s], angles (k,) of the movable parts [rad].
        """
        if self.tables is None:
            return self
        curves, landmarks = self.tables.at(
            airspeed * self.tables.chord / viscosity, angles)
        return replace(self, curves=curves, **dict(zip(
            reynolds.LANDMARKS, np.ascontiguousarray(landmarks[self.polar_index].T))))


@dataclass(frozen=True, slots=True, eq=False)
class _SurfaceMesh:
    """
    Corners (rows + 1, strips + 1, 3) of a surface's panels and its strip edges [m].

    turn (strips,) : of the normals against the panels, nose-up [rad]; point (strips,) : where
    between its ends a strip's flow is tangent, 0..1.
    """

    corners: FloatArray
    edges: FloatArray
    turn: FloatArray
    point: FloatArray
    between: list[reynolds.Between]


def _mesh(surface: Surface, rows: int) -> _SurfaceMesh:
    """Return the panels' corners of a surface and the sections that its strips lie between."""
    sections, place = stations.of_surface(surface)
    edges = stations.strip_edges(surface, place)
    leading = np.array([s.leading_edge_G for s in sections])
    trailing = np.empty_like(leading)
    twist = np.array([s.twist for s in sections])
    for i, section in enumerate(sections):
        a, b = max(i - 1, 0), min(i + 1, len(sections) - 1)
        if surface.symmetric and 2 * i == len(sections) - 1:
            along = np.array([0.0, 1.0, 0.0])   # the root of a mirrored surface twists about y
        else:
            along = leading[b] - leading[a]
            along = np.array([0.0, along[1], along[2]]) / math.hypot(along[1], along[2])
        normal = np.cross([1.0, 0.0, 0.0], along)
        angle = 0.0 if surface.flat else section.twist
        trailing[i] = leading[i] + section.chord * (
            math.cos(angle) * np.array([1.0, 0.0, 0.0]) - math.sin(angle) * normal)
    front = np.column_stack([np.interp(edges, place, leading[:, k]) for k in range(3)])
    rear = np.column_stack([np.interp(edges, place, trailing[:, k]) for k in range(3)])
    share = np.linspace(0.0, 1.0, rows + 1)[:, None, None]
    point = stations.collocation_shares(surface)
    places = (1.0 - point) * edges[:-1] + point * edges[1:]
    turn = np.zeros_like(places)
    if surface.flat:   # as between the turned chords of two sections
        chord = np.array([s.chord for s in sections])
        turn = np.arctan2(np.interp(places, place, chord * np.sin(twist)),
                          np.interp(places, place, chord * np.cos(twist)))
    between = []
    for at in places:
        i = min(max(int(np.searchsorted(place, at)) - 1, 0), len(sections) - 2)
        between.append((sections[i].airfoil, sections[i + 1].airfoil,
                        (at - place[i]) / (place[i + 1] - place[i])))
    return _SurfaceMesh((1.0 - share) * front + share * rear, edges, turn, point, between)


def build(aircraft: Aircraft, rows: int) -> Lattice:
    """Return the lattice of an aircraft with `rows` equal panels along every chord."""
    meshes = [_mesh(surface, rows) for surface in aircraft.surfaces]
    grids, parts = [], []
    panel0 = strip0 = node0 = edge0 = 0
    for number, (surface, mesh) in enumerate(zip(aircraft.surfaces, meshes)):
        n = surface.strips
        grid = Grid(surface.name, rows, slice(panel0, panel0 + rows * n),
                    slice(strip0, strip0 + n), slice(node0, node0 + n + 1),
                    slice(edge0, edge0 + (rows + 1) * n + rows * (n + 1)))
        grids.append(grid)
        parts.append(_surface_arrays(mesh, grid, number))
        panel0, strip0 = grid.panels.stop, grid.strips.stop
        node0, edge0 = grid.nodes.stop, grid.edges.stop
    arrays = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}

    movable, flown = _movables(aircraft, grids, meshes, arrays, rows)
    mirror = _mirror(arrays['quarter_chord'], arrays['strip_chord'])
    for array in (*arrays.values(), *movable.values(), mirror):
        array.setflags(write=False)
    return Lattice(
        grids=tuple(grids), mirror=mirror,
        mean_panel=float(arrays['strip_chord'].mean()) / rows,
        curves=flown.curves, polar_index=flown.polar_index,
        reynolds_range=flown.reynolds_range, tables=flown.tables,
        strip_names=tuple(f'{grid.name}_{i + 1}' for grid in grids
                          for i in range(grid.strips.stop - grid.strips.start)),
        **dict(zip(reynolds.LANDMARKS, flown.landmarks)), **movable, **arrays)


def _mirror(place: FloatArray, chord: FloatArray) -> np.ndarray:
    """Return the strip (n,) whose quarter chord and chord are the mirror image of each one's."""
    image = place * np.array([1.0, -1.0, 1.0])
    apart = np.linalg.norm(image[:, None] - place[None, :], axis=-1) \
        + np.abs(chord[:, None] - chord[None, :])
    nearest = np.argmin(apart, axis=1)
    found = apart[np.arange(len(chord)), nearest] < 1e-6 * chord
    return np.where(found, nearest, np.arange(len(chord)))


def _unit(vectors: FloatArray) -> FloatArray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _surface_arrays(mesh: _SurfaceMesh, grid: Grid, number: int) -> dict[str, np.ndarray]:
    """Return one surface's share of the lattice's arrays, indices already those of the whole."""
    P = mesh.corners
    M, N = P.shape[0] - 1, P.shape[1] - 1
    Z = np.empty_like(P)
    Z[:-1] = 0.75 * P[:-1] + 0.25 * P[1:]
    Z[-1] = P[-1] + 0.25 * (P[-1] - P[-2])
    # left-front, right-front, right-rear, left-rear: circulation to starboard in front lifts.
    rings = np.stack([Z[:-1, :-1], Z[:-1, 1:], Z[1:, 1:], Z[1:, :-1]], axis=2)
    middle = 0.5 * (P[:, :-1] + P[:, 1:])
    at = mesh.point[:, None]
    tangent = (1.0 - at) * P[:, :-1] + at * P[:, 1:]
    collocation = 0.25 * tangent[:-1] + 0.75 * tangent[1:]
    # x aft crossed with the span, left to right, points to the suction side.
    cross = np.cross(P[1:, 1:] - P[:-1, :-1], P[:-1, 1:] - P[1:, :-1])
    normal = _unit(cross)
    area = 0.5 * np.linalg.norm(cross, axis=-1)

    quarter = 0.75 * P[0] + 0.25 * P[-1]
    along = quarter[1:] - quarter[:-1]
    width = np.linalg.norm(along, axis=-1)
    e = along / width[:, None]
    chordwise = middle[-1] - middle[0]
    t = _unit(chordwise - np.sum(chordwise * e, axis=-1, keepdims=True) * e)
    k = np.cross(t, e)
    if mesh.turn.any():
        # About the span's direction across x, as a swept wing is rigged; normal to e again, and
        # panels to their own bound vortices, which taper sweeps differently.
        level = _unit(chordwise)
        chord = np.cos(mesh.turn)[:, None] * level \
            - np.sin(mesh.turn)[:, None] * _unit(np.cross(level, e))
        k = _unit(np.cross(chord, e))
        t = np.cross(e, k)
        normal = _unit(np.cross(chord, Z[:-1, 1:] - Z[:-1, :-1]))

    across = np.cross(k, chordwise)
    moment_axis = across / np.sum(across * e, axis=-1, keepdims=True)

    panel = grid.panels.start + np.arange(M * N).reshape(M, N)
    strip = grid.strips.start + np.arange(N)
    none = np.full(N, -1)
    span_edges = {
        'vector': Z[:, 1:] - Z[:, :-1], 'middle': (1.0 - at) * Z[:, :-1] + at * Z[:, 1:],
        'plus': np.vstack([panel, none]), 'minus': np.vstack([none, panel]),
        'wake': np.vstack([np.full((M, N), -1), strip]),
        'strip': np.broadcast_to(strip[:, None], (M + 1, N, 2))}
    beside = np.full((M, 1), -1)
    neighbours = np.column_stack([np.r_[strip[0], strip], np.r_[strip, strip[-1]]])
    # Of the last rings' sides what lies behind the trailing edge is wake: it carries no load.
    ends = np.concatenate([Z[1:-1], P[-1:]])
    chord_edges = {
        'vector': ends - Z[:-1], 'middle': 0.5 * (ends + Z[:-1]),
        'plus': np.hstack([beside, panel]), 'minus': np.hstack([panel, beside]),
        'wake': np.full((M, N + 1), -1),
        'strip': np.broadcast_to(neighbours, (M, N + 1, 2))}
    edges = {
        'edge_' + key: np.concatenate([
            span_edges[key].reshape((-1,) + span_edges[key].shape[2:]),
            chord_edges[key].reshape((-1,) + chord_edges[key].shape[2:])])
        for key in span_edges}
    return {
        'ring_corners': rings.reshape(-1, 4, 3),
        'collocation': collocation.reshape(-1, 3),
        'normal': normal.reshape(-1, 3),
        'tangent': _unit(np.cross(e[None], normal)).reshape(-1, 3),
        'area': area.ravel(),
        'panel_strip': np.tile(strip, M),
        'panel_share': np.repeat(plate.flat_plate_share(M), N),
        'wake_nodes': Z[-1].copy(),
        'span_axis': e, 'chord_axis': t, 'strip_normal': k,
        'quarter_chord': 0.5 * (quarter[1:] + quarter[:-1]),
        'strip_chord': area.sum(axis=0) / width,
        'strip_width': width,
        'moment_axis': moment_axis,
        'strip_surface': np.full(N, number),
        'span_place': np.cumsum(width) - 0.5 * width,
        'te_panel': panel[-1].copy(),
        'te_node': grid.nodes.start + np.arange(N),
        **edges}


def _movables(aircraft: Aircraft, grids: list[Grid], meshes: list[_SurfaceMesh],
              arrays: dict[str, np.ndarray], rows: int,
              ) -> tuple[dict[str, FloatArray], reynolds.StripCurves]:
    """Return what the movable parts do per unit angle, see `Lattice`, and the strips' curves."""
    parts, panels, strips = aircraft.movables, len(arrays['area']), len(arrays['strip_chord'])
    turn, slant = np.zeros((2, len(parts), panels))
    shift, load_moment, pivot, floating, flap = np.zeros((5, len(parts), strips))
    names = [grid.name for grid in grids]
    for k, part in enumerate(parts):
        s = names.index(part.surface)
        grid = grids[s]
        sign = np.array([control_sign(each) for each in arrays['strip_normal'][grid.strips]])
        turned, *panelwise = hinges.turned(
            part, aircraft.surfaces[s], meshes[s].edges, meshes[s].corners,
            *(arrays[key][grid.panels].reshape(rows, -1, 3) for key in ('normal', 'tangent')))
        turned = sign * turned
        turn[k, grid.panels], slant[k, grid.panels] = (
            (sign * each).ravel() for each in panelwise)
        weights = turned * arrays['strip_width'][grid.strips]
        if not weights.any():
            raise ConfigError(f'control {part.name}: its span of surface {part.surface}, '
                              f'{part.span[0]:g} to {part.span[1]:g}, is too short to turn'
                              + (', or its hinge_axis crosses the span' if part.hinge_axis
                                 else ''))
        floating[k, grid.strips] = -floating_ratio(part.hinge) * weights \
            / np.abs(weights).sum()
        if part.hinge == 0.0:
            pivot[k, grid.strips] = turned
        else:
            flap[k, grid.strips] = turned
            shift[k, grid.strips] = turned * plate.flap_effectiveness(rows, part.hinge)
            load_moment[k, grid.strips] = turned * plate.flap_moment(rows, part.hinge)
    for control, mixed in zip(aircraft.controls, aircraft.mixing.T):
        if not np.any(mixed @ turn):
            raise ConfigError(
                f'control {control.name}: its effectors cancel or cover no strip')
    flown = reynolds.strip_curves(
        aircraft.airfoils, [each for mesh in meshes for each in mesh.between],
        arrays['strip_chord'], flap, shift, load_moment)
    return {'turn': turn, 'slant': slant, 'shift': shift, 'load_moment': load_moment,
            'pivot': pivot, 'floating': floating, 'mixing': aircraft.mixing,
            'travel': np.array([part.travel for part in parts]).reshape(-1, 2),
            'stops': np.array([part.stops for part in parts]).reshape(-1, 2)}, flown
