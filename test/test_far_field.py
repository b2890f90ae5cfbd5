# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Induced drag in the Trefftz plane, by itself and beside the lattice's edges."""

import math
from dataclasses import replace

import numpy as np
import pytest
import wings

from poststall_sim.aero import far_field
from poststall_sim.aero import lattice as lattices
from poststall_sim.aero import model as models
from poststall_sim.aircraft import Section, Surface
from poststall_sim.polar import Condition, point

AFT = np.array([1.0, 0.0, 0.0])


def elliptic_drag(strips, direction=AFT, *, cosine=False):
    """Return the drag of an elliptic circulation of 1 m^2/s over a span of 6 m, over pi/8 rho."""
    aircraft = wings.rectangular(6.0, strips=strips)
    aircraft = replace(aircraft, surfaces=tuple(
        replace(each, spacing_cosine=cosine) for each in aircraft.surfaces))
    lattice = lattices.build(aircraft, 1)
    half = 0.5 * lattice.strip_width.sum()
    shed = np.sqrt(1.0 - (lattice.quarter_chord[:, 1] / half) ** 2)
    return far_field.induced_drag(lattice, shed, direction, 1.225) / (math.pi / 8.0 * 1.225)


def test_an_elliptic_circulation_has_the_drag_of_munk():
    """D = pi/8 rho G^2, whatever the span; even strips miss half a strip's square root at tips."""
    errors = [elliptic_drag(strips) - 1.0 for strips in (20, 40, 80)]
    assert abs(errors[-1]) < 0.01
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.3) \
        and errors[1] / errors[2] == pytest.approx(2.0, abs=0.3)


def test_the_direction_of_the_wake_turns_the_plane():
    """Seen along itself a plane wing's wake is as wide, whichever way it goes up or down."""
    up = np.array([math.cos(0.3), 0.0, math.sin(0.3)])
    assert elliptic_drag(20, up) == pytest.approx(elliptic_drag(20), rel=1e-12)


def test_near_and_far_field_agree_on_the_drag_of_a_wing():
    """Munk: the same in the limit. Within 1 % on twenty even strips of an unswept wing."""
    aircraft = wings.rectangular(6.0, strips=20)
    model = models.build(aircraft, models.Settings(decambering=False, unsteady=False))
    found = point(model, Condition(math.radians(5.0)), airspeed=20.0, density=1.225)
    friction = found.aero.strips.cd.mean()
    assert found.induced_far == pytest.approx(found.coefficients.CD - friction, rel=0.01)


@pytest.mark.parametrize('above', [0.0, 1e-17, 1e-12])
def test_a_tail_in_the_line_of_a_wings_vortex_feels_the_others(above):
    """
    By AVL's rules there is no core; a little to either side the vortex gives and takes as much.

    Five strips with their middles on the nodes of the wing, against the mean of both sides.
    """
    wing = wings.rectangular(8.0, strips=16)
    foil = wing.airfoils[0].name

    def drag(aside):
        tail = Surface('tail', tuple(Section((3.0, aside + y, above), 1.0, foil)
                                     for y in (-1.25, 1.25)), strips=5)
        lattice = replace(lattices.build(
            replace(wing, surfaces=(*wing.surfaces, tail)), 1), core=0.0)
        shed = np.concatenate([np.sin(np.linspace(0.1, math.pi - 0.1, 16)), np.full(5, 0.3)])
        return far_field.induced_drag(lattice, shed, AFT, 1.225)

    assert drag(0.0) == pytest.approx(0.5 * (drag(1e-4) + drag(-1e-4)), rel=1e-5)
