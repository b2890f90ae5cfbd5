# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The definition of an aircraft: geometry, masses, section curves, and the whole.

All records are frozen; lengths in metres and angles in radians, geometry axes G
(x aft, y right, z up). Constructors refuse what cannot fly, with a `ConfigError`.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from poststall_sim.controls import Control, Movable, movables
from poststall_sim.engines import Engine
from poststall_sim.frames import GRAVITY, FloatArray
from poststall_sim.nonlifting import NonliftingBody
from poststall_sim.records import (
    ConfigError,
    read_only,
    require_length,
    require_place,
    require_positive,
)


@dataclass(frozen=True, slots=True, eq=False)
class Airfoil:
    """
    Measured or computed curves of one section over a full turn.

    alpha : (n,) strictly increasing from -pi to pi [rad]; cl, cd, cm : (n,) [-], cm about the
    quarter chord, nose-up positive; the last row equals the first. reynolds : that they hold for,
    None if that is not known; deflection : of a plain flap that they were made with [rad], above
    0 where it adds lift. An aircraft may have several of one name, no two for the same of these.
    """

    name: str
    alpha: FloatArray
    cl: FloatArray
    cd: FloatArray
    cm: FloatArray
    reynolds: float | None = None
    deflection: float = 0.0

    def __post_init__(self) -> None:
        """Refuse tables that are not curves over a full turn."""
        for key in ('alpha', 'cl', 'cd', 'cm'):
            object.__setattr__(self, key, read_only(getattr(self, key)))
        n = len(self.alpha)
        if n < 8 or any(len(getattr(self, key)) != n for key in ('cl', 'cd', 'cm')):
            raise ConfigError(f'airfoil {self.name}: alpha, cl, cd and cm need one length of '
                              f'at least 8 rows, got {n}')
        for key in ('alpha', 'cl', 'cd', 'cm'):
            bad = np.flatnonzero(~np.isfinite(getattr(self, key)))
            if bad.size:
                raise ConfigError(f'airfoil {self.name}: {key} is not a finite number in '
                                  f'data row {bad[0] + 1}')
        falls = np.flatnonzero(np.diff(self.alpha) <= 0.0)
        if falls.size:
            raise ConfigError(
                f'airfoil {self.name}: alpha must increase from row to row, but row '
                f'{falls[0] + 2} has {math.degrees(self.alpha[falls[0] + 1]):g} deg after '
                f'{math.degrees(self.alpha[falls[0]]):g} deg')
        if abs(self.alpha[0] + math.pi) > 1e-6 or abs(self.alpha[-1] - math.pi) > 1e-6:
            raise ConfigError(
                f'airfoil {self.name}: alpha must run from -180 to 180 deg, got '
                f'{math.degrees(self.alpha[0]):g} to {math.degrees(self.alpha[-1]):g}')
        for key in ('cl', 'cd', 'cm'):
            values = getattr(self, key)
            if abs(values[0] - values[-1]) > 1e-9:
                raise ConfigError(f'airfoil {self.name}: {key} must be the same at -180 and 180 '
                                  f'deg, got {values[0]:g} and {values[-1]:g}')
        if self.reynolds is not None:
            require_positive(f'airfoil {self.name}: reynolds', self.reynolds, 'number')
        if not abs(self.deflection) <= math.pi / 2:
            raise ConfigError(f'airfoil {self.name}: a flap must be deflected by at most 90 deg, '
                              f'got {math.degrees(self.deflection):g}')
        if self.cd.min() < 0.0:
            raise ConfigError(f'airfoil {self.name}: cd must not be negative, got '
                              f'{self.cd.min():g}')


@dataclass(frozen=True, slots=True)
class Section:
    """One station of a surface: leading edge in G [m], chord [m], twist nose-up [rad], airfoil."""

    leading_edge_G: tuple[float, float, float]
    chord: float
    airfoil: str
    twist: float = 0.0

    def __post_init__(self) -> None:
        """Refuse lengths of another unit and a twist that looks like degrees."""
        require_length('chord', self.chord)
        require_place('leading edge', self.leading_edge_G)
        if not abs(self.twist) <= math.pi / 2:
            raise ConfigError(
                f'twist is in radians and must lie within +-pi/2, got {self.twist!r} '
                f'(did you mean {math.radians(self.twist):.4f}, from degrees?)')


@dataclass(frozen=True, slots=True)
class Surface:
    """
    A lifting surface: sections in order along its span, and how finely it is cut.

    A symmetric surface is drawn from root to starboard tip and mirrored in y = 0; any other
    from its left tip to its right tip, a fin from root to tip. ``strips`` counts the whole
    surface, both sides; ``spacing_cosine`` crowds them towards the tips. ``edges``, where there
    are any, say where the strips end instead: shares of the (half) span from 0 to 1, each inner
    section among them; ``points``, one a strip, where between their ends the flow is tangent
    (shares of the span too, else the middles). ``flat`` panels lie in the plane of the leading
    edges and x, and twist turns their normals only, as in AVL; else the chords are turned.
    """

    name: str
    sections: tuple[Section, ...]
    strips: int
    symmetric: bool = False
    spacing_cosine: bool = False
    edges: tuple[float, ...] = ()
    points: tuple[float, ...] = ()
    flat: bool = False

    def __post_init__(self) -> None:
        """Refuse surfaces without span or strips."""
        if len(self.sections) < 2:
            raise ConfigError(f'surface {self.name}: needs at least 2 sections, got '
                              f'{len(self.sections)}')
        if self.strips < 1 or (self.symmetric and self.strips % 2):
            raise ConfigError(f'surface {self.name}: strips must be a positive number, even on '
                              f'a symmetric surface, got {self.strips}')
        for a, b in zip(self.sections, self.sections[1:]):
            if math.hypot(b.leading_edge_G[1] - a.leading_edge_G[1],
                          b.leading_edge_G[2] - a.leading_edge_G[2]) < 1e-6 * a.chord:
                raise ConfigError(f'surface {self.name}: two neighbouring sections stand at the '
                                  f'same y and z, {a.leading_edge_G[1:]}')
            across = b.leading_edge_G[1] - a.leading_edge_G[1]
            level = abs(across) >= abs(b.leading_edge_G[2] - a.leading_edge_G[2])
            if across < 0.0 and (self.symmetric or level):
                raise ConfigError(
                    f'surface {self.name}: sections go from '
                    f'{"the root to the starboard tip" if self.symmetric else "left to right"}, '
                    f'y rising (to the right), but y falls from {a.leading_edge_G[1]:g} to '
                    f'{b.leading_edge_G[1]:g} m')
        halves = (len(self.sections) - 1) * (2 if self.symmetric else 1)
        if self.strips < halves:
            raise ConfigError(f'surface {self.name}: {self.strips} strips are fewer than its '
                              f'{halves} trapezoids')
        if self.symmetric and abs(self.sections[0].leading_edge_G[1]) > 1e-9:
            raise ConfigError(f'surface {self.name}: a symmetric surface starts at y = 0, got '
                              f'y = {self.sections[0].leading_edge_G[1]:g} m')
        if self.edges or self.points:
            self._require_edges()

    def _require_edges(self) -> None:
        """Refuse strip edges that do not cut the span into the strips, or miss a section."""
        each = self.strips // 2 if self.symmetric else self.strips
        if len(self.edges) != each + 1 or self.edges[0] != 0.0 or self.edges[-1] != 1.0 \
                or not all(a < b for a, b in zip(self.edges, self.edges[1:])):
            raise ConfigError(f'surface {self.name}: strip edges must rise from 0 to 1 in '
                              f'{each + 1} numbers for {self.strips} strips')
        if self.points and not (len(self.points) == each and all(
                a < point < b for a, point, b in zip(self.edges, self.points, self.edges[1:]))):
            raise ConfigError(f'surface {self.name}: strip points must be {each} numbers, one '
                              'between the edges of each strip')
        for share in self.section_shares:
            if min(abs(share - edge) for edge in self.edges) > 1e-6:
                raise ConfigError(f'surface {self.name}: the section at {share:.6g} of the span '
                                  'must be a strip edge')

    @property
    def section_places(self) -> tuple[float, ...]:
        """Return where the sections stand along the (half) span [m], from 0."""
        place = [0.0]
        for a, b in zip(self.sections, self.sections[1:]):
            place.append(place[-1] + math.hypot(b.leading_edge_G[1] - a.leading_edge_G[1],
                                                b.leading_edge_G[2] - a.leading_edge_G[2]))
        return tuple(place)

    @property
    def section_shares(self) -> tuple[float, ...]:
        """Return where the sections stand along the (half) span, 0 to 1."""
        return tuple(place / self.section_places[-1] for place in self.section_places)

    def cut(self, strips: int) -> 'Surface':
        """Return the surface cut into another number of strips, by its spacing."""
        return self if strips == self.strips else replace(
            self, strips=strips, edges=(), points=())


@dataclass(frozen=True, slots=True, eq=False)
class MassProperties:
    """Mass [kg], centre of gravity in G [m], inertia about it, (3, 3) in B [kg m^2]."""

    mass: float
    cg_G: tuple[float, float, float]
    inertia_B: FloatArray

    def __post_init__(self) -> None:
        """Refuse bodies that cannot exist."""
        require_positive('mass', self.mass, 'kg')
        require_place('cg', self.cg_G)
        object.__setattr__(self, 'inertia_B', read_only(self.inertia_B))
        inertia = self.inertia_B
        if inertia.shape != (3, 3) or not np.isfinite(inertia).all() \
                or np.abs(inertia - inertia.T).max() > 1e-9 * np.abs(inertia).max():
            raise ConfigError('inertia must be a symmetric 3 x 3 tensor of finite numbers')
        moments = np.linalg.eigvalsh(inertia)
        if moments[0] <= 0.0:
            raise ConfigError(f'inertia must be positive in every direction, its principal '
                              f'moments are {np.array2string(moments, precision=4)} kg m^2')
        if moments[0] + moments[1] < moments[2] * (1.0 - 1e-9):
            raise ConfigError(
                f'inertia breaks the triangle inequality: the two smaller principal moments, '
                f'{moments[0]:.4g} and {moments[1]:.4g}, must add up to at least the largest, '
                f'{moments[2]:.4g} kg m^2')


def usual_radii(span: float, length: float) -> FloatArray:
    """
    Return the radii of gyration (3,) about body axes of an aircraft with a single propeller [m].

    Shares of half the span, half the length and half their mean: D. P. Raymer, Aircraft Design,
    6th ed., table 16.1.
    """
    return np.array([0.25, 0.38, 0.39]) * [0.5 * span, 0.5 * length, 0.25 * (span + length)]


def level_airspeed(mass: float, area: float, density: float, lift: float) -> float:
    """
    Return the airspeed at which a lift coefficient on an area carries a mass [m/s].

    mass [kg]; area [m^2]; density [kg/m^3]. Level flight at 1 g, of which thrust carries nothing.
    """
    return math.sqrt(2.0 * mass * GRAVITY / (density * area * lift))


@dataclass(frozen=True, slots=True)
class Reference:
    """Area [m^2], chord [m] and span [m] that coefficients are made with."""

    area: float
    chord: float
    span: float

    def __post_init__(self) -> None:
        """Refuse lengths that coefficients cannot be divided by."""
        require_positive('reference area', self.area, 'm^2')
        require_positive('reference chord', self.chord, 'm')
        require_positive('reference span', self.span, 'm')


@dataclass(frozen=True, slots=True, eq=False)
class Aircraft:
    """
    Everything that is needed to fly, and nothing that changes in flight.

    movables, mixing : the parts that the controls move, see `controls.movables`; assumptions :
    what its file did not say and a reader had to assume, a sentence each.
    """

    name: str
    surfaces: tuple[Surface, ...]
    airfoils: tuple[Airfoil, ...]
    reference: Reference
    mass: MassProperties
    controls: tuple[Control, ...] = ()
    engines: tuple[Engine, ...] = ()
    bodies: tuple[NonliftingBody, ...] = ()
    assumptions: tuple[str, ...] = ()
    control_names: tuple[str, ...] = field(init=False)
    engine_names: tuple[str, ...] = field(init=False)
    movables: tuple[Movable, ...] = field(init=False)
    mixing: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        """Refuse names that point nowhere or twice."""
        if not self.surfaces:
            raise ConfigError('an aircraft needs at least one surface')
        object.__setattr__(self, 'engine_names', tuple(
            engine.name or f'engine_{i}' for i, engine in enumerate(self.engines, 1)))
        for kinds, names in (('surfaces', [s.name for s in self.surfaces]),
                             ('controls', [c.name for c in self.controls]),
                             ('engines', self.engine_names),
                             ('bodies', [b.name for b in self.bodies])):
            for name in names:
                if names.count(name) > 1:
                    raise ConfigError(f'two {kinds} are named {name}')
        for name in dict.fromkeys(airfoil.name for airfoil in self.airfoils):
            family = [airfoil for airfoil in self.airfoils if airfoil.name == name]
            levels = list(dict.fromkeys(airfoil.deflection for airfoil in family))
            if 0.0 not in levels:
                raise ConfigError(f'airfoil {name}: a table with the flap at 0 deg must be there')
            for level in levels:
                tables = [each.reynolds for each in family if each.deflection == level]
                if len(tables) > 1 and (None in tables or len(set(tables)) < len(tables)):
                    told = ', '.join(f'{each:g}' if each else 'none' for each in tables)
                    raise ConfigError(
                        f'two airfoils are named {name}: several tables of one section and '
                        f'flap_deg need a Reynolds number each, got {told}')
        if any(control.name == 'throttle' for control in self.controls):
            raise ConfigError("a control must not be named throttle: that is the engines' name")
        airfoils = {airfoil.name for airfoil in self.airfoils}
        surfaces = {surface.name: surface for surface in self.surfaces}
        for surface in self.surfaces:
            for section in surface.sections:
                if section.airfoil not in airfoils:
                    raise ConfigError(f'surface {surface.name}: no airfoil named '
                                      f'{section.airfoil}, there are {sorted(airfoils)}')
        for control in self.controls:
            for effector in control.effectors:
                if effector.surface not in surfaces:
                    raise ConfigError(f'control {control.name}: no surface named '
                                      f'{effector.surface}, there are {sorted(surfaces)}')
                if effector.side and not surfaces[effector.surface].symmetric:
                    raise ConfigError(f'control {control.name}: surface {effector.surface} is '
                                      'not symmetric, so it has no left or right side')
        object.__setattr__(
            self, 'control_names', tuple(control.name for control in self.controls))
        parts, mixing = movables(
            self.controls, [surface.name for surface in self.surfaces if surface.symmetric])
        object.__setattr__(self, 'movables', parts)
        object.__setattr__(self, 'mixing', mixing)

    def require_engines(self, names: frozenset[str]) -> None:
        """Raise `ConfigError` for a name that no engine has."""
        for name in sorted(names - set(self.engine_names)):
            raise ConfigError(f'{self.name} has no engine named {name!r}, there are '
                              f'{list(self.engine_names) or "none"}')
