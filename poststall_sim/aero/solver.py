# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Aerodynamics of one instant and of one step: the only place that orders the parts.

`build` makes a `Model` once; `steady` and `advance` use it and change nothing in it. Both find
the decambering from a steady problem at the present onset: in the march each surface with its
own straight wake plus the wash of the other surfaces and their wakes as they are. Taking it
from the bound matrix alone, with the wake held, looks natural and flutters past stall: within
one step the lattice answers a change of decambering with a fraction of its final lift only.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from poststall_sim.aero import lattice as lattices
from poststall_sim.aero import loads, schemes
from poststall_sim.aero import wake as wakes
from poststall_sim.aero.decambering import Closure, averaging, operating_points, strip_operator
from poststall_sim.aero.kernels import ring_influence
from poststall_sim.aero.lattice import Lattice
from poststall_sim.aero.polars import sections
from poststall_sim.aero.wake import Placement, Wake
from poststall_sim.aircraft import Aircraft, ConfigError
from poststall_sim.frames import FloatArray, geometry_to_body
from poststall_sim.state import Status, Strips

FADE_BEGIN, FADE_END = math.cos(math.radians(60.0)), math.cos(math.radians(75.0))
"""A strip whose flow leaves the chord by more fades from the lattice into strip theory."""
WAKE_CONE = math.radians(60.0)
"""The straight wake of the steady problem stays within this of the lattice's aft axis."""
REFRESH_ANGLE = math.radians(0.5)
"""The strip operator is made anew when the onset has turned by more."""
SLOWEST_SHARE, SLOWEST_SPEED = 0.05, 0.5
"""A strip below this share of the airspeed, or of 0.5 m/s, keeps its decambering."""


@dataclass(frozen=True, slots=True)
class Settings:
    """
    How the aerodynamics are computed.

    chordwise : panels along every chord; wake_length [m], None for the tail arm and twenty
    chords; ell : averaging length of the non-local closure [chords]; tolerance on the closure's
    residual [rad] ([-] for the local one); limit on its iterations; decambering False: attached
    flow at any angle; coarsen : rows of the wake far from their trailing edge evaluated in
    groups; unsteady False: no wake history, no added mass, loads of the steady lattice.
    """

    chordwise: int = 4
    wake_length: float | None = None
    closure: Closure = Closure.NONLOCAL
    ell: float = 1.0
    tolerance: float = 1e-5
    limit: int = 60
    decambering: bool = True
    coarsen: bool = True
    unsteady: bool = True

    def __post_init__(self) -> None:
        """Refuse what cannot be computed."""
        if not 1 <= self.chordwise <= 32:
            raise ConfigError(f'chordwise panels must be 1 to 32, got {self.chordwise}')
        if self.wake_length is not None and not self.wake_length > 0.0:
            raise ConfigError(f'wake_length must be above 0 m, got {self.wake_length!r}')
        if not 0.0 <= self.ell <= 10.0:
            raise ConfigError(f'ell must be 0 to 10 chords, got {self.ell!r}')
        if not 0.0 < self.tolerance <= 0.1:
            raise ConfigError(f'tolerance must be above 0 and at most 0.1, got '
                              f'{self.tolerance!r}')
        if self.limit < 1:
            raise ConfigError(f'limit must be at least 1 iteration, got {self.limit}')


DEFAULTS = Settings()


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """
    An aircraft ready to be computed.

    bound (p, p) : normalwash of unit rings on collocation points; bound_inverse; crossing (p, p)
    the same between different surfaces only; edge_influence (3 s, p) : velocity of unit rings at
    the edges' middles; wake_points : per surface, its collocation points and then its edges'
    middles, where the wake is felt; mean (n, n) : see `averaging`; added_mass (6, 6) : in B
    about the centre of gravity, per unit density; te_rows (n, p) picks trailing-edge rings;
    the arms of collocation points, edges and quarter chords are from the centre of gravity.
    """

    aircraft: Aircraft
    lattice: Lattice
    settings: Settings
    bound: FloatArray
    bound_inverse: FloatArray
    crossing: FloatArray
    edge_influence: FloatArray
    mean: FloatArray
    added_mass: FloatArray
    te_rows: FloatArray
    wake_points: tuple[FloatArray, ...]
    collocation_arm: FloatArray
    edge_arm: FloatArray
    quarter_arm: FloatArray

    @property
    def wake_length(self) -> float:
        """Length of wake that is kept [m]."""
        if self.settings.wake_length is not None:
            return self.settings.wake_length
        length = float(np.ptp(self.lattice.wake_nodes[:, 0]))
        return length + 20.0 * float(self.lattice.strip_chord.max())


@dataclass(frozen=True, slots=True, eq=False)
class Onset:
    """Velocity of the air past the centre of gravity (3,) [m/s] and rates (3,) [rad/s], in G."""

    velocity_G: FloatArray
    rates_G: FloatArray

    def at(self, arm: FloatArray) -> FloatArray:
        """Return the velocity (..., 3) of the air past points at arms (..., 3) from the CG."""
        p, q, r = self.rates_G
        x, y, z = arm[..., 0], arm[..., 1], arm[..., 2]
        turning = np.stack([q * z - r * y, r * x - p * z, p * y - q * x], axis=-1)
        return self.velocity_G - turning


@dataclass(frozen=True, slots=True, eq=False)
class StripResponse:
    """Circulation of strips per unit normalwash (n, p), each surface alone, for one onset."""

    direction: FloatArray
    response: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FlowState:
    """
    What the flow remembers from step to step.

    circulation, previous : (p,) of this step and the one before; bare, previous_bare : (p,) those
    of the undeflected lattice without a wake; shed : (n,) what the trailing edges leave to the
    next row; delta : (n,) [rad]; steps : since the start, the order of dG/dt builds up with it.
    """

    wake: Wake
    circulation: FloatArray
    previous: FloatArray
    bare: FloatArray
    previous_bare: FloatArray
    shed: FloatArray
    delta: FloatArray
    response: StripResponse
    steps: int


@dataclass(frozen=True, slots=True, eq=False)
class AeroResult:
    """Force [N] and moment about the centre of gravity [N m] in G, strips, and how it went."""

    force_G: FloatArray
    moment_G: FloatArray
    circulation: FloatArray
    strips: Strips
    status: Status
    iterations: int
    max_residual: float


def build(aircraft: Aircraft, settings: Settings = DEFAULTS) -> Model:
    """Return the model of an aircraft: lattice, influence, averaging and added mass."""
    lattice = lattices.build(aircraft, settings.chordwise)
    owner = lattice.strip_surface[lattice.panel_strip]
    at_points = _influence(lattice, lattice.collocation, owner, lattice.ring_corners, owner)
    bound = np.einsum('ijk,ik->ij', at_points, lattice.normal)
    edge_owner = lattice.strip_surface[lattice.edge_strip[:, 0]]
    at_edges = _influence(lattice, lattice.edge_middle, edge_owner, lattice.ring_corners, owner)
    inverse = np.linalg.inv(bound)
    cg = np.array(aircraft.mass.cg_G)
    arm = lattice.collocation - cg
    modes = np.hstack([lattice.normal, np.cross(arm, lattice.normal)])
    added = -(modes * lattice.area[:, None]).T @ inverse @ modes
    turn = np.concatenate([geometry_to_body(np.ones(3))] * 2)
    te_rows = np.zeros((lattice.strips, lattice.panels))
    te_rows[np.arange(lattice.strips), lattice.te_panel] = 1.0
    arrays = {
        'bound': bound, 'bound_inverse': inverse,
        'crossing': np.where(owner[:, None] == owner[None, :], 0.0, bound),
        'edge_influence': np.ascontiguousarray(
            at_edges.transpose(0, 2, 1).reshape(-1, lattice.panels)),
        'mean': averaging(lattice, settings.ell),
        'added_mass': turn[:, None] * added * turn[None, :],
        'te_rows': te_rows, 'collocation_arm': arm, 'edge_arm': lattice.edge_middle - cg,
        'quarter_arm': lattice.quarter_chord - cg}
    for array in arrays.values():
        array.setflags(write=False)
    wake_points = tuple(
        np.concatenate([lattice.collocation[g.panels], lattice.edge_middle[g.edges]])
        for g in lattice.grids)
    return Model(aircraft=aircraft, lattice=lattice, settings=settings, wake_points=wake_points,
                 **arrays)


def _influence(lattice: Lattice, points: FloatArray, point_owner: np.ndarray,
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
    speed = float(np.linalg.norm(velocity_G))
    if speed == 0.0:
        return aft
    direction = velocity_G / speed
    if direction[0] >= math.cos(WAKE_CONE):
        return direction
    across = np.array([0.0, direction[1], direction[2]])
    length = float(np.linalg.norm(across))
    if length < 1e-9:
        return aft
    return math.cos(WAKE_CONE) * aft + math.sin(WAKE_CONE) * across / length


def _far_rings(lattice: Lattice, direction: FloatArray) -> FloatArray:
    """Return the corners (n, 4, 3) of the rings of a straight steady wake, one a strip."""
    left, right = lattice.wake_nodes[lattice.te_node], lattice.wake_nodes[lattice.te_node + 1]
    far = wakes.far_length(lattice) * direction
    return np.stack([left, right, right + far, left + far], axis=1)


def _far_normalwash(model: Model, direction: FloatArray) -> FloatArray:
    """Return the normalwash (p, n) of unit straight wakes on the collocation points."""
    lattice = model.lattice
    far = _influence(lattice, lattice.collocation, lattice.strip_surface[lattice.panel_strip],
                     _far_rings(lattice, direction), lattice.strip_surface)
    return np.einsum('ijk,ik->ij', far, lattice.normal)


def _own_response(model: Model, direction: FloatArray) -> StripResponse:
    """Return the strips' response with each surface alone in its own straight wake."""
    lattice = model.lattice
    far = _far_normalwash(model, direction)
    response = np.zeros((lattice.strips, lattice.panels))
    for grid in lattice.grids:
        te_rows = model.te_rows[grid.strips, grid.panels]
        matrix = model.bound[grid.panels, grid.panels] + far[grid.panels, grid.strips] @ te_rows
        response[grid.strips, grid.panels] = np.linalg.solve(matrix.T, te_rows.T).T
    return StripResponse(direction, response)


@dataclass(frozen=True, slots=True, eq=False)
class _Boundary:
    """
    The onset at the lattice with controls set.

    level, turned (p,) : w = level cos th + turned sin th; strips (8, n) : see
    `operating_points`; fade (n,).
    """

    level: FloatArray
    turned: FloatArray
    strips: FloatArray

    @property
    def fade(self) -> FloatArray:
        return self.strips[3]


def _boundary(model: Model, onset: Onset, deflections: FloatArray) -> _Boundary:
    lattice = model.lattice
    velocity = onset.at(model.collocation_arm)
    level = np.einsum('ij,ij->i', velocity, lattice.normal)
    turned = np.einsum('ij,ij->i', velocity, lattice.tangent)
    turn = deflections @ lattice.flap_angle
    shift = deflections @ lattice.flap_shift
    cosine, sine = np.cos(turn), np.sin(turn)
    strips = np.empty((8, lattice.strips))
    at_strips = onset.at(model.quarter_arm)
    strips[0] = np.einsum('ij,ij->i', at_strips, lattice.chord_axis)
    strips[1] = np.einsum('ij,ij->i', at_strips, lattice.strip_normal)
    speed = np.hypot(strips[0], strips[1])
    along = strips[0] / np.maximum(speed, 1e-12)
    ramp = np.clip((along - FADE_END) / (FADE_BEGIN - FADE_END), 0.0, 1.0)
    strips[2] = lattice.strip_chord
    strips[3] = ramp * ramp * (3.0 - 2.0 * ramp)
    strips[4] = lattice.zero_lift
    strips[5] = lattice.zero_lift - shift
    strips[6] = shift
    airspeed = float(np.linalg.norm(onset.velocity_G))
    strips[7] = speed > SLOWEST_SHARE * max(airspeed, SLOWEST_SPEED)
    return _Boundary(level * cosine + turned * sine, turned * cosine - level * sine, strips)


@dataclass(frozen=True, slots=True, eq=False)
class _Operating:
    """Converged (or best) decambering and operating points of all strips."""

    delta: FloatArray
    alpha: FloatArray
    circulation: FloatArray
    speed: FloatArray
    residual: FloatArray
    iterations: int


def _decamber(model: Model, boundary: _Boundary, response: FloatArray, wash: FloatArray,
              start: FloatArray) -> _Operating:
    """Return the operating points by the closure in the settings, from delta ``start`` (n,)."""
    lattice, settings = model.lattice, model.settings
    n = lattice.strips
    operator = np.empty((n, 2 * n + 1))
    strip_operator(response, boundary.level, boundary.turned, wash, lattice.panel_strip, operator)
    alpha, circulation, speed, residual = (np.zeros(n) for _ in range(4))
    delta = np.array(start)
    iterations = 0
    if not settings.decambering:
        delta[:] = 0.0
        operating_points(
            delta, boundary.strips, operator, alpha, circulation, speed, np.empty((n, n)))
    elif settings.closure is Closure.NONLOCAL:
        iterations = schemes.newton(
            delta, boundary.strips, operator, lattice.curves, lattice.polar_index, model.mean,
            settings.tolerance, settings.limit, alpha, circulation, speed, residual)
    else:
        iterations = schemes.scheme_d(
            delta, boundary.strips, operator, lattice.curves, lattice.polar_index,
            _uniform_slope(model, response), 1.0, settings.tolerance, settings.limit,
            alpha, circulation, speed, residual)
    return _Operating(delta, alpha, circulation, speed, residual, iterations)


def _uniform_slope(model: Model, response: FloatArray) -> FloatArray:
    """
    Return sigma (n,), d cl / d delta for a change on all strips alike [1/rad].

    Scheme D's trajectory; the floor keeps strips in strong downwash from moving off at once.
    """
    sigma = -2.0 * response.sum(axis=1) / model.lattice.strip_chord
    return np.maximum(sigma, 0.3 * 2.0 * math.pi)


def _normalwash(model: Model, boundary: _Boundary, delta: FloatArray) -> FloatArray:
    """Return the onset's normalwash w (p,) on panels turned by delta, controls and camber."""
    theta = (delta - model.lattice.zero_lift)[model.lattice.panel_strip]
    return boundary.level * np.cos(theta) + boundary.turned * np.sin(theta)


def _strip_theory(model: Model, boundary: _Boundary, delta: FloatArray,
                  circulation: FloatArray) -> FloatArray:
    """
    Return circulation (p,) with faded strips brought to that of their section alone.

    A plate at theta in a stream U, W carries G = pi c (W cos theta + U sin theta).
    """
    u, w, chord, fade, _, zero = boundary.strips[:6]
    if np.all(fade == 1.0):
        return circulation
    theta = delta - zero
    plate = math.pi * chord * (w * np.cos(theta) + u * np.sin(theta))
    strip = model.lattice.panel_strip
    return fade[strip] * circulation \
        + ((1.0 - fade) * plate)[strip] * model.lattice.panel_share


def _result(model: Model, onset: Onset, boundary: _Boundary, operating: _Operating,
            circulation: FloatArray, row: FloatArray, induced: FloatArray, density: float,
            rate: FloatArray | None) -> AeroResult:
    """
    Return loads and strips of a flow.

    circulation (p,); row (n,) of the wake row at the trailing edge; induced (s, 3) velocity of
    the wake at the edges' middles; rate (p,) dG/dt or None.
    """
    lattice, settings = model.lattice, model.settings
    n = lattice.strips
    induced = induced + (model.edge_influence @ circulation).reshape(-1, 3)
    fade = boundary.fade[lattice.edge_strip].mean(axis=1)
    velocity = onset.at(model.edge_arm) + fade[:, None] * induced
    padded = np.append(circulation, 0.0)
    strength = padded[lattice.edge_plus] - padded[lattice.edge_minus] \
        + np.append(row, 0.0)[lattice.edge_wake]
    total = np.zeros(6)
    loads.lattice_force(density, strength, velocity, lattice.edge_vector, model.edge_arm, total)
    if rate is not None:
        loads.added_mass_force(
            density, rate, lattice.area, lattice.normal, model.collocation_arm, total)
    looked_up = operating.alpha + boundary.strips[6]
    stalled = (looked_up > lattice.stall_high) | (looked_up < lattice.stall_low)
    if not settings.decambering:
        looked_up = np.clip(looked_up, lattice.stall_low, lattice.stall_high)
        stalled = np.zeros(n, dtype=bool)
    values = np.empty((n, 4))
    sections(lattice.curves, lattice.polar_index, looked_up, values)
    loads.section_force(
        density, operating.alpha, operating.speed, values[:, 1], values[:, 2],
        lattice.strip_chord, lattice.strip_width, lattice.chord_axis, lattice.strip_normal,
        lattice.span_axis, model.quarter_arm, total)
    worst = float(np.abs(operating.residual).max())
    status = Status.CONVERGED if worst <= settings.tolerance else Status.NOT_CONVERGED
    if not (np.isfinite(total).all() and math.isfinite(worst)):
        status = Status.DIVERGED
    lift = 2.0 * operating.circulation / (np.maximum(operating.speed, 1e-12) * lattice.strip_chord)
    return AeroResult(
        force_G=total[:3], moment_G=total[3:], circulation=circulation,
        strips=Strips(alpha=operating.alpha, cl=lift, cd=values[:, 1], cm=values[:, 2],
                      delta=operating.delta, circulation=operating.circulation,
                      residual=operating.residual, stalled=stalled),
        status=status, iterations=operating.iterations, max_residual=worst)


def steady(model: Model, onset: Onset, deflections: FloatArray, *, density: float,
           delta0: FloatArray | None = None) -> AeroResult:
    """
    Return loads and strips in steady flow, all surfaces and their straight wakes at once.

    deflections : (controls,) [rad]; delta0 : (n,) where the decambering starts, 0 without;
    past stall the closure may have several solutions, and the start chooses among them.
    """
    lattice = model.lattice
    direction = wake_direction(onset.velocity_G)
    far = _far_normalwash(model, direction)
    # A value that is not finite goes through to the status; a step never raises.
    factors = lu_factor(model.bound + far @ model.te_rows, check_finite=False)
    response = lu_solve(factors, model.te_rows.T, trans=1, check_finite=False).T
    boundary = _boundary(model, onset, deflections)
    start = np.zeros(lattice.strips) if delta0 is None else delta0
    operating = _decamber(model, boundary, response, np.zeros(lattice.panels), start)
    circulation = -lu_solve(
        factors, _normalwash(model, boundary, operating.delta), check_finite=False)
    circulation = _strip_theory(model, boundary, operating.delta, circulation)
    edge_owner = lattice.strip_surface[lattice.edge_strip[:, 0]]
    at_edges = _influence(lattice, lattice.edge_middle, edge_owner,
                          _far_rings(lattice, direction), lattice.strip_surface)
    row = circulation[lattice.te_panel]
    return _result(model, onset, boundary, operating, circulation, row,
                   np.einsum('ijk,j->ik', at_edges, row), density, None)


def start(model: Model, onset: Onset, placement: Placement, deflections: FloatArray, *,
          density: float, dt: float, at_rest: bool = False,
          delta0: FloatArray | None = None) -> tuple[FlowState, AeroResult]:
    """
    Return the flow that a march begins with, and its loads.

    From the steady solution with its straight wake; at_rest True: a wake without strength, the
    impulsive start. dt [s] sets the length of the wake's rows.
    """
    lattice = model.lattice
    result = steady(model, onset, deflections, density=density, delta0=delta0)
    boundary = _boundary(model, onset, deflections)
    fade = boundary.fade
    bare = -model.bound_inverse @ boundary.level
    speed = float(np.linalg.norm(onset.velocity_G))
    step = max(speed * dt, 0.02 * float(lattice.strip_chord.min()))
    rows = max(2, math.ceil(model.wake_length / step))
    shed = fade * result.circulation[lattice.te_panel]
    direction = wake_direction(onset.velocity_G)
    strength = np.zeros(lattice.strips) if at_rest else shed
    wake = wakes.straight(lattice, placement, step * direction, rows, strength)
    return FlowState(
        wake=wake, circulation=result.circulation, previous=result.circulation, bare=bare,
        previous_bare=bare, shed=strength, delta=result.strips.delta,
        response=_own_response(model, direction), steps=0 if at_rest else 2), result


def advance(model: Model, flow: FlowState, onset: Onset, placement: Placement,
            deflections: FloatArray, *, density: float, dt: float,
            drift_N: FloatArray) -> tuple[FlowState, AeroResult]:
    """
    Return flow and loads one step later.

    The step goes from t to t + dt; onset, placement and deflections are those of t + dt. All
    surfaces have moved to ``placement``; the wake has drifted by drift_N (3,) [m] with the wind.
    """
    lattice, settings = model.lattice, model.settings
    if not settings.unsteady:
        result = steady(model, onset, deflections, density=density, delta0=flow.delta)
        return replace(flow, circulation=result.circulation, previous=flow.circulation,
                       delta=result.strips.delta, steps=flow.steps + 1), result
    wake = wakes.shed(flow.wake, lattice, placement, flow.shed, drift_N)
    rows = len(wake.circulation)
    marks = wakes.ladder(rows) if settings.coarsen else np.arange(rows + 1)
    own, other = wakes.velocity(wake, lattice, placement, marks, model.wake_points)
    sizes = [g.panels.stop - g.panels.start for g in lattice.grids]
    foreign = np.concatenate([u[:k] for u, k in zip(other, sizes)])
    everything = np.concatenate([u[:k] + v[:k] for u, v, k in zip(own, other, sizes)])
    at_edges = np.concatenate([u[k:] + v[k:] for u, v, k in zip(own, other, sizes)])

    response = flow.response
    direction = wake_direction(onset.velocity_G)
    if direction @ response.direction < math.cos(REFRESH_ANGLE):
        response = _own_response(model, direction)
    boundary = _boundary(model, onset, deflections)
    wash = model.crossing @ flow.circulation + np.einsum('ij,ij->i', foreign, lattice.normal)
    operating = _decamber(model, boundary, response.response, wash, flow.delta)

    normalwash = _normalwash(model, boundary, operating.delta) \
        + np.einsum('ij,ij->i', everything, lattice.normal)
    circulation = _strip_theory(
        model, boundary, operating.delta, -model.bound_inverse @ normalwash)
    # A faded strip has the circulation of strip theory, which in reversed flow answers the
    # normalwash with the other sign; the air that the plate carries along does not.
    bare = -model.bound_inverse @ boundary.level
    fade = boundary.fade[lattice.panel_strip]
    rate = fade * _rate(circulation, flow.circulation, flow.previous, flow.steps, dt) \
        + (1.0 - fade) * _rate(bare, flow.bare, flow.previous_bare, flow.steps, dt)
    at_te = circulation[lattice.te_panel]
    row = wake.circulation[0] + (1.0 - boundary.fade) * at_te
    result = _result(
        model, onset, boundary, operating, circulation, row, at_edges, density, rate)
    return FlowState(
        wake=wake, circulation=circulation, previous=flow.circulation, bare=bare,
        previous_bare=flow.bare, shed=boundary.fade * at_te, delta=operating.delta,
        response=response, steps=flow.steps + 1), result


def _rate(new: FloatArray, old: FloatArray, older: FloatArray, steps: int,
          dt: float) -> FloatArray:
    """Return d/dt by backward differences, of the order that the steps so far allow."""
    if steps == 0:
        return np.zeros_like(new)
    if steps == 1:
        return (new - old) / dt
    return (3.0 * new - 4.0 * old + older) / (2.0 * dt)
