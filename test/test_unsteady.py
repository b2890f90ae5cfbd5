# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The march: what must not matter, what is at rest, through stall and beyond it."""

import math

import numpy as np
import pytest
import wings
from wings import loads, steadily

from poststall_sim.aero import model as models
from poststall_sim.aero import wake
from poststall_sim.aero.model import Settings, build
from poststall_sim.frames import body_to_geometry, quaternion_from_euler, rotation
from poststall_sim.state import Status


def test_body_gathering_speed_across_its_wings_feels_its_added_mass():
    """From rest, F = -M dnu/dt in heave and roll: what the coupling takes out is put in."""
    model = build(wings.wing_tail(wings.potential()), Settings(decambering=False))
    for rate in ((0.0, 0.0, 2.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.3, 0.0, 0.0)):
        speeding = np.array(rate)

        def air(t, speeding=speeding):
            return models.Onset(body_to_geometry(-t * speeding[:3]),
                                body_to_geometry(t * speeding[3:]))

        *_, (_, _, result) = wings.march(model, air, 0.01, 5)
        load = body_to_geometry(np.array([result.force_G, result.moment_G])).ravel()
        expected = -wings.DENSITY * model.added_mass @ speeding
        # Air comes from below (or nearly): circulation pushes along the chord, not across it.
        assert load[2:4] == pytest.approx(expected[2:4], rel=1e-9, abs=1e-9)


def stalled(t):
    """Return an unsteady onset through stall with sideslip, at 40 m/s."""
    return wings.onset(40.0, 0.3 + 0.2 * math.sin(15.0 * t), 0.1 * math.cos(10.0 * t))


def test_moving_body_in_still_air_is_a_body_at_rest_in_the_wind():
    """Galileo: only motion through the air counts, in whatever frame, to 1e-10."""
    model = build(wings.wing_tail(), Settings(**wings.EXACTLY))
    air = wings.onset(40.0, 0.3, 0.05)
    still = loads(model, steadily(air), 0.25 / 40.0, 50, 40.0, at_rest=True)
    tunnel = wings.LEVEL @ air.velocity_G
    for wind in (tunnel, np.array([7.0, -30.0, 3.0])):
        blown = loads(model, steadily(air), 0.25 / 40.0, 50, 40.0, at_rest=True, wind_N=wind)
        assert blown == pytest.approx(still, abs=1e-10)


def test_heading_and_attitude_do_not_matter_without_gravity():
    """The same flight seen from axes turned by any rotation: the same loads."""
    model = build(wings.wing_tail(), Settings(tolerance=1e-9, **wings.EXACTLY))
    turned = rotation(quaternion_from_euler(0.5, -1.0, 2.0)) @ wings.LEVEL
    straight = loads(model, stalled, 0.25 / 40.0, 40, 40.0, at_rest=True)
    other = loads(model, stalled, 0.25 / 40.0, 40, 40.0, at_rest=True,
                  attitude_at=lambda t: turned)
    # The wake begins on the trailing edge, where velocity is wanted: round-off of 1e-15 m there,
    # over 2 pi times the core of 1e-5 chords squared, is 2e-6 of the circulation per metre.
    assert other == pytest.approx(straight, abs=1e-6)


def test_mirrored_march_has_mirrored_loads():
    """Sideslip, roll, yaw, aileron and rudder change sign, on the trainer through its stall."""
    model = build(wings.shipped_aircraft('trainer'), Settings(tolerance=1e-9, **wings.EXACTLY))

    def run(side):
        return loads(
            model, lambda t: wings.onset(
                15.0, 0.25 + 0.2 * math.sin(5.0 * t), side * 0.2 * math.cos(4.0 * t),
                (side * 0.5, 0.2, side * 0.3)),
            0.1 / 15.0, 40, 15.0, deflections=[side * 0.1, -0.2, side * 0.2])

    here, there = run(1.0), run(-1.0)
    assert there == pytest.approx(here * [1, -1, 1, -1, 1, -1], abs=1e-8)


def test_slow_steady_roll_marches_to_the_damping_of_the_straight_wake():
    """The helix that the tips leave is straight to the order of (pb/2V)^2."""
    model, rate = build(wings.rectangular(6, 12), Settings(wake_length=20.0)), 0.01

    def attitude(t):
        c, s = math.cos(rate * t), math.sin(rate * t)
        return np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ wings.LEVEL

    rolling = loads(model, steadily(wings.onset(1.0, rates_B=(rate, 0.0, 0.0))), 0.25, 80, 1.0,
                    attitude_at=attitude)[:, 3]
    # 1 %: of a wake twenty chords long that has not seen the first of them.
    assert rolling[-1] == pytest.approx(rolling[0], rel=0.01)
    assert rolling[0] * rate > 0.0   # about x aft: against right wing down


def test_body_at_rest_piles_up_no_rows_and_feels_nothing():
    """Without airspeed the wake stays as it is; all values are finite and all loads vanish."""
    model = build(wings.wing_tail())
    for step in wings.march(model, steadily(wings.onset(0.0)), 0.01, 30):
        placement, flow, result = step
        # Speeds are kept above 1e-150 m/s against 0/0; nothing else is left.
        assert np.abs(result.force_G).max() < 1e-250 and result.status is Status.CONVERGED
        assert np.linalg.norm(np.diff(flow.wake.nodes_N, axis=0), axis=-1).min() > 0.0
    front = placement.to_inertial(model.lattice.wake_nodes)
    assert np.array_equal(flow.wake.nodes_N[0], front)


def test_short_rows_merge_and_keep_what_the_edge_has_shed():
    """Creeping by 0.03 panels a step: rows of 0.1 panels, circulation times length conserved."""
    model = build(wings.rectangular(4, 6), Settings(wake_length=3.0))
    panel, step = 0.25, 0.03 * 0.25
    shed, at_te = np.zeros(6), None
    for _, flow, _ in wings.march(
            model, steadily(wings.onset(1.0, 0.1)), step, 60, at_rest=True):
        length = np.linalg.norm(np.diff(flow.wake.nodes_N, axis=0), axis=-1)[:, 0]
        if at_te is not None:
            shed = shed + at_te * step   # of the step before, over the way since
            assert length @ flow.wake.circulation == pytest.approx(shed, rel=1e-9)
        at_te = flow.shed
    rows = np.flatnonzero(flow.wake.circulation[:, 0])
    assert 60 * 0.03 / 0.13 < len(rows) < 60 * 0.03 / 0.1 + 1.0
    assert length[rows[1:]].min() >= wake.SHORTEST_ROW * panel


def test_ramp_through_stall_marches_without_a_failed_step():
    """To 35 deg in a hundred chords: every step converges, lift peaks past the section's stall."""
    for machine, speed in ((wings.wing_tail(), 40.0), (wings.shipped_aircraft('trainer'), 15.0)):
        model, dt = build(machine), 0.25 * machine.reference.chord / speed
        angle = np.radians(np.linspace(0.0, 35.0, 401))

        def ramp(t, speed=speed, dt=dt, angle=angle):
            return wings.onset(speed, angle[round(t / dt)])

        results = [result for _, _, result in wings.march(model, ramp, dt, 400)]
        assert all(result.status is Status.CONVERGED for result in results)
        lift = np.array([wings.coefficients(machine, result, speed, alpha).lift
                         for result, alpha in zip(results, angle)])
        section = math.degrees(model.lattice.stall_high[0])
        assert section < np.degrees(angle[lift.argmax()]) < section + 6.0
        assert lift[-1] < 0.9 * lift.max()
        # Smooth: nowhere more than a hundredth of the greatest lift from one step to the next.
        assert np.abs(np.diff(lift[3:])).max() < 0.01 * lift.max()
        assert np.mean([result.iterations for result in results]) < 2.0


@pytest.mark.parametrize('degrees', [100.0, 150.0, 180.0])
def test_reversed_flow_stays_finite_and_sheds_nothing(degrees):
    """From 75 deg on strips are sections by themselves: their wake cannot grow on them."""
    model = build(wings.wing_tail())
    alpha = math.radians(degrees)
    steady = wings.steady(model, 40.0, alpha)
    for _, flow, result in wings.march(model, steadily(wings.onset(40.0, alpha)), 0.25 / 40.0,
                                       60, at_rest=True):
        assert result.status is Status.CONVERGED
        assert result.force_G == pytest.approx(steady.force_G, abs=1e-6 * 12000.0)
        assert np.all(flow.wake.circulation == 0.0)


def test_flow_turning_over_its_back_never_blows_up():
    """A full turn of alpha in 120 chords, then level: bounded by what sections can carry."""
    model, dt = build(wings.wing_tail()), 0.25 / 40.0
    force = loads(model, lambda t: wings.onset(40.0, 2.0 * math.pi * min(t / (480 * dt), 1.0)),
                  dt, 720, 40.0)
    assert np.isfinite(force).all()
    # Areas of wing and tail at the most a section has: a resultant of about 2.1 (at 90 deg).
    assert np.linalg.norm(force[:, [0, 2]], axis=1).max() < 2.5 * (12.0 + 2.24) / 12.0
    # Sixty chords later it has forgotten: Wagner's lift lacks 1/s = 1/120 of the last change.
    assert force[-1] == pytest.approx(force[0], abs=0.01)
