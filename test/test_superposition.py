# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Basic and additional loadings (Paul 2015, 3.1) against the lattice solved for each case anew."""

import math

import curves
import numpy as np
import pytest

from poststall_sim.aero import model as models
from poststall_sim.aero import solver, superposition
from poststall_sim.aero.decambering import AngleForm, Closure
from poststall_sim.aero.model import Settings, far_normalwash
from poststall_sim.aero.schemes import Scheme

FOIL = curves.airfoil('normal')
MACHINES = {'wing': curves.wing_alone(FOIL), 'wing and tail': curves.wing_tail(FOIL)}
CHORDWISE = {'Weissinger': 1, 'four panels': 4}
AFT = np.array([1.0, 0.0, 0.0])


class Direct:
    """A lattice and its straight wake along x, solved by numpy for each twist and incidence."""

    def __init__(self, machine, chordwise):
        self.model = models.build(machine, Settings(
            chordwise=chordwise, unsteady=False, angle_form=AngleForm.LINEAR))
        self.lattice = self.model.lattice
        self.matrix = self.model.bound + far_normalwash(self.lattice, AFT) @ self.model.te_rows

    def lift(self, angle):
        """Return strip cl (n,) for angles (n,) or (panels,) [rad] between stream and chords."""
        if len(angle) == self.lattice.strips:
            angle = angle[self.lattice.panel_strip]
        strength = np.linalg.solve(self.matrix, -angle)[self.lattice.te_panel]
        return 2.0 * strength / self.lattice.strip_chord

    def total(self, cl):
        """Return CL of strips' cl, over the reference area."""
        area = self.lattice.strip_chord * self.lattice.strip_width
        return float(area @ cl) / self.model.aircraft.reference.area

    @property
    def slopes(self):
        """M, d cl_j / d delta_k, as the product makes it."""
        response = np.linalg.solve(self.matrix.T, self.model.te_rows.T).T
        return superposition.lift_slopes(self.lattice, response)

    @property
    def loadings(self):
        return superposition.loadings(
            self.lattice, self.slopes, self.model.aircraft.reference.area)


@pytest.fixture(scope='module', params=[(m, c) for m in MACHINES for c in CHORDWISE],
                ids=lambda key: ', '.join(key))
def direct(request):
    machine, chordwise = request.param
    return Direct(MACHINES[machine], CHORDWISE[chordwise])


def twists(lattice):
    """Yield the twists [rad] of figure 3.1 and some more, with their names."""
    n = lattice.strips
    y, wing = lattice.quarter_chord[:, 1], lattice.strip_surface == 0
    yield 'none', np.zeros(n)
    # Strips 10 and 11 of the wing, beside its root, at -3 deg.
    yield 'figure 3.1', np.where(wing & (np.abs(y) < 0.6), math.radians(-3.0), 0.0)
    yield 'stalled', np.random.default_rng(0).uniform(-0.4, 0.0, n)
    yield 'antisymmetric', np.where(wing, 0.08 * np.sign(y) * (np.abs(y) > 3.6), 0.0)
    # Rolling to the right at pb/2V = 0.1 raises the incidence of the right wing by p y / V.
    yield 'roll', 0.1 * y / 6.0
    yield 'roll, stalled', 0.1 * y / 6.0 + np.random.default_rng(1).uniform(-0.4, 0.0, n)


def test_superposition_is_the_direct_solution(direct):
    """Equations 3.1 to 3.4: strip cl and CL at any incidence with any twist."""
    parts = direct.loadings
    for name, twist in twists(direct.lattice):
        for degrees in (-5.0, 0.0, 10.0, 24.0):
            alpha = math.radians(degrees)
            cl, CL = parts.lift(alpha, twist)
            expected = direct.lift(alpha + twist)
            # One linear map in two orders of summation: round-off of a hundred unknowns.
            assert np.abs(cl - expected).max() < 1e-10, (name, degrees)
            assert CL == pytest.approx(direct.total(expected), abs=1e-10), (name, degrees)


def test_basic_loadings_lift_nothing_and_the_additional_one_lifts_one(direct):
    """CL of Cl_a1 is 1, that of each Cl_bj is 0; a twist of all strips alike is incidence."""
    parts = direct.loadings
    assert direct.total(parts.additional) == pytest.approx(1.0, abs=1e-13)
    assert np.abs(parts.area @ parts.basic).max() < 1e-13
    assert parts.basic_angle.sum() == pytest.approx(-1.0, abs=1e-12)
    assert np.abs(parts.basic.sum(axis=1)).max() < 1e-12


def test_superposition_is_the_steady_solution_of_the_product():
    """The whole way through `solver.steady`, small-angle form: decambered past stall, in roll."""
    for name, machine in MACHINES.items():
        for chordwise in CHORDWISE.values():
            settings = Settings(chordwise=chordwise, unsteady=False, closure=Closure.LOCAL,
                                angle_form=AngleForm.LINEAR, tolerance=1e-4)
            model = models.build(machine, settings)
            lattice = model.lattice
            # The wake of the steady problem follows the stream: the map of this incidence.
            for degrees, rate in ((8.0, 0.0), (20.0, 0.0), (20.0, 0.1)):
                flow = curves.Flow(
                    math.radians(degrees), 0.0,
                    np.array([rate * curves.SPEED / 6.0, 0.0, 0.0]),
                    np.zeros(len(machine.controls)))
                found = solver.steady(model, flow.onset, flow.deflections,
                                      density=curves.DENSITY)
                stream = flow.onset.velocity_G / curves.SPEED
                matrix = model.bound + far_normalwash(lattice, stream) @ model.te_rows
                response = np.linalg.solve(matrix.T, model.te_rows.T).T
                parts = superposition.loadings(
                    lattice, superposition.lift_slopes(lattice, response),
                    machine.reference.area)
                # In roll p y adds to the normal velocity, which turns the stream on a strip.
                y = lattice.quarter_chord[:, 1]
                normal = math.sin(flow.alpha) + flow.rates_B[0] * y / curves.SPEED
                local = np.arctan2(normal, math.cos(flow.alpha))
                cl = parts.lift(0.0, local + found.strips.delta - lattice.zero_lift)[0]
                assert np.abs(cl - found.strips.cl).max() < 1e-10, (name, chordwise, degrees)


def perturbed(direct, which, size):
    """Return d cl / d delta (n,) of each strip where strips `which(j)` are changed at once."""
    n = direct.lattice.strips
    base = np.random.default_rng(2).uniform(-0.3, 0.1, n)
    at_base, slopes = direct.lift(base), np.empty(n)
    for j in range(n):
        slopes[j] = (direct.lift(base + size * which(j)) - at_base)[j] / size
    return slopes


def test_trajectory_slopes_are_those_of_the_perturbed_lattice(direct):
    """
    Scheme B changes one strip, scheme D all of them: equations 3.7 and 3.11.

    (3.7 with the wing's lift slope a where a_0 is printed, or it would not agree with 3.6.)
    """
    n = direct.lattice.strips
    single, together = superposition.trajectory_slopes(direct.loadings)
    # The map is linear, so that a whole radian may be taken and only round-off is left.
    alone = perturbed(direct, lambda j: np.eye(n)[j], 1.0)
    assert np.abs(single - alone).max() < 1e-11
    assert np.abs(together - perturbed(direct, lambda j: np.ones(n), 1.0)).max() < 1e-11
    # All at once downwash takes some of the section's 2 pi; a strip alone has its own tips.
    assert np.all(together < 2.0 * math.pi)
    assert np.all(single[:20] < together[:20]) and np.all(single > 0.0)


def test_trajectory_lines_are_equations_3_6_and_3_10(direct):
    """Slopes in the (alpha, cl) plane, from the elementary loadings as printed."""
    parts = direct.loadings
    single, together = superposition.trajectory_slopes(parts)
    a0, a = 2.0 * math.pi, parts.slope
    additional, basic, angle = parts.additional, np.diag(parts.basic), parts.basic_angle
    # (3.6) with alpha_a of the configuration: alpha_a1 = 1/a.
    line = (-angle * additional * a + basic) / (basic / a0 - angle * additional * a / a0 - 1.0)
    ours = superposition.trajectory_line(single)
    # As a share: the line steepens without bound where a strip's slope comes near 2 pi.
    assert np.abs(ours / line - 1.0).max() < 1e-11
    # (3.10): alpha_a1(j) is the angle of the section, Cl_a1 / a_0, alpha_a,wing that of the wing.
    line = additional / (additional / a0 - 1.0 / a)
    assert np.abs(superposition.trajectory_line(together) / line - 1.0).max() < 1e-11
    assert np.isinf(superposition.trajectory_line(np.array([a0]))).all()   # scheme A: vertical


@pytest.mark.parametrize('chordwise', CHORDWISE.values(), ids=CHORDWISE)
def test_models_move_strips_along_these_slopes(chordwise):
    """What the schemes of a model use; D's floor of 0.3 a_0 is for strips in strong downwash."""
    direct = Direct(MACHINES['wing and tail'], chordwise)
    n = direct.lattice.strips
    trajectory = direct.model.trajectory
    assert np.array_equal(trajectory[Scheme.A], np.full(n, 2.0 * math.pi))
    single = perturbed(direct, lambda j: np.eye(n)[j], 1.0)
    together = perturbed(direct, lambda j: np.ones(n), 1.0)
    assert np.abs(trajectory[Scheme.B] - single).max() < 1e-11
    floor = 0.3 * 2.0 * math.pi
    assert np.abs(trajectory[Scheme.D] - np.maximum(together, floor)).max() < 1e-11
    # Prandtl-like for aspect ratio 12 on 20 strips (method 4.5): 3.41 at the tip, 5.68 at the
    # root, of a lifting line; the lattice is within a few per cent of it, 5 % asked.
    alone = Direct(MACHINES['wing'], chordwise)
    wing = alone.model.trajectory[Scheme.D]
    assert wing[[0, 9]] == pytest.approx([3.41, 5.68], rel=0.05)


def test_induced_angles_close_both_conditions(direct):
    """The lattice's own cl makes alpha - alpha_g + W cl = 0 with W = inv(M) - I / 2 pi."""
    slopes, n = direct.slopes, direct.lattice.strips
    induced = superposition.induced_angles(slopes)
    delta = np.random.default_rng(3).uniform(-0.4, 0.0, n)
    geometric = np.random.default_rng(4).uniform(0.1, 0.4, n)
    cl = direct.lift(geometric + delta)
    alpha = cl / (2.0 * math.pi) - delta
    # inv(M) has a condition number of some hundreds: 1e-16 becomes 1e-13.
    assert np.abs(alpha - geometric + induced @ cl).max() < 1e-12
