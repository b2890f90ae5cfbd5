# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The job of the command `derivatives`: stability and control derivatives as plain results.

As in `jobs`, what is returned is what ``--json`` writes. A derivative that cannot be had, at a
fold of the decambering or where a solution does not converge, is None.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from enum import Enum

import numpy as np

from poststall_sim import jobs
from poststall_sim import polar as polars
from poststall_sim.aero.model import Model
from poststall_sim.frames import velocity_from_flow_angles
from poststall_sim.stability import derivatives
from poststall_sim.state import Status


class Axes(Enum):
    """About which axes moments and rates are."""

    BODY = 'body'
    STABILITY = 'stability'


AXES = {
    Axes.BODY: 'CL, CD: stability axes, which turn with alpha; CY, Cl, Cm, Cn: body axes, x '
               'forward, y right, z down; moments and rates about the reference point',
    Axes.STABILITY: 'stability axes, which turn with alpha, x forward in the wind, y right, z '
                    'down; moments and rates about the reference point'}
UNITS = ('by alpha, beta and each control [1/rad]; by p (p b/2V), q (q c/2V), r (r b/2V) [-]; '
         'static_margin [reference chords], neutral_point_x_m [m] aft in the drawing')
_RATES = {'p': 'p b/2V', 'q': 'q c/2V', 'r': 'r b/2V'}
LEFT_OUT = ('derivatives by the rate of alpha: the loads are steady; lag of the wake and added '
            'mass are in the linear systems of poststall modes; engines and their slipstreams')
_LEAST_SLOPE = 0.1
"""Of lift over alpha [1/rad]: below, past the stall, there is no neutral point to speak of."""


def along(model: Model, alphas: Sequence[float], *, beta: float, deflected: np.ndarray,
          airspeed: float, altitude: float,
          axes: Axes = Axes.BODY) -> Iterator[jobs.Result]:
    """
    Yield coefficients and derivatives at each alpha [rad], each on the branch of the one before.

    beta [rad], deflected (controls,) [rad], airspeed [m/s], altitude [m]. Moments and rates are
    about axes through the centre of gravity of the model's aircraft.
    """
    air = model.atmosphere.at(altitude)
    flown = model.at(airspeed, air.kinematic_viscosity, deflected)
    conditions = jobs.conditions(alphas, beta=beta, rates=np.zeros(3), deflected=deflected)
    for point in polars.sweep(flown, conditions, airspeed=airspeed, density=air.density):
        alpha = point.condition.alpha
        found = derivatives.about(
            flown, velocity_B=velocity_from_flow_angles(airspeed, alpha, beta),
            deflections=deflected, delta0=point.aero.strips.delta, density=air.density,
            viscosity=air.kinematic_viscosity)
        coefficients, changes = asdict(point.coefficients), found.coefficients
        if axes is Axes.STABILITY:
            coefficients, changes = _about_stability_axes(coefficients, changes, alpha)
        yield {'alpha_deg': round(math.degrees(alpha), 10),
               'coefficients': coefficients, 'CDi_far': point.induced_far,
               'stalled_strips': int(np.count_nonzero(point.aero.strips.stalled)),
               'derivatives': {key: float(value) if math.isfinite(value) else None
                               for key, value in changes.items()},
               **_neutral_point(model, found.coefficients),
               'status': found.status.name.lower(), 'message': found.message,
               'max_residual': float(found.max_residual)
               if math.isfinite(found.max_residual) else None}


def _about_stability_axes(coefficients: Mapping[str, float], changes: Mapping[str, float],
                          alpha: float) -> tuple[dict[str, float], dict[str, float]]:
    """Return coefficients and derivatives with roll and yaw, and their rates, about such axes."""
    c, s = math.cos(alpha), math.sin(alpha)

    def turned(values: Mapping[str, float], by: str) -> dict[str, float]:
        roll, yaw = values[f'Cl{by}'], values[f'Cn{by}']
        return {f'Cl{by}': c * roll + s * yaw, f'Cn{by}': c * yaw - s * roll}

    coefficients = {**coefficients, **turned(coefficients, '')}
    changes = dict(changes)
    for key in jobs.COEFFICIENTS:
        p, r = changes[f'{key}_p'], changes[f'{key}_r']
        changes[f'{key}_p'], changes[f'{key}_r'] = c * p + s * r, c * r - s * p
    for name in (key[3:] for key in tuple(changes) if key.startswith('Cl_')):
        changes |= turned(changes, f'_{name}')
    # The axes turn with alpha under a moment that stays.
    changes['Cl_alpha'] += coefficients['Cn']
    changes['Cn_alpha'] -= coefficients['Cl']
    return coefficients, changes


def _neutral_point(model: Model, coefficients) -> jobs.Result:
    """Return the static margin, and where the pitching moment does not change with alpha."""
    slope, moment = coefficients['CL_alpha'], coefficients['Cm_alpha']
    if not (math.isfinite(moment) and slope > _LEAST_SLOPE):
        return {'static_margin': None, 'neutral_point_x_m': None}
    margin = -moment / slope
    aircraft = model.aircraft
    return {'static_margin': margin,
            'neutral_point_x_m': aircraft.mass.cg_G[0] + margin * aircraft.reference.chord}


def variables(point: jobs.Result) -> list[str]:
    """Return what a point's coefficients are derived by, in order."""
    return [key.partition('_')[2] for key in point['derivatives'] if key.startswith('CL_')]


def block(point: jobs.Result) -> tuple[str, tuple[str, ...], list[list[str]]]:
    """Return title, head and rows of a point: its coefficients, then a row by each variable."""
    head = ('', *jobs.COEFFICIENTS)
    rows = [['', *(f'{point["coefficients"][key]:z.4f}' for key in jobs.COEFFICIENTS)]]
    rows += [[f'by {_RATES.get(name, f"{name} [1/rad]")}',
              *(_cell(point['derivatives'][f'{key}_{name}']) for key in jobs.COEFFICIENTS)]
             for name in variables(point)]
    title = f'alpha {point["alpha_deg"]:g} deg, {point["stalled_strips"]} strips stalled'
    title += f', induced drag far behind CDi_far = {point["CDi_far"]:.5f}'
    if point['static_margin'] is not None:
        title += (f', static margin {100.0 * point["static_margin"]:z.1f} % of the reference '
                  f'chord in this flow, neutral point x = {point["neutral_point_x_m"]:z.3f} m')
    if point['status'] != Status.CONVERGED.name.lower():
        title += f'; {point["message"]}'
    return title, head, rows


def _cell(value: float | None) -> str:
    return '-' if value is None else f'{value:z.4f}'
