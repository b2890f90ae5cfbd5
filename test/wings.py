# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Wings and section curves that the tests of the aerodynamics share, made by formula.

Only the records of `poststall_sim.aircraft` are used to build, and coefficients are made here
from the raw forces, so that a test's reference does not pass through the code under test.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from poststall_sim import definition, propulsion
from poststall_sim.aero import model as models
from poststall_sim.aero import solver
from poststall_sim.aero.wake import Placement
from poststall_sim.aero.wash import Precision
from poststall_sim.aircraft import Aircraft, Airfoil, MassProperties, Reference, Section, Surface
from poststall_sim.controls import Control, Effector
from poststall_sim.frames import body_to_geometry, velocity_from_flow_angles

CONFIG = Path(__file__).resolve().parents[1] / 'config'
DENSITY = 1.225
EXACTLY = {'precision': Precision.FLOAT64, 'coarsen': False, 'interpolate': False}
"""Settings for every row of the wake at every point in float64."""
LEVEL = np.diag([-1.0, 1.0, -1.0])
"""Rotation from geometry axes to N of a body whose x axis points north, level."""


def potential(zero_lift_deg=0.0):
    """Return a section whose curve is the plate in potential flow, cl = 2 pi sin(a - a0)."""
    alpha = np.radians(np.linspace(-180.0, 180.0, 1441))
    cl = 2.0 * np.pi * np.sin(alpha - math.radians(zero_lift_deg))
    cl[-1] = cl[0]
    return Airfoil('potential', alpha, cl, 0.0 * alpha, 0.0 * alpha)


def stalling(zero_lift_deg=-4.0, stall_deg=15.0, width_deg=2.5):
    """
    Return a section that goes from a plate in potential flow to a separated one.

        cl = k 2 pi sin(a - a0) + (1 - k) 1.1 sin 2a,   k = 1/(1 + exp((|a| - stall)/width))
        cd = 0.01 + (1 - k) 1.9 sin^2 a,   cm = -0.05 k - (1 - k) 0.45 sin a
    """
    alpha = np.radians(np.linspace(-180.0, 180.0, 721))
    # Attached share; the exponent is held below overflow, where k is 0 to round-off anyway.
    excess = (np.abs(np.degrees(alpha)) - stall_deg) / width_deg
    k = 1.0 / (1.0 + np.exp(np.minimum(excess, 600.0)))
    cl = k * 2.0 * np.pi * np.sin(alpha - math.radians(zero_lift_deg)) \
        + (1.0 - k) * 1.1 * np.sin(2.0 * alpha)
    cd = 0.01 + (1.0 - k) * 1.9 * np.sin(alpha) ** 2
    cm = -0.05 * k - (1.0 - k) * 0.45 * np.sin(alpha)
    for values in (cl, cd, cm):
        values[-1] = values[0]
    return Airfoil('stalling', alpha, cl, cd, cm)


def shipped(name):
    """Return the section curves of a file that the package ships."""
    return definition.airfoil(CONFIG / 'airfoils' / f'{name}.csv')


def shipped_aircraft(name):
    """Return an aircraft that the package ships."""
    return definition.aircraft(CONFIG / 'aircraft' / f'{name}.yaml')


def aircraft(surfaces, airfoil, *, area, chord, span, cg_G=(0.25, 0.0, 0.0), controls=()):
    """Return an aircraft of surfaces of one section; its mass plays no part here."""
    mass = MassProperties(100.0, cg_G, np.diag([100.0, 200.0, 250.0]))
    return Aircraft('test', tuple(surfaces), (airfoil,), Reference(area, chord, span), mass,
                    tuple(controls))


def panel_wing(airfoil, leading_edges, chords, strips, *, twist=0.0, cosine=False,
               symmetric=False, name='wing'):
    """Return a surface through stations, left to right (or root to tip)."""
    sections = tuple(Section(tuple(map(float, place)), float(chord), airfoil.name, twist)
                     for place, chord in zip(leading_edges, chords))
    return Surface(name, sections, strips, symmetric=symmetric, spacing_cosine=cosine)


def rectangular(aspect_ratio, strips, airfoil=None, *, chord=1.0, cosine=False, sweep=0.0,
                cg_G=None, controls=()):
    """Return a wing of constant chord, all of it one surface so that odd counts do, too."""
    airfoil = potential() if airfoil is None else airfoil
    half = 0.5 * aspect_ratio * chord
    back = half * math.tan(sweep)
    if sweep:
        stations, chords, symmetric = [(0, 0, 0), (back, half, 0)], [chord] * 2, True
    else:
        stations, chords, symmetric = [(0, -half, 0), (0, half, 0)], [chord] * 2, False
    surface = panel_wing(airfoil, stations, chords, strips, cosine=cosine, symmetric=symmetric)
    return aircraft([surface], airfoil, area=2.0 * half * chord, chord=chord, span=2.0 * half,
                    cg_G=(0.25 * chord, 0.0, 0.0) if cg_G is None else cg_G, controls=controls)


def wing_a(rows):
    """Return the flat wing of AVL's runs in the tests of VortexLattice.jl, and its model."""
    wing = panel_wing(potential(), [(0, 0, 0), (0.4, 7.5, 0)], [2.2, 1.8], 24, symmetric=True,
                      twist=math.radians(2.0))
    machine = aircraft([wing], potential(), area=30.0, chord=2.0, span=15.0, cg_G=(0.5, 0.0, 0.0))
    return machine, models.build(machine, models.Settings(chordwise=rows))


def wing_tail(airfoil=None, strips=20, tail_strips=6):
    """Return the configuration of Figure 2.2 of Paul 2015 with an elevator and ailerons."""
    airfoil = shipped('naca4415_re3e6') if airfoil is None else airfoil
    wing = panel_wing(airfoil, [(0, 0, 0), (0, 6, 0)], [1, 1], strips, symmetric=True)
    tail = panel_wing(airfoil, [(7.5, 0, 0), (7.5, 2.5 * 0.67, 0)], [0.67, 0.67], tail_strips,
                      symmetric=True, name='tail')
    elevator = Control('elevator', (-0.5, 0.5), (Effector('tail', hinge=0.7),))
    aileron = Control('aileron', (-0.5, 0.5), (
        Effector('wing', (0.6, 1.0), side=1, gain=-1.0),
        Effector('wing', (0.6, 1.0), side=-1, gain=1.0)))
    return aircraft([wing, tail], airfoil, area=12.0, chord=1.0, span=12.0,
                    controls=(elevator, aileron))


def onset(speed, alpha=0.0, beta=0.0, rates_B=(0.0, 0.0, 0.0)):
    """Return the air past a body that flies at speed, alpha, beta, with body rates."""
    velocity_B = velocity_from_flow_angles(speed, alpha, beta)
    return models.Onset(body_to_geometry(-velocity_B), body_to_geometry(np.array(rates_B)))


@dataclass(frozen=True)
class Coefficients:
    """Lift, drag, side force in wind axes (beta = 0), moments about body x, y, z at the CG."""

    lift: float
    drag: float
    side: float
    roll: float
    pitch: float
    yaw: float


def push(machine, velocity_B, throttle, *, rates_B=(0.0, 0.0, 0.0), density=DENSITY,
         failed=frozenset()):
    """Return what the engines do with their shafts in balance."""
    meeting = propulsion.Meeting(np.array(velocity_B, dtype=float), np.array(rates_B), density,
                                 propulsion.throttles(machine, throttle, failed))
    return propulsion.balanced(machine, meeting, failed)


def coefficients(machine, result, speed, alpha=0.0):
    """Return coefficients, from the raw force in G: x aft, y right, z up."""
    pressure = 0.5 * DENSITY * speed ** 2 * machine.reference.area
    x, y, z = result.force_G / pressure
    roll, pitch, yaw = np.array([-1.0, 1.0, -1.0]) * result.moment_G / pressure
    chord, span = machine.reference.chord, machine.reference.span
    return Coefficients(z * math.cos(alpha) - x * math.sin(alpha),
                        z * math.sin(alpha) + x * math.cos(alpha), y,
                        roll / span, pitch / chord, yaw / span)


def steady(model, speed, alpha=0.0, beta=0.0, rates_B=(0.0, 0.0, 0.0), deflections=None,
           delta0=None):
    """Return the steady result of a model; deflections are 0 unless given."""
    if deflections is None:
        deflections = np.zeros(len(model.aircraft.controls))
    return solver.steady(model, onset(speed, alpha, beta, rates_B), np.asarray(deflections),
                         density=DENSITY, delta0=delta0)


def march(model, onset_at, dt, steps, *, at_rest=False, deflections=None, wind_N=(0.0, 0.0, 0.0),
          attitude_at=lambda t: LEVEL):
    """
    Yield placement, flow and result of a march, those of the start first.

    onset_at(t) and attitude_at(t) give the onset and the rotation from G to N. The centre of
    gravity moves as the onset says (trapezoidal rule) in air that moves with wind_N, and starts
    at the origin of N.
    """
    if deflections is None:
        deflections = np.zeros(len(model.aircraft.controls))
    cg, wind_N = np.array(model.aircraft.mass.cg_G), np.asarray(wind_N)

    def ground_speed(t):
        return wind_N - attitude_at(t) @ onset_at(t).velocity_G

    position, rotation = np.zeros(3), attitude_at(0.0)
    placement = Placement(position - rotation @ cg, rotation)
    flow, result = solver.start(model, onset_at(0.0), placement, np.asarray(deflections),
                                density=DENSITY, dt=dt, at_rest=at_rest)
    yield placement, flow, result
    for k in range(1, steps + 1):
        t = k * dt
        position = position + 0.5 * dt * (ground_speed(t - dt) + ground_speed(t))
        rotation = attitude_at(t)
        placement = Placement(position - rotation @ cg, rotation)
        flow, result = solver.advance(
            model, flow, onset_at(t), placement, np.asarray(deflections), density=DENSITY,
            dt=dt, drift_N=wind_N * dt)
        yield placement, flow, result


def steadily(air):
    """Return the same onset at any time."""
    return lambda t: air


def loads(model, onset_at, dt, steps, speed, **options):
    """Return force and moment coefficients (steps + 1, 6) in G of a march."""
    reference = model.aircraft.reference
    pressure = 0.5 * DENSITY * speed ** 2 * reference.area
    return np.array([np.concatenate([result.force_G, result.moment_G / reference.chord])
                     for _, _, result in march(model, onset_at, dt, steps, **options)]) / pressure
