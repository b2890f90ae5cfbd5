# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The parameters of Gazebo's AdvancedLiftDrag plugin that come nearest to aerodynamic tables.

The plugin has, with sigma = 0 below the stall and 1 beyond it,

    CL = (1 - sigma) (CL0 + CLa alpha) + sigma 2 sign(alpha) sin^2(alpha) cos(alpha) + CLb beta
    CD = (1 - sigma) (CD0 + CL^2 / (pi AR eff)) + sigma CD_fp sin^2(alpha)
    Cm = Cem0 + Cema alpha up to the stall, then with the slope Cema_stall, + Cemb beta
    CY, Cl, Cn = (by alpha) alpha + (by beta) beta
    sigma = 1 / (1 + exp(-M (alpha - stall))) + 1 / (1 + exp(M (alpha + stall))), M = 15, the
    product of both less; CD_fp = 2 / (1 + exp(-0.224 - 0.115 AR))

and to each what is linear in p b/2V, q c/2V, r b/2V and in deflections, per degree. Lift and drag
are in stability axes, the others in body axes, beta is atan2(v, u) and the dynamic pressure that
of the motion in the plane of symmetry. M and CD_fp are fixed in the plugin.

The angle of stall is the one, of steps of 0.05 deg, from which the least squares of lift leave
least; all else is linear least squares, of drag without negative terms. What is linear at all
angles in the plugin is fitted up to the stall.

References
----------
K. Srivatsan, F. Markus: gz-sim, src/systems/advanced_lift_drag, revision 033d64c.

"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from poststall_sim.aircraft import ConfigError
from poststall_sim.buildup import COEFFICIENTS, BuildUp, Increment
from poststall_sim.frames import FloatArray

LEAST_ANGLES = 4
"""Angles of attack that a fit needs."""
SHARPNESS = 15.0
"""M of the plugin."""
_FLAT_PLATE = (-0.224, -0.115)
_STALLS = np.radians(np.arange(5.0, 60.0, 0.05))
_MOST_EFFICIENT = 10.0
"""Bound of the efficiency where drag does not grow with lift."""
_NAMES = {'CL': 'CL', 'CD': 'CD', 'CY': 'CY', 'Cl': 'Cell', 'Cm': 'Cem', 'Cn': 'Cen'}


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """
    Parameters by the plugin's names, of the whole and of each control [1/deg].

    rms, worst : of what the fit leaves of each coefficient over the base tables, up to the stall
    and over all angles, by name: (up to, all).
    """

    values: Mapping[str, float]
    controls: Mapping[str, Mapping[str, float]]
    rms: Mapping[str, tuple[float, float]]
    worst: Mapping[str, tuple[float, float]]


def blend(alpha: FloatArray, stall: float) -> FloatArray:
    """Return sigma of the plugin: 0 between -stall and stall, 1 beyond."""
    below = 1.0 / (1.0 + np.exp(-SHARPNESS * (alpha - stall)))
    above = 1.0 / (1.0 + np.exp(SHARPNESS * (alpha + stall)))
    return below + above - below * above


def lift_and_drag(values: Mapping[str, float], alpha: FloatArray,
                  beta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return CL and CD of the plugin, controls neutral and without rates."""
    sigma, ratio = blend(alpha, values['alpha_stall']), values['AR']
    plate = 2.0 * np.sign(alpha) * np.sin(alpha) ** 2 * np.cos(alpha)
    lift = (1.0 - sigma) * (values['CL0'] + values['CLa'] * alpha) + sigma * plate \
        + values['CLb'] * beta
    drag = (1.0 - sigma) * (values['CD0'] + lift ** 2 / (math.pi * ratio * values['eff'])) \
        + sigma * _flat_plate(ratio) * np.sin(alpha) ** 2
    return lift, drag


def moment(values: Mapping[str, float], alpha: FloatArray, beta: FloatArray) -> FloatArray:
    """Return Cm as the plugin's parameters mean it, see `gazebo_writer` on what it does."""
    inside = np.clip(alpha, -values['alpha_stall'], values['alpha_stall'])
    return values['Cem0'] + values['Cema'] * inside \
        + values['Cema_stall'] * (alpha - inside) + values['Cemb'] * beta


def fit(tables: BuildUp) -> Fit:
    """Return the parameters for tables, whose angles must reach up to some lift."""
    alpha, beta = (each.ravel() for each in np.meshgrid(
        tables.alpha, tables.beta, indexing='ij'))
    in_plane = np.cos(beta) ** 2
    target = dict(zip(COEFFICIENTS, tables.base.reshape(len(COEFFICIENTS), -1) / in_plane))
    beta = np.arctan2(np.sin(beta), np.cos(alpha) * np.cos(beta))
    level = np.abs(beta) < 1e-12
    if np.unique(alpha[level]).size < LEAST_ANGLES:
        raise ConfigError(
            f'the parameters of AdvancedLiftDrag need at least {LEAST_ANGLES} angles of attack')
    reference = tables.reference
    values = {'AR': reference.span ** 2 / reference.area, 'mac': reference.chord,
              'area': reference.area}
    stall, values['CL0'], values['CLa'] = _lift_curve(alpha[level], target['CL'][level])
    values['alpha_stall'] = stall
    attached = np.abs(alpha) <= stall
    values['CLb'] = 0.0
    lift, _ = lift_and_drag(values | {'CD0': 0.0, 'eff': 1.0}, alpha, beta)
    values['CLb'], = _least_squares(target['CL'] - lift, attached, beta)
    values |= _drag(values, alpha, beta, target['CD'])
    inside = np.clip(alpha, -stall, stall)
    every = np.full(alpha.shape, True)
    values |= dict(zip(('Cem0', 'Cema', 'Cema_stall', 'Cemb'), _least_squares(
        target['Cm'], every, np.ones_like(alpha), inside, alpha - inside, beta)))
    for key in ('CY', 'Cl', 'Cn'):
        name = _NAMES[key]
        values[f'{name}a'], values[f'{name}b'] = _least_squares(
            target[key], attached, alpha, beta)
    below = np.abs(tables.alpha) <= stall
    for rate, change in tables.rates.items():
        values |= {f'{_NAMES[key]}{rate}': slope
                   for key, slope in _slopes(change, below).items()}
    controls = {name: {f'{_NAMES[key]}_ctrl': slope * math.radians(1.0)
                       for key, slope in _slopes(change, below).items()}
                for name, change in tables.controls.items()}
    lift, drag = lift_and_drag(values, alpha, beta)
    found = {'CL': lift, 'CD': drag, 'Cm': moment(values, alpha, beta),
             **{key: values[f'{_NAMES[key]}a'] * alpha + values[f'{_NAMES[key]}b'] * beta
                for key in ('CY', 'Cl', 'Cn')}}
    left = {key: (found[key] - target[key]) * in_plane for key in COEFFICIENTS}
    return Fit(
        {key: float(value) for key, value in values.items()}, controls,
        {key: tuple(float(np.sqrt(np.mean(left[key][chosen] ** 2)))
                    for chosen in (attached, every)) for key in left},
        {key: tuple(float(np.abs(left[key][chosen]).max())
                    for chosen in (attached, every)) for key in left})


def _lift_curve(alpha: FloatArray, lift: FloatArray) -> tuple[float, float, float]:
    """Return the angle of stall [rad], CL0 and CLa."""
    plate = 2.0 * np.sign(alpha) * np.sin(alpha) ** 2 * np.cos(alpha)
    best = (math.inf, 0.0, 0.0, 0.0)
    for stall in _STALLS:
        if np.count_nonzero(np.abs(alpha) <= stall) < 3:
            continue
        sigma = blend(alpha, stall)
        columns = (1.0 - sigma)[:, None] * np.column_stack([np.ones_like(alpha), alpha])
        (zero, slope), *_ = np.linalg.lstsq(columns, lift - sigma * plate, rcond=None)
        left = float(np.sum((columns @ [zero, slope] + sigma * plate - lift) ** 2))
        best = min(best, (left, float(stall), float(zero), float(slope)))
    if not math.isfinite(best[0]):
        raise ConfigError('the parameters of AdvancedLiftDrag need angles of attack about 0')
    return best[1:]


def _drag(values: Mapping[str, float], alpha: FloatArray, beta: FloatArray,
          drag: FloatArray) -> dict[str, float]:
    """Return CD0 and eff."""
    lift, beyond = lift_and_drag(values | {'CD0': 0.0, 'eff': math.inf}, alpha, beta)
    share = 1.0 - blend(alpha, values['alpha_stall'])
    scale = 1.0 / (math.pi * values['AR'])
    (zero, growth), _ = nnls(
        share[:, None] * np.column_stack([np.ones_like(alpha), scale * lift ** 2]), drag - beyond)
    return {'CD0': zero, 'eff': min(1.0 / growth, _MOST_EFFICIENT) if growth else _MOST_EFFICIENT}


def _flat_plate(ratio: float) -> float:
    return 2.0 / (1.0 + math.exp(_FLAT_PLATE[0] + _FLAT_PLATE[1] * max(ratio, 1.0 / ratio)))


def _least_squares(target: FloatArray, chosen: np.ndarray, *columns: FloatArray) -> FloatArray:
    """Return factors (k,) of columns; 0 of one that never changes from 0."""
    matrix = np.column_stack(columns)[chosen]
    return np.linalg.lstsq(matrix, target[chosen], rcond=1e-12)[0]


def _slopes(change: Increment, below: np.ndarray) -> dict[str, float]:
    """Return each coefficient's slope through zero over x, of the angles chosen (n,)."""
    squares = below.sum() * np.sum(change.x ** 2)
    return {key: float(np.sum(each[below] * change.x) / squares)
            for key, each in zip(COEFFICIENTS, change.change)}
