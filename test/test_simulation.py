# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Flow and body together: order of the coupling, what a flight conserves, and how it ends.

The aircraft is the trainer, trimmed at 15 m/s, but for a light wing; nothing in here needs its
numbers to stay.
"""

import dataclasses
import math

import numpy as np
import pytest
import wings
from scipy.linalg import expm

from poststall_sim import definition, simulation
from poststall_sim.aero import model as models
from poststall_sim.aero import solver
from poststall_sim.aero.model import Settings
from poststall_sim.aircraft import ConfigError, MassProperties
from poststall_sim.atmosphere import standard_air
from poststall_sim.frames import (
    GRAVITY,
    body_to_geometry,
    geometry_to_body,
    quaternion_from_euler,
    rotation,
    velocity_from_flow_angles,
)
from poststall_sim.state import BodyState, Controls, Status
from poststall_sim.weather import Weather

DT_NS = 6_000_000
CALM = np.zeros(3)
AIRSPEED = 15.0


@pytest.fixture(scope='module')
def trainer():
    return definition.aircraft(definition.find('aircraft', 'trainer'))


@pytest.fixture(scope='module')
def level(trainer):
    """Return a flight in level trim, at its start; its model serves most tests."""
    return simulation.start(trainer, airspeed=AIRSPEED, altitude=300.0)


@pytest.fixture(scope='module')
def quasi_steady(trainer):
    return models.build(trainer, Settings(unsteady=False))


def fly(model, body, command, seconds, *, dt_ns=DT_NS, wind_N=CALM, start=None, delta0=None):
    """Return a flight's snapshots; command gives controls from the time [s]."""
    flight = simulation.Flight(model, body, command(0.0) if start is None else start,
                               dt_ns=dt_ns, weather=Weather(wind_N), delta0=delta0)
    snapshots = [flight.snapshot]
    for k in range(1, round(seconds * 1e9 / dt_ns) + 1):
        snapshots.append(flight.step(command(k * dt_ns * 1e-9)))
    return snapshots


def held(controls):
    return lambda time: controls


def moving(level, seconds, scale=(1.0, 1.0, 1.0)):
    """Return a command that moves every control smoothly from trim and back."""
    def command(time):
        bump = math.sin(math.pi * time / seconds) ** 2
        swing = np.radians([6.0, -4.0, 5.0]) * scale * bump
        return Controls(level.trim.deflections + swing, level.trim.throttle + 0.3 * bump)
    return command


def packed(snapshot):
    body = snapshot.body
    return np.concatenate([body.position_N, body.velocity_B, body.rates_B, body.q_NB])


def everything(snapshot):
    return np.concatenate([
        packed(snapshot), snapshot.force_B, snapshot.moment_B, snapshot.acceleration_B,
        snapshot.strips.delta, snapshot.strips.circulation, [snapshot.max_residual]])


def first_body(level, **changes):
    return dataclasses.replace(level._first, **changes)


def weight_B(snapshot, mass):
    return rotation(snapshot.body.q_NB)[2] * mass * GRAVITY


def self_convergence(trainer, level, settings, seconds, steps_ms):
    """Return the orders seen between the ends of one flight with shrinking dt."""
    model = models.build(trainer, settings)
    ends = []
    for dt in steps_ms:
        snapshots = fly(model, first_body(level), moving(level, seconds), seconds,
                        dt_ns=round(dt * 1e6), delta0=level._delta0)
        assert not any(s.strips.stalled.any() for s in snapshots)   # an attached manoeuvre
        ends.append(packed(snapshots[-1]))
    differences = [np.linalg.norm(b - a) for a, b in zip(ends, ends[1:])]
    return np.log2(np.array(differences[:-1]) / differences[1:])


# --- order

def test_coupling_is_of_second_order_with_quasi_steady_loads(trainer, level):
    """Predictor with old loads held, corrector with loads linear in time."""
    orders = self_convergence(trainer, level, Settings(unsteady=False, tolerance=1e-12),
                              0.384, (12.0, 6.0, 3.0, 1.5))
    # Measured 1.94 and 1.97, coming up to 2 from below.
    assert orders == pytest.approx([2.0, 2.0], abs=0.1)


def test_the_full_unsteady_step_is_of_first_order_where_panels_stay(trainer, level):
    """
    Steps get shorter and panels do not: what a step sheds starts later than it should.

    Measured at a fixed length of wake: 0.96 from 6 to 1.5 ms, 1.14 from 3 to 0.75 ms. Where a
    step is a panel the march is of second order, see test_unsteady_theory.
    """
    orders = self_convergence(trainer, level, Settings(wake_length=2.0, tolerance=1e-10),
                              0.192, (6.0, 3.0, 1.5, 0.75))
    # First order with a second-order share of either sign still in it.
    assert orders == pytest.approx([1.0, 1.0], abs=0.2)


# --- the same again

def test_the_same_input_flies_the_same_flight_bit_for_bit(trainer, level):
    flights = [fly(model, first_body(level), moving(level, 0.24), 0.24)
               for model in (level.model, level.model, models.build(trainer))]
    for other in flights[1:]:
        for a, b in zip(flights[0], other):
            assert np.array_equal(everything(a), everything(b))


def test_a_restart_from_a_kept_state_is_bit_identical(trainer, level):
    command = moving(level, 0.24)
    flight = simulation.Flight(level.model, first_body(level), command(0.0), dt_ns=DT_NS)
    for k in range(1, 41):
        if k == 21:
            kept = flight.state
        last = flight.step(command(k * DT_NS * 1e-9))
    rebuilt, state = models.build(trainer), kept
    for k in range(21, 41):
        state, snapshot = simulation.step(
            rebuilt, state, command(k * DT_NS * 1e-9), dt_ns=DT_NS)
    assert snapshot.time_ns == last.time_ns == 40 * DT_NS
    assert np.array_equal(everything(snapshot), everything(last))
    assert np.array_equal(state.flow.wake.nodes_N, flight.state.flow.wake.nodes_N)
    assert np.array_equal(state.flow.wake.circulation, flight.state.flow.wake.circulation)


def test_reset_is_the_first_state_again_while_time_goes_on(level):
    flight = simulation.Flight(level.model, first_body(level), level.trim, dt_ns=DT_NS)
    first = everything(flight.snapshot)
    flight.step(Controls(level.trim.deflections, 1.0))
    assert flight.reset().time_ns == DT_NS
    assert np.array_equal(everything(flight.snapshot), first)
    assert flight.reset(time_ns=0).time == 0.0


# --- trim, symmetry, signs

def test_a_flight_put_elsewhere_is_one_that_began_there(level):
    """Whatever it did before; what cannot be computed leaves it as it was."""
    flight = simulation.Flight(level.model, first_body(level), level.trim, dt_ns=DT_NS)
    there = first_body(level, rates_B=np.array([0.2, -0.1, 0.05]))
    fresh = simulation.Flight(level.model, there, level.trim, dt_ns=DT_NS)
    for _ in range(10):
        flight.step(Controls(np.array([0.1, -0.2, 0.0]), 1.0))
    flight.paused_reason = 'ground contact, tested'
    flight.place(there, level.trim)
    assert flight.paused_reason is None and flight.snapshot.time_ns == 10 * DT_NS
    flight.set_time(fresh.snapshot.time_ns)
    before = flight.snapshot
    with pytest.raises(ConfigError, match='a number of this state is not finite'):
        flight.place(first_body(level, velocity_B=np.full(3, np.inf)), level.trim)
    with np.errstate(all='ignore'), pytest.raises(ConfigError, match='loads in this state'):
        flight.place(first_body(level, velocity_B=np.full(3, 1e200)), level.trim)
    assert flight.snapshot is before
    for _ in range(5):
        assert np.array_equal(everything(flight.step(level.trim)),
                              everything(fresh.step(level.trim)))


def test_a_trimmed_flight_stays_on_trim(level):
    snapshots = fly(level.model, first_body(level), held(level.trim), 10.0,
                    delta0=level._delta0)
    airspeed = np.array([s.airspeed for s in snapshots])
    alpha = np.degrees([s.alpha for s in snapshots])
    # The wake of 10 m stands for the endless one of the trim: 1e-4 of the loads.
    assert np.abs(airspeed - airspeed[0]).max() < 0.05
    assert np.abs(alpha - alpha[0]).max() < 0.05
    assert snapshots[-1].body.position_N[0] == pytest.approx(150.0, abs=0.1)
    # Nothing pushes sideways but round-off, that of the wake in float32; measured: 7e-5 m.
    assert np.abs([s.body.position_N[1] for s in snapshots]).max() < 5e-4


def test_load_factor_is_one_in_level_trim(level):
    """The lift, engine's share included, carries the weight: to the trim's residual of 1e-6."""
    model = level.model
    for airspeed in (12.0, AIRSPEED, 20.0):
        trim = simulation.trims.straight(model, airspeed=airspeed, altitude=300.0)
        body = BodyState(np.array([0.0, 0.0, -300.0]), trim.velocity_B, np.zeros(3), trim.q_NB)
        flight = simulation.Flight(model, body, trim.controls, dt_ns=DT_NS,
                                   delta0=trim.aero.strips.delta)
        assert flight.snapshot.load_factor == pytest.approx(1.0, abs=2e-6)
        assert flight.snapshot.acceleration_B == pytest.approx(np.zeros(3), abs=2e-6 * GRAVITY)


def test_mirrored_commands_fly_the_mirrored_flight(level):
    right, left = (
        fly(level.model, first_body(level), moving(level, 0.6, scale), 0.6)[-1]
        for scale in ((1.0, 1.0, 1.0), (-1.0, 1.0, -1.0)))
    mirror = np.array([1, -1, 1, 1, -1, 1, -1, 1, -1, 1, -1, 1, -1])   # r, v, omega, q
    assert abs(right.body.rates_B[0]) > 0.1   # there is something to mirror
    # The closure is solved to 1e-5 rad, and not from mirrored round-off.
    assert np.abs(packed(left) - mirror * packed(right)).max() < 1e-6


def test_controls_turn_the_aircraft_as_the_signs_say(level):
    names = level.model.aircraft.control_names
    for name, rate, sign in (('aileron', 0, 1), ('elevator', 1, -1), ('rudder', 2, -1)):
        deflections = level.trim.deflections.copy()
        deflections[names.index(name)] += math.radians(3.0)
        last = fly(level.model, first_body(level), held(Controls(deflections, 0.2)), 0.15)[-1]
        assert sign * math.degrees(last.body.rates_B[rate]) > 1.0


def test_commands_beyond_the_limits_are_flown_at_the_limits(level):
    limits = np.array([control.limits for control in level.model.aircraft.controls])
    flight = simulation.Flight(level.model, first_body(level), level.trim, dt_ns=DT_NS)
    snapshot = flight.step(Controls(np.array([9.0, -9.0, 9.0]), 7.0))
    assert np.array_equal(snapshot.controls.deflections, limits[[0, 1, 2], [1, 0, 1]])
    assert snapshot.controls.throttle == 1.0
    assert flight.step(Controls(np.zeros(3), -1.0)).controls.throttle == 0.0


# --- wind

def wind_gap(level, model, dt_ns):
    """Return how much calm and wind differ relative to the air, and in place less the drift."""
    wind_N = np.array([6.0, -4.0, 0.0])   # level: the density goes with the altitude
    first = first_body(level)
    blown = first_body(level, velocity_B=first.velocity_B + rotation(first.q_NB).T @ wind_N)
    calm = fly(model, first, moving(level, 0.6), 0.6, dt_ns=dt_ns)
    windy = fly(model, blown, moving(level, 0.6), 0.6, dt_ns=dt_ns, wind_N=wind_N)
    return max(
        np.abs(np.concatenate([
            a.velocity_air_B - b.velocity_air_B, a.body.rates_B - b.body.rates_B,
            a.body.q_NB - b.body.q_NB,
            a.body.position_N + wind_N * a.time - b.body.position_N])).max()
        for a, b in zip(calm, windy))


def test_constant_wind_carries_the_flight_along(level, quasi_steady):
    """
    Galileo: relative to the air nothing differs; the place drifts with the wind.

    Turning axes see the wind turn, which the Runge-Kutta rule follows to its fourth order.
    """
    gaps = [wind_gap(level, quasi_steady, dt_ns) for dt_ns in (2 * DT_NS, DT_NS)]
    assert gaps[1] < 1e-8   # of 15 m/s; measured 1.3e-9
    assert math.log2(gaps[0] / gaps[1]) == pytest.approx(4.0, abs=0.1)


def test_constant_wind_carries_the_unsteady_flight_along(level):
    """
    With added mass the invariance holds to the truncation of the step.

    Its rate is differenced on velocities over the ground, where turning axes see the wind
    change; against the same change by Newton's equation this is of second order in dt.
    """
    gaps = [wind_gap(level, level.model, dt_ns) for dt_ns in (DT_NS, DT_NS // 2)]
    assert gaps[0] < 1e-4   # of 15 m/s; measured 4.5e-5, and orders 2.4, 2.2, 2.1 on the way
    assert 2.0 < math.log2(gaps[0] / gaps[1]) < 2.5


# --- what a snapshot says

@pytest.fixture(scope='module', params=[True, False], ids=['unsteady', 'quasi-steady'])
def manoeuvre(request, level, quasi_steady):
    model = level.model if request.param else quasi_steady
    return fly(model, first_body(level, rates_B=np.array([0.3, 0.1, -0.2])),
               moving(level, 0.3), 0.3)


def test_force_is_mass_times_acceleration(trainer, manoeuvre):
    """Aerodynamic force, thrust and weight are what the snapshot's acceleration says."""
    mass = trainer.mass.mass
    for s in manoeuvre:
        total = s.force_B + s.thrust_B + weight_B(s, mass)
        # Through the inverse of the mass matrix: round-off of 100 N.
        assert mass * s.acceleration_B == pytest.approx(total, abs=1e-11)


def test_moment_is_the_change_of_angular_momentum(trainer, manoeuvre):
    inertia = trainer.mass.inertia_B
    for s in manoeuvre:
        rates = s.body.rates_B
        change = inertia @ s.rate_change_B + np.cross(rates, inertia @ rates)
        assert change == pytest.approx(s.moment_B + s.thrust_moment_B, abs=1e-11)


def test_acceleration_is_the_slope_of_the_velocity(manoeuvre):
    """By the trapezium rule, whose error is the second difference over 12."""
    dt = DT_NS * 1e-9
    velocity = np.array([rotation(s.body.q_NB) @ s.body.velocity_B for s in manoeuvre])
    acceleration = np.array([rotation(s.body.q_NB) @ s.acceleration_B for s in manoeuvre])
    rates = np.array([s.body.rates_B for s in manoeuvre])
    change = np.array([s.rate_change_B for s in manoeuvre])
    for path, slope in ((velocity, acceleration), (rates, change)):
        gap = np.diff(path, axis=0) / dt - 0.5 * (slope[1:] + slope[:-1])
        truncation = np.abs(np.diff(slope, 2, axis=0)).max() / 12.0
        # The loads of a step are those of the predicted body, as far off as the truncation.
        assert np.abs(gap).max() < 3.0 * truncation


# --- light aircraft

@pytest.mark.parametrize('share', [0.2, 0.08])
def test_a_light_aircraft_rolls_without_chatter(trainer, share):
    """
    With far less inertia in roll than the air it carries, an explicit coupling diverges.

    Mass, inertia and thrust are scaled together, the speed with the root: the same aircraft,
    lighter. A disturbance in roll dies out, and no step undoes the one before.
    """
    density = 1.2133   # at 100 m
    added = density * models.build(trainer).added_mass[3, 3]
    scale = share * added / trainer.mass.inertia_B[0, 0]
    light = dataclasses.replace(
        trainer,
        mass=MassProperties(trainer.mass.mass * scale, trainer.mass.cg_G,
                            trainer.mass.inertia_B * scale),
        engines=tuple(dataclasses.replace(e, static_thrust=e.static_thrust * scale)
                      for e in trainer.engines))
    airspeed = AIRSPEED * math.sqrt(scale)
    start = simulation.start(light, airspeed=airspeed, altitude=100.0, dt=0.015)
    snapshots = fly(start.model, first_body(start, rates_B=np.array([0.5, 0.0, 0.0])),
                    held(start.trim), 2.0, dt_ns=start.dt_ns, delta0=start._delta0)
    rates = np.array([s.body.rates_B for s in snapshots])
    assert np.abs(rates).max() <= 0.5   # never above the disturbance
    assert abs(rates[-1, 0]) < 0.05     # the roll has died out
    # A chatter from step to step shows in the second difference; a smooth decay of time
    # constant 0.1 s and 15 ms leaves (0.15)^2 of what is left of the rate.
    assert np.abs(np.diff(rates[30:, 0], 2)).max() < 0.02 * 0.05
    assert all(s.status is Status.CONVERGED for s in snapshots)


def lighter(rows, axis, share):
    """
    Return a wing of aspect ratio 6 that is free about or along one axis of B only, and its rate.

    Its inertia there is a share of the air's that it carries, elsewhere it is as good as fixed.
    The rate [1/s] is the one at which the steady damping stops both together, L/(I + A).
    """
    model = models.build(wings.rectangular(6, 16), Settings(chordwise=rows, decambering=False))
    density = standard_air(100.0).density
    added = density * model.added_mass[axis, axis]
    inertia = np.full(6, 1e5)
    inertia[axis] = share * added
    mass = MassProperties(inertia[2], model.aircraft.mass.cg_G, np.diag(inertia[3:]))
    model = dataclasses.replace(model, aircraft=dataclasses.replace(model.aircraft, mass=mass))

    def load(motion):
        onset = models.Onset(body_to_geometry(-motion[:3]), body_to_geometry(motion[3:]))
        aero = solver.steady(model, onset, np.zeros(0), density=density)
        return np.concatenate([geometry_to_body(aero.force_G), geometry_to_body(aero.moment_G)])

    ahead, nudge = np.array([20.0, 0, 0, 0, 0, 0]), 1e-2 * np.eye(6)[axis]
    damping = (load(ahead + nudge) - load(ahead))[axis] / 1e-2
    return model, -damping / ((1.0 + share) * added)


def released(model, axis, steps):
    """Return what is left of 0.01 m/s of heave or 0.01 rad/s of roll at 20 m/s, step by step."""
    dt_ns = round(1e9 / (20.0 * model.settings.chordwise))
    motions = []
    for nudge in (1e-2, 0.0):
        motion = np.array([20.0, 0, 0, 0, 0, 0]) + nudge * np.eye(6)[axis]
        body = BodyState(np.array([0.0, 0.0, -100.0]), motion[:3], motion[3:],
                         np.array([1.0, 0.0, 0.0, 0.0]))
        snapshots = fly(model, body, held(Controls(np.zeros(0))), steps * dt_ns * 1e-9,
                        dt_ns=dt_ns)
        motions.append([np.concatenate([s.body.velocity_B, s.body.rates_B])[axis]
                        for s in snapshots])
    return np.subtract(*motions) / 1e-2


HEAVE, ROLL = 2, 3
INDICIAL = {HEAVE: (0.361, 0.381), ROLL: (0.283, 0.540)}
"""
Lift after a step is 1 - a exp(-b s), s in semichords: a, b of aspect ratios 6 and 3.

R. T. Jones, NACA Report 681, 1940, for elliptic wings; in roll each half is a wing by itself.
"""


@pytest.mark.parametrize(('rows', 'within'), [(4, 0.1), (16, 0.04)])
@pytest.mark.parametrize('axis', INDICIAL)
def test_a_light_wing_slows_down_with_the_air_that_it_carries(axis, rows, within):
    """
    With 0.2 of the air's inertia of its own, in heave or in roll: as linear theory says.

    Released in steady flow, it begins at the rate r of `lighter`; then the wake that is shed,
    with the share z of the motion that lift has not yet followed, takes it through zero:

        x' = -r (x - a z),   z' = x' - 2 b V/c z.

    Wings differ by the planform, and a panel's way is a fair part of the time 1/r in which it
    happens, 0.4 to 0.65 chords: errors of the first order in it.
    """
    model, rate = lighter(rows, axis, 0.2)
    left = released(model, axis, 4 * rows)
    a, b = INDICIAL[axis]
    dt = 1.0 / (20.0 * rows)
    advance = expm(dt * np.array([[-rate, rate * a], [-rate, rate * a - 40.0 * b]]))
    theory = [np.array([1.0, 0.0])]
    for _ in left[1:]:
        theory.append(advance @ theory[-1])
    assert np.abs(left - np.array(theory)[:, 0]).max() < within
    assert -math.log(left[1]) / (rate * dt) == pytest.approx(1.0, abs=1.25 / rows)
    # Once down and once back: nothing alternates.
    assert np.count_nonzero(np.diff(np.sign(np.diff(left)))) == 1


@pytest.mark.parametrize('axis', INDICIAL)
def test_without_the_added_mass_on_the_left_side_the_same_wing_diverges(axis):
    """Five times the inertia on the right side: alternating, and growing more than fivefold."""
    model, _ = lighter(4, axis, 0.2)
    left = released(dataclasses.replace(model, added_mass=np.zeros((6, 6))), axis, 3)
    assert np.all(np.diff(np.sign(np.diff(left))) != 0)
    assert np.all(np.abs(left[2:]) > 5.0 * np.abs(left[1:-1]))


# --- ends

def test_reset_in_another_wind_is_as_trimmed_as_the_start(level):
    """Airspeed and angles come back, the ground speed is what the new wind makes of them."""
    flight = simulation.Flight(level.model, first_body(level), level.trim, dt_ns=DT_NS)
    start = flight.snapshot
    flight.wind_N = np.array([0.0, -6.0, 0.0])
    again = flight.reset()
    np.testing.assert_allclose(again.velocity_air_B, start.velocity_air_B, atol=1e-12)
    moved = rotation(again.body.q_NB) @ again.body.velocity_B \
        - rotation(start.body.q_NB) @ start.body.velocity_B
    np.testing.assert_allclose(moved, flight.wind_N, atol=1e-12)


def test_ground_contact_pauses_with_the_reason_and_keeps_the_state(level):
    body = first_body(level, position_N=np.array([0.0, 0.0, -0.4]),
                      velocity_B=np.array([14.0, 0.0, 5.0]))
    flight = simulation.Flight(level.model, body, level.trim, dt_ns=DT_NS)
    before = flight.snapshot
    while flight.paused_reason is None and flight.snapshot.time < 1.0:
        before, snapshot = flight.snapshot, flight.step(level.trim)
    assert before.body.altitude > 0.0 >= snapshot.body.altitude > -0.1
    assert flight.paused_reason.startswith(f'ground contact at {snapshot.time:.3f} s with ')
    assert f'{np.linalg.norm(snapshot.body.velocity_B):.1f} m/s' in flight.paused_reason
    assert snapshot.body.is_finite() and snapshot.status is not Status.DIVERGED
    assert flight.step(level.trim) is snapshot   # it does not go on by itself
    assert flight.state.body is snapshot.body
    flight.reset()
    assert flight.paused_reason is None
    assert flight.step(level.trim).body.altitude > 0.0


@pytest.mark.parametrize('unsteady, inertia, rates', [
    (True, 1.0, 1e6),      # a spin of a million rad/s: no step of 6 ms resolves it
    (False, 1e-12, 0.1),   # a body without inertia, its loads lagging a step behind
])
def test_divergence_is_reported_and_the_last_good_state_kept(
        trainer, level, unsteady, inertia, rates):
    aircraft = dataclasses.replace(trainer, mass=MassProperties(
        trainer.mass.mass, trainer.mass.cg_G, trainer.mass.inertia_B * inertia))
    model = models.build(aircraft, Settings(unsteady=unsteady))
    flight = simulation.Flight(model, first_body(level, rates_B=np.full(3, rates)), level.trim,
                               dt_ns=DT_NS)
    good = flight.state
    with np.errstate(all='ignore'):   # the overflow is what is looked for
        for _ in range(50):
            flight.step(level.trim)
            if flight.paused_reason is not None:
                break
            good = flight.state
    assert flight.paused_reason == (
        f'diverged after {good.time_ns * 1e-9:.3f} s: a value is not finite; '
        'the last good state is kept')
    assert flight.state is good
    assert flight.state.body.is_finite() and np.isfinite(everything(flight.snapshot)).all()


def test_a_command_that_is_not_a_number_does_not_raise(level, quasi_steady):
    """The node filters commands; whoever does not gets a reported divergence."""
    for model in (level.model, quasi_steady):
        flight = simulation.Flight(model, first_body(level), level.trim, dt_ns=DT_NS)
        flight.step(Controls(np.array([0.0, math.nan, 0.0]), 0.5))
        assert flight.paused_reason.startswith('diverged after 0.000 s')
        assert np.isfinite(everything(flight.snapshot)).all()


@pytest.mark.parametrize('airspeed, dt, message', [
    (AIRSPEED, 0.02, r'dt must be above 0 and at most 0\.012 s .* got 0\.02 s'),
    (AIRSPEED, 0.0, 'dt must be above 0'),
    (5.0, None, 'no level trim at 5 m/s: '),
    (28.0, None, 'no level trim at 28 m/s: the throttle would have to stand at 3'),
])
def test_flights_that_cannot_start_say_why(trainer, airspeed, dt, message):
    with pytest.raises(ConfigError, match=message):
        simulation.start(trainer, airspeed=airspeed, altitude=300.0, dt=dt)


@pytest.mark.parametrize('airspeed, milliseconds', [(15.0, 6), (12.5, 8), (10.0, 10), (500.0, 1)])
def test_automatic_step_is_a_panel_of_travel_in_whole_milliseconds(
        level, airspeed, milliseconds):
    assert level.model.aircraft.reference.chord == 0.4 and level.model.settings.chordwise == 4
    assert simulation.automatic_dt_ns(level.model, airspeed) == milliseconds * 1_000_000


# --- any attitude

def test_any_attitude_and_any_onset_stays_finite(level):
    random = np.random.default_rng(20260101)
    limits = np.array([control.limits for control in level.model.aircraft.controls])
    for _ in range(20):
        q_NB = random.normal(size=4)
        body = BodyState(
            np.array([0.0, 0.0, -500.0]),
            velocity_from_flow_angles(random.uniform(0.0, 30.0), random.uniform(-math.pi, math.pi),
                                      random.uniform(-math.pi / 2, math.pi / 2)),
            random.uniform(-2.0, 2.0, 3), q_NB / np.linalg.norm(q_NB))
        controls = Controls(random.uniform(limits[:, 0], limits[:, 1]), random.uniform())
        snapshots = fly(level.model, body, held(controls), 0.5)
        assert len(snapshots) == 84
        assert all(np.isfinite(everything(s)).all() for s in snapshots)
        assert all(s.status is not Status.DIVERGED for s in snapshots)
        # Aerodynamic force over dynamic pressure and all the area there is (1.7 m^2): a plate
        # across the stream has 2; rotation, ends of control travel and added mass are allowed
        # as much again, with the highest speed of the flight.
        fastest = max(s.airspeed + 1.6 * np.linalg.norm(s.body.rates_B) for s in snapshots)
        largest = max(np.linalg.norm(s.force_B) for s in snapshots)
        assert largest < 4.0 * 0.5 * 1.17 * fastest**2 * 1.7


def tailslide(model, pitch_deg, speed):
    body = BodyState(np.array([0.0, 0.0, -500.0]), np.array([speed, 0.0, 0.0]), np.zeros(3),
                     quaternion_from_euler(0.0, math.radians(pitch_deg), 0.0))
    return fly(model, body, held(Controls(np.zeros(3))), 1.5)


def rise(energy):
    """Return the largest rise above any earlier value."""
    return np.max(energy - np.minimum.accumulate(energy))


def mechanical_energy(snapshots, mass):
    return np.array([
        0.5 * mass.mass * s.body.velocity_B @ s.body.velocity_B
        + 0.5 * s.body.rates_B @ mass.inertia_B @ s.body.rates_B
        + mass.mass * GRAVITY * s.body.altitude for s in snapshots])


@pytest.mark.parametrize('pitch_deg, speed', [(90, 3), (89, 3), (80, 4), (60, 3), (90, 0), (0, 0)])
def test_without_thrust_quasi_steady_flight_never_gains_energy(
        trainer, quasi_steady, pitch_deg, speed):
    """Straight up, through V = 0 and down tail first: steady loads only take energy away."""
    snapshots = tailslide(quasi_steady, pitch_deg, speed)
    if pitch_deg > 85:
        assert min(s.airspeed for s in snapshots) < 0.1
        assert abs(snapshots[-1].alpha) > math.radians(150.0)
    # 45 kJ of height, to 1e-10 by the corrector's own truncation.
    assert rise(mechanical_energy(snapshots, trainer.mass)) < 5e-6


@pytest.mark.parametrize('pitch_deg, speed', [(90, 3), (89, 3), (80, 4), (60, 3), (90, 0), (0, 0)])
def test_without_thrust_an_unsteady_flight_gets_back_no_more_than_the_air_had(
        trainer, level, pitch_deg, speed):
    """
    The air that the aircraft moves has kinetic energy, and may give back that and no more.

    Held to a tenth of the largest energy that the added mass had in the flight: most of it goes
    into the wake. Measured: at most half a per cent, and nothing where the fall is straight.
    """
    snapshots = tailslide(level.model, pitch_deg, speed)
    air = max(0.5 * s.density * nu @ level.model.added_mass @ nu
              for s in snapshots
              for nu in [np.concatenate([s.velocity_air_B, s.body.rates_B])])
    assert rise(mechanical_energy(snapshots, trainer.mass)) < 0.1 * air + 5e-6
    assert mechanical_energy(snapshots, trainer.mass)[-1] \
        < mechanical_energy(snapshots, trainer.mass)[0]
    if pitch_deg < 80:
        return
    # Up and down in the plane of symmetry nothing rolls: no flutter tail first.
    assert np.abs([s.body.rates_B[[0, 2]] for s in snapshots]).max() < 1e-6
