# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The trainer in gliding trim from 1 to 25 degrees: its trims, its modes, and how it answers.

With the settings that a flight has by default. Angles are in degrees here.
"""

import math
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm
from wing_tail import DEG

from poststall_sim import definition, modal_analysis, simulation
from poststall_sim.aero import model as models
from poststall_sim.aero.model import Model
from poststall_sim.aero.wake import Shape
from poststall_sim.plots import modes as plots
from poststall_sim.plots import style
from poststall_sim.plots.decambering import Curve, Kind, Panel, draw
from poststall_sim.stability import flight
from poststall_sim.stability.motion import Decambering
from poststall_sim.state import BodyState
from poststall_sim.trim import Trim

ALPHAS = range(1, 26)
ALTITUDE = 1000.0
PITCH_RATE, ROLL_RATE = 4, 3
"""Where q and p stand in the states of a free body."""


@cache
def trainer(wake: Shape = Shape.PRESCRIBED) -> Model:
    """Return the trainer with a wake of a shape."""
    aircraft = definition.aircraft(definition.find(definition.Kind.AIRCRAFT, 'trainer'))
    return models.build(aircraft, models.Settings(wake=wake))


@cache
def trimmed() -> tuple[Trim, ...]:
    """Return the glide at each angle of attack."""
    return tuple(flight.trims_along(trainer(), np.radians(ALPHAS), altitude=ALTITUDE))


@cache
def points() -> tuple[dict[str, Any], ...]:
    """Return the modes with fixed and variable decambering, and the quasi-steady ones."""
    return tuple(point for at in tqdm(modal_analysis.modes(
        trainer(), np.radians(ALPHAS), altitude=ALTITUDE, climb_angle=None,
        kinds=(Decambering.FIXED, Decambering.VARIABLE), quasi_steady=True),
        total=len(ALPHAS), desc='modes', leave=False) for point in at)


def figure_5_12(file: Path) -> None:
    """Draw the trims over alpha."""
    alphas = np.array(ALPHAS, dtype=float)
    elevator = trainer().aircraft.control_names.index('elevator')
    draw(file, [Panel(kind, '', (Curve('', alphas, np.array(values), style.ATTACHED,
                                       marker='o', size=3.5),), limits=(0.0, 26.0, None, None))
                for kind, values in (
                    (Kind.AIRSPEED, [each.airspeed for each in trimmed()]),
                    (Kind.CLIMB, np.degrees([each.climb_angle for each in trimmed()])),
                    (Kind.ELEVATOR, np.degrees([each.controls.deflections[elevator]
                                                for each in trimmed()])))], height=3.0)


def figure_5_13(file: Path) -> None:
    """Draw the longitudinal eigenvalues with increasing alpha."""
    plots.draw_loci(file, points(), plots.LOOKS[:1])


def figure_5_14(file: Path) -> None:
    """Draw the lateral eigenvalues with increasing alpha."""
    plots.draw_loci(file, points(), plots.LOOKS[1:])


@dataclass(frozen=True, slots=True)
class Kick:
    """A disturbance of a trim: the state it shows in, its size and how long it is followed."""

    kind: Kind
    state: int
    place: int
    share: float
    seconds: float


KICKS = (Kick(Kind.PITCHING, PITCH_RATE, 2, 0.01, 4.0), Kick(Kind.ROLLING, ROLL_RATE, 1, 0.01, 4.0))
"""A change of w and of v by a hundredth of the airspeed: half a degree of alpha and of beta."""


def linear(trim: Trim, kick: Kick) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and the rate [deg/s] of the linear aircraft."""
    found = flight.linearise(trainer(), trim, altitude=ALTITUDE,
                             decamberings=(Decambering.VARIABLE,))
    system = found.systems[Decambering.VARIABLE]
    steps = round(kick.seconds / system.flow.dt)
    start = np.zeros(9)
    start[kick.place] = kick.share * trim.airspeed
    return system.flow.dt * np.arange(steps + 1), np.degrees(
        system.march(start, steps)[:, kick.state])


def simulated(trim: Trim, kick: Kick, wake: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and the rate [deg/s] of a flight begun in trim and disturbed."""
    chosen = trainer(wake)
    dt_ns = simulation.automatic_dt_ns(chosen, trim.airspeed)
    body = BodyState(np.array([0.0, 0.0, -ALTITUDE]), trim.velocity_B, np.zeros(3), trim.q_NB)
    flown = simulation.Flight(chosen, body, trim.controls, dt_ns=dt_ns,
                              delta0=trim.aero.strips.delta)
    change = np.zeros(3)
    change[kick.place] = kick.share * trim.airspeed
    flown.state = replace(flown.state, body=replace(body, velocity_B=body.velocity_B + change))
    steps = round(kick.seconds / (dt_ns * 1e-9))
    rates = [0.0, *(flown.step(trim.controls).body.rates_B[kick.state - 3] for _ in range(steps))]
    return dt_ns * 1e-9 * np.arange(steps + 1), np.degrees(rates)


def figure_response(file: Path) -> None:
    """Draw a flight that is disturbed a little, and the linear one on top."""
    panels = []
    for alpha in (6, 17):
        trim = trimmed()[ALPHAS.index(alpha)]
        for kick, what in zip(KICKS, ('w', 'v')):
            curves = [
                Curve('simulated, frozen wake', *simulated(trim, kick, Shape.FROZEN),
                      style.ATTACHED, width=2.6, top=2),
                Curve('simulated, wake as by default', *simulated(trim, kick, Shape.PRESCRIBED),
                      style.SECOND, (0, (5, 2)), top=3),
                Curve('linear', *linear(trim, kick), style.INK, (0, (1, 1.5)), width=1.4, top=4)]
            panels.append(Panel(
                kick.kind, rf'$\alpha$ = {alpha}{DEG}, {what} by {math.floor(100 * kick.share)} % '
                'of V', tuple(curves), limits=(0.0, kick.seconds, None, None)))
    draw(file, panels, columns=2, height=2.8)
