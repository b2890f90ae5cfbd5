# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Stability derivatives from steady loads, and the classical equations of small motions with them.

The quasi-steady cross-check of modes that come from the unsteady lattice. Loads are those of the
steady lattice with its decambering converged anew at each change of the motion, so that they know
nothing of how fast it changes: derivatives with respect to the rate of the angle of attack
(CL_alpha_dot, Cm_alpha_dot), the lag of wake and separation and the added mass are not in them.

Axes and signs are those of `frames`: alpha = atan2(w, u), beta = asin(v / V); rates p, q, r about
the body axes through the centre of gravity, not about stability axes.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from poststall_sim.aero import solver
from poststall_sim.aero.decambering import wrap
from poststall_sim.aero.model import Model, Onset
from poststall_sim.aero.schemes import Start
from poststall_sim.aero.solver import AeroResult
from poststall_sim.aircraft import Aircraft, Reference, read_only
from poststall_sim.frames import (
    FloatArray,
    body_to_geometry,
    body_to_stability,
    cross,
    flow_angles,
    geometry_to_body,
)
from poststall_sim.polar import APART
from poststall_sim.slipstream import Gust
from poststall_sim.stability.bodies import Body
from poststall_sim.stability.modes import LATERAL, LONGITUDINAL
from poststall_sim.state import Status
from poststall_sim.trim import ACCEPTED, TIGHT, Trim, onset_of

STEP = 1e-4
"""Change of an angle [rad], of a velocity over V, and of p b/2V, q c/2V, r b/2V: differences of
smooth curves are then good to 1e-6 or so, and what the solver leaves is far below."""
_MOTION = ('u', 'v', 'w', 'p', 'q', 'r')


@dataclass(frozen=True, slots=True, eq=False)
class Derivatives:
    """
    How steady loads change about a straight motion, such as a trim.

    loads (6,) : aerodynamic force [N] and moment about the centre of gravity [N m] in B,
    there; motion (6, 6) : their change with (u, v, w) [per m/s] and (p, q, r) [per rad/s] in B;
    controls (6, k) [per rad], in the order
    of ``aircraft.control_names``. Columns without a trustworthy difference are NaN, the status is
    then not CONVERGED and message says why; max_residual : the worst of the closure in all
    solutions [rad].

    coefficients : by name, such as Cm_q or CY_beta, those of `polar.Coefficients`: CL and CD in
    stability axes, which turn with alpha; CY and the moments Cl, Cm, Cn about the centre of
    gravity in body axes. Each is derived, at constant airspeed, by alpha and beta [per rad], by
    p b/2V, q c/2V, r b/2V about the body axes [-], and by each control, Cm_elevator [per rad].
    """

    loads: FloatArray
    motion: FloatArray
    controls: FloatArray
    coefficients: Mapping[str, float]
    status: Status
    message: str
    max_residual: float

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for key in ('loads', 'motion', 'controls'):
            object.__setattr__(self, key, read_only(getattr(self, key)))


def quasi_steady(model: Model, trim: Trim, *, density: float, step: float = STEP) -> Derivatives:
    """
    Return the derivatives about a trim, in straight flight; see `about`.

    A trim may have its throttle or elevator out of reach; where it does not balance, the
    derivatives are given and the status says that it does not.
    """
    found = about(model, velocity_B=trim.velocity_B, deflections=trim.controls.deflections,
                  delta0=trim.aero.strips.delta, density=density, step=step,
                  gust=onset_of(model, trim, density).gust)
    if np.abs(trim.residual).max() <= ACCEPTED and trim.aero.status is Status.CONVERGED:
        return found
    complaints = [f'the trim: {trim.message}']
    if found.status is not Status.CONVERGED:
        complaints.append(found.message)
    status = Status.DIVERGED if found.status is Status.DIVERGED else Status.NOT_CONVERGED
    return replace(found, status=status, message='; '.join(complaints))


def about(model: Model, *, velocity_B: FloatArray, deflections: FloatArray, delta0: FloatArray,
          density: float, step: float = STEP, viscosity: float | None = None,
          gust: Gust | None = None) -> Derivatives:
    """
    Return the derivatives about any straight motion by central differences of steady loads.

    Every solution starts from one decambering, so that all are on its branch, and is converged to
    `trim.TIGHT`. A difference is refused where a solution does not converge, or where the
    decambering of a strip changes on one side by `polar.APART` more than on the other: at
    a fold, behind which the branch does not go on, it goes to another one.

    Parameters
    ----------
    model : Model
        With the section curves of the motion, see `Model.at`.
    velocity_B : (3,) array
        Through the air [m/s].
    deflections : (controls,) array
        [rad].
    delta0 : (n,) array
        Decambering of the steady solution there [rad].
    density : float
        Of the air [kg/m^3].
    step : float
        Change over V, of an angle [rad], and of a rate without units [-].
    viscosity : float
        Kinematic, of the air [m^2/s]: with it sections whose curves change with a flap do so
        under each change of a control; without, they keep those of the model.
    gust : function, optional
        What the air has more, as the slipstream of a trim, see `Onset`: held.

    Returns
    -------
    Derivatives
        With their status.

    References
    ----------
    B. Etkin, L. D. Reid, Dynamics of Flight, 3rd ed., 1996, ch. 4 and 5.

    """
    settings = model.settings
    model = replace(model, settings=replace(
        settings, start=Start.GIVEN, tolerance=min(TIGHT, settings.tolerance)))
    nu, airspeed = np.append(velocity_B, np.zeros(3)), float(np.linalg.norm(velocity_B))

    def solved(change: FloatArray) -> AeroResult:
        moved, deflected = nu + change[:6], deflections + change[6:]
        onset = Onset(body_to_geometry(-moved[:3]), body_to_geometry(moved[3:]), gust)
        flown = model if viscosity is None else model.at(airspeed, viscosity, deflected)
        return solver.steady(flown, onset, deflected, density=density, delta0=delta0)

    reference = model.aircraft.reference
    steps = step * np.concatenate(
        [np.full(3, airspeed), _rate_units(reference, airspeed), np.ones(deflections.size)])
    middle = solved(np.zeros(steps.size))
    columns, complaints, residuals = [], [], [middle.max_residual]
    for name, change in zip((*_MOTION, *model.aircraft.control_names), np.diag(steps)):
        low, high = solved(-change), solved(change)
        residuals += [low.max_residual, high.max_residual]
        column = (_load(high) - _load(low)) / (2.0 * change.sum())
        complaint = _complaint(low, middle, high)
        if complaint:
            complaints.append(f'{name}: {complaint}')
        columns.append(np.full(6, math.nan) if complaint else column)
    matrix, loads = np.column_stack(columns), _load(middle)
    worst = float(np.max(residuals))
    status = Status.NOT_CONVERGED if complaints else Status.CONVERGED
    if not (math.isfinite(worst) and np.isfinite(loads).all()):
        status = Status.DIVERGED
    return Derivatives(
        loads=loads, motion=matrix[:, :6], controls=matrix[:, 6:],
        coefficients=_coefficients(model.aircraft, velocity_B, loads, matrix, density),
        status=status, message='; '.join(complaints) or 'converged', max_residual=worst)


def _load(aero: AeroResult) -> FloatArray:
    return np.concatenate([geometry_to_body(aero.force_G), geometry_to_body(aero.moment_G)])


def _rate_units(reference: Reference, airspeed: float) -> FloatArray:
    """Return the p, q, r [rad/s] at which p b/2V, q c/2V and r b/2V are 1."""
    return 2.0 * airspeed / np.array([reference.span, reference.chord, reference.span])


def _complaint(low: AeroResult, middle: AeroResult, high: AeroResult) -> str:
    """Return what keeps the difference of two solutions from being used, '' if nothing does."""
    for aero in (low, middle, high):
        if aero.status is not Status.CONVERGED:
            return f'a solution did not converge, residual {aero.max_residual:.1e}'
    uneven = float(np.abs(wrap(
        high.strips.delta + low.strips.delta - 2.0 * middle.strips.delta)).max())
    if uneven > APART:
        return (f'the decambering changes by {math.degrees(uneven):.2g} deg more on one side than '
                'on the other: the branch ends at a fold')
    return ''


def _coefficients(aircraft: Aircraft, velocity_B: FloatArray, loads: FloatArray,
                  matrix: FloatArray, density: float) -> dict[str, float]:
    """Return the derivatives of the coefficients, from loads (6,) and their change (6, 6 + k)."""
    (airspeed, alpha, beta), reference = flow_angles(velocity_B), aircraft.reference
    u, _, w = velocity_B
    by_alpha = matrix[:, 2] * u - matrix[:, 0] * w
    # What stability axes see of a load that stays as it is in B, while they turn.
    by_alpha[:3] += cross(np.array([0.0, 1.0, 0.0]), loads[:3])
    by_beta = airspeed * math.cos(beta) * matrix[:, 1] - math.tan(beta) * (
        u * matrix[:, 0] + w * matrix[:, 2])
    rates = matrix[:, 3:6] * _rate_units(reference, airspeed)
    by = {'alpha': by_alpha, 'beta': by_beta, 'p': rates[:, 0],
          'q': rates[:, 1], 'r': rates[:, 2], **dict(zip(aircraft.control_names,
                                                         matrix[:, 6:].T))}
    area = 0.5 * density * airspeed ** 2 * reference.area
    result = {}
    for name, change in by.items():
        drag, side, lift = body_to_stability(change[:3], alpha) / area
        roll, pitch, yaw = change[3:] / area
        values = {'CL': -lift, 'CD': -drag, 'CY': side, 'Cl': roll / reference.span,
                  'Cm': pitch / reference.chord, 'Cn': yaw / reference.span}
        result.update({f'{key}_{name}': float(value) for key, value in values.items()})
    return result


def state_matrix(body: Body, loads: FloatArray,
                 added_mass: FloatArray | None = None) -> FloatArray:
    """
    Return A (m, m) of dy/dt = A y for a body of m states in quasi-steady air.

    loads (6, 6) : of the air by nu, such as `Derivatives.motion`; added_mass (6, 6) : in B about
    the centre of gravity [kg, kg m, kg m^2], none without. Of a free body the blocks of four that
    `longitudinal` and `lateral` take are those of the textbooks.
    """
    mass = body.mass
    if added_mass is not None:
        mass = mass + body.push @ added_mass @ body.motion
    return np.linalg.solve(mass, body.push @ loads @ body.motion + body.rest)


def longitudinal(matrix: FloatArray) -> FloatArray:
    """Return the block (4, 4) of (u, w, q, theta) of the matrix (9, 9) of all states."""
    return matrix[np.ix_(LONGITUDINAL, LONGITUDINAL)]


def lateral(matrix: FloatArray) -> FloatArray:
    """Return the block (4, 4) of (v, p, r, phi) of the matrix (9, 9) of all states."""
    return matrix[np.ix_(LATERAL, LATERAL)]
