# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Free and frozen wakes, and the ground."""

import math

import numpy as np
import pytest
import wings

from poststall_sim.aero import images
from poststall_sim.aero import model as models
from poststall_sim.aero.model import Settings
from poststall_sim.aero.wake import Placement, Shape
from poststall_sim.aero.wash import Precision
from poststall_sim.aircraft import ConfigError

PLAIN = {'precision': Precision.FLOAT64, 'coarsen': False, 'interpolate': False}


def build(machine, **changes):
    return models.build(machine, Settings(tolerance=1e-9, **{**PLAIN, **changes}))


def last(model, alpha, steps, dt=0.25, speed=1.0, height=None):
    """Return the last step of a straight march: placement, flow, CL and CD."""
    if height is None:
        *_, (placement, flow, result) = wings.march(
            model, lambda t: wings.onset(speed, alpha), dt, steps)
    else:
        placement, flow, result = near_ground(model, alpha, steps, dt, height)
    found = wings.coefficients(model.aircraft, result, speed, alpha)
    return placement, flow, found


def near_ground(model, alpha, steps, dt, height):
    """March along the ground at a height of the quarter chord [m], 1 m/s, pitched by alpha."""
    c, s = math.cos(alpha), math.sin(alpha)
    rotation = np.array([[-c, 0, -s], [0, 1, 0], [s, 0, -c]])     # x aft, z up in N (down)
    cg = np.array(model.aircraft.mass.cg_G)
    onset = wings.onset(1.0, alpha)
    assert rotation @ onset.velocity_G == pytest.approx([-1.0, 0.0, 0.0], abs=1e-12)
    step = None
    for k in range(steps + 1):
        placement = Placement(np.array([k * dt, 0.0, -height]) - rotation @ cg, rotation)
        arguments = (onset, placement, np.zeros(len(model.aircraft.controls)))
        if step is None:
            step = wings.solver.start(model, *arguments, density=wings.DENSITY, dt=dt)
        else:
            step = wings.solver.advance(model, step[0], *arguments, density=wings.DENSITY, dt=dt,
                                        drift_N=np.zeros(3))
    return placement, *step


def test_no_air_goes_through_the_ground():
    """Wing, wake and mirror image together, at points of the plane z = 0."""
    model = build(wings.wing_tail(), ground=True)
    placement, flow, _ = last(model, 0.15, 12, height=1.5)
    points = np.array([[x, y, 0.0] for x in (-3.0, 0.0, 2.0) for y in (-4.0, 0.5, 7.0)])
    image = images.ground_velocity(flow.wake, model.lattice, placement, flow.circulation, points)
    real = np.zeros_like(points)
    for _, nodes, rings, core in images._grids(
            flow.wake, model.lattice, placement, flow.circulation):
        real += images._velocity(nodes, rings, np.full(len(nodes), core), points)
    assert np.abs(real[:, 2]).max() > 0.01
    assert (real + image)[:, 2] == pytest.approx(0.0, abs=1e-12)
    assert (real - image)[:, :2] == pytest.approx(0.0, abs=1e-12)     # and along it, twice


@pytest.mark.parametrize('height', [0.5, 1.0, 2.0])
def test_ground_takes_induced_drag_away_as_wieselsberger_found(height):
    """His factor of CDi at one lift, 1 - s, s = (1 - 1.32 h/b)/(1.05 + 7.4 h/b), AR 8."""
    machine = wings.rectangular(8, 24)
    span = machine.reference.span
    free = last(build(machine), 0.08, 160)[2]
    near = last(build(machine, ground=True), 0.08, 160, height=height)[2]
    here, there = near.drag / near.lift ** 2, free.drag / free.lift ** 2
    share = height / span
    factor = 1.0 - (1.0 - 1.32 * share) / (1.05 + 7.4 * share)
    print(f'h/b {share:.3f}: CDi/CL^2 {here / there:.3f} of free air, Wieselsberger {factor:.3f},'
          f' CL {near.lift / free.lift:.3f}')
    # His fit for 1/15 < h/b < 1/4 (NACA TM 77) is of lifting lines in elliptic load.
    assert here / there == pytest.approx(factor, abs=0.03)
    assert near.lift > 1.02 * free.lift


def test_ground_far_below_is_not_felt():
    """At 300 chords, 1e-5 of the lift; nearer ground is felt more."""
    machine = wings.rectangular(6, 10)
    free = last(build(machine), 0.1, 30)[2].lift
    lifts = [last(build(machine, ground=True), 0.1, 30, height=h)[2].lift for h in (300.0, 3.0)]
    assert lifts[0] == pytest.approx(free, rel=1e-5)
    assert abs(lifts[1] - free) > 1e-3 * free


def test_frozen_wake_is_the_prescribed_one_in_straight_flight_and_not_in_a_turn():
    """Behind a body that does as it did at the start they are one wake."""
    machine = wings.wing_tail()
    straight = [last(build(machine, wake=shape), 0.1, 24)[2]
                for shape in (Shape.PRESCRIBED, Shape.FROZEN)]
    assert straight[1].lift == pytest.approx(straight[0].lift, rel=1e-10)
    assert straight[1].pitch == pytest.approx(straight[0].pitch, rel=1e-8, abs=1e-10)

    def plunge(t):
        return wings.onset(1.0, 0.1 + 0.05 * math.sin(t))

    march = {shape: list(wings.march(build(machine, wake=shape), plunge, 0.25, 40))
             for shape in (Shape.PRESCRIBED, Shape.FROZEN)}
    frozen = march[Shape.FROZEN][-1][1].wake
    gaps = np.diff(frozen.nodes_N, axis=0)
    assert gaps == pytest.approx(np.broadcast_to(gaps[0, 0], gaps.shape), abs=1e-9)
    lift = {shape: [result.force_G[2] for _, _, result in steps]
            for shape, steps in march.items()}
    # Linear theory: where the wake lies matters to second order only.
    assert lift[Shape.FROZEN] == pytest.approx(lift[Shape.PRESCRIBED], rel=0.01)
    assert np.abs(np.subtract(*lift.values())).max() > 1e-7


def test_free_wake_rolls_up_and_sinks_and_hardly_changes_the_wing():
    """Tip vortices draw in and roll up, the middle sinks; loads of one wing change by 1e-3."""
    machine = wings.rectangular(8, 16)
    flows = {shape: last(build(machine, wake=shape, free_rows=40, free_every=1), 0.15, 60)
             for shape in (Shape.PRESCRIBED, Shape.FREE)}
    nodes = {shape: placement.to_geometry(flow.wake.nodes_N)
             for shape, (placement, flow, _) in flows.items()}
    moved = nodes[Shape.FREE] - nodes[Shape.PRESCRIBED]
    assert np.isfinite(moved).all()
    assert np.array_equal(moved[0], np.zeros_like(moved[0]))     # it begins at the trailing edge
    # Ten chords behind. The sheet sinks by about the downwash CL/(pi AR) times the way.
    row, middle = 40, moved.shape[1] // 2
    lift = flows[Shape.FREE][2].lift
    assert 0.5 < -moved[row, middle, 2] / (lift / (math.pi * 8.0) * 10.0) < 2.0
    assert moved[row, 0, 1] > 0.02 and moved[row, -1, 1] < -0.02   # the tips move inboard
    assert moved[row, 0, 2] > moved[row, middle, 2] + 0.05         # and stay above it
    assert lift == pytest.approx(flows[Shape.PRESCRIBED][2].lift, rel=2e-3)
    # Both sides alike, to round-off grown by rolling up.
    assert moved[:, ::-1] * [1, -1, 1] == pytest.approx(moved, abs=1e-6)


def test_free_wake_every_other_step_is_nearly_the_same():
    """Half the work for a part in 1000 of the lift of a wing with a tail in its wake."""
    lifts = [last(build(wings.wing_tail(), wake=Shape.FREE, free_every=n), 0.2, 40)[2].lift
             for n in (1, 2)]
    assert lifts[1] == pytest.approx(lifts[0], rel=1e-3)


def test_what_cannot_be_is_refused():
    """A ground without time, a frozen wake above ground."""
    with pytest.raises(ConfigError, match='are for unsteady flow'):
        Settings(ground=True, unsteady=False)
    with pytest.raises(ConfigError, match='nowhere that a ground'):
        Settings(ground=True, wake=Shape.FROZEN)
    with pytest.raises(ConfigError, match='free_rows must be 1 to 1000, got 0'):
        Settings(free_rows=0)
