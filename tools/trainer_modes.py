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
from poststall_sim.atmosphere import standard_air
from poststall_sim.plots import modes as plots
from poststall_sim.plots import style
from poststall_sim.plots.decambering import Curve, Kind, Panel, draw
from poststall_sim.stability import flight
from poststall_sim.stability.motion import Decambering
from poststall_sim.state import BodyState
from poststall_sim.trim import Trim

ALPHAS = range(1, 26)
HIGH = 1000.0
"""Where it flies when it is disturbed [m]; trims and modes are those at sea level."""
EXACT = 1e-9
"""Tolerance of the closure, against which a small disturbance is large [rad]."""
SETTLED = 3
"""Steps in which a jump has been through the differences in time."""
PITCH_RATE, ROLL_RATE = 4, 3
"""Where q and p stand in the states of a free body."""


@cache
def trainer(wake: Shape = Shape.PRESCRIBED) -> Model:
    """Return the trainer with a wake of a shape."""
    aircraft = definition.aircraft(definition.find(definition.Kind.AIRCRAFT, 'trainer'))
    return models.build(aircraft, models.Settings(wake=wake, tolerance=EXACT))


@cache
def trimmed() -> tuple[Trim, ...]:
    """Return the glide at each angle of attack."""
    return tuple(flight.trims_along(trainer(), np.radians(ALPHAS), altitude=0.0))


@cache
def points() -> tuple[dict[str, Any], ...]:
    """Return the modes with fixed and variable decambering, and the quasi-steady ones."""
    return tuple(point for at in tqdm(modal_analysis.modes(
        trainer(), np.radians(ALPHAS), altitude=0.0, climb_angle=None,
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


def _eigenvalue(mode: dict[str, Any] | None) -> str:
    """Return an eigenvalue in words, in brackets where it is less than half the body's."""
    if mode is None:
        return '-'
    pair = f' ± {mode["imag"]:.3f}i' if mode['imag'] > 0.0 else ''
    said = f'{mode["real"]:.3f}{pair}'
    return said if mode['share'] >= 0.5 else f'({said})'


def table_5_3() -> str:
    """Return longitudinal eigenvalues by the lattice and by the classical equations, a table."""
    names = ('short period', 'phugoid')
    rows = ['| alpha [deg] | ' + ' | '.join(
        f'{name}, {model}' for name in names for model in MODELS) + ' |',
        '|---|' + '---|' * (len(names) * len(MODELS))]
    for alpha in (4, 8, 12, 20):
        here = {point['decambering']: {mode['name']: mode for mode in point['modes']}
                for point in points() if round(point['alpha_deg']) == alpha}
        cells = [_eigenvalue(here[model].get(name)) for name in names for model in MODELS]
        rows.append(f'| {alpha} | ' + ' | '.join(cells) + ' |')
    return '\n'.join(rows)


@dataclass(frozen=True, slots=True)
class Kick:
    """A disturbance of a trim: the state it shows in, its size and how long it is followed."""

    kind: Kind
    state: int
    place: int
    share: float
    seconds: float


MODELS = ('fixed', 'variable', 'quasi-steady')
SHARE = 1e-3
KICKS = (Kick(Kind.PITCHING, PITCH_RATE, 2, SHARE, 4.0),
         Kick(Kind.ROLLING, ROLL_RATE, 1, SHARE, 4.0))
"""A change of w and of v by a thousandth of the airspeed: 0.06 degrees of alpha and of beta."""


def linear(trim: Trim, kick: Kick) -> tuple[np.ndarray, np.ndarray]:
    """
    Return times [s] and the rate [deg/s] of the linear aircraft.

    A jump of its velocity sets the air in motion as well, in the first steps: that is what it is
    given more, and the first steps are left out.
    """
    found = flight.linearise(trainer(), trim, altitude=HIGH,
                             decamberings=(Decambering.VARIABLE,))
    system = found.systems[Decambering.VARIABLE]
    change = np.zeros(9)
    change[kick.place] = kick.share * trim.airspeed
    body, density = system.body, standard_air(HIGH).density
    change += np.linalg.solve(
        body.mass, body.push @ (density * trainer().added_mass) @ body.motion @ change)
    steps = round(kick.seconds / system.flow.dt)
    rate = np.degrees(system.march(change, steps)[:, kick.state])
    return (system.flow.dt * np.arange(steps + 1))[SETTLED:], rate[SETTLED:]


def simulated(trim: Trim, kick: Kick, wake: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and what a disturbance changes in the rate [deg/s] of a trimmed flight."""
    chosen = trainer(wake)
    dt_ns = simulation.automatic_dt_ns(chosen, trim.airspeed)
    steps = round(kick.seconds / (dt_ns * 1e-9))
    body = BodyState(np.array([0.0, 0.0, -HIGH]), trim.velocity_B, np.zeros(3), trim.q_NB)
    change = np.zeros(3)
    change[kick.place] = kick.share * trim.airspeed

    def rates(velocity_B: np.ndarray) -> np.ndarray:
        flown = simulation.Flight(chosen, body, trim.controls, dt_ns=dt_ns,
                                  delta0=trim.aero.strips.delta)
        flown.state = replace(flown.state, body=replace(body, velocity_B=velocity_B))
        return np.array([0.0, *(flown.step(trim.controls).body.rates_B[kick.state - 3]
                                for _ in range(steps))])

    rate = rates(trim.velocity_B + change) - rates(trim.velocity_B)
    return dt_ns * 1e-9 * np.arange(steps + 1), np.degrees(rate)


def figure_response(file: Path) -> None:
    """Draw a flight that is disturbed a little, and the linear one on top."""
    panels = []
    for trim in flight.trims_along(trainer(), np.radians((6, 17)), altitude=HIGH):
        for kick, what in zip(KICKS, ('w', 'v')):
            curves = [
                Curve('simulated', *simulated(trim, kick, Shape.PRESCRIBED),
                      style.ATTACHED, width=2.6, top=2),
                Curve('simulated, frozen wake', *simulated(trim, kick, Shape.FROZEN),
                      style.SECOND, (0, (5, 2)), top=3),
                Curve('linear', *linear(trim, kick), style.INK, (0, (1, 1.5)), width=1.4, top=4)]
            title = rf'$\alpha$ = {math.degrees(trim.alpha):.0f}{DEG}, ' \
                f'{what} changed by V/{1.0 / kick.share:.0f}'
            panels.append(Panel(kick.kind, title, tuple(curves),
                                limits=(0.0, kick.seconds, None, None)))
    draw(file, panels, columns=2, height=2.8)
