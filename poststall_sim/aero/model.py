# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What is computed once for an aircraft: settings, influence of the lattice, responses."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from poststall_sim.aero import lattice as lattices
from poststall_sim.aero import superposition
from poststall_sim.aero import wake as wakes
from poststall_sim.aero.clearance import require_apart
from poststall_sim.aero.corners import add_corners
from poststall_sim.aero.decambering import AngleForm, Closure, averaging
from poststall_sim.aero.kernels import ring_influence
from poststall_sim.aero.lattice import Lattice
from poststall_sim.aero.schemes import Scheme, Start
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.wake import Shape
from poststall_sim.aero.wash import Felt, Precision, felt
from poststall_sim.aircraft import Aircraft, ConfigError
from poststall_sim.atmosphere import STANDARD, Atmosphere
from poststall_sim.frames import FloatArray, geometry_to_body, norm

WAKE_CONE = math.radians(60.0)
"""The straight wake of the steady problem stays within this of the lattice's aft axis."""


@dataclass(frozen=True, slots=True)
class Settings:
    """
    How the aerodynamics are computed.

    chordwise : panels along every chord; wake_length [m], None for the tail arm and twenty
    chords; core : of vortices of other surfaces, and of free wakes, in strip widths; decambering
    False: attached flow at any angle; ell : averaging length of the
    non-local closure [chords], one or one a surface; scheme, damping, start : of the local
    closure; symmetric : its schemes A to D move mirrored strips alike; tolerance on the
    closure's residual [rad] ([-] for the local one); limit on its iterations; precision of the
    wake's velocity; coarsen : rows of the wake are taken together where they are far, interpolate
    : and their velocity is computed at few points there, see `wash`; unsteady False: no wake
    history, no added mass, loads of the steady lattice; separation : how it follows the flow in
    time, lag [chords] its time constant under LAG, relaxation and delay [chords] tau_1 and tau_2
    under GOMAN_KHRABROV, of the size identified for airfoils there; wake : its shape, free_rows
    that move in a free one, every so many steps, free_every; ground : flat, at altitude 0, felt
    by its mirror image in unsteady flow; axial_wake : straight wakes go along x, as AVL's do, not
    with the flow, in steady flow; as_avl : such wakes, no core between surfaces, and forces of
    the vortices along the span alone, with the flow at their middles as it is: what chordwise
    edges carry and what the middles miss (see `corners`) is left out.
    """

    chordwise: int = 4
    wake_length: float | None = None
    core: float = lattices.CORE
    decambering: bool = True
    closure: Closure = Closure.NONLOCAL
    angle_form: AngleForm = AngleForm.EXACT
    ell: float | tuple[float, ...] = 1.0
    scheme: Scheme = Scheme.ROBUST
    damping: float = 1.0
    start: Start = Start.GIVEN
    symmetric: bool = False
    tolerance: float = 1e-5
    limit: int = 200
    precision: Precision = Precision.FLOAT32
    coarsen: bool = True
    interpolate: bool = True
    unsteady: bool = True
    separation: Separation = Separation.QUASI_STEADY
    lag: float = 3.0
    relaxation: float = 0.5
    delay: float = 4.5
    wake: Shape = Shape.PRESCRIBED
    free_rows: int = 16
    free_every: int = 2
    ground: bool = False
    axial_wake: bool = False
    as_avl: bool = False

    def __post_init__(self) -> None:
        """Refuse what cannot be computed."""
        if not 1 <= self.chordwise <= 32:
            raise ConfigError(f'chordwise panels must be 1 to 32, got {self.chordwise}')
        if self.wake_length is not None and not self.wake_length > 0.0:
            raise ConfigError(f'wake_length must be above 0 m, got {self.wake_length!r}')
        if not 1e-3 <= self.core <= 1.0:
            raise ConfigError(f'core must be 0.001 to 1 strip widths, got {self.core!r}')
        for ell in self.ell if isinstance(self.ell, tuple) else (self.ell,):
            if not 0.0 <= ell <= 10.0:
                raise ConfigError(f'ell must be 0 to 10 chords, got {self.ell!r}')
        if not 0.0 < self.damping <= 1.0:
            raise ConfigError(f'damping must be above 0 and at most 1, got {self.damping!r}')
        if self.unsteady and (self.axial_wake or self.as_avl):
            raise ConfigError("the axial wake and AVL's rules are for steady flow: set unsteady "
                              'to False')
        if self.separation is not Separation.QUASI_STEADY and not (
                self.unsteady and self.decambering and self.closure is Closure.NONLOCAL
                and self.angle_form is AngleForm.EXACT):
            raise ConfigError(f'separation {self.separation.value} is for unsteady flow with the '
                              'non-local closure, decambering and exact angles')
        if (self.ground or self.wake is not Shape.PRESCRIBED) and not self.unsteady:
            raise ConfigError('a free or frozen wake and the ground are for unsteady flow')
        if self.ground and self.wake is Shape.FROZEN:
            raise ConfigError('a frozen wake is nowhere that a ground could mirror it')
        for name, most in (('free_rows', 1000), ('free_every', 100)):
            if not 1 <= getattr(self, name) <= most:
                raise ConfigError(f'{name} must be 1 to {most}, got {getattr(self, name)!r}')
        for name, low in (('lag', 1e-3), ('relaxation', 1e-3), ('delay', 0.0)):
            if not low <= getattr(self, name) <= 100.0:
                raise ConfigError(
                    f'{name} must be {low:g} to 100 chords, got {getattr(self, name)!r}')
        if not 0.0 < self.tolerance <= 0.1:
            raise ConfigError(f'tolerance must be above 0 and at most 0.1, got '
                              f'{self.tolerance!r}')
        if self.limit < 1:
            raise ConfigError(f'limit must be at least 1 iteration, got {self.limit}')


DEFAULTS = Settings()


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """
    An aircraft ready to be computed, and the atmosphere it flies in.

    bound (p, p) : normalwash of unit rings on collocation points; bound_inverse; te_inverse (n,
    p) : circulation at the trailing edges per unit normalwash, each surface alone, with no wake;
    edge_influence (3 s, p) : velocity of unit rings at the edges' middles with what those miss,
    see `corners`, and edge_rounded the same in the precision of the march; felt : where the wake
    is; mean (2, n, n) : see `averaging`; added_mass (6, 6) : in B about the centre of gravity, per
    unit density; te_rows (n, p) picks trailing-edge rings; trajectory (n,) by scheme : d cl / d
    delta [1/rad] along which schemes A to D move a strip; the arms of collocation points, edges
    and quarter chords are from the centre of gravity.
    """

    aircraft: Aircraft
    lattice: Lattice
    settings: Settings
    bound: FloatArray
    bound_inverse: FloatArray
    te_inverse: FloatArray
    edge_influence: FloatArray
    edge_rounded: np.ndarray
    mean: FloatArray
    added_mass: FloatArray
    te_rows: FloatArray
    trajectory: dict[Scheme, FloatArray]
    felt: Felt
    collocation_arm: FloatArray
    edge_arm: FloatArray
    quarter_arm: FloatArray
    atmosphere: Atmosphere = STANDARD

    @property
    def wake_length(self) -> float:
        """Length of wake that is kept [m]."""
        if self.settings.wake_length is not None:
            return self.settings.wake_length
        length = float(np.ptp(self.lattice.wake_nodes[:, 0]))
        return length + 20.0 * float(self.lattice.strip_chord.max())

    def at(self, airspeed: float, viscosity: float, deflections: FloatArray,
           angles: FloatArray | None = None) -> 'Model':
        """Return it with the curves that it flies, see `Lattice.at`, `boundary_condition`."""
        angles = self.lattice.angles(deflections) if angles is None else angles
        lattice = self.lattice.at(airspeed, viscosity, angles)
        return self if lattice is self.lattice else replace(self, lattice=lattice)

    def wake_rows(self, step: float) -> int:
        """Return how many rows of wake are kept that are a step [m] long."""
        return max(2, math.ceil(self.wake_length / step))


@dataclass(frozen=True, slots=True, eq=False)
class Onset:
    """
    Velocity of the air past the centre of gravity (3,) [m/s] and rates (3,) [rad/s], in G.

    gust : what the air has more than that at arms (k, 3) from the CG, (k, 3) in G, or None.
    """

    velocity_G: FloatArray
    rates_G: FloatArray
    gust: Callable[[FloatArray], FloatArray] | None = None

    @property
    def airspeed(self) -> float:
        """Return the speed of the air past the centre of gravity [m/s]."""
        return norm(self.velocity_G)

    def at(self, arm: FloatArray) -> FloatArray:
        """Return the velocity (..., 3) of the air past points at arms (..., 3) from the CG."""
        out = np.empty(arm.shape)
        _passing(self.velocity_G, self.rates_G, arm.reshape(-1, 3), out.reshape(-1, 3))
        if self.gust is not None:
            out += self.gust(arm.reshape(-1, 3)).reshape(arm.shape)
        return out


@njit(cache=True, nogil=True)
def _passing(velocity, rates, arm, out):
    """Fill `out` (n, 3) with velocity - rates x arm."""
    p, q, r = rates
    for i in range(arm.shape[0]):
        x, y, z = arm[i, 0], arm[i, 1], arm[i, 2]
        out[i, 0] = velocity[0] - (q * z - r * y)
        out[i, 1] = velocity[1] - (r * x - p * z)
        out[i, 2] = velocity[2] - (p * y - q * x)


@dataclass(frozen=True, slots=True, eq=False)
class StripResponse:
    """
    What straight wakes along one direction (3,) do, as far as it has been asked for.

    response (n, p) : circulation of strips per unit normalwash, each surface alone in its own;
    far (p, n) normalwash and far_edges (3 s, n) velocity of unit wakes of all surfaces, of use
    where strips do not shed what they carry.
    """

    direction: FloatArray
    response: FloatArray
    far: FloatArray | None = None
    far_edges: FloatArray | None = None

    def with_far(self, lattice: Lattice) -> 'StripResponse':
        """Return it with `far` and `far_edges`."""
        if self.far is not None:
            return self
        return replace(self, far=far_normalwash(lattice, self.direction),
                       far_edges=far_velocity(lattice, self.direction))


def build(aircraft: Aircraft, settings: Settings = DEFAULTS,
          atmosphere: Atmosphere = STANDARD) -> Model:
    """Return the model of an aircraft: lattice, influence, averaging and added mass."""
    lattice = replace(lattices.build(aircraft, settings.chordwise), core=settings.core)
    if settings.as_avl:
        lattice = _as_avl(lattice)
    if isinstance(settings.ell, tuple) and len(settings.ell) != len(lattice.grids):
        raise ConfigError(f'ell must be one number or one for each of the {len(lattice.grids)} '
                          f'surfaces, got {settings.ell!r}')
    owner = lattice.strip_surface[lattice.panel_strip]
    require_apart(lattice, owner)
    at_points = influence(lattice, lattice.collocation, owner, lattice.ring_corners, owner)
    bound = np.einsum('ijk,ik->ij', at_points, lattice.normal)
    edge_owner = lattice.strip_surface[lattice.edge_strip[:, 0]]
    at_edges = influence(lattice, lattice.edge_middle, edge_owner, lattice.ring_corners, owner)
    if not settings.as_avl:
        add_corners(lattice, at_edges)
    edge_influence = np.ascontiguousarray(
        at_edges.transpose(0, 2, 1).reshape(-1, lattice.panels))
    inverse = np.linalg.inv(bound)
    cg = np.array(aircraft.mass.cg_G)
    arm = lattice.collocation - cg
    modes = np.hstack([lattice.normal, np.cross(arm, lattice.normal)])
    added = -(modes * lattice.area[:, None]).T @ inverse @ modes
    turn = np.concatenate([geometry_to_body(np.ones(3))] * 2)
    te_rows = np.zeros((lattice.strips, lattice.panels))
    te_rows[np.arange(lattice.strips), lattice.te_panel] = 1.0
    te_inverse = np.zeros_like(te_rows)
    for grid in lattice.grids:
        te_inverse[grid.strips, grid.panels] = np.linalg.solve(
            bound[grid.panels, grid.panels].T, te_rows[grid.strips, grid.panels].T).T
    arrays = {
        'bound': bound, 'bound_inverse': inverse,
        'te_inverse': te_inverse,
        'edge_influence': edge_influence,
        'edge_rounded': edge_influence.astype(settings.precision.value, copy=False),
        'mean': averaging(lattice, settings.ell),
        'added_mass': turn[:, None] * added * turn[None, :],
        'te_rows': te_rows, 'collocation_arm': arm, 'edge_arm': lattice.edge_middle - cg,
        'quarter_arm': lattice.quarter_chord - cg}
    for array in arrays.values():
        array.setflags(write=False)
    aft = np.array([1.0, 0.0, 0.0])
    response = steady_response(bound, far_normalwash(lattice, aft), te_rows)
    parts = superposition.loadings(
        lattice, superposition.lift_slopes(lattice, response), aircraft.reference.area)
    single, together = superposition.trajectory_slopes(parts)
    plate = np.full(lattice.strips, 2.0 * math.pi)
    trajectory = {
        Scheme.A: plate, Scheme.B: single, Scheme.C: plate,
        # The floor keeps a strip in strong downwash from moving off at once.
        Scheme.D: np.maximum(together, 0.3 * plate)}
    return Model(aircraft=aircraft, lattice=lattice, settings=settings,
                 felt=felt(lattice, settings.precision, settings.interpolate),
                 trajectory=trajectory, atmosphere=atmosphere, **arrays)


def _as_avl(lattice: Lattice) -> Lattice:
    """Return it without cores, and without length of chordwise edges, so that they carry none."""
    vector = lattice.edge_vector.copy()
    for grid in lattice.grids:
        across = (grid.rows + 1) * (grid.strips.stop - grid.strips.start)
        vector[grid.edges.start + across:grid.edges.stop] = 0.0
    vector.setflags(write=False)
    return replace(lattice, edge_vector=vector, core=0.0)


def steady_response(bound: FloatArray, far: FloatArray, te_rows: FloatArray) -> FloatArray:
    """
    Return the strips' circulation (n, p) per unit normalwash in steady flow, G = -response w.

    bound (p, p); far (p, n) : see `far_normalwash`; te_rows (n, p).
    """
    return np.ascontiguousarray(np.linalg.solve((bound + far @ te_rows).T, te_rows.T).T)


def influence(lattice: Lattice, points: FloatArray, point_owner: np.ndarray,
               corners: FloatArray, ring_owner: np.ndarray) -> FloatArray:
    """Return the velocity (points, rings, 3) of unit rings, softened between surfaces."""
    surfaces = range(len(lattice.grids))
    table = np.array([[wakes.core(lattice, s, p) for s in surfaces] for p in surfaces])
    out = np.empty((len(points), len(corners), 3))
    ring_influence(points, np.ascontiguousarray(corners),
                   table[point_owner[:, None], ring_owner[None, :]], out)
    return out


def wake_direction(velocity_G: FloatArray) -> FloatArray:
    """Return the unit direction (3,) of the steady wake: downstream, within `WAKE_CONE`."""
    aft = np.array([1.0, 0.0, 0.0])
    speed = norm(velocity_G)
    if speed == 0.0:
        return aft
    direction = velocity_G / speed
    if direction[0] >= math.cos(WAKE_CONE):
        return direction
    across = np.array([0.0, direction[1], direction[2]])
    length = norm(across)
    if length < 1e-9:
        return aft
    return math.cos(WAKE_CONE) * aft + math.sin(WAKE_CONE) * across / length


def far_rings(lattice: Lattice, direction: FloatArray) -> FloatArray:
    """Return the corners (n, 4, 3) of the rings of a straight steady wake, one a strip."""
    left, right = lattice.wake_nodes[lattice.te_node], lattice.wake_nodes[lattice.te_node + 1]
    far = wakes.far_length(lattice) * direction
    return np.stack([left, right, right + far, left + far], axis=1)


def far_normalwash(lattice: Lattice, direction: FloatArray) -> FloatArray:
    """Return the normalwash (p, n) of unit straight wakes on the collocation points."""
    far = influence(lattice, lattice.collocation, lattice.strip_surface[lattice.panel_strip],
                     far_rings(lattice, direction), lattice.strip_surface)
    return np.einsum('ijk,ik->ij', far, lattice.normal)


def far_velocity(lattice: Lattice, direction: FloatArray) -> FloatArray:
    """Return the velocity (3 s, n) of unit straight wakes at the edges' middles."""
    far = influence(lattice, lattice.edge_middle, lattice.strip_surface[lattice.edge_strip[:, 0]],
                    far_rings(lattice, direction), lattice.strip_surface)
    return np.ascontiguousarray(far.transpose(0, 2, 1).reshape(-1, lattice.strips))


def crossing(model: Model, circulation: FloatArray) -> FloatArray:
    """Return the normalwash (p,) of the rings of each surface on the others."""
    out = np.zeros(model.lattice.panels)
    for here in model.lattice.grids:
        for there in model.lattice.grids:
            if here is not there:
                out[here.panels] += model.bound[here.panels, there.panels] \
                    @ circulation[there.panels]
    return out


def own_response(model: Model, direction: FloatArray) -> StripResponse:
    """
    Return the strips' response with each surface alone in its own straight wake.

    With T the rows of the trailing edge, B the bound rings and F the wakes, by Woodbury's formula
    T (B + F T)^-1 = (1 + T B^-1 F)^-1 T B^-1: a system of as many unknowns as strips.
    """
    lattice = model.lattice
    rings = far_rings(lattice, direction)
    response = np.zeros((lattice.strips, lattice.panels))
    for s, grid in enumerate(lattice.grids):
        panels, strips = grid.panels, grid.strips
        far = np.empty((panels.stop - panels.start, strips.stop - strips.start, 3))
        ring_influence(lattice.collocation[panels], rings[strips],
                       np.full(far.shape[:2], wakes.core(lattice, s, s)), far)
        alone = model.te_inverse[strips, panels]
        wake = alone @ np.matmul(far, lattice.normal[panels, :, None])[..., 0]
        response[strips, panels] = np.linalg.solve(np.eye(len(wake)) + wake, alone)
    return StripResponse(direction, response)
