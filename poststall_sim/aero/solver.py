# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Aerodynamics of one instant and of one step: the only place that orders the parts.

`steady` and `advance` use a `Model` and change nothing in it. Both find the decambering from a
steady problem at the present onset: in the march each surface with its own straight wake plus
the wash of the other surfaces and their wakes as they are. Taking it from the bound matrix
alone, with the wake held, looks natural and flutters past stall: within one step the lattice
answers a change of decambering with a fraction of its final lift only.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import lu_solve

from poststall_sim import fuselage
from poststall_sim.aero import images, loads, separation, wash
from poststall_sim.aero import wake as wakes
from poststall_sim.aero.flaps import look_up
from poststall_sim.aero.lattice import Lattice
from poststall_sim.aero.model import (
    Model,
    Onset,
    StripResponse,
    crossing,
    far_velocity,
    own_response,
    wake_direction,
)
from poststall_sim.aero.operating import (
    NO_PATH,
    Boundary,
    Operating,
    boundary_condition,
    decamber,
    lagging,
    lattice_operator,
    normalwash,
    steady_problem,
    with_strip_theory,
)
from poststall_sim.aero.polars import sections
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.wake import Placement, Shape, Wake
from poststall_sim.frames import FloatArray
from poststall_sim.state import Status, Strips

REFRESH_ANGLE = math.radians(0.5)
"""The strip operator is made anew when the onset has turned by more."""


@dataclass(frozen=True, slots=True, eq=False)
class FlowState:
    """
    What the flow remembers from step to step.

    circulation, previous : (p,) of this step and the one before; bare, previous_bare : (p,) those
    of the undeflected lattice without a wake; shed : (n,) what the trailing edges leave to the
    next row; delta : (n,) [rad]; share, mean, angle : (n,) see `separation.relaxed`; steps :
    since the start, the order of dG/dt builds up with it.
    """

    wake: Wake
    circulation: FloatArray
    previous: FloatArray
    bare: FloatArray
    previous_bare: FloatArray
    shed: FloatArray
    delta: FloatArray
    share: FloatArray
    mean: FloatArray
    angle: FloatArray
    response: StripResponse
    row_G: FloatArray
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


def _result(model: Model, onset: Onset, boundary: Boundary, operating: Operating,
            circulation: FloatArray, row: FloatArray, induced: FloatArray, density: float,
            rate: FloatArray | None) -> AeroResult:
    """
    Return loads and strips of a flow.

    circulation (p,); row (n,) of the wake row at the trailing edge; induced (s, 3) velocity of
    the wake at the edges' middles; rate (p,) dG/dt or None in steady flow.
    """
    lattice, settings = model.lattice, model.settings
    n = lattice.strips
    matrix = model.edge_influence if rate is None else model.edge_rounded
    bound = matrix @ circulation.astype(matrix.dtype)
    velocity, strength = np.empty_like(lattice.edge_vector), np.empty(len(lattice.edge_vector))
    loads.edge_flow(
        onset.at(model.edge_arm), induced, bound, boundary.fade, lattice.edge_strip, circulation,
        row, lattice.edge_plus, lattice.edge_minus, lattice.edge_wake, velocity, strength)
    total = np.zeros(6)
    loads.lattice_force(density, strength, velocity, lattice.edge_vector, model.edge_arm, total)
    if rate is not None:
        loads.added_mass_force(
            density, rate, lattice.area, lattice.normal, model.collocation_arm, total)
    looked_up, left, fall = np.empty((3, n))
    look_up(operating.alpha, boundary.strips, looked_up, left, fall)
    stalled = (looked_up > lattice.stall_high) | (looked_up < lattice.stall_low)
    if not settings.decambering:
        looked_up = np.clip(looked_up, lattice.stall_low, lattice.stall_high)
        stalled = np.zeros(n, dtype=bool)
    values = np.empty((n, 4))
    sections(lattice.curves, lattice.polar_index, looked_up, values)
    # The lattice has the flaps' own moment whole, as far as a strip is one of the lattice: what
    # separation takes of it is taken here.
    moment = values[:, 2] \
        - (1.0 - left) * boundary.fade * (boundary.angles @ lattice.load_moment)
    loads.section_force(
        density, operating.alpha - boundary.pivot, operating.speed, values[:, 1], moment,
        lattice.strip_chord, lattice.strip_width, lattice.chord_axis, lattice.strip_normal,
        lattice.moment_axis, model.quarter_arm, total)
    aircraft = model.aircraft
    if aircraft.bodies:
        total += fuselage.load(aircraft.bodies, aircraft.mass.cg_G, onset.at, density)
    worst = float(np.abs(operating.residual).max())
    status = Status.CONVERGED if worst <= settings.tolerance else Status.NOT_CONVERGED
    if not (np.isfinite(total).all() and math.isfinite(worst)):
        status = Status.DIVERGED
    lift = 2.0 * operating.circulation / (np.maximum(operating.speed, 1e-12) * lattice.strip_chord)
    return AeroResult(
        force_G=total[:3], moment_G=total[3:], circulation=circulation,
        strips=Strips(alpha=operating.alpha, cl=lift, cd=values[:, 1], cm=moment,
                      delta=operating.delta, circulation=operating.circulation,
                      residual=operating.residual, stalled=stalled),
        status=status, iterations=operating.iterations, max_residual=worst,
        history=operating.history)


def steady(model: Model, onset: Onset, deflections: FloatArray, *, density: float,
           delta0: FloatArray | None = None, path: FloatArray = NO_PATH,
           angles: FloatArray | None = None) -> AeroResult:
    """
    Return loads and strips in steady flow, all surfaces and their straight wakes at once.

    deflections : (controls,) [rad]; angles : see `boundary_condition`; delta0 : (n,) where the
    decambering starts, 0 without; past stall the closure may have several solutions, and the
    start chooses among them.
    path (k, 2 n) : filled with the points (alpha, cl) of the first iterates of schemes A to D.
    """
    lattice = model.lattice
    problem = steady_problem(model, onset, deflections, angles)
    boundary = problem.boundary
    start = np.zeros(lattice.strips) if delta0 is None else delta0
    operating = decamber(model, boundary, problem.operator, start, path)
    circulation = -lu_solve(
        problem.factors, normalwash(model, boundary, operating.delta), check_finite=False)
    circulation = with_strip_theory(model, boundary, operating.delta, circulation)
    row = circulation[lattice.te_panel]
    induced = (far_velocity(lattice, problem.direction) @ row).reshape(-1, 3)
    return _result(
        model, onset, boundary, operating, circulation, row, induced, density, None)


def start(model: Model, onset: Onset, placement: Placement, deflections: FloatArray, *,
          density: float, dt: float, at_rest: bool = False,
          delta0: FloatArray | None = None,
          angles: FloatArray | None = None) -> tuple[FlowState, AeroResult]:
    """
    Return the flow that a march begins with, and its loads.

    From the steady solution with its straight wake; at_rest True: a wake without strength, the
    impulsive start. dt [s] sets the length of the wake's rows; angles : see
    `boundary_condition`.
    """
    lattice = model.lattice
    result = steady(model, onset, deflections, density=density, delta0=delta0, angles=angles)
    boundary = boundary_condition(model, onset, deflections, angles)
    fade = boundary.fade
    bare = -(model.bound_inverse @ boundary.level)
    step = first_row(model, onset, dt)
    rows = model.wake_rows(step)
    circulation = result.circulation
    if at_rest:
        # No wake yet. Half of what the first moment brings is shed before it, half after.
        circulation = with_strip_theory(
            model, boundary, result.strips.delta,
            -(model.bound_inverse @ normalwash(model, boundary, result.strips.delta)))
    shed = fade * circulation[lattice.te_panel]
    direction = wake_direction(onset.velocity_G)
    strength = np.zeros(lattice.strips) if at_rest else shed
    free = model.settings.wake is Shape.FREE
    if model.settings.wake is Shape.FROZEN:
        placement = Placement(np.zeros(3), np.eye(3))
    wake = wakes.straight(lattice, placement, step * direction, rows, strength,
                          1 + model.settings.free_rows if free else 1)
    mean = separation.mean_angle(
        boundary.strips, model.mean, result.strips.delta, result.strips.alpha)
    return FlowState(
        wake=wake, circulation=circulation, previous=circulation, bare=bare, previous_bare=bare,
        shed=0.5 * shed if at_rest else shed, delta=result.strips.delta,
        share=np.full(lattice.strips, math.nan), mean=mean,
        angle=separation.geometric_angle(boundary.strips),
        response=own_response(model, direction), row_G=step * direction,
        steps=0 if at_rest else 2), result


def first_row(model: Model, onset: Onset, dt: float) -> float:
    """Return how long the rows of a wake are that a march begins with [m]."""
    return max(onset.airspeed * dt, 0.02 * float(model.lattice.strip_chord.min()))


def advance(model: Model, flow: FlowState, onset: Onset, placement: Placement,
            deflections: FloatArray, *, density: float, dt: float, drift_N: FloatArray,
            drift_at: Callable[[FloatArray], FloatArray] | None = None,
            angles: FloatArray | None = None) -> tuple[FlowState, AeroResult]:
    """
    Return flow and loads one step later.

    The step goes from t to t + dt; onset, placement and deflections are those of t + dt. All
    surfaces have moved to ``placement``; the wake has drifted by drift_N (3,) [m] with the wind,
    and by drift_at(points (k, 3) in N) more where that differs from place to place. angles : see
    `boundary_condition`.
    """
    lattice, settings = model.lattice, model.settings
    if not settings.unsteady:
        result = steady(
            model, onset, deflections, density=density, delta0=flow.delta, angles=angles)
        return replace(flow, circulation=result.circulation, previous=flow.circulation,
                       delta=result.strips.delta, steps=flow.steps + 1), result
    wake_placement = placement
    if settings.wake is Shape.FROZEN:
        # As behind a body that goes on as at the start: in its axes the rows stay where they are.
        origin_N = flow.wake.moving_A[0, 0] - lattice.wake_nodes[0] - flow.row_G
        wake_placement, drift_N = Placement(origin_N, np.eye(3)), np.zeros(3)
    wake = wakes.shed(flow.wake, lattice, wake_placement, flow.shed, drift_N)
    if drift_at is not None and settings.wake is not Shape.FROZEN:
        wake = wake.carried(drift_at)
    if settings.wake is Shape.FREE and flow.steps % settings.free_every == 0:
        wake = wake.moved(settings.free_every * dt * images.own_velocity(
            wake, lattice, placement, flow.circulation, dt))
    induced, _ = wash.velocity(wake, lattice, model.felt, wake_placement, settings.coarsen)
    if settings.ground:
        at_points = images.ground_velocity(
            wake, lattice, placement, flow.circulation, placement.to_inertial(model.felt.points))
        induced[:, 3:] += at_points @ placement.rotation_NG
    everything, foreign, at_edges = wash.on_lattice(induced, model.felt, lattice.normal)

    response = flow.response
    direction = wake_direction(onset.velocity_G)
    if direction @ response.direction < math.cos(REFRESH_ANGLE):
        response = own_response(model, direction)
    boundary = boundary_condition(model, onset, deflections, angles)
    faded = not (boundary.fade == 1.0).all()
    if faded:
        response = response.with_far(lattice)
    operator = lattice_operator(
        model, boundary, response.response, foreign + crossing(model, flow.circulation))
    mean, angle = flow.mean, flow.angle
    if settings.separation is Separation.GOMAN_KHRABROV:
        boundary.strips[11] = separation.relaxed(
            flow.share, boundary.strips, flow.mean, flow.angle, lattice.curves,
            lattice.polar_index, dt, (settings.relaxation, settings.delay))
    operating = decamber(model, boundary, operator, flow.delta, NO_PATH)
    if settings.separation is Separation.GOMAN_KHRABROV:
        angle = separation.geometric_angle(boundary.strips)
        mean = separation.mean_angle(
            boundary.strips, model.mean, operating.delta, operating.alpha)
    elif settings.separation is Separation.LAG:
        operating = lagging(model, boundary, operator, operating, flow.delta,
                            boundary.strips[10] * dt / lattice.strip_chord)

    normal = normalwash(model, boundary, operating.delta) + everything
    both = np.empty((lattice.panels, 2))
    both[:, 0], both[:, 1] = normal, boundary.level
    attached, bare = -(model.bound_inverse @ both).T
    if faded:
        attached = _with_unshed(model, boundary, operating.delta, response.far, attached)
    circulation = with_strip_theory(model, boundary, operating.delta, attached)
    # A faded strip has the circulation of strip theory, which in reversed flow answers the
    # normalwash with the other sign; the air that the plate carries along does not.
    rate = _rate(circulation, flow.circulation, flow.previous, flow.steps, dt)
    if faded:
        fade = boundary.fade[lattice.panel_strip]
        rate = fade * rate \
            + (1.0 - fade) * _rate(bare, flow.bare, flow.previous_bare, flow.steps, dt)
        unshed = (1.0 - boundary.fade) * circulation[lattice.te_panel]
        at_edges = at_edges + (response.far_edges @ unshed).reshape(-1, 3)
    at_te = circulation[lattice.te_panel]
    behind = wake.newest_length()
    share = te_share(lattice, 0.5 * (behind[lattice.te_node] + behind[lattice.te_node + 1]))
    row = at_te + share * (wake.moving_rings[0] - boundary.fade * at_te)
    result = _result(
        model, onset, boundary, operating, circulation, row, at_edges, density, rate)
    return FlowState(
        wake=wake, circulation=circulation, previous=flow.circulation, bare=bare,
        previous_bare=flow.bare, shed=boundary.fade * at_te, delta=operating.delta,
        share=boundary.strips[11], mean=mean, angle=angle,
        response=response, row_G=flow.row_G, steps=flow.steps + 1), result


def _with_unshed(model: Model, boundary: Boundary, delta: FloatArray, far: FloatArray,
                 circulation: FloatArray) -> FloatArray:
    """
    Return the lattice's circulation (p,) with straight wakes behind strips for what they keep.

    A strip sheds the share f of its blended circulation f G + (1 - f) P, with P that of the plate
    in strip theory; behind G in steady flow there is a straight wake of all of it. With F the
    straight wakes and T the trailing edges' rows, B G = -w - F (T G - f (f T G + (1 - f) P)).
    Nothing comes of it where f = 1.
    """
    fade, te = boundary.fade, model.lattice.te_panel
    plate = with_strip_theory(model, boundary, delta, np.zeros_like(circulation))[te]
    kept = model.bound_inverse @ far
    start = circulation + kept @ (fade * plate)
    share = 1.0 - fade * fade
    at_te = np.linalg.solve(np.eye(len(fade)) + kept[te] * share, start[te])
    return start - kept @ (share * at_te)


def te_share(lattice: Lattice, length: FloatArray) -> FloatArray:
    """
    Return the share (n,) of the trailing edge's vortex against its wake that carries load.

    length (n,) : of the newest row behind each strip [m]. The vortex stands a quarter panel
    behind the edge for all that is shed between a quarter panel ahead and the next row. With the
    whole of it the lift of a step is late by half a step, without it early by half a panel's
    time: half a panel over the row's length leaves the second order.
    """
    panel = lattice.strip_chord / lattice.grids[0].rows
    return 0.5 * panel / np.maximum(length, panel)


def _rate(new: FloatArray, old: FloatArray, older: FloatArray, steps: int,
          dt: float) -> FloatArray:
    """Return d/dt by backward differences, of the order that the steps so far allow."""
    if steps == 0:
        return np.zeros_like(new)
    if steps == 1:
        return (new - old) / dt
    return (3.0 * new - 4.0 * old + older) / (2.0 * dt)
