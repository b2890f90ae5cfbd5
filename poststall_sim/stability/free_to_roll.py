# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
An aircraft or a wing held at its centre of gravity in a stream, free to turn about one axis.

The linear one has its damping and its poles; the nonlinear one, let go at a small rate, comes to
rest, swings or autorotates. The stream stays where it is: as the body turns about its own x axis
at an angle of attack it meets the stream with sideslip as well, about the axis of the stream it
does not.
"""

import enum
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from poststall_sim.aero import solver
from poststall_sim.aero.model import Model, Onset
from poststall_sim.aero.solver import AeroResult
from poststall_sim.aero.wake import Placement
from poststall_sim.aircraft import ConfigError
from poststall_sim.frames import (
    FloatArray,
    body_to_geometry,
    geometry_to_body,
    multiply,
    quaternion_about,
    quaternion_from_euler,
    rotation,
    velocity_from_flow_angles,
)
from poststall_sim.stability import bodies, linear, motion
from poststall_sim.stability.motion import Decambering, Spectrum
from poststall_sim.state import Status


class Axis(enum.Enum):
    """What the body turns about."""

    BODY = 'body'
    VELOCITY = 'velocity'

    def in_body(self, alpha: float) -> FloatArray:
        """Return the axis (3,) in B at an angle of attack [rad]."""
        return np.array([1.0, 0.0, 0.0]) if self is Axis.BODY \
            else velocity_from_flow_angles(1.0, alpha, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Damping:
    """
    The linear free-to-roll body at an angle of attack [rad].

    Clp : derivative of the rolling moment coefficient about the axis by rate b/2V about it, in
    quasi-steady flow; spectrum : of the body with states rate and angle; condition : of the
    closure's Jacobian, see `linear.LinearFlow`; status and max_residual of the flow it is about.
    """

    alpha: float
    axis: Axis
    decambering: Decambering
    Clp: float
    spectrum: Spectrum
    condition: float
    status: Status
    max_residual: float

    @property
    def pole(self) -> complex:
        """Return the eigenvalue with the greatest real part of those that the body has [1/s]."""
        shares = self.spectrum.participation
        own = self.spectrum.eigenvalues[shares >= min(0.5, shares.max())]
        return complex(own[int(np.argmax(own.real))])


def damping(model: Model, *, alpha: float, airspeed: float, density: float, axis: Axis,
            decamberings: tuple[Decambering, ...], dt: float, rows: int | None = None,
            delta0: FloatArray | None = None) -> tuple[tuple[Damping, ...], AeroResult]:
    """
    Return the damping about an axis for each kind of decambering, and the steady flow.

    alpha [rad]; airspeed [m/s]; dt [s]; rows : of wake; delta0 (n,) : where the decambering
    starts. Raises `ConfigError` where there is no lattice flow, see `linear.linearise`, and where
    the decambering is at a fold.
    """
    velocity_B = velocity_from_flow_angles(airspeed, alpha, 0.0)
    onset = Onset(body_to_geometry(-velocity_B), np.zeros(3))
    neutral = np.zeros(len(model.aircraft.controls))
    aero = solver.steady(model, onset, neutral, density=density, delta0=delta0)
    flow = linear.linearise(model, onset, neutral, aero, density=density, dt=dt, rows=rows)
    about = axis.in_body(alpha)
    body = bodies.rolling_body(model.aircraft.mass, velocity_B, about)
    reference = model.aircraft.reference
    scale = 0.25 * density * airspeed * reference.area * reference.span ** 2
    found = []
    for decambering in decamberings:
        if flow.at_fold and decambering is not Decambering.FIXED:
            raise ConfigError(f'at {math.degrees(alpha):g} deg the decambering is at a fold '
                              'and has no derivative')
        system = motion.assemble(flow, body, model.aircraft.control_names, decambering,
                                 model.settings.lag)
        steady = motion.response(system, 1.0).real
        found.append(Damping(
            alpha=alpha, axis=axis, decambering=decambering,
            Clp=float(about @ steady[3:, 3:] @ about) / scale,
            spectrum=motion.spectrum(system, 12), condition=flow.condition, status=aero.status,
            max_residual=aero.max_residual))
    return tuple(found), aero


@dataclass(frozen=True, slots=True)
class Turn:
    """
    A body free to turn at a time [s]: its angle [rad] and rate [rad/s] about the axis.

    moment : of the air about it [N m]; status : of the flow.
    """

    time: float
    angle: float
    rate: float
    moment: float
    status: Status


def let_go(model: Model, *, alpha: float, airspeed: float, density: float, axis: Axis,
           rate: float, dt: float, steps: int, angle: float = 0.0,
           delta0: FloatArray | None = None) -> Iterator[Turn]:
    """
    Yield the turning of a body that is let go at a rate [rad/s], steps + 1 instants.

    angle [rad] : from wings level in a stream at alpha [rad]. The wake is that of the settings;
    the coupling that of `simulation`: the body is moved with the old moment, the flow advanced to
    where that puts it, and the body moved again, added mass on the left.
    """
    about = axis.in_body(alpha)
    held = quaternion_from_euler(0.0, alpha, 0.0)
    stream_N = np.array([-airspeed, 0.0, 0.0])
    cg = np.array(model.aircraft.mass.cg_G)
    neutral = np.zeros(len(model.aircraft.controls))
    added = density * float(about @ model.added_mass[3:, 3:] @ about)
    inertia = float(about @ model.aircraft.mass.inertia_B @ about)

    def seen(angle: float, rate: float) -> tuple[Onset, Placement]:
        turned = rotation(multiply(held, quaternion_about(about, angle)))
        rotation_NG = turned * geometry_to_body(np.ones(3))
        return (Onset(body_to_geometry(turned.T @ stream_N), body_to_geometry(rate * about)),
                Placement(-rotation_NG @ cg, rotation_NG))

    def moment(aero: AeroResult) -> float:
        return float(about @ geometry_to_body(aero.moment_G))

    onset, place = seen(angle, 0.0)
    flow, aero = solver.start(model, onset, place, neutral, density=density, dt=dt, delta0=delta0)
    load, before, older = moment(aero), rate, rate
    yield Turn(0.0, angle, rate, load, aero.status)
    for k in range(steps):
        speeding = load / (inertia + added)
        guess = rate + dt * speeding
        onset, place = seen(angle + dt * (rate + 0.5 * dt * speeding), guess)
        flow, aero = solver.advance(
            model, flow, onset, place, neutral, density=density, dt=dt, drift_N=dt * stream_N)
        changing = (3.0 * guess - 4.0 * before + older) / (2.0 * dt)
        new = moment(aero) + added * changing
        after = rate + 0.5 * dt * (load + new) / (inertia + added)
        angle += dt * (rate + dt * (2.0 * load + new) / (6.0 * (inertia + added)))
        rate, load, before, older = after, new, guess, before
        yield Turn((k + 1) * dt, angle, rate, moment(aero) + added * (changing - speeding),
                   aero.status)
        if not math.isfinite(rate):
            return
