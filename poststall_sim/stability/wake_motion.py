# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
How the rows of a prescribed wake move against the body that has shed them.

A row of nodes stays in the air. Seen from a body whose velocity and rates nu = (v, omega) in B
differ a little from the steady flight, it is displaced like a rigid body, by a translation and
a turn a_r (6,) about the centre of gravity, that begin with zero at the trailing edge:

    a_r+ = C a_(r-1) - dt nu+,   C = [[1, dt turn x v0], [0, 1]],

v0 the velocity of the body: what is turned as it is left behind moves aside as it goes on. (Taking
nu+ for the mean over the step is of first order in dt; all else is of second.)
What the displacements of a row's nodes do is found by central differences, with the strengths of
the steady flow; all else of the linear system is derived by hand.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from poststall_sim.aero import wake
from poststall_sim.aero.kernels import grid_edges, grid_velocity
from poststall_sim.aero.model import Model, Onset
from poststall_sim.frames import FloatArray, geometry_to_body

SHIFT, TURN = 1e-4, 1e-5
"""Displacements of a row that differences are taken over: in chords, and in radians."""


@dataclass(frozen=True, slots=True, eq=False)
class WakeMotion:
    """
    What rows of nodes (R) do per unit of their displacement, the first behind the edge first.

    normalwash, foreign (R, p, 6) : of all wakes, and of other surfaces' alone; at_edges (R, 3 s,
    6) : velocity at the edges' middles; carried (6, 6) : C.
    """

    normalwash: FloatArray
    foreign: FloatArray
    at_edges: FloatArray
    carried: FloatArray


def still(model: Model) -> WakeMotion:
    """Return the motion of a wake that is frozen behind the body: none, of no rows."""
    panels, edges = model.lattice.panels, len(model.lattice.edge_vector)
    return WakeMotion(np.zeros((0, panels, 6)), np.zeros((0, panels, 6)),
                      np.zeros((0, 3 * edges, 6)), np.eye(6))


def moving(model: Model, onset: Onset, nodes: FloatArray, strength: FloatArray,
           dt: float) -> WakeMotion:
    """
    Return the motion of a wake in the air.

    nodes (R + 2, n, 3) : of the steady wake, the closing row last; strength (strips,) of all its
    rows; dt [s].
    """
    lattice, felt = model.lattice, model.felt
    cg = np.array(model.aircraft.mass.cg_G)
    steps = np.repeat([SHIFT * float(lattice.strip_chord.mean()), TURN], 3)
    velocity = np.empty((len(nodes) - 2, 6, len(felt.points), 6))
    _swayed(np.ascontiguousarray(nodes), strength, cg, steps, felt.bounds, felt.cores, felt.far,
            felt.points, velocity)
    velocity /= steps[None, :, None, None]
    # Turns and translations are about B's axes.
    velocity *= np.concatenate([geometry_to_body(np.ones(3))] * 2)[None, :, None, None]
    own, other = velocity[:, :, felt.panel, :3], velocity[:, :, felt.panel, 3:]
    everywhere = velocity[:, :, felt.edge, :3] + velocity[:, :, felt.edge, 3:]
    carried = np.eye(6)
    u, v, w = geometry_to_body(-onset.velocity_G)
    carried[:3, 3:] = dt * np.array([[0.0, w, -v], [-w, 0.0, u], [v, -u, 0.0]])
    return WakeMotion(
        normalwash=np.einsum('rmpc,pc->rpm', own + other, lattice.normal),
        foreign=np.einsum('rmpc,pc->rpm', other, lattice.normal),
        at_edges=everywhere.reshape(len(velocity), 6, -1).transpose(0, 2, 1), carried=carried)


@njit(cache=True, nogil=True)
def _swayed(nodes, strength, cg, steps, bounds, cores, far, points, out):
    """
    Fill `out` (R, 6, k, 6) with half the differences of velocities at points, own and others'.

    bounds, cores, points : see `wash.Felt`. A row's displacement changes the rings before and
    behind it, and the last row's the closing row as well.
    """
    rows, out[:] = out.shape[0], 0.0
    whole = nodes.copy()
    for r in range(1, rows + 1):
        for m in range(6):
            for sign in (1.0, -1.0):
                for k in range(nodes.shape[1]):
                    if m < 3:
                        whole[r, k, m] += sign * steps[m]
                    else:
                        i, j = (m - 2) % 3, (m - 1) % 3
                        arm_i, arm_j = nodes[r, k, i] - cg[i], nodes[r, k, j] - cg[j]
                        whole[r, k, i] -= sign * steps[m] * arm_j
                        whole[r, k, j] += sign * steps[m] * arm_i
                if r == rows:
                    wake.close(whole, far)
                for s in range(bounds.shape[0] - 1):
                    own = np.ascontiguousarray(
                        whole[r - 1:r + 2, bounds[s, 0]:bounds[s + 1, 0]])
                    ring = np.empty((2, bounds[s + 1, 1] - bounds[s, 1]))
                    ring[:] = strength[bounds[s, 1]:bounds[s + 1, 1]]
                    edges = np.empty((6, own.shape[0] * own.shape[1]))
                    for t in range(bounds.shape[0] - 1):
                        here = slice(bounds[t, 2], bounds[t + 1, 2])
                        grid_edges(own, ring, np.full(3, cores[s, t]), edges)
                        velocity = np.empty((bounds[t + 1, 2] - bounds[t, 2], 3))
                        grid_velocity(edges[0], edges[1], edges[2], edges[3], edges[4], edges[5],
                                      own.shape[1], points[here], velocity)
                        column = 0 if s == t else 3
                        for p in range(velocity.shape[0]):
                            for c in range(3):
                                out[r - 1, m, bounds[t, 2] + p, column + c] += \
                                    0.5 * sign * velocity[p, c]
                whole[r:r + 2] = nodes[r:r + 2]
