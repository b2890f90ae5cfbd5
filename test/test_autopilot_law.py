# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The example autopilot's law: signs on single inputs, then the trainer flown by it in a loop."""

import math
from dataclasses import replace

import numpy as np
import pytest

from poststall_sim import autopilot_law, definition, simulation
from poststall_sim.autopilot_law import Law, Memory, Seen
from poststall_sim.frames import (
    euler_from_quaternion,
    quaternion_from_euler,
    velocity_from_flow_angles,
)
from poststall_sim.state import BodyState, Controls

LAW = Law()
HELD = Seen(roll=LAW.roll, pitch=LAW.pitch, p=0.0, q=0.0, r=0.0, airspeed=LAW.airspeed,
            alpha=0.09, beta=0.0)
TRIM = Memory(elevator=-0.02, throttle=0.3)


def commanded(law=LAW, memory=TRIM, dt=0.0, **seen):
    return autopilot_law.answer(law, memory, replace(HELD, **seen), dt)[0]


# --- signs: elevator down pushes, aileron rolls to the right, rudder left turns to the left

def test_what_is_held_asks_for_nothing_but_trim():
    answer = commanded()
    assert (answer.aileron, answer.rudder) == (0.0, 0.0)
    assert (answer.elevator, answer.throttle) == (TRIM.elevator, TRIM.throttle)


@pytest.mark.parametrize(('control', 'sign', 'seen'), [
    ('elevator', -1, {'pitch': LAW.pitch - 0.1}),   # too low: up
    ('elevator', +1, {'q': 0.1}),                   # nose rises: down
    ('elevator', +1, {'alpha': LAW.stall_alpha - 0.01}),   # no angle of attack left: down
    ('aileron', +1, {'roll': -0.1}),                # left wing low: to the right
    ('aileron', -1, {'p': 0.1}),                    # rolls to the right: to the left
    ('aileron', -1, {'roll': math.pi - 0.1}),       # on its back: the short way round
    ('aileron', +1, {'roll': -math.pi + 0.1}),
    ('rudder', +1, {'r': 0.1}),                     # yaws to the right: left
    ('rudder', -1, {'beta': 0.1}),                  # wind from the right: right, into it
    ('throttle', +1, {'airspeed': LAW.airspeed - 1.0}),
])
def test_each_error_is_answered_by_its_control_with_its_sign(control, sign, seen):
    assert (getattr(commanded(**seen), control) - getattr(commanded(), control)) * sign > 0.0


@pytest.mark.parametrize('seen', [{'alpha': 0.4}, {'stalled': 0.5}])
def test_a_stall_is_answered_by_push_power_and_rudder_against_the_bank(seen):
    answer = commanded(**{'alpha': 0.2, **seen, 'roll': 0.5})
    assert answer.elevator > TRIM.elevator and answer.throttle == LAW.recovery_throttle
    assert answer.rudder > 0.0 and answer.aileron == 0.0   # a bank to the right: rudder left
    assert commanded(**{'alpha': 0.2, **seen, 'roll': -0.5}).rudder < 0.0


def test_the_recovery_ends_when_both_alpha_and_airspeed_are_back():
    stalled = replace(TRIM, recovering=True)

    def recovering(memory=stalled, **seen):
        return autopilot_law.answer(LAW, memory, replace(HELD, **seen), 0.0)[1].recovering

    assert recovering(alpha=LAW.recovered_alpha + 0.01)
    assert recovering(airspeed=LAW.recovered_airspeed - 0.1)
    assert not recovering()
    assert not recovering(memory=TRIM, alpha=LAW.stall_alpha - 0.01)   # slow is no stall yet


def test_answers_and_what_is_added_up_stay_within_the_limits():
    memory = Memory()
    seen = replace(HELD, roll=-3.0, pitch=-1.5, airspeed=0.1, beta=1.0)
    for _ in range(1000):
        answer, memory = autopilot_law.answer(LAW, memory, seen, 0.1)
    assert (answer.elevator, answer.aileron, answer.rudder, answer.throttle) == (
        -LAW.elevator_limit, LAW.aileron_limit, -LAW.rudder_limit, 1.0)
    assert abs(memory.elevator) <= LAW.elevator_limit
    assert memory.aileron <= LAW.aileron_limit
    assert memory.throttle == 0.0   # full throttle as it is: nothing to add up


# --- the trainer in a loop with it

@pytest.fixture(scope='module')
def flight():
    return simulation.start(
        definition.aircraft(definition.find('aircraft', 'trainer')), airspeed=12.0,
        altitude=150.0)


def body(*, roll, pitch, alpha, airspeed, beta=0.0):
    """Return a body state of angles in deg, 150 m up and without rates."""
    roll, pitch, alpha, beta = np.radians([roll, pitch, alpha, beta])
    return BodyState(np.array([0.0, 0.0, -150.0]),
                     velocity_from_flow_angles(airspeed, alpha, beta), np.zeros(3),
                     quaternion_from_euler(roll, pitch, 0.0))


def seen_in(snapshot):
    roll, pitch, _ = euler_from_quaternion(snapshot.body.q_NB)
    return Seen(roll, pitch, *snapshot.body.rates_B, snapshot.airspeed, snapshot.alpha,
                snapshot.beta, snapshot.strips.stalled.mean())


def placed(flight, first):
    flight.reset(time_ns=0)
    flight.place(first, flight.trim)
    return flight


def flown(flight, law, seconds):
    """Return what is seen, the altitudes and whether it recovers, step by step from here."""
    names = flight.model.aircraft.control_names
    dt = flight.dt_ns * 1e-9
    memory = Memory(throttle=flight.trim.throttle)
    states = []
    for _ in range(round(seconds / dt)):
        seen = seen_in(flight.snapshot)
        answer, memory = autopilot_law.answer(law, memory, seen, dt)
        states.append((seen, flight.snapshot.body.altitude, memory.recovering))
        flight.step(Controls(np.array([getattr(answer, name) for name in names]),
                             answer.throttle))
    assert flight.paused_reason is None
    return states


def assert_held(seen, law):
    """Within a degree of the attitude and 0.3 m/s: what slow integrals leave after 12 s."""
    assert (seen.roll, seen.pitch) == pytest.approx((law.roll, law.pitch), abs=math.radians(1.0))
    assert seen.airspeed == pytest.approx(law.airspeed, abs=0.3)


@pytest.mark.parametrize(('law', 'first'), [
    (LAW, {'roll': 40.0, 'pitch': 15.0, 'alpha': 6.0, 'airspeed': 15.0, 'beta': 5.0}),
    (LAW, {'roll': -60.0, 'pitch': -20.0, 'alpha': 2.0, 'airspeed': 13.0}),
    (replace(LAW, roll=0.5, pitch=0.12, airspeed=14.0),
     {'roll': 0.0, 'pitch': 5.0, 'alpha': 5.0, 'airspeed': 12.0}),
])
def test_the_trainer_comes_to_the_attitude_and_airspeed_that_are_to_be_held(flight, law, first):
    states = flown(placed(flight, body(**first)), law, 12.0)
    assert not any(recovering for _, _, recovering in states)
    assert_held(states[-1][0], law)


@pytest.mark.parametrize('first', [
    {'roll': 30.0, 'pitch': 25.0, 'alpha': 25.0, 'airspeed': 9.0},
    {'roll': -50.0, 'pitch': 10.0, 'alpha': 30.0, 'airspeed': 9.0, 'beta': -8.0},
])
def test_the_trainer_comes_out_of_a_stall_with_a_wing_low(flight, first):
    states = flown(placed(flight, body(**first)), LAW, 12.0)
    assert states[0][0].stalled > 0.5 and states[0][2]
    recovered = next(k for k, (_, _, recovering) in enumerate(states) if not recovering)
    assert recovered * flight.dt_ns * 1e-9 < 2.0
    assert not any(recovering for _, _, recovering in states[recovered:])   # no second stall
    # 1.3 and 5.8 m are lost; as energy, the 3 m/s that are lacking are worth 3.2 m.
    assert min(altitude for _, altitude, _ in states) > 150.0 - 8.0
    assert_held(states[-1][0], LAW)


def test_the_trainer_comes_out_of_a_stall_that_was_flown_into(flight):
    """Throttled, pulled and kicked until a wing drops past 20 deg: the wake is a stalled one."""
    flight.reset(time_ns=0)
    while not (flight.snapshot.alpha > math.radians(20.0)
               and seen_in(flight.snapshot).roll > math.radians(30.0)):
        assert flight.snapshot.time < 4.0
        pull = math.radians(min(8.0 * flight.snapshot.time, 25.0))
        kick = -0.15 if flight.snapshot.time > 1.5 else 0.0
        flight.step(Controls(flight.trim.deflections + [0.0, -pull, kick], 0.0))
    begin = flight.snapshot
    states = flown(flight, LAW, 12.0)
    assert not any(recovering for _, _, recovering in states[round(2e9 / flight.dt_ns):])
    assert max(seen.alpha for seen, _, _ in states[round(1e9 / flight.dt_ns):]) < LAW.stall_alpha
    # 9.2 m are lost; as energy, the 5.2 m/s that are lacking are worth 5.0 m.
    assert min(altitude for _, altitude, _ in states) > begin.body.altitude - 12.0
    assert_held(states[-1][0], LAW)
