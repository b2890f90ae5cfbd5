# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Wind with shear, discrete gusts, turbulence: their values, and a flight that feels them."""

import math
from dataclasses import replace

import numpy as np
import pytest
import wings

from poststall_sim import flight_file, simulation
from poststall_sim.aero import solver
from poststall_sim.aero.model import Onset
from poststall_sim.atmosphere import Atmosphere
from poststall_sim.frames import body_to_geometry, euler_from_quaternion, geometry_to_body
from poststall_sim.records import ConfigError
from poststall_sim.state import BodyState, Status
from poststall_sim.turbulence import FOOT, Spectrum, Turbulence, military
from poststall_sim.weather import (
    CALM,
    ROUGH,
    SMOOTH,
    Gust,
    GustShape,
    Shear,
    ShearLaw,
    Weather,
    gust_ahead,
)

NORTH, WEST, EAST = np.eye(3)[0], -np.eye(3)[1], np.eye(3)[1]
AIRSPEED, ALTITUDE = 15.0, 100.0


@pytest.fixture(scope='module')
def start():
    """Return a function that gives the trainer in level trim, heading north, in a weather."""
    first = simulation.start(
        wings.shipped_aircraft('trainer'), airspeed=AIRSPEED, altitude=ALTITUDE)
    saved = first.saved()

    def flight(weather=CALM):
        return simulation.Flight.resumed(first.model, replace(
            saved, weather=weather, state=saved.state))
    return flight


def flown(flight, steps=60):
    for _ in range(steps):
        snapshot = flight.step(flight.trim)
        assert snapshot.status is Status.CONVERGED
    return snapshot


def test_logarithmic_profile_of_the_specification():
    """ln(h / z0) over ln(20 ft / z0): twice the wind at 200 ft for z0 = 2 ft, 1 at 20 ft."""
    rough = Shear(ShearLaw.LOGARITHMIC, ROUGH)
    assert rough.share(FOOT * np.array([20.0, 200.0])) == pytest.approx([1.0, 2.0])
    # ln(200 / 0.15) / ln(20 / 0.15) = 7.1954 / 4.8929
    assert Shear(ShearLaw.LOGARITHMIC, SMOOTH).share(200.0 * FOOT) == pytest.approx(
        1.4706, abs=1e-4)
    assert rough.share(3000.0) == rough.share(1000.0 * FOOT)
    assert rough.share(-10.0) == rough.share(3.0 * FOOT) > 0.0


def test_power_profile():
    shear = Shear(ShearLaw.POWER, 0.5, reference_height=10.0)
    assert shear.share(np.array([10.0, 40.0, 90.0])) == pytest.approx([1.0, 2.0, 3.0])


@pytest.mark.parametrize('shape, values', [
    (GustShape.ONE_MINUS_COSINE, [0.0, 0.0, 0.5, 1.0, 0.5, 0.0, 0.0]),
    (GustShape.RISE, [0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0])])
def test_gust_rises_as_a_cosine_and_goes_back_or_stays(shape, values):
    """At ways of -1, 0, 1/2, 1, 3/2, 2 and 9 of its length, counted from 100 m north."""
    gust = Gust(np.array([0.0, 2.0, -4.0]), 10.0, 100.0, NORTH, shape)
    points = np.zeros((7, 3))
    points[:, 0] = 100.0 + 10.0 * np.array([-1.0, 0.0, 0.5, 1.0, 1.5, 2.0, 9.0])
    expected = np.outer(values, gust.velocity_N)
    assert gust.velocity(0.0, points) == pytest.approx(expected, abs=1e-12)
    # One that comes at 5 m/s has come 50 m in 10 s.
    coming = replace(gust, speed=5.0)
    assert coming.velocity(10.0, points - [50.0, 0.0, 0.0]) == pytest.approx(expected, abs=1e-12)


def test_gusts_and_turbulence_go_with_the_wind():
    """What is met now is what was there before the wind carried it here."""
    weather = Weather(np.array([3.0, 1.0, 0.0]), gusts=(Gust(WEST, 5.0, 20.0, NORTH),),
                      turbulence=military(Spectrum.DRYDEN, 1.0, altitude=100.0))
    points = np.random.default_rng(0).uniform(-50.0, 50.0, (20, 3))
    carried = np.array([30.0, 10.0, 0.0])
    assert weather.beyond_N(10.0, points + carried, carried, weather.wind_N) == pytest.approx(
        weather.beyond_N(0.0, points, np.zeros(3), weather.wind_N), abs=1e-12)


def test_a_flight_begins_trimmed_in_the_wind_of_its_height(start):
    """Twice the wind at four times the height; the airspeed is the trimmed one."""
    shear = Shear(ShearLaw.POWER, 0.5, reference_height=ALTITUDE / 4.0)
    flight = start(Weather(np.array([2.0, -1.0, 0.0]), shear))
    snapshot = flight.reset()
    assert snapshot.wind_N == pytest.approx([4.0, -2.0, 0.0])
    assert snapshot.airspeed == pytest.approx(AIRSPEED, abs=1e-9)
    snapshot = flown(flight, 30)
    share = math.sqrt(snapshot.body.altitude / (ALTITUDE / 4.0))
    assert snapshot.wind_N == pytest.approx([2.0 * share, -share, 0.0], abs=1e-3)
    assert flight.carried_N == pytest.approx(
        np.array([4.0, -2.0, 0.0]) * snapshot.time, rel=1e-3)


@pytest.mark.parametrize('half, roll', [(WEST, 1.0), (EAST, -1.0)])
def test_a_wing_with_one_half_in_rising_air_rolls_to_the_other(start, half, roll):
    """The air rises from 0.2 m left of the flight path on: the left wing with it."""
    rising = Gust(np.array([0.0, 0.0, -1.0]), 0.3, 0.2, half, GustShape.RISE)
    snapshot = flown(start(replace(CALM, gusts=(rising,))), 30)
    assert roll * euler_from_quaternion(snapshot.body.q_NB)[0] > math.radians(1.0)


def test_lift_in_a_long_gust_is_that_of_steady_flow_in_it(start):
    """
    Held on its way, 1 % of the airspeed from below: the lift of steady flow with that onset.

    The front is over after 1 m; 1.2 s are 150 half chords behind it, where Wagner's function is
    within 2 % of its end.
    """
    flight, gust = start(), np.array([0.0, 0.0, -0.01 * AIRSPEED])
    front = Gust(gust, 1.0, 1.0, NORTH, GustShape.RISE)
    weather = replace(CALM, gusts=(front,))
    first, state = flight.state.body, flight.state
    velocity_N = np.array([AIRSPEED, 0.0, 0.0])
    motion = np.concatenate([first.velocity_B, first.rates_B])
    for _ in range(200):
        new, snapshot = simulation.step(
            flight.model, state, flight.trim, dt_ns=flight.dt_ns,
            gusts=lambda time, points: weather.beyond_N(time, points, np.zeros(3), np.zeros(3)))
        body = BodyState(first.position_N + velocity_N * new.time_ns * 1e-9, first.velocity_B,
                         first.rates_B, first.q_NB)
        state = replace(new, body=body, load=flight.state.load, motion=motion,
                        previous_motion=motion)
    alpha, force = flight.snapshot.alpha, {}
    down_B = np.array([-math.sin(alpha), 0.0, math.cos(alpha)])
    for name, down in (('calm', 0.0), ('gust', gust[2])):
        aero = solver.steady(
            flight.model, Onset(body_to_geometry(down * down_B - first.velocity_B), np.zeros(3)),
            flight.trim.deflections, density=snapshot.density,
            delta0=flight.snapshot.strips.delta)
        force[name] = -geometry_to_body(aero.force_G)[2]
    assert force['gust'] > 1.05 * force['calm']
    # Of the load, not of the force measured: that has the air that a free body would carry along.
    assert flight.state.load[2] - new.load[2] == pytest.approx(
        force['gust'] - force['calm'], rel=0.03)


def rough_air():
    return Weather(
        np.array([2.0, 3.0, 0.0]), Shear(ShearLaw.LOGARITHMIC, ROUGH),
        (Gust(np.array([0.0, 1.0, -1.0]), 3.0, 5.0, NORTH),
         Gust(np.array([0.5, 0.0, 0.0]), 2.0, 4.0, WEST, GustShape.RISE, speed=1.0)),
        military(Spectrum.VON_KARMAN, 0.6, altitude=ALTITUDE, seed=11))


def state_of(flight):
    return {name: value.tobytes() for name, value in flight_file._arrays('', flight.saved())}


def test_same_seed_same_flight_to_the_last_bit(start):
    """Two flights, and one after a reset; with another seed another one."""
    flights = [start(rough_air()) for _ in range(2)]
    for flight in flights:
        flight.reset(0)
        flown(flight, 60)
    assert state_of(flights[0]) == state_of(flights[1])
    flights[1].reset(0)
    flown(flights[1], 60)
    assert state_of(flights[0]) == state_of(flights[1])
    other = rough_air()
    other = start(replace(other, turbulence=replace(other.turbulence, seed=12)))
    other.reset(0)
    assert np.abs(flown(other, 60).body.position_N
                  - flights[0].snapshot.body.position_N).max() > 1e-3


def test_rough_flight_goes_on_from_its_file_to_the_last_bit(start, tmp_path):
    """Wind, shear, gusts, turbulence, a hot day: all of it stands in the file."""
    flight = start(rough_air())
    flight.model = replace(flight.model, atmosphere=Atmosphere(20.0, 99000.0))
    flight.reset()
    flown(flight, 40)
    flight_file.save_state(flight, tmp_path / 'rough.npz')
    again = flight_file.load_state(start().model, tmp_path / 'rough.npz')
    assert again.model.atmosphere == flight.model.atmosphere
    assert [gust.shape for gust in again.weather.gusts] == [
        GustShape.ONE_MINUS_COSINE, GustShape.RISE]
    assert state_of(again) == state_of(flight)
    flown(flight, 40)
    flown(again, 40)
    assert state_of(again) == state_of(flight)


def test_gust_ahead_is_met_after_its_distance(start):
    """Put 3 m ahead at 15 m/s: nothing at the centre of gravity for 0.2 s, then the wind of it."""
    flight = start(Weather(np.array([0.0, 4.0, 0.0])))
    flight.reset()
    flown(flight, 10)
    snapshot = flight.snapshot
    gust = gust_ahead(np.array([0.0, 0.0, -1.0]), 1.5, snapshot.body.position_N - flight.carried_N,
                      np.array([AIRSPEED, 0.0, 0.0]), distance=3.0,
                      shape=GustShape.ONE_MINUS_COSINE)
    flight.weather = replace(flight.weather, gusts=(gust,))
    begun, felt = snapshot.time, []
    for _ in range(60):
        snapshot = flown(flight, 1)
        felt.append((snapshot.time - begun, -snapshot.wind_N[2]))
    time, up = np.array(felt).T
    assert np.all(up[time < 0.195] == 0.0) and up.max() == pytest.approx(1.0, abs=0.02)
    assert time[np.argmax(up)] == pytest.approx(4.5 / AIRSPEED, abs=0.015)
    with pytest.raises(ConfigError, match='only what moves'):
        gust_ahead(NORTH, 1.0, NORTH, np.zeros(3), distance=1.0, shape=GustShape.RISE)


def test_gusts_left_behind_are_forgotten_when_another_comes():
    """One of 2 x 10 m from 0 on: 219 m on it is still kept, 221 m on it is not; a rise stays."""
    first = Gust(WEST, 10.0, 0.0, NORTH)
    stays, another = replace(first, shape=GustShape.RISE), replace(first, begin=500.0)
    weather = replace(CALM, gusts=(first, stays))
    for place, kept in ((219.0, (first, stays, another)), (221.0, (stays, another))):
        assert weather.with_gust(another, 0.0, place * NORTH).gusts == kept


def test_turbulence_is_felt_by_wings_in_two_winds(start):
    """In a field of 3 m the strips of a wing 3 m wide work at angles that are not each other's."""
    field = Turbulence(Spectrum.DRYDEN, 1.0, 1.0, 3.0, 3.0, 5)
    snapshot = flown(start(replace(CALM, turbulence=field)), 40)
    wing = snapshot.strips.alpha[:20]
    assert np.abs(wing - wing[::-1]).max() > math.radians(1.0)


@pytest.mark.parametrize('wrong, what', [
    (lambda: Shear(ShearLaw.POWER, -0.1), 'exponent'),
    (lambda: Shear(ShearLaw.LOGARITHMIC, 2.0), 'roughness'),
    (lambda: Shear(ShearLaw.POWER, 0.2, reference_height=0.0), 'reference height'),
    (lambda: Gust(NORTH, 0.0, 0.0, NORTH), 'length'),
    (lambda: Gust(NORTH, 1.0, math.nan, NORTH), 'begin'),
    (lambda: Gust(200.0 * NORTH, 1.0, 0.0, NORTH), 'velocity'),
    (lambda: Gust(NORTH, 1.0, 0.0, 2.0 * NORTH), 'unit vector'),
    (lambda: Weather(NORTH, gusts=(Gust(NORTH, 1.0, 0.0, NORTH),) * 21), '20 gusts')])
def test_what_is_no_weather_is_refused(wrong, what):
    with pytest.raises(ConfigError, match=what):
        wrong()
