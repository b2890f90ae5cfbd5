# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The derivatives of what strips do: operating points, closure, loads of their sections.

All of them are by (nu, controls, decambering, wash) side by side, see `linear`, about the flow
that `aero.solver.steady` gives.
"""

import math
from dataclasses import dataclass

import numpy as np

from poststall_sim.aero import loads
from poststall_sim.aero.decambering import (
    Closure,
    faded_mean,
    mean_angles,
    potential_angle,
)
from poststall_sim.aero.flaps import look_up
from poststall_sim.aero.model import Model
from poststall_sim.aero.operating import Boundary
from poststall_sim.aero.polars import CD, CM, lift, sections
from poststall_sim.aero.solver import AeroResult
from poststall_sim.frames import FloatArray, geometry_to_body

FLIP = geometry_to_body(np.ones(3))


def passing_rate(arm: FloatArray) -> FloatArray:
    """Return the derivative (k, 3, 6) of `Onset.at` by (v, omega) of the body in B."""
    out = np.zeros((len(arm), 3, 6))
    out[:, :, :3] = -np.diag(FLIP)
    x, y, z = arm.T
    zero = np.zeros_like(x)
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]])
    out[:, :, 3:] = cross.transpose(2, 0, 1) * FLIP
    return out


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """
    Derivatives (n, k) of the strips' operating points, and their speed at_speed (n,) [m/s].

    shift : of the angle by which a flap moves the section's curve; pivot : by which an
    all-moving part turns the chord; flap_moment : of what separation takes of a flap's moment
    coefficient; looked_at (n,) : the angle [rad] at which the section's table is read, looked_up
    its derivative.
    """

    at_speed: FloatArray
    circulation: FloatArray
    alpha: FloatArray
    speed: FloatArray
    shift: FloatArray
    pivot: FloatArray
    flap_moment: FloatArray
    looked_at: FloatArray
    looked_up: FloatArray


def operating_points(model: Model, boundary: Boundary, aero: AeroResult,
                     circulation: FloatArray, widths: np.ndarray, moved: FloatArray) -> Points:
    """
    Return the derivatives of what `decambering.operating_points` gives.

    circulation (n, k) : its own derivative by (nu, controls, decambering, wash); widths (3,) :
    where each but the first begins; moved (parts, controls) : of the movable parts' angles.
    """
    lattice, strips = model.lattice, boundary.strips
    u, w, plate, theta = strips[0], strips[1], math.pi * strips[2], aero.strips.delta - strips[5]
    cosine, sine = np.cos(theta), np.sin(theta)
    air_nu = passing_rate(model.quarter_arm)
    ahead, up = np.cos(boundary.pivot)[:, None], np.sin(boundary.pivot)[:, None]
    along = np.einsum(
        'ic,icm->im', ahead * lattice.chord_axis - up * lattice.strip_normal, air_nu)
    across = np.einsum(
        'ic,icm->im', ahead * lattice.strip_normal + up * lattice.chord_axis, air_nu)
    turned, shift, pivot, flap_moment = np.zeros((4, *circulation.shape))
    by_control = slice(widths[0], widths[1])
    shift[:, by_control] = lattice.shift.T @ moved
    pivot[:, by_control] = lattice.pivot.T @ moved
    flap_moment[:, by_control] = lattice.load_moment.T @ moved
    turned[:, widths[1]:widths[2]] = np.eye(lattice.strips)
    turned += shift
    up = aero.strips.circulation / plate
    on = u * cosine - w * sine
    speed = np.hypot(up, on)
    up_rate = circulation / plate[:, None]
    on_rate = -(u * sine + w * cosine)[:, None] * (turned + pivot)
    on_rate[:, :widths[0]] += cosine[:, None] * along - sine[:, None] * across
    alpha = (on[:, None] * up_rate - up[:, None] * on_rate) / speed[:, None] ** 2 - turned
    looked_at, left, fall = np.empty((3, lattice.strips))
    look_up(aero.strips.alpha, strips, looked_at, left, fall)
    looked_up = alpha + left[:, None] * shift + (strips[6] * fall)[:, None] * (alpha + shift)
    flap_moment *= ((left - 1.0) * boundary.fade)[:, None]
    flap_moment += (fall * boundary.fade * (boundary.angles @ lattice.load_moment))[:, None] \
        * (alpha + shift)
    return Points(
        at_speed=speed, circulation=circulation, alpha=alpha, shift=shift, pivot=pivot,
        flap_moment=flap_moment, looked_at=looked_at, looked_up=looked_up,
        speed=(up[:, None] * up_rate + on[:, None] * on_rate) / speed[:, None])


def closure(model: Model, boundary: Boundary, aero: AeroResult, points: Points,
            widths: np.ndarray) -> FloatArray:
    """Return the derivative (n, k) of the closure's residual."""
    lattice, strips, n = model.lattice, boundary.strips, model.lattice.strips
    if model.settings.closure is Closure.LOCAL:
        values = np.empty((n, 4))
        sections(lattice.curves, lattice.polar_index, points.looked_at, values)
        lift_rate = points.circulation \
            - (aero.strips.circulation / points.at_speed)[:, None] * points.speed
        return (2.0 / (points.at_speed * lattice.strip_chord))[:, None] * lift_rate \
            - values[:, 3:] * points.looked_up
    delta = np.zeros_like(points.alpha)
    delta[:, widths[1]:widths[2]] = np.eye(n)
    weights = np.empty((2, n, n))
    read_at, angle, left, fall, rate = np.empty((5, n))
    faded_mean(strips, model.mean, weights)
    mean_angles(aero.strips.delta, strips, aero.strips.alpha, weights, read_at)
    look_up(read_at, strips, angle, left, fall)
    for j, curve in enumerate(lattice.curves[lattice.polar_index]):
        rate[j] = potential_angle(curve, angle[j], False)[1]
    mean = weights[0] @ points.alpha - weights[1] @ (delta + points.shift)
    looked_up = mean + left[:, None] * points.shift \
        + (strips[6] * fall)[:, None] * (mean + points.shift)
    return delta - rate[:, None] * looked_up + mean + points.shift


def section_loads(model: Model, density: float, boundary: Boundary, aero: AeroResult,
                  points: Points) -> FloatArray:
    """Return d(force, moment) in G (6, k) of the sections' drag and moment."""
    lattice, strips = model.lattice, aero.strips
    looked_up, direction = points.looked_at, strips.alpha - boundary.pivot
    held = np.zeros(lattice.strips, dtype=bool)
    if not model.settings.decambering:
        held = (looked_up > lattice.stall_high) | (looked_up < lattice.stall_low)
    curves = lattice.curves[lattice.polar_index]
    cd_slope, cm_slope = (np.where(held, 0.0, [
        lift(curve[c:c + 1], angle)[1] for curve, angle in zip(curves, looked_up)])
        for c in (CD, CM))
    none, one = np.zeros(lattice.strips), np.ones(lattice.strips)

    def force(j: int, alpha: FloatArray, cd: FloatArray, cm: FloatArray) -> FloatArray:
        here, total = slice(j, j + 1), np.zeros(6)
        loads.section_force(
            density, alpha[here], points.at_speed[here], cd[here], cm[here],
            lattice.strip_chord[here], lattice.strip_width[here], lattice.chord_axis[here],
            lattice.strip_normal[here], lattice.moment_axis[here], model.quarter_arm[here], total)
        return total

    out = np.zeros((6, points.alpha.shape[1]))
    for j in range(lattice.strips):
        # Drag turned a quarter further is the derivative of its direction.
        out += np.outer(force(j, direction + 0.5 * math.pi, strips.cd, none),
                        points.alpha[j] - points.pivot[j])
        out += np.outer(force(j, direction, cd_slope, cm_slope), points.looked_up[j])
        out += np.outer(force(j, direction, none, one), points.flap_moment[j])
        out += np.outer(2.0 / points.at_speed[j] * force(j, direction, strips.cd, strips.cm),
                        points.speed[j])
    return out
