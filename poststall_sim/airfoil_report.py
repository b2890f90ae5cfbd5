# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What a section's curves are like: their landmarks, and how sharp a stall a wing stands."""

import math
from dataclasses import dataclass

import numpy as np

from poststall_sim.aero import model as models
from poststall_sim.aero.model import Model, own_response
from poststall_sim.aero.polars import SectionPolar
from poststall_sim.aircraft import (
    Aircraft,
    Airfoil,
    MassProperties,
    Reference,
    Section,
    Surface,
)
from poststall_sim.separated_flow import generic_plate

ATTACHED = (math.radians(-4.0), math.radians(6.0))
"""The lift slope is taken over these angles."""
STALLING = math.radians(40.0)
"""A fall of lift beyond is that of a plate, not of a stall."""
LOST = 0.1
"""Share of clmax whose loss measures the softness of a stall."""


@dataclass(frozen=True, slots=True)
class StallFigures:
    """
    One side's stall, signs as if positive.

    cl and alpha [rad] of the greatest lift; steepest fall of cl beyond it, below 0 [1/rad], and
    its angle [rad]; softness : angle from the greatest lift to where a tenth of it is lost [rad],
    infinite if it never is within 40 deg.
    """

    cl: float
    alpha: float
    steepest_fall: float
    steepest_at: float
    softness: float


@dataclass(frozen=True, slots=True)
class SectionFigures:
    """Zero-lift angle [rad], lift slope [1/rad], least drag, cm at zero lift, both stalls."""

    zero_lift: float
    lift_slope: float
    least_cd: float
    cm_at_zero_lift: float
    positive: StallFigures
    negative: StallFigures


def stands_in(airfoil: Airfoil) -> bool:
    """Tell whether a section separates as `generic_plate`: its own curves were not known."""
    across = np.abs(np.abs(airfoil.alpha) - 0.5 * math.pi) < math.radians(30.0)
    lift, _ = generic_plate(airfoil.alpha[across])
    return bool(np.allclose(airfoil.cl[across], lift, rtol=0.0, atol=1e-6))


def figures(polar: SectionPolar) -> SectionFigures:
    """Return what the curves of a section are like, as they are flown."""
    attached = np.linspace(*ATTACHED, 101)
    slope = np.polyfit(attached, polar.at(attached)[:, 0], 1)[0]
    return SectionFigures(
        zero_lift=polar.zero_lift, lift_slope=float(slope),
        least_cd=float(polar.curve[1, 0].min()), cm_at_zero_lift=float(
            polar.at(polar.zero_lift)[2]),
        positive=_stall(polar, 1.0, polar.stall_high),
        negative=_stall(polar, -1.0, -polar.stall_low))


def _stall(polar: SectionPolar, side: float, alpha: float) -> StallFigures:
    beyond = np.linspace(alpha, max(STALLING, alpha), 2001)
    cl, slope = polar.at(side * beyond)[:, [0, 3]].T
    steepest, lost = int(np.argmin(slope)), np.flatnonzero(side * cl < (1.0 - LOST) * side * cl[0])
    return StallFigures(
        cl=float(side * cl[0]), alpha=float(alpha), steepest_fall=float(slope[steepest]),
        steepest_at=float(beyond[steepest]),
        softness=float(beyond[lost[0]] - alpha) if lost.size else math.inf)


def steepest_unique_fall(airfoil: Airfoil, *, aspect_ratio: float, strips: int,
                         ell: float = 1.0) -> float:
    """
    Return the steepest fall of lift [1/rad] with which a wing's flow has one solution.

    Of a rectangular wing with this section throughout, in steady flow along its chord and with the
    non-local closure. In the linear form of angles its Jacobian is

        dF/dd = 1 + (1 - a/a0) (G (M/a0 - 1) - H),   a0 = 2 pi,

    with a the slope of the curve, the same on all strips, G and H the averaging over `ell` chords
    and beyond the tips, and M (n, n) = d cl/d delta. Where a is above what makes the least of its
    eigenvalues zero, no two solutions can meet.
    """
    model = _wing(airfoil, aspect_ratio, strips, ell)
    lattice = model.lattice
    response = own_response(model, np.array([1.0, 0.0, 0.0])).response
    turned = np.zeros((lattice.panels, lattice.strips))
    turned[np.arange(lattice.panels), lattice.panel_strip] = 1.0
    lift = -2.0 / lattice.strip_chord[:, None] * (response @ turned)
    a0 = 2.0 * math.pi
    mean = model.mean[0] @ (lift / a0 - np.eye(len(lift))) - model.mean[1]
    least = float(np.linalg.eigvals(mean).real.min())
    return a0 * (1.0 + 1.0 / least)


def _wing(airfoil: Airfoil, aspect_ratio: float, strips: int, ell: float) -> Model:
    """Return a rectangular wing of unit chord."""
    half = 0.5 * aspect_ratio
    sections = tuple(Section((0.0, y, 0.0), 1.0, airfoil.name) for y in (0.0, half))
    wing = Surface('wing', sections, strips, symmetric=True)
    aircraft = Aircraft(
        'wing', (wing,), (airfoil,), Reference(aspect_ratio, 1.0, aspect_ratio),
        MassProperties(1.0, (0.0, 0.0, 0.0), np.eye(3)))
    return models.build(aircraft, models.Settings(ell=ell))
