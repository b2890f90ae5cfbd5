# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A linear system as discrete state space, whole or with the air's states reduced to a few.

An input acts at the end of a step, E x(k+1) = A x(k) + B u(k+1), so that the states are

    xi = x - E^-1 B u :  xi(k+1) = E^-1 A xi(k) + E^-1 A E^-1 B u(k),  x = xi + E^-1 B u.

Only the air is reduced. It dies out where the aircraft does not, and the body is coupled to what
is left as it was to the whole, so that unstable aircraft are reduced as well. Apart from the load
by the rate of circulation, which is a difference of the impulse I(k) of the rings and goes in
as it is,

    L(k) = S(k) + (3 I(k) - 4 I(k-1) + I(k-2)) / (2 dt),

the air is known by what S and I do, step by step, after a unit impulse h_0, h_1, ..., h_K of each
velocity, rate and deflection. The states are where they go on to, a K long column h, and move up
one place in a step; those that matter are what oscillations of all frequencies of interest leave
behind. An orthonormal basis of these, U (the motion at rest first, then in the order of singular
values), leaves of the shift S_h a matrix U' S_h U, whose eigenvalues are always within the unit
circle: a shift has none on it.

J.-N. Juang & R. S. Pappa, J. Guidance 8(5), 1985, with columns weighted by frequency as in D. F.
Enns, 23rd IEEE Conf. on Decision and Control, 1984: without a weight, which asks for all
frequencies alike, the hard end of the wake costs many more states.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg, sparse

from poststall_sim.aircraft import ConfigError, Reference
from poststall_sim.frames import FloatArray
from poststall_sim.stability import motion
from poststall_sim.stability.motion import Rows, System
from poststall_sim.stability.state_space import StateSpace

LOADS = ('force_x', 'force_y', 'force_z', 'moment_x', 'moment_y', 'moment_z')
"""Of the air on the body [N, N m], about its centre of gravity, in B."""
BAND = 1.0
"""Frequencies of interest reach to this times V/c."""
MOST = 120
"""The highest order that is tried for an error asked for."""
_GRID = 25
"""Frequencies whose oscillations make the basis; 1.6 times as many check it."""
_DECAYED = 1e-7
"""Impulse responses end where they are below this share of their largest."""
_LENGTHS = 20
"""They take this many lengths of the wake at most: longer, the air does not die out."""
_NOTHING = 1e-9
"""A load below this share of the largest is round-off."""


def full(system: System) -> StateSpace:
    """
    Return the whole system as discrete state space.

    Inputs are those of `motion.System`, outputs the states of the body and `LOADS`. Of n states,
    thousands, it fills n^2 numbers.
    """
    rows, panels, strips = system.flow.wake.shape
    names = [f'{what}_{axis}[{row}]' for row in range(len(system.flow.load_sway))
             for what in ('shift', 'turn') for axis in 'xyz']
    names += [f'wake[{row},{strip}]' for row in range(rows) for strip in range(strips)]
    for name, count in (('circulation_before', panels), ('circulation', panels),
                        ('decambering', strips)):
        names += [f'{name}[{i}]' for i in range(count)]
    return _state_space(system, system.e, system.a, system.b, (*names, *LOADS))


def _state_space(system: System, e: sparse.csc_matrix, a: sparse.csc_matrix, b: FloatArray,
                 air: tuple[str, ...]) -> StateSpace:
    """Return a descriptor system in the form of the head of this file; air : names of states."""
    factors = motion.factorised(e)
    step, enters = factors.solve(a.toarray()), factors.solve(b)
    body, size = system.body.names, len(b)
    shown = np.r_[len(air):size, len(air) - 6:len(air)]
    show = np.zeros((len(shown), size))
    show[np.arange(len(shown)), shown] = 1.0
    return StateSpace(step, step @ enters, show, enters[shown], system.flow.dt, (*air, *body),
                      system.inputs, (*body, *LOADS))


@dataclass(frozen=True, slots=True, eq=False)
class Reduced:
    """
    A system with a reduced flow.

    space : discrete, of `order` states of the air, two impulses before and the load (18), and the
    body's; its inputs and outputs those of `full`. error : of the load's response to velocity,
    rates and deflections up to `frequency` [rad/s], for the worst load its largest over the
    largest of the response, with velocities over V, rates p b/2V, q c/2V, r b/2V. radius : of
    the circle in which the flow's eigenvalues z are, below 1.

    Modes that the body has to itself are those of the whole system, the closer the smaller the
    error. Those that die as fast as the wake stand among many of the air, of which a few take the
    place: the motion is the same long before their eigenvalues one by one are.
    """

    space: StateSpace
    order: int
    error: float
    frequency: float
    radius: float

    def eigenvalue_errors(self, eigenvalues: np.ndarray) -> FloatArray:
        """Return how far the nearest is from each of (k,) [1/s], none 0, over its size."""
        own = self.space.eigenvalues
        return np.array([np.abs(own - each).min() / abs(each) for each in eigenvalues])


def reduce(system: System, *, reference: Reference, airspeed: float, order: int | None = None,
           error: float = 1e-3) -> Reduced:
    """
    Return the system with the air reduced to `order` states, or as few as have the error.

    airspeed [m/s]; error : see `Reduced`. Static loads are kept whatever the order. Raises
    `ConfigError` where the air does not die out, and where the order, or the error, is out of
    reach.
    """
    flow, chord_time = system.flow, reference.chord / airspeed
    span_rate, chord_rate = 2.0 * airspeed / reference.span, 2.0 * airspeed / reference.chord
    unit = np.concatenate([np.full(3, airspeed), [span_rate, chord_rate, span_rate],
                           np.ones(flow.flap.shape[1])])
    grid = np.concatenate([[0.0], np.geomspace(1e-3, 1.0, 8 * _GRID // 5)]) * BAND / chord_time
    z = np.exp(1j * grid * flow.dt)
    exact = np.array([motion.load_response(system, each) for each in z]) * unit
    size = np.linalg.norm(exact, axis=2).max(axis=0)
    size = np.maximum(size, _NOTHING * size.max())
    scale = np.concatenate([size, size * chord_time])
    impulses = _impulses(system, unit, scale)
    basis, least = _basis(impulses, np.linspace(0.0, BAND / chord_time, _GRID) * flow.dt)

    def reduced(order: int) -> tuple[Rows, float]:
        rows = _rows(impulses, basis[:, :order], unit, scale, flow.dt)
        found = np.array([_load_response(rows, each) for each in z]) * unit
        return rows, float((np.linalg.norm(found - exact, axis=2).max(axis=0) / size).max())

    largest = basis.shape[1]
    if order is not None and not least <= order <= largest:
        raise ConfigError(f'order {order}: the air needs {least} states for its static loads, '
                          f'and has {largest} that matter')
    best = np.inf
    for tried in range(least, min(MOST, largest) + 1) if order is None else (order,):
        rows, reached = reduced(tried)
        if order is not None or reached <= error:
            break
        best = min(best, reached)
    else:
        raise ConfigError(f'error {error:g}: out of reach, the least was {best:.1e}')
    names = [f'air[{i}]' for i in range(tried)]
    for name in ('impulse_before', 'impulse'):
        names += [f'{name}[{i}]' for i in range(6)]
    air = rows.a.toarray()[:tried, :tried]
    return Reduced(
        _state_space(system, *motion.couple(rows, system.body, flow.dt), (*names, *LOADS)),
        tried, reached, BAND / chord_time, float(np.abs(linalg.eigvals(air)).max()))


def _impulses(system: System, unit: FloatArray, scale: FloatArray) -> FloatArray:
    """
    Return h (K + 1, 12, m), of (S, I) over scale (12,) by (nu, controls) in units (m,).

    Raises `ConfigError` where they do not die out.
    """
    flow = system.flow
    rows = motion.flow_rows(flow, system.share, system.kept)
    factors = motion.factorised(rows.e)
    rings = slice(system.split[1], system.split[2])
    x = factors.solve(np.hstack([rows.nu, rows.flap]) * unit)
    older = before = np.zeros((6, len(unit)))
    out, largest = [], 0.0
    for _ in range(_LENGTHS):
        for _ in range(len(flow.wake)):
            now = flow.load_rate @ x[rings]
            still = x[-6:] - (3.0 * now - 4.0 * before + older) / (2.0 * flow.dt)
            out.append(np.vstack([still, now]) / scale[:, None])
            older, before, x = before, now, factors.solve(rows.a @ x)
        last = np.abs(out[-len(flow.wake):]).max()
        largest = max(largest, last)
        if last <= _DECAYED * largest:
            return np.array(out)
    raise ConfigError('the air does not die out by itself about a body that is held: there is '
                      f'{last / largest:.1e} left after {len(out)} steps, and no reduced order')


def _basis(impulses: FloatArray, angles: FloatArray) -> tuple[FloatArray, int]:
    """
    Return an orthonormal basis (12 K, r) of what oscillations leave behind, and the rank at rest.

    angles (f,) : the frequencies times dt, of which the first is 0.
    """
    late = np.exp(-1j * angles)[:, None, None]
    left = np.empty((len(impulses) - 1, len(angles), *impulses.shape[1:]), dtype=complex)
    behind = 0.0
    for k in range(len(left) - 1, -1, -1):
        behind = impulses[k + 1] + late * behind
        left[k] = behind
    columns = left.transpose(0, 2, 1, 3)
    columns = columns.reshape(columns.shape[0] * columns.shape[1], len(angles), -1)
    rest = linalg.orth(columns[:, 0].real, rcond=_NOTHING)
    moving = columns[:, 1:].reshape(len(columns), -1)
    moving = np.hstack([moving.real, moving.imag])
    for _ in range(2):      # once leaves round-off of the large ones in the small ones
        moving -= rest @ (rest.T @ moving)
    vectors, values, _ = linalg.svd(moving, full_matrices=False)
    return np.hstack([rest, vectors[:, values > _NOTHING * values[0]]]), rest.shape[1]


def _rows(impulses: FloatArray, basis: FloatArray, unit: FloatArray, scale: FloatArray,
          dt: float) -> Rows:
    """
    Return the rows of the reduced flow: states of the air, I one step ago and now, load.

    The air's are those of the end of the step, as the body's are, and not of its begin.
    """
    steps, outputs, inputs = impulses.shape
    order = basis.shape[1]
    moved = np.vstack([basis[outputs:], np.zeros((outputs, order))])
    enters = basis.T @ impulses[1:].reshape(-1, inputs) / unit
    seen, direct = basis[:outputs] * scale[:, None], impulses[0] * scale[:, None] / unit
    size, rate = order + 18, 1.0 / (2.0 * dt)
    air, before, now, load = np.split(np.arange(size), [order, order + 6, order + 12])
    e, a, v = np.eye(size), np.zeros((size, size)), np.zeros((size, inputs))
    e[load, now] = -3.0 * rate
    a[:order, :order], v[air] = basis.T @ moved, enters
    a[before, now] = 1.0
    a[now, :order], v[now] = seen[6:], direct[6:]
    a[load, :order], v[load] = seen[:6], direct[:6]
    a[load, now], a[load, before] = -4.0 * rate, rate
    return Rows(sparse.csc_matrix(e), sparse.csc_matrix(a), v[:, :6], v[:, 6:])


def _load_response(rows: Rows, z: complex) -> np.ndarray:
    """Return what `motion.load_response` does, of a flow given by a few rows."""
    return linalg.solve((z * rows.e - rows.a).toarray(), z * np.hstack([rows.nu, rows.flap]))[-6:]
