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

from poststall_sim.aero import loads, schemes
from poststall_sim.aero import wake as wakes
from poststall_sim.aero.decambering import (
    AngleForm,
    Closure,
    alpha_slopes,
    nonlocal_jacobian,
    nonlocal_residual,
    operating_points,
    strip_operator,
)
from poststall_sim.aero.model import (
    Model,
    Onset,
    StripResponse,
    far_normalwash,
    far_rings,
    influence,
    own_response,
    wake_direction,
)
from poststall_sim.aero.polars import sections
from poststall_sim.aero.schemes import Scheme, Start
from poststall_sim.aero.wake import Placement, Wake
from poststall_sim.frames import FloatArray
from poststall_sim.state import Status, Strips

FADE_BEGIN, FADE_END = math.cos(math.radians(60.0)), math.cos(math.radians(75.0))
"""A strip whose flow leaves the chord by more fades from the lattice into strip theory."""
REFRESH_ANGLE = math.radians(0.5)
"""The strip operator is made anew when the onset has turned by more."""
SLOWEST_SHARE, SLOWEST_SPEED = 0.05, 0.5
"""A strip below this share of the airspeed, or of 0.5 m/s, keeps its decambering."""


@dataclass(frozen=True, slots=True, eq=False)
class FlowState:
    """
    What the flow remembers from step to step.

    circulation, previous : (p,) of this step and the one before; shed : (n,) what the trailing
    edges leave to the next row; delta : (n,) [rad]; steps : since the start, the order of
    dG/dt builds up with it.
    """

    wake: Wake
    circulation: FloatArray
    previous: FloatArray
    shed: FloatArray
    delta: FloatArray
    response: StripResponse
    steps: int


@dataclass(frozen=True, slots=True, eq=False)
class AeroResult:
    """
    Force [N] and moment about the centre of gravity [N m] in G, strips, and how it went.

    history (iterations + 1,) : max |residual| at the start and after each iteration.
    """

    force_G: FloatArray
    moment_G: FloatArray
    circulation: FloatArray
    strips: Strips
    status: Status
    iterations: int
    max_residual: float
    history: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Boundary:
    """
    The onset at the lattice with controls set.

    level, turned (p,) : w = level cos th + turned sin th; strips (11, n) : see
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
    strips = np.empty((11, lattice.strips))
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
    strips[8], strips[9] = np.cos(-shift), np.sin(-shift)
    strips[10] = np.maximum(speed, 1e-12)
    airspeed = float(np.linalg.norm(onset.velocity_G))
    strips[7] = speed > SLOWEST_SHARE * max(airspeed, SLOWEST_SPEED)
    if model.settings.angle_form is AngleForm.LINEAR:
        # w = V (alpha + theta), V that of a stream along x at zero incidence.
        stream = airspeed * lattice.tangent[:, 0]
        strips[0], strips[1], strips[3] = airspeed * lattice.chord_axis[:, 0], 0.0, 1.0
        return _Boundary(stream * (np.arctan2(level, turned) + turn), stream, strips)
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
    history: FloatArray


def _decamber(model: Model, boundary: _Boundary, operator: FloatArray,
              start: FloatArray, path: FloatArray) -> _Operating:
    """
    Return the operating points by the closure in the settings.

    operator (n, 2 n + 1) : see `operating_points`; start (n,) : delta where Start.GIVEN begins;
    path (k, 2 n) : filled with the points (alpha, cl) of the first k iterates of schemes A to D.
    """
    lattice, settings = model.lattice, model.settings
    n = lattice.strips
    linear = settings.angle_form is AngleForm.LINEAR
    alpha, circulation, speed, residual = (np.zeros(n) for _ in range(4))
    delta = np.array(start) if settings.start is Start.GIVEN else np.zeros(n)
    curves = (lattice.curves, lattice.polar_index)
    found = (alpha, circulation, speed, residual)
    history = np.zeros(settings.limit + 1)
    iterations = 0
    if not settings.decambering:
        delta[:] = 0.0
        operating_points(delta, boundary.strips, operator, linear, alpha, circulation, speed)
    elif settings.closure is Closure.NONLOCAL:
        iterations = schemes.newton(
            delta, boundary.strips, operator, linear, *curves, model.mean, settings.tolerance,
            settings.limit, *found, history)
    elif settings.scheme is Scheme.ROBUST:
        inverse, level = np.empty((n, n)), np.empty((n, n + 1))
        schemes.prepare(boundary.strips, operator, linear, inverse, level)
        iterations = schemes.robust(
            delta, boundary.strips, operator, inverse, level, linear, *curves, lattice.mirror,
            settings.tolerance, settings.limit, *found, history)
    else:
        iterations = schemes.relaxation(
            delta, boundary.strips, operator, linear, *curves,
            model.trajectory[settings.scheme], settings.scheme is Scheme.C, settings.damping,
            settings.start is Start.SCHEME_A,
            lattice.mirror if settings.symmetric else np.arange(n),
            settings.tolerance, settings.limit, *found, history, path)
    return _Operating(delta, *found, iterations, history[:iterations + 1])


def _operator(model: Model, boundary: _Boundary, response: FloatArray,
              wash: FloatArray) -> FloatArray:
    """Return the map (n, 2 n + 1) from decambering to circulation, see `operating_points`."""
    n = model.lattice.strips
    operator = np.empty((n, 2 * n + 1))
    strip_operator(response, boundary.level, boundary.turned, wash, model.lattice.panel_strip,
                   operator)
    return operator


def _normalwash(model: Model, boundary: _Boundary, delta: FloatArray) -> FloatArray:
    """Return the onset's normalwash w (p,) on panels turned by delta, controls and camber."""
    theta = (delta - model.lattice.zero_lift)[model.lattice.panel_strip]
    if model.settings.angle_form is AngleForm.LINEAR:
        return boundary.level + boundary.turned * theta
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
        status=status, iterations=operating.iterations, max_residual=worst,
        history=operating.history)


@dataclass(frozen=True, slots=True, eq=False)
class SteadyProblem:
    """
    The decambering of one steady onset, before it is solved.

    strips (11, n), operator (n, 2 n + 1) : see `operating_points`; factors : of the steady matrix;
    direction (3,) of the straight wake.
    """

    boundary: _Boundary
    operator: FloatArray
    factors: tuple
    direction: FloatArray


def steady_problem(model: Model, onset: Onset, deflections: FloatArray) -> SteadyProblem:
    """Return the decambering problem of all surfaces and their straight wakes at once."""
    direction = wake_direction(onset.velocity_G)
    far = far_normalwash(model.lattice, direction)
    # A value that is not finite goes through to the status; a step never raises.
    factors = lu_factor(model.bound + far @ model.te_rows, check_finite=False)
    response = lu_solve(factors, model.te_rows.T, trans=1, check_finite=False).T
    boundary = _boundary(model, onset, deflections)
    operator = _operator(
        model, boundary, np.ascontiguousarray(response), np.zeros(model.lattice.panels))
    return SteadyProblem(boundary, operator, factors, direction)


NO_PATH = np.empty((0, 0))


def steady(model: Model, onset: Onset, deflections: FloatArray, *, density: float,
           delta0: FloatArray | None = None, path: FloatArray = NO_PATH) -> AeroResult:
    """
    Return loads and strips in steady flow, all surfaces and their straight wakes at once.

    deflections : (controls,) [rad]; delta0 : (n,) where the decambering starts, 0 without;
    past stall the closure may have several solutions, and the start chooses among them.
    path (k, 2 n) : filled with the points (alpha, cl) of the first iterates of schemes A to D.
    """
    lattice = model.lattice
    problem = steady_problem(model, onset, deflections)
    boundary = problem.boundary
    start = np.zeros(lattice.strips) if delta0 is None else delta0
    operating = _decamber(model, boundary, problem.operator, start, path)
    circulation = -lu_solve(
        problem.factors, _normalwash(model, boundary, operating.delta), check_finite=False)
    circulation = _strip_theory(model, boundary, operating.delta, circulation)
    edge_owner = lattice.strip_surface[lattice.edge_strip[:, 0]]
    at_edges = influence(lattice, lattice.edge_middle, edge_owner,
                         far_rings(lattice, problem.direction), lattice.strip_surface)
    row = circulation[lattice.te_panel]
    return _result(model, onset, boundary, operating, circulation, row,
                   np.einsum('ijk,j->ik', at_edges, row), density, None)


def uniqueness(model: Model, problem: SteadyProblem, delta: FloatArray) -> float:
    """
    Return how far a solution stands from a fold: below 0 it may not be the only one.

    Non-local closure: min Re eig(dF/d delta). Local closure: min Re eig(I + W diag(a_v)) with W
    the induced angles and a_v the slopes of the sections' curves; below 0 no relaxation,
    however damped, stays there.
    """
    lattice, n = model.lattice, model.lattice.strips
    strips = problem.boundary.strips
    linear = model.settings.angle_form is AngleForm.LINEAR
    alpha, circulation, speed, residual = (np.empty(n) for _ in range(4))
    slope, jacobian = np.empty((n, n)), np.empty((n, n))
    operating_points(delta, strips, problem.operator, linear, alpha, circulation, speed)
    alpha_slopes(delta, strips, problem.operator, linear, circulation, speed, slope)
    if model.settings.closure is Closure.NONLOCAL:
        change = np.empty(n)
        nonlocal_residual(delta, strips, linear, lattice.curves, lattice.polar_index, model.mean,
                          alpha, residual, change)
        nonlocal_jacobian(strips, model.mean, change, slope, jacobian)
    else:
        values = np.empty((n, 4))
        sections(lattice.curves, lattice.polar_index, alpha + strips[6], values)
        ratio = 0.0 if linear else np.clip(values[:, 0] / schemes.TWO_PI, -0.999, 0.999)
        rate = values[:, 3] / np.sqrt(1.0 - ratio ** 2)
        induced = -np.linalg.solve((np.eye(n) + slope).T, slope.T).T / schemes.TWO_PI
        jacobian = np.eye(n) + induced * rate
    if not np.isfinite(jacobian).all():
        return math.nan
    return float(np.linalg.eigvals(jacobian).real.min())


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
    fade = _boundary(model, onset, deflections).fade
    speed = float(np.linalg.norm(onset.velocity_G))
    step = max(speed * dt, 0.02 * float(lattice.strip_chord.min()))
    rows = max(2, math.ceil(model.wake_length / step))
    shed = fade * result.circulation[lattice.te_panel]
    direction = wake_direction(onset.velocity_G)
    strength = np.zeros(lattice.strips) if at_rest else shed
    wake = wakes.straight(lattice, placement, step * direction, rows, strength)
    return FlowState(
        wake=wake, circulation=result.circulation, previous=result.circulation, shed=strength,
        delta=result.strips.delta, response=own_response(model, direction),
        steps=0 if at_rest else 2), result


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
        response = own_response(model, direction)
    boundary = _boundary(model, onset, deflections)
    wash = model.crossing @ flow.circulation + np.einsum('ij,ij->i', foreign, lattice.normal)
    operating = _decamber(model, boundary, _operator(model, boundary, response.response, wash),
                          flow.delta, NO_PATH)

    normalwash = _normalwash(model, boundary, operating.delta) \
        + np.einsum('ij,ij->i', everything, lattice.normal)
    circulation = _strip_theory(
        model, boundary, operating.delta, -model.bound_inverse @ normalwash)
    if flow.steps == 0:
        rate = np.zeros(lattice.panels)
    elif flow.steps == 1:
        rate = (circulation - flow.circulation) / dt
    else:
        rate = (3.0 * circulation - 4.0 * flow.circulation + flow.previous) / (2.0 * dt)
    at_te = circulation[lattice.te_panel]
    row = wake.circulation[0] + (1.0 - boundary.fade) * at_te
    result = _result(
        model, onset, boundary, operating, circulation, row, at_edges, density, rate)
    return FlowState(
        wake=wake, circulation=circulation, previous=flow.circulation,
        shed=boundary.fade * at_te, delta=operating.delta, response=response,
        steps=flow.steps + 1), result
