# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Modes of the linear lattice against its own march and against the nonlinear simulation.

The aircraft is the trainer with few strips and a short wake: what is compared are two
computations on the same lattice, step and rows, at 4 deg and past the stall at 20 deg.
"""

import dataclasses
import math

import curves
import numpy as np
import pytest
import wings
from scipy.optimize import least_squares

from poststall_sim import simulation
from poststall_sim import trim as trims
from poststall_sim.aero import model as models
from poststall_sim.aero.model import Settings
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.wake import Shape
from poststall_sim.aircraft import MassProperties
from poststall_sim.atmosphere import standard_air
from poststall_sim.frames import euler_from_quaternion, quaternion_from_euler, rotation
from poststall_sim.stability import derivatives, flight, motion
from poststall_sim.stability.motion import Decambering
from poststall_sim.state import BodyState

ALTITUDE = 300.0
LONGITUDINAL, LATERAL = [0, 2, 4, 7], [1, 3, 5, 6]


def trainer(heavier=1.0):
    """Return the trainer with few strips, its mass and inertia times a factor."""
    machine = curves.with_strips(wings.shipped_aircraft('trainer'), wing=10, tail=4, fin=3)
    mass = machine.mass
    return dataclasses.replace(machine, mass=MassProperties(
        heavier * mass.mass, mass.cg_G, heavier * mass.inertia_B))


class Trimmed:
    """The trainer in a glide, and its linear systems."""

    def __init__(self, degrees, *, shape=Shape.FROZEN, separation=Separation.QUASI_STEADY,
                 heavier=1.0, chords=5.0, chordwise=2, dt=None):
        machine = trainer(heavier)
        self.model = models.build(machine, Settings(
            chordwise=chordwise, wake_length=chords * machine.reference.chord, wake=shape,
            separation=separation, tolerance=1e-11, **wings.EXACTLY))
        for alpha in (*range(2, degrees, 3), degrees):
            self.trim, = flight.trims_along(self.model, [math.radians(alpha)], altitude=ALTITUDE)
        self.dt = simulation.automatic_dt_ns(self.model, self.trim.airspeed) * 1e-9 \
            if dt is None else dt
        at = flight.linearise(self.model, self.trim, altitude=ALTITUDE,
                              decamberings=tuple(Decambering), dt=self.dt)
        self.systems = at.systems

    def modes(self, decambering):
        return flight.flight_modes(
            self.model, self.systems[decambering], self.trim, decambering)[0]

    def own(self, decambering):
        """Return the eigenvalues [1/s] that are the body's for the most part."""
        found = motion.spectrum(self.systems[decambering])
        return found.eigenvalues[found.participation > 0.5]

    def flown(self, kick, steps):
        """Return what becomes of a small change, (steps, 9): half the difference of both signs."""
        return 0.5 * (self._flown(kick, steps) - self._flown(-kick, steps))

    def _flown(self, kick, steps):
        pitch = self.trim.alpha + self.trim.climb_angle
        place, dt_ns = np.array([0.0, 0.0, -ALTITUDE]), round(self.dt * 1e9)
        state, _ = simulation.begin(
            self.model, BodyState(place, self.trim.velocity_B, np.zeros(3),
                                  quaternion_from_euler(0.0, pitch, 0.0)),
            self.trim.controls, dt_ns=dt_ns, delta0=self.trim.aero.strips.delta)
        state = dataclasses.replace(state, body=BodyState(
            place, self.trim.velocity_B + kick[:3], kick[3:6],
            quaternion_from_euler(kick[6], pitch + kick[7], kick[8])))
        out = []
        for _ in range(steps):
            state, _ = simulation.step(self.model, state, self.trim.controls, dt_ns=dt_ns)
            body = state.body
            out.append(np.concatenate([
                body.velocity_B, body.rates_B, euler_from_quaternion(body.q_NB)]))
        return np.array(out)


def fitted(signal, dt, others, start):
    """
    Return the eigenvalue [1/s] with which exponentials fit a signal (steps, states) best.

    others (k,) : eigenvalues that the signal has some of as well; start : where it is looked for.
    """
    time = dt * np.arange(len(signal))
    signal = signal / np.abs(signal).max(axis=0)
    # In a growing signal the begin counts as much as the end.
    weight = np.exp(-max(start.real, 0.0) * time)[:, None]

    def columns(value):
        wave = np.exp(value * time)
        return [wave.real, wave.imag] if abs(value.imag) > 1e-9 else [wave.real]

    rest = [column for value in others for column in columns(value)]

    def left(unknown):
        basis = np.column_stack(columns(complex(*unknown)) + rest) * weight
        parts = np.linalg.lstsq(basis, weight * signal, rcond=None)[0]
        return (basis @ parts - weight * signal).ravel()

    unknown = [start.real, start.imag] if abs(start.imag) > 1e-9 else [start.real]
    return complex(*least_squares(left, unknown, x_scale=abs(start), xtol=1e-10, ftol=1e-12,
                                  gtol=1e-14).x)


def nearest(values, wanted):
    return values[np.argmin(np.abs(values - wanted))]


@pytest.mark.parametrize('decambering', Decambering)
@pytest.mark.parametrize('degrees', [4, 20])
def test_an_eigenvalue_is_the_rate_at_which_the_linear_march_dies_away(degrees, decambering):
    """Begun with a mode's whole vector the march stays in it and grows by z a step: to 1e-6."""
    system = Trimmed(degrees).systems[decambering]
    z, vectors, residual = motion.arnoldi(system, 12)
    assert residual.max() < 1e-10
    solve = motion.factorised(system.e)
    for each, vector in zip(z, vectors):
        x = vector
        for _ in range(20):
            x = system.a @ x
            # Of length one at every step, or round-off outgrows a mode that dies quickly.
            x = (solve.solve(x.real) + 1j * solve.solve(x.imag)) / each
        assert np.linalg.norm(x - vector) < 1e-6 * np.linalg.norm(vector)


def lasting(at, decambering, wanted, known=()):
    """
    Return what an eigenvalue [1/s] is in the simulation that is let go with its vector.

    And what the same record of the linear march gives, which says how far to trust it. The flow
    is not in the mode when the body is let go, and sets off a little of the others. known : pairs
    of linear eigenvalues and what they are in this simulation.
    """
    found = motion.spectrum(at.systems[decambering])
    which = np.argmin(np.abs(found.eigenvalues - wanted))
    vector = found.vectors[:, which]
    states = LATERAL if np.linalg.norm(vector[LATERAL]) > np.linalg.norm(vector[LONGITUDINAL]) \
        else LONGITUDINAL
    vector = vector * np.exp(-1j * np.angle(vector[states][np.argmax(np.abs(vector[states]))]))
    kick = 1e-5 * vector.real / np.abs(vector[:8]).max()
    turns = 9.0 / abs(wanted.imag) if abs(wanted.imag) > 1e-9 else 0.0
    last = min(max(3.0 / abs(wanted.real), turns), 6.0)
    begin, end = round(0.4 / at.dt), round((0.4 + last) / at.dt)
    kind = np.linalg.norm(found.vectors[states], axis=0) \
        > 0.7 * np.linalg.norm(found.vectors[:8], axis=0)
    kind[which] = False
    others = linear = found.eigenvalues[kind & (found.participation > 0.1)]
    for value, simulated in known:
        others = np.where(np.abs(others - value) < 1e-6, simulated, others)
    records = at.flown(kick, end), at.systems[decambering].march(kick, end)[1:]
    return tuple(fitted(record[begin:, states], at.dt, rest, wanted)
                 for record, rest in zip(records, (others, linear)))


@pytest.mark.parametrize('shape', [Shape.FROZEN, Shape.PRESCRIBED])
@pytest.mark.parametrize('decambering', [Decambering.VARIABLE, Decambering.LAGGED])
@pytest.mark.parametrize('degrees', [4, 20])
def test_modes_are_those_of_the_simulation_with_the_same_wake(degrees, decambering, shape):
    """
    Each mode slower than 3/s, or past the stall all of the body's five: within 1 %.

    The simulation predicts and corrects, the linear system solves both at once, and the air's
    density changes with altitude in the one only. With the wake in the air 2 %, or 0.002 1/s: it
    leaves the edge from where the simulation has predicted it.
    """
    lagged = decambering is Decambering.LAGGED
    at = Trimmed(degrees, separation=Separation.LAG if lagged else Separation.QUASI_STEADY,
                 shape=shape)
    held, known = [], []
    for value in sorted(at.own(decambering), key=lambda value: -value.real):
        if abs(value) < 1e-6 or value.real < -3.0:
            continue   # the heading, and what is gone before the record begins
        found, marched = lasting(at, decambering, value, known)
        known.append((value, found))
        print(f'{value:.4f} linear, {marched:.4f} marched, {found:.4f} simulated')
        assert abs(marched - value) < 0.01 * abs(value)
        bound = 0.01 * abs(value) if shape is Shape.FROZEN else max(0.02 * abs(value), 2e-3)
        assert abs(found - marched) < bound
        held.append(value)
    assert len(held) >= (3 if degrees == 4 else 5)


def test_a_wake_in_the_air_is_not_one_that_is_frozen():
    """
    Past the stall, lateral modes: their sideslip turns a wake in the air, and a frozen one not.

    Attached, the air's load at rest is that of steady flow, with a wake that turns; what is left
    is the straight wake of a steady turn.
    """
    apart = {}
    frozen, real = (Trimmed(20, shape=shape).modes(Decambering.VARIABLE).modes[:5]
                    for shape in (Shape.FROZEN, Shape.PRESCRIBED))
    for one, other in zip(frozen, real):
        assert one.name == other.name
        apart[one.name] = abs(one.eigenvalue - other.eigenvalue) / abs(other.eigenvalue)
        print(f'{one.name}: frozen wake {one.eigenvalue:.3f}, in the air {other.eigenvalue:.3f} '
              f'1/s, {apart[one.name]:.1%}')
    assert apart['phugoid'] < 0.01
    assert 0.03 < apart['spiral'] < 0.1 and 0.03 < apart['Dutch roll'] < 0.1
    at = Trimmed(4, shape=Shape.PRESCRIBED, chords=20.0)
    still = motion.response(at.systems[Decambering.VARIABLE], 1.0).real
    steady = derivatives.quasi_steady(
        at.model, at.trim, density=standard_air(ALTITUDE).density).motion
    by_velocity, by_rates = still[:, :3] - steady[:, :3], still[:, 3:] - steady[:, 3:]
    assert np.abs(by_velocity).max() < 1e-4 * np.abs(steady[:, :3]).max()
    assert np.abs(by_rates).max() < 0.02 * np.abs(steady[:, 3:]).max()


def test_modes_converge_with_panels_steps_and_wake():
    """Slow modes past the stall: each change is less than the one before, by a third at least."""
    def slow(**options):
        found = Trimmed(20, **options).modes(Decambering.VARIABLE)
        return np.array([next(mode.eigenvalue for mode in found.modes if mode.name == name)
                         for name in ('phugoid', 'Dutch roll', 'spiral')])

    airspeed = Trimmed(20).trim.airspeed
    longer = [slow(chords=chords) for chords in (2.0, 4.0, 8.0)]
    finer = [slow(chordwise=panels, dt=0.4 / panels / airspeed) for panels in (4, 8, 16)]
    shorter = [slow(chordwise=4, dt=0.1 / share / airspeed) for share in (1, 2, 4)]
    for first, second, third in (longer, finer, shorter):
        # A wake of four chords is long enough for all but the phugoid.
        assert np.all(np.abs(third - second)
                      < 0.67 * np.abs(second - first) + 2e-3 * np.abs(third))


def test_a_heavy_aircraft_has_the_modes_of_quasi_steady_air():
    """
    Twenty times heavier, it moves little in the time that the air needs.

    Slow modes within 2 %, the short period within 10 %: at its reduced frequency of 0.02 the
    wake takes 3 % of the lift and shifts it by as much of a radian. The spiral, a small
    difference of large moments, is within 2 % of the same lattice's at rest only: in the classical
    equations the wake of a steady turn is straight, and that changes the spiral by an eighth.
    """
    at = Trimmed(4, heavier=20.0, chords=20.0, shape=Shape.PRESCRIBED)
    system = at.systems[Decambering.VARIABLE]
    lattice = {mode.name: mode for mode in at.modes(Decambering.VARIABLE).modes}
    classical = {mode.name: mode for mode in flight.quasi_steady_modes(
        at.model, at.trim, altitude=ALTITUDE).modes}
    assert list(lattice)[:5] == list(classical) == [
        'short period', 'phugoid', 'Dutch roll', 'roll', 'spiral']
    reference = at.model.aircraft.reference
    value = classical['short period'].eigenvalue
    reduced = abs(value) * reference.chord / (2.0 * at.trim.airspeed)
    assert reduced < 0.02
    at_rest = np.linalg.eigvals(motion.quasi_steady(system))
    for name, mode in classical.items():
        value, still = lattice[name].eigenvalue, nearest(at_rest, mode.eigenvalue)
        print(f'{name}: lattice {value:.4f}, at rest {still:.4f}, classical '
              f'{mode.eigenvalue:.4f}')
        bound = 0.1 if name == 'short period' else 0.02
        assert abs(value - still) < bound * abs(still)
        if name != 'spiral':
            assert abs(value - mode.eigenvalue) < bound * abs(value)


def test_loads_at_rest_are_the_stability_derivatives():
    """H(1) against differences of steady loads: all but what the wake's direction does."""
    at = Trimmed(20, chords=20.0)
    still = motion.response(at.systems[Decambering.VARIABLE], 1.0).real
    found = derivatives.quasi_steady(
        at.model, at.trim, density=standard_air(ALTITUDE).density)
    # The steady wake turns with the stream, the frozen one stays: 2 % of the largest.
    assert still == pytest.approx(found.motion, abs=0.02 * np.abs(found.motion).max())


def test_a_gust_blows_on_the_engine_as_well():
    """Powered level flight: a wind that rises at once along the flight, simulated and linear."""
    at = Trimmed(4, shape=Shape.PRESCRIBED)
    level = trims.powered(at.model, alpha=math.radians(4.0), altitude=ALTITUDE)
    dt_ns = simulation.automatic_dt_ns(at.model, level.airspeed)
    found = flight.linearise(at.model, level, altitude=ALTITUDE,
                             decamberings=(Decambering.VARIABLE,), dt=dt_ns * 1e-9)
    system = found.systems[Decambering.VARIABLE]
    gust_B, steps = np.array([0.02, 0.0, 0.01]), 100
    body = BodyState(np.array([0.0, 0.0, -ALTITUDE]), level.velocity_B, np.zeros(3), level.q_NB)

    def flown(sign):
        state, _ = simulation.begin(at.model, body, level.controls, dt_ns=dt_ns,
                                    delta0=level.aero.strips.delta)
        wind_N = sign * rotation(level.q_NB) @ gust_B
        for _ in range(steps):
            state, _ = simulation.step(
                at.model, state, level.controls, dt_ns=dt_ns, wind_N=wind_N)
        return np.concatenate([state.body.velocity_B, state.body.rates_B])

    entering = system.b[:, [system.inputs.index(f'gust_{axis}') for axis in 'uvw']] @ gust_B
    solve, x = motion.factorised(system.e), np.zeros(system.size)
    for _ in range(steps):
        x = solve.solve(system.a @ x + entering)
    simulated, linear = 0.5 * (flown(1.0) - flown(-1.0)), x[system.own][:6]
    assert abs(simulated[0]) > 1e-3
    # The gust is there at the first step's end in the one, and from its begin on in the other.
    assert linear == pytest.approx(simulated, abs=0.02 * np.abs(simulated).max())
