# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The demo's flight, and the figures of the dissertation's chapter 4 from it.

The trainer and the scenario `stall_and_recovery`, flown without a graph as fast as it goes; the
figures are those that `poststall plot` draws of its bag. Angles are in degrees here.
"""

import shutil
import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from wing_tail import section

from poststall_sim import definition, fields, jobs, plots, recording, simulation, topics
from poststall_sim.aero.model import Model
from poststall_sim.coupling import FlightState
from poststall_sim.plots import style
from poststall_sim.plots.decambering import Curve, Kind, Panel, draw
from poststall_sim.state import Snapshot

AIRCRAFT, SCENARIO = 'trainer', 'stall_and_recovery'
SECTIONS = {'wing': 'NACA 4415', 'tail': 'NACA 0012', 'fin': 'NACA 0012'}
KEPT_AT = 8.4
"""When the state is kept that the wake is drawn of: in the deepest stall [s]."""


@dataclass(frozen=True, slots=True)
class Flown:
    """
    A flight with all of its instants and the folder of the figures of its bag.

    kept : the whole state of one of them, with its wake.
    """

    model: Model
    layout: fields.Layout
    snapshots: tuple[Snapshot, ...]
    figures: tempfile.TemporaryDirectory
    kept: FlightState

    def between(self, begin: float, end: float) -> list[Snapshot]:
        """Return the instants of a stretch of time [s]."""
        return [s for s in self.snapshots if begin - 1e-9 <= s.time <= end + 1e-9]


@cache
def flown() -> Flown:
    """Return the flight, recorded and drawn."""
    scenario = definition.scenario(definition.find(definition.Kind.SCENARIO, SCENARIO))
    flight = simulation.start(
        definition.aircraft(definition.find(definition.Kind.AIRCRAFT, AIRCRAFT)),
        airspeed=scenario.airspeed, altitude=scenario.altitude)
    first, folder = flight.snapshot, tempfile.TemporaryDirectory()
    with recording.FlightRecorder(Path(folder.name) / 'bag', flight) as recorder:
        snapshots = [first]
        for snapshot in jobs.fly(flight, scenario, scenario.duration, recorder):
            snapshots.append(snapshot)
            if snapshot.time <= KEPT_AT:
                kept = flight.state
    plots.flight_figures(Path(folder.name) / 'bag', folder.name)
    return Flown(flight.model, topics.layout(flight), tuple(snapshots), folder, kept)


def of_the_bag(name: str, file: Path) -> None:
    """Take a figure of those that `poststall plot` draws."""
    shutil.copyfile(Path(flown().figures.name) / f'{name}.png', file)


def full_turn(file: Path, name: str, label: str) -> None:
    """Draw lift, drag and moment of a section about the stall and over a full turn."""
    curve = section(name)
    panels = []
    for low, high, title in ((-20.0, 40.0, f'{label}, about the stall'),
                             (-180.0, 180.0, 'over a full turn')):
        alpha = np.linspace(low, high, 721)
        values = curve.at(np.radians(alpha))
        panels.append(Panel(Kind.INPUT, title, tuple(
            Curve(symbol, alpha, values[:, k], colour)
            for k, (symbol, colour) in enumerate((
                ('$C_l$', style.ATTACHED), ('$C_d$', style.STALLED),
                ('$C_m$ about c/4', style.SECOND)))), limits=(low, high, None, None)))
    draw(file, panels, height=3.2)


def figure_4_4(file: Path) -> None:
    """Draw the input of tail and fin."""
    full_turn(file, 'naca0012_re3e5', 'NACA 0012, Re 3e5')


def figure_4_5(file: Path) -> None:
    """Draw the input of the wing."""
    full_turn(file, 'naca4415_re4e5', 'NACA 4415, Re 4e5')


def figure_4_6(file: Path) -> None:
    """Draw the trajectory."""
    of_the_bag('trajectory', file)


def figure_4_7(file: Path) -> None:
    """Draw the elevator's command and what the angle of attack does."""
    of_the_bag('elevator_alpha', file)


def figure_4_8(file: Path) -> None:
    """Draw the rudder's command and what the sideslip does."""
    of_the_bag('rudder_beta', file)


def figure_4_9(file: Path) -> None:
    """Draw the lift of the strips, stalled and attached again: Figures 4.9 and 4.10."""
    of_the_bag('strip_cl', file)


def table_aircraft() -> str:
    """Return geometry, masses and reference values of the aircraft that flies, Tables 4.1, 4.2."""
    aircraft = flown().model.aircraft
    rows = ['| surface | area [m²] | span [m] | aspect ratio | section |', '|---|---|---|---|---|']
    lattice = flown().model.lattice
    for surface, grid in zip(aircraft.surfaces, lattice.grids):
        width = lattice.strip_width[grid.strips]
        area, span = float(width @ lattice.strip_chord[grid.strips]), float(width.sum())
        rows.append(f'| {surface.name} | {area:.3f} | {span:.2f} | {span ** 2 / area:.2f} | '
                    f'{SECTIONS[surface.name]} |')
    mass, reference = aircraft.mass, aircraft.reference
    xx, yy, zz = np.diag(mass.inertia_B)
    return '\n'.join([*rows, '', (
        f'Mass {mass.mass:g} kg, centre of gravity {mass.cg_G[0]:g} m behind the leading edge of '
        f'the root and {-mass.cg_G[2]:g} m below it; inertias about x, y, z {xx:g}, {yy:g} and '
        f'{zz:g} kg m²; reference area {reference.area:g} m², chord {reference.chord:g} m, span '
        f'{reference.span:g} m.')])
