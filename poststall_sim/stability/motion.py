# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A body in a linearised flow: E x(k+1) = A x(k) + B u(k+1), and its eigenvalues near z = 1.

x is, in this order: displacement of the wake's rows (rows 6, none in a frozen wake), circulation
of these (rows n), of the rings one step ago (p) and now (p), decambering (n), load (6), and the
states y of the body. In this order an elimination from the first to the last goes down the chains
of the wake at no cost and leaves a small full matrix. The load goes linearly from step to step as
in `simulation`, and the body's rows are trapezoidal, which for velocities is the same:

    M (y+ - y)/dt = (P (L+ + L) + R (y+ + y)) / 2,   nu = N y

The decambering is FIXED (d+ = 0), VARIABLE (the derivative of the closure, as the simulation has
it) or LAGGED (on its way there by the lag law, as the simulation has it with that switched on).
"""

import enum
import math
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, SuperLU, eigs, splu

from poststall_sim.frames import FloatArray
from poststall_sim.stability.bodies import Body
from poststall_sim.stability.linear import LinearFlow


class Decambering(enum.Enum):
    """What the decambering does when the flow changes a little."""

    FIXED = 'fixed'
    VARIABLE = 'variable'
    LAGGED = 'lagged'


@dataclass(frozen=True, slots=True, eq=False)
class System:
    """
    E x(k+1) = A x(k) + B u(k+1), see the head of this file; E and A are sparse.

    inputs : deflections by name [rad], the velocity of the air gust_u, gust_v, gust_w in B [m/s],
    everywhere alike, and throttle. split (6,) : where each part of x but the first begins. share
    (n,) and kept (n,) : of the way to its new value the decambering goes in a step, and of its
    own that it keeps.
    """

    flow: LinearFlow
    body: Body
    e: sparse.csc_matrix
    a: sparse.csc_matrix
    b: FloatArray
    inputs: tuple[str, ...]
    split: tuple[int, ...]
    share: FloatArray
    kept: FloatArray

    @property
    def size(self) -> int:
        """Return the number of unknowns."""
        return self.e.shape[0]

    @property
    def own(self) -> slice:
        """Return where the body's states stand in x."""
        return slice(self.split[-1], self.size)

    def march(self, y: FloatArray, steps: int) -> FloatArray:
        """Return the body's states (steps + 1, m) from y (m,), in a flow as yet undisturbed."""
        factors = factorised(self.e)
        x = np.zeros(self.size)
        x[self.own] = y
        out = [y]
        for _ in range(steps):
            x = factors.solve(self.a @ x)
            out.append(x[self.own])
        return np.array(out)


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """
    A flow by itself: E x(k+1) = A x(k) + V nu(k+1) + W c(k+1), the last six of x its load.

    e, a (n, n) sparse; nu (n, 6) V, of the body's velocity and rates; flap (n, controls) W.
    """

    e: sparse.csc_matrix
    a: sparse.csc_matrix
    nu: FloatArray
    flap: FloatArray


def assemble(flow: LinearFlow, body: Body, controls: tuple[str, ...],
             decambering: Decambering, lag: float) -> System:
    """Return the system of a body in a flow; lag [chords] : of the LAGGED decambering."""
    rows, panels, strips = flow.wake.shape
    share, kept = np.ones(strips), np.zeros(strips)
    if decambering is Decambering.FIXED:
        share = np.zeros(strips)
    elif decambering is Decambering.LAGGED:
        kept = np.exp(-flow.chords / lag)
        share = 1.0 - kept
    split = np.cumsum([6 * len(flow.load_sway), rows * strips, panels, panels, strips, 6])
    return System(
        flow, body, *couple(flow_rows(flow, share, kept), body, flow.dt),
        (*controls, 'gust_u', 'gust_v', 'gust_w', 'throttle'), tuple(int(i) for i in split),
        share, kept)


def flow_rows(flow: LinearFlow, share: FloatArray, kept: FloatArray) -> Rows:
    """Return the rows of a flow whose decambering goes and keeps a share (n,), see `System`."""
    rows, panels, strips = flow.wake.shape

    def chain(blocks: FloatArray) -> FloatArray:
        return blocks.transpose(1, 0, 2).reshape(blocks.shape[1], -1)

    follow_wash, sway = share[:, None] * flow.follow_wash, flow.sway
    follow_wake = chain(np.einsum('np,rpk->rnk', follow_wash, flow.foreign))
    follow_sway = chain(np.einsum('np,rpm->rnm', follow_wash, sway.foreign))
    load_wake = chain(flow.load_wake + np.einsum('kp,rpn->rkn', flow.load_wash, flow.foreign))
    load_sway = chain(flow.load_sway + np.einsum('kp,rpm->rkm', flow.load_wash, sway.foreign))
    rate = flow.load_rate / (2.0 * flow.dt)
    eye, none, displaced = np.eye, None, len(sway.foreign)
    e = [
        [sparse.eye(rows * strips), none, none, none, none],
        [none, eye(panels), none, none, none],
        [chain(flow.wake), none, flow.bound, flow.turn, none],
        [-follow_wake, none, none, eye(strips), none],
        [-load_wake, none, -flow.load_bound - 3.0 * rate, -flow.load_turn, eye(6)]]
    shed = sparse.vstack([sparse.csr_matrix(flow.te),
                          sparse.csr_matrix(((rows - 1) * strips, panels))])
    empty = sparse.csr_matrix((panels, panels))
    a = [
        [sparse.eye(rows * strips, k=-strips), none, shed, none, none],
        [none, empty, eye(panels), none, none],
        [none, none, empty, none, none],
        [none, none, follow_wash @ flow.other, np.diag(kept), none],
        [none, rate, -4.0 * rate + flow.load_wash @ flow.other, none, sparse.csr_matrix((6, 6))]]
    if displaced:
        does = (none, none, chain(sway.normalwash), -follow_sway, -load_sway)
        e = [[sparse.eye(6 * displaced), *[none] * 5],
             *([block, *row] for block, row in zip(does, e))]
        a = [[sparse.kron(sparse.eye(displaced, k=-1), sway.carried), *[none] * 5],
             *([none, *row] for row in a)]
    still = rows * strips + panels
    return Rows(
        sparse.bmat(e, format='csc'), sparse.bmat(a, format='csc'),
        np.vstack([np.tile(-flow.dt * eye(6), (displaced, 1)), np.zeros((still, 6)), -flow.onset,
                   share[:, None] * flow.follow_nu, flow.load_nu]),
        np.vstack([np.zeros((6 * displaced + still, flow.flap.shape[1])), -flow.flap,
                   share[:, None] * flow.follow_flap, flow.load_flap]))


def couple(flow: Rows, body: Body, dt: float,
           ) -> tuple[sparse.csc_matrix, sparse.csc_matrix, FloatArray]:
    """Return E, A and B of a body in a flow, see the head of this file; dt [s]."""
    size, states = len(flow.nu), len(body.names)
    rest, mass = 0.5 * body.rest, body.mass / dt
    push = sparse.hstack([sparse.csr_matrix((states, size - 6)), 0.5 * body.push])
    e = [[flow.e, -flow.nu @ body.motion], [-push, mass - rest]]
    a = [[flow.a, None], [push, mass + rest]]
    # A gust blows past the body as if it moved the other way.
    gust = -flow.nu[:, :3]
    controls = flow.flap.shape[1]
    b = np.vstack([
        np.hstack([flow.flap, gust, np.zeros((size, 1))]),
        np.hstack([np.zeros((states, controls)), body.wind, body.throttle[:, None]])])
    return sparse.bmat(e, format='csc'), sparse.bmat(a, format='csc'), b


def factorised(matrix: sparse.csc_matrix) -> SuperLU:
    """Return the factors of E or A - z E, eliminated in the order they stand in."""
    return splu(matrix.tocsc(), permc_spec='NATURAL', diag_pivot_thresh=0.0,
                options={'SymmetricMode': True})


def response(system: System, z: complex) -> np.ndarray:
    """Return H (6, 6): the load H nu z^k of the air that a motion nu z^k of the body makes."""
    return load_response(system, z)[:, :6]


def load_response(system: System, z: complex) -> np.ndarray:
    """Return the load (6, 6 + controls) of the air by motions nu z^k and deflections c z^k."""
    flow, late = system.flow, 1.0 / z
    powers = late ** np.arange(1, len(flow.wake) + 1)
    parts = np.array([powers.real, powers.imag])   # of real blocks, which stay real so

    def shed(blocks: FloatArray) -> np.ndarray:
        real, imaginary = np.tensordot(parts, blocks, 1)
        return (real + 1j * imaginary) @ flow.te

    wake, foreign, load_wake = shed(flow.wake), shed(flow.foreign), shed(flow.load_wake)
    wash = foreign + late * flow.other
    sway = _swayed(flow, late)
    follow = (system.share / (1.0 - late * system.kept))[:, None]
    turned_by = follow * np.hstack([
        flow.follow_nu + flow.follow_wash @ sway['foreign'], flow.follow_flap])
    turned = follow * flow.follow_wash @ wash
    circulation = -np.linalg.solve(
        flow.bound + wake + flow.turn @ turned,
        np.hstack([flow.onset + sway['normalwash'], flow.flap]) + flow.turn @ turned_by)
    rate = (3.0 - 4.0 * late + late ** 2) / (2.0 * flow.dt)
    per_circulation = flow.load_bound + rate * flow.load_rate + load_wake \
        + flow.load_wash @ wash + flow.load_turn @ turned
    direct = flow.load_nu + sway['load'] + flow.load_wash @ sway['foreign']
    return per_circulation @ circulation + np.hstack([direct, flow.load_flap]) \
        + flow.load_turn @ turned_by


def _swayed(flow: LinearFlow, late: complex) -> dict[str, np.ndarray]:
    """Return what displaced rows do per motion nu z^k, (p, 6) and (6, 6); late : 1/z."""
    place, found = np.zeros((6, 6), dtype=complex), []
    for _ in flow.load_sway:
        place = late * flow.sway.carried @ place - flow.dt * np.eye(6)
        found.append(place)
    places = np.array(found).reshape(-1, 6, 6)
    return {name: np.einsum('rpm,rmk->pk', blocks, places, optimize=True) for name, blocks in (
        ('normalwash', flow.sway.normalwash), ('foreign', flow.sway.foreign),
        ('load', flow.load_sway))}


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """
    Eigenvalues of a system, of conjugate pairs the one with positive imaginary part.

    eigenvalues (k,) : continuous, ln(z)/dt [1/s]; vectors (m, k) of the body's states;
    participation (k,) : about 1 for a mode of the body, 0 for one of the wake, in between where
    a mode dies away as fast as the wake does and the two cannot be told apart; residual (k,) :
    |A x - z E x| / |x| over the norm of A.
    """

    eigenvalues: np.ndarray
    vectors: np.ndarray
    participation: FloatArray
    residual: FloatArray


NEAR = 1.0 + 0.03j
"""Where eigenvalues are looked for: off z = 1, which the heading has for its own."""
SAME = 1e-6
"""Eigenvalues z closer to each other are one."""


def quasi_steady(system: System) -> FloatArray:
    """Return A (m, m) of dy/dt = A y with the air's load at rest and the added mass it has."""
    flow, body = system.flow, system.body
    added = flow.load_rate @ np.linalg.solve(flow.bound, flow.onset)
    return np.linalg.solve(
        body.mass + body.push @ added @ body.motion,
        body.push @ response(system, 1.0).real @ body.motion + body.rest)


def arnoldi(system: System, count: int) -> tuple[np.ndarray, np.ndarray, FloatArray]:
    """Return the z (k,) nearest to 1, whole vectors (k, N) and residuals as of `Spectrum`."""
    factors = factorised(system.a - NEAR * system.e)
    inverse = LinearOperator((system.size, system.size), dtype=complex,
                             matvec=lambda x: factors.solve(system.a @ x))
    # (A - s E)^-1 A has z/(z - s) where (A - s E)^-1 E has 1/(z - s), and A is all but empty.
    found, vectors = eigs(inverse, k=count, which='LM', tol=1e-11,
                          v0=np.ones(system.size, dtype=complex))
    z = NEAR * found / (found - 1.0)
    error = system.a @ vectors - (system.e @ vectors) * z
    return z, vectors.T, np.linalg.norm(error, axis=0) / (
        sparse.linalg.norm(system.a) * np.linalg.norm(vectors, axis=0))


def spectrum(system: System, count: int = 24) -> Spectrum:
    """
    Return the `count` eigenvalues nearest to z = 1, by Arnoldi on the shifted inverse.

    And what Newton's method finds further out from the quasi-steady eigenvalues: a body that is
    quickly damped, or that departs quickly.
    """
    z, vectors, residual = (list(each) for each in arnoldi(system, count))
    vectors, reach = [each[system.own] for each in vectors], max(abs(each - NEAR) for each in z)
    for value in np.linalg.eigvals(quasi_steady(system)):
        start = np.exp(value * system.flow.dt)
        if value.imag >= 0.0 and abs(start - NEAR) > 0.5 * reach:
            end, vector, left = _newton(system, start)
            if left < 1e-10 and min(abs(end - other) for other in z) > SAME:
                z.append(end)
                vectors.append(vector)
                residual.append(left)
    upper = [i for i, each in enumerate(z) if each.imag > -1e-9]
    z = np.array(z)[upper]
    return Spectrum(
        eigenvalues=np.log(z) / system.flow.dt, vectors=np.array(vectors)[upper].T,
        participation=np.array([_participation(system, each) for each in z]),
        residual=np.array(residual)[upper])


def _small(system: System, z: complex) -> np.ndarray:
    """
    Return what is left of A - z E for the body's states when the flow is eliminated.

        S(z) = (1 + 1/z) (P H(z) N + R) / 2 - M (1 - 1/z)/dt
    """
    body = system.body
    return 0.5 * (1.0 + 1.0 / z) * (body.push @ response(system, z) @ body.motion + body.rest) \
        - body.mass / system.flow.dt * (1.0 - 1.0 / z)


def _slope(system: System, z: complex) -> tuple[complex, complex, np.ndarray, complex, float]:
    """Return u* S v, u* S' v, v, u* M v and |S v| dt/|M|, u, v the vectors S all but maps to 0."""
    step = 1e-7
    here = _small(system, z)
    left, size, right = np.linalg.svd(here)
    u, v = left[:, -1].conj(), right[-1].conj()
    change = u @ ((_small(system, z + step) - here) / step) @ v
    left_over = float(size[-1] * system.flow.dt / np.linalg.norm(system.body.mass))
    return u @ here @ v, change, v, u @ system.body.mass @ v, left_over


def _newton(system: System, z: complex) -> tuple[complex, np.ndarray, float]:
    """Return the eigenvalue that Newton's method on u* S v leads to, v and what is left."""
    for _ in range(12):
        value, change, vector, _, left = _slope(system, z)
        nearer = z - value / change if change != 0.0 else math.nan
        # Towards 0, where the wake has eigenvalues without number, there is nothing of the body.
        if left < 1e-13 or not 0.2 < abs(nearer) < 5.0:
            break
        z = nearer
    return z, vector, left


def _participation(system: System, z: complex) -> float:
    """
    Return the body's share in a mode: its part of the product of left and right eigenvector.

    dS/dz of the whole is what remains of the product when the flow is eliminated; that of the
    body's inertia alone is its part. (Perez-Arriaga, Verghese & Schweppe, IEEE Trans. PAS-101(9),
    1982, for systems without elimination.) Where a strip's decambering lags by itself, S has a
    pole and the body no part.
    """
    if np.abs(z - system.kept).min() < SAME:
        return 0.0
    _, change, _, inertia, _ = _slope(system, z)
    return float(abs(inertia / (system.flow.dt * z ** 2 * change)))
