# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A wing in a stream, free to roll: its damping, its poles, and what it does when it is let go.

The wing of the dissertation's Figure 2.2, aspect ratio 12 and a chord of 1 m, with a roll inertia
of 2000 kg m^2, at 30 m/s; exact angles, four panels along the chord and the non-local closure.
Angles are in degrees here.
"""

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from tqdm import tqdm
from wing_tail import DEG, section

from poststall_sim import definition
from poststall_sim.aero import model as models
from poststall_sim.aero.model import Model
from poststall_sim.aero.solver import AeroResult
from poststall_sim.aero.wake import Shape
from poststall_sim.plots import decambering as plots
from poststall_sim.plots import style
from poststall_sim.plots.decambering import Curve, Kind, Panel, draw
from poststall_sim.stability import free_to_roll
from poststall_sim.stability.free_to_roll import Axis, Damping
from poststall_sim.stability.motion import Decambering

INERTIA = 2000.0
AIR = {'airspeed': 30.0, 'density': 1.225, 'dt': 0.25 / 30.0}
ALPHAS = np.arange(0, 41, 2)
KINDS = (Decambering.FIXED, Decambering.VARIABLE)
COLOURS = {Decambering.FIXED: style.ATTACHED, Decambering.VARIABLE: style.STALLED}
KICK = 0.5
"""The rate at which the wing is let go [deg/s]."""


@cache
def wing(wake: Shape = Shape.PRESCRIBED) -> Model:
    """
    Return the wing without its tail, with its inertia in roll and a wake of a shape.

    Its closure is solved so closely that a slow roll does not pass for none.
    """
    aircraft = definition.aircraft(definition.find(definition.Kind.AIRCRAFT, 'wing_tail'))
    inertia = np.diag([INERTIA, *np.diag(aircraft.mass.inertia_B)[1:]])
    return models.build(replace(
        aircraft, surfaces=aircraft.surfaces[:1], controls=(),
        mass=replace(aircraft.mass, inertia_B=inertia)),
        models.Settings(wake=wake, tolerance=1e-9))


@cache
def damped(axis: Axis) -> dict[int, tuple[tuple[Damping, ...], AeroResult]]:
    """Return the damping and the flow by alpha, raised from 0."""
    found, delta = {}, None
    for alpha in tqdm(ALPHAS, desc=f'about the {axis.value} axis', leave=False):
        found[int(alpha)] = free_to_roll.damping(
            wing(), alpha=math.radians(alpha), axis=axis, decamberings=KINDS, delta0=delta, **AIR)
        delta = found[int(alpha)][1].strips.delta
    return found


def _by_kind(axis: Axis):
    """Yield the kinds of decambering, each with its damping at every alpha."""
    for i, kind in enumerate(KINDS):
        yield kind, [each[0][i] for each in damped(axis).values()]


def figure_5_6(file: Path) -> None:
    """Draw the poles of the wing that is free to roll."""
    reference = wing().aircraft.reference
    speed = 0.25 * AIR['density'] * AIR['airspeed'] * reference.area * reference.span ** 2
    about_stream, about_body = [], []
    for kind, found in _by_kind(Axis.VELOCITY):
        poles, coefficient = (np.array([getattr(each, key) for each in found])
                              for key in ('pole', 'Clp'))
        about_stream += [
            Curve(f'{kind.value} decambering', ALPHAS, poles.real, COLOURS[kind]),
            Curve('', ALPHAS, coefficient * speed / INERTIA, COLOURS[kind], (0, (2, 2)),
                  width=1.0)]
    about_stream.append(Curve(r'from $C_{lp}$ alone, no wake', np.zeros(0), np.zeros(0), style.INK,
                              (0, (2, 2)), width=1.0))
    for kind, found in _by_kind(Axis.BODY):
        places, values = [], []
        for alpha, each in zip(ALPHAS, found):
            own = each.spectrum.eigenvalues[each.spectrum.participation >= 0.5].real
            places += [alpha] * own.size
            values += own.tolist()
        about_body.append(Curve('', np.array(places), np.array(values), COLOURS[kind], '',
                                's' if kind is Decambering.FIXED else 'o', size=3.0))
    zero = Curve('', ALPHAS[[0, -1]], np.zeros(2), style.INK, width=0.8, top=1)
    limits = (0.0, 40.0, -7.0, 4.5)
    draw(file, [Panel(Kind.POLE, 'about the stream: rate', (*about_stream, zero), limits=limits),
                Panel(Kind.POLE, 'about the body axis: rate and angle', (*about_body, zero),
                      limits=limits)], height=3.7)


def figure_5_7(file: Path) -> None:
    """Draw where the strips of the port half work on their section's curve."""
    lattice = wing().lattice
    port = lattice.quarter_chord[:, 1] < 0.0
    curves = [plots.section_curves(section(), low=0.0, deltas=())[0]]
    for alpha, colour, marker in zip((6, 14, 18, 22, 28, 36), (
            style.ATTACHED, '#56B4E9', style.SECOND, '#E69F00', style.STALLED, style.THIRD),
            'osD^vP'):
        strips = damped(Axis.VELOCITY)[alpha][1].strips
        curves.append(Curve(rf'wing at {alpha}{DEG}', np.degrees(strips.alpha[port]),
                            strips.cl[port], colour, '', marker, size=4.5, top=5))
    draw(file, [Panel(Kind.SECTION, 'Strips of the port half', tuple(curves),
                      limits=(0.0, 40.0, 0.2, 1.8))], height=4.2)


def figure_5_8(file: Path) -> None:
    """Draw the damping in roll about both axes."""
    curves = [Curve('', ALPHAS[[0, -1]], np.zeros(2), style.INK, width=0.8, top=1)]
    for axis, line, name in ((Axis.BODY, '-', 'body axis'),
                             (Axis.VELOCITY, (0, (4, 2)), 'velocity axis')):
        for kind, found in _by_kind(axis):
            curves.append(Curve(f'{kind.value} decambering, {name}', ALPHAS,
                                np.array([each.Clp for each in found]), COLOURS[kind], line))
    draw(file, [Panel(Kind.DAMPING, 'Damping in roll', tuple(curves),
                      limits=(0.0, 40.0, None, None))], height=4.0)


def figure_let_go(file: Path) -> None:
    """Draw the roll rate of the wing that is let go, and what the linear one does."""
    curves = []
    for alpha, seconds, colour in (
            (10, 1.6, style.ATTACHED), (20, 6.0, '#56B4E9'), (24, 6.0, '#E69F00'),
            (28, 6.0, style.STALLED), (34, 6.0, style.THIRD), (40, 4.0, style.SECOND)):
        (_, linear), aero = damped(Axis.VELOCITY)[alpha]
        for wake, label, line, width in ((Shape.PRESCRIBED, rf'$\alpha$ = {alpha}{DEG}', '-', 2.2),
                                         (Shape.FROZEN, '', (0, (5, 2)), 1.2)):
            turned = list(free_to_roll.let_go(
                wing(wake), alpha=math.radians(alpha), axis=Axis.VELOCITY,
                rate=math.radians(KICK), steps=round(seconds / AIR['dt']),
                delta0=aero.strips.delta, **AIR))
            time = np.array([each.time for each in turned])
            curves.append(Curve(label, time, np.degrees([each.rate for each in turned]), colour,
                                line, width=width))
        curves.append(Curve('', time, KICK * np.exp(linear.pole.real * time), style.INK,
                            (0, (1, 1.5)), width=1.1, top=4))
    curves += [Curve(label, np.zeros(0), np.zeros(0), style.INK, line, width=width)
               for label, line, width in (('simulated', '-', 2.2),
                                          ('simulated, frozen wake', (0, (5, 2)), 1.2),
                                          ('linear: exp(pole t)', (0, (1, 1.5)), 1.1))]
    draw(file, [Panel(Kind.ROLLING, f'Let go at {KICK:g}{DEG}/s, about the stream', tuple(curves),
                      limits=(0.0, 6.0, 2e-3, 400.0), log=True)], height=4.2)
