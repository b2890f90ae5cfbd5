# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
What of a case its row depends on, told from what is computed and kept, without computing it.

What is not read is put aside: a curve that no surface has, a span that no kept coefficient is made
with, the limits of a recovery that nobody asks for. Two cases of which the same is left come to
the same row, so that a key by which only the rest differs changes nothing.
"""

import dataclasses

import numpy as np

from poststall_sim import flight_file, jobs
from poststall_sim.actuators import IDEAL
from poststall_sim.aero.model import DEFAULTS, Settings
from poststall_sim.aero.separation import Separation
from poststall_sim.aircraft import Aircraft, MassProperties
from poststall_sim.atmosphere import STANDARD
from poststall_sim.campaign.case import Case, Flying, Recovered, Steady

_DEFAULT = Recovered()


def fingerprint(case: Case) -> str:
    """Return a hash of all that the row of a case depends on, but for its number."""
    task, kept = case.task, frozenset(case.quantities)
    aircraft, atmosphere = _without_spares(case.aircraft), case.atmosphere
    settings = _settings(case.settings, task)
    if isinstance(task, Flying):
        aircraft = _flown(aircraft, task)
        task = _flying(task, kept)
    else:
        aircraft = _balanced(aircraft, task, kept)
        if task.kind == 'polar' and _one_table_each(aircraft):
            # Coefficients of steady flow go by air and airspeed through Reynolds numbers alone.
            atmosphere, task = STANDARD, dataclasses.replace(task, airspeed=1.0, altitude=0.0)
    return flight_file.fingerprint((aircraft, settings, atmosphere, task))


def watches_recovery(task: Flying, kept: frozenset[str]) -> bool:
    """Tell whether it makes a difference to a flight's row what a recovery is."""
    return task.stop.recovered or not kept.isdisjoint(('recovered', 'time_to_recover_s'))


def watches_spin(task: Flying, kept: frozenset[str]) -> bool:
    """Tell whether it makes a difference to a flight's row from where on turns are counted."""
    return task.stop.spun or not kept.isdisjoint(('spun', 'stalled_turn_deg'))


def _without_spares(aircraft: Aircraft) -> Aircraft:
    used = {section.airfoil for surface in aircraft.surfaces for section in surface.sections}
    return dataclasses.replace(
        aircraft, name='aircraft', assumptions=(),
        airfoils=tuple(each for each in aircraft.airfoils if each.name in used))


def _one_table_each(aircraft: Aircraft) -> bool:
    names = [each.name for each in aircraft.airfoils]
    return len(set(names)) == len(names)


def _settings(settings: Settings, task: Flying | Steady) -> Settings:
    """Put settings aside that go with others: a lag without its separation."""
    aside = [] if settings.decambering else ['ell']
    if isinstance(task, Flying):
        if settings.separation is not Separation.LAG:
            aside += ['lag']
        if settings.separation is not Separation.GOMAN_KHRABROV:
            aside += ['relaxation', 'delay']
    elif task.kind != 'modes':   # steady flow has no history
        aside += ['lag', 'relaxation', 'delay', 'separation', 'wake', 'ground']
    return dataclasses.replace(settings, **{name: getattr(DEFAULTS, name) for name in aside})


def _flown(aircraft: Aircraft, task: Flying) -> Aircraft:
    """Put references aside that no kept number is made with, and actuators that stand still."""
    moved = set(aircraft.control_names)
    if task.law is not None:
        moved &= {'aileron', 'elevator', 'rudder'}
    elif task.scenario is not None and not task.scenario.faults:
        moved &= {channel.control for channel in task.scenario.channels}
    elif task.scenario is None and task.autopilot is None:
        moved = set()
    # The chord stays: the step of the march and the balance of the trim are made with it.
    return dataclasses.replace(
        aircraft, reference=dataclasses.replace(aircraft.reference, area=1.0, span=1.0),
        controls=tuple(each if each.name in moved else dataclasses.replace(each, actuator=IDEAL)
                       for each in aircraft.controls))


def _flying(task: Flying, kept: frozenset[str]) -> Flying:
    weather = task.weather
    if not weather.wind_N.any():   # nothing is sheared
        weather = dataclasses.replace(weather, shear=None)
    # Processor time makes a difference to what is given up, and that goes by the machine.
    return dataclasses.replace(
        task, weather=weather, cpu_limit=1.0,
        recovered=task.recovered if watches_recovery(task, kept) else _DEFAULT,
        spin_alpha=task.spin_alpha if watches_spin(task, kept) else 0.0)


def _balanced(aircraft: Aircraft, task: Steady, kept: frozenset[str]) -> Aircraft:
    """Put aside what acts in time only, and of a polar what has a weight or pulls."""
    polar, mass, reference = task.kind == 'polar', aircraft.mass, aircraft.reference
    roll, pitch, yaw = task.rates
    if task.kind != 'modes':   # their names go by span and chord
        sideways = roll or yaw or not kept.isdisjoint(('Cl', 'Cn'))
        lengthways = not polar or pitch or 'Cm' in kept
        reference = dataclasses.replace(
            reference, span=reference.span if sideways else 1.0,
            chord=reference.chord if lengthways else 1.0)
        mass = MassProperties(mass.mass, mass.cg_G, np.eye(3))
    if kept.isdisjoint(jobs.COEFFICIENTS):
        reference = dataclasses.replace(reference, area=1.0)
    if polar:
        about = mass.cg_G if any(task.rates) or not kept.isdisjoint(('Cl', 'Cm', 'Cn')) \
            else (0.0, 0.0, 0.0)
        mass = MassProperties(1.0, about, mass.inertia_B)
    return dataclasses.replace(
        aircraft, mass=mass, reference=reference,
        engines=() if polar else aircraft.engines,
        controls=tuple(dataclasses.replace(each, actuator=IDEAL) for each in aircraft.controls))
