# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The derivative of one step of the flow, about a steady one.

The quantities of a step, all of them differences from the steady flow:

    B g+ + sum_r (A_r G_r+ + S_r a_r+) + W_nu nu+ + W_c c+ + W_d d+ = 0    boundary condition
    G_0+ = T g,   G_r+ = G_(r-1)                                  wake
    a_r+ = C a_(r-1) - dt nu+                                     where it is, if it moves
    f = sum_r X (A_r G_r+ + S_r a_r+) + X B g                     wash of the other surfaces
    d+ = K_nu nu+ + K_c c+ + K_f f                                decambering, if it follows
    L+ = L_g g+ + L_t dg/dt+ + sum_r (L_r G_r+ + Z_r a_r+) + L_nu nu+ + L_c c+ + L_d d+ + L_f f

g (p,) circulation of rings, G_r (n,) of wake rows, the newest first, a_r (6,) displacements of
these, which stay in the air or are frozen behind the body, see `wake_motion`, d (n,) decambering,
nu (6,) velocity and rates of the body through the air in B, c (controls,) deflections, f (p,)
normalwash that decambering does not turn, L (6,) force and moment about the centre of gravity in
B; + is one step later, and X picks the panels of other surfaces than the one that induces. K is
the implicit function theorem on the closure's own residual. The loads are those of `aero.loads`:
they are linear in each of velocity, strength and rate, so that the derivative by one is the
function itself with a unit of it.

Paul 2015, chapter 5, after the state-space lattice of Simpson, Palacios & Murua, AIAA J. 51(7),
2013; the rows of the decambering are our own.
"""

from dataclasses import dataclass

import numpy as np

from poststall_sim import fuselage
from poststall_sim.aero import loads, wake
from poststall_sim.aero.decambering import AngleForm
from poststall_sim.aero.model import Model, Onset, influence, own_response, wake_direction
from poststall_sim.aero.operating import Boundary, boundary_condition
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.solver import AeroResult, te_share
from poststall_sim.aero.wake import Shape
from poststall_sim.aircraft import ConfigError
from poststall_sim.frames import FloatArray
from poststall_sim.stability import wake_motion
from poststall_sim.stability.strips import (
    FLIP,
    closure,
    operating_points,
    passing_rate,
    section_loads,
)
from poststall_sim.stability.wake_motion import WakeMotion

NEAR_FOLD = 1e6
"""Condition number of the closure's Jacobian from which a flow counts as one at a fold."""


@dataclass(frozen=True, slots=True, eq=False)
class LinearFlow:
    """
    The matrices of a step as in the head of this file, with rows (R) of wake.

    bound (p, p); wake (R, p, n); onset (p, 6); flap (p, controls); turn (p, n); other (p, p) and
    foreign (R, p, n) : of bound and wake what is on other surfaces, X B and X A_r; follow_nu
    (n, 6), follow_flap (n, controls), follow_wash (n, p) : K; load_bound, load_rate, load_wash
    (6, p), load_wake (R, 6, n), load_nu (6, 6), load_flap (6, controls), load_turn (6, n); te
    (n, p) : T; chords (n,) : local chords travelled in a step; sway : S, X S and C, of
    no rows where the wake is frozen; load_sway (rows, 6, 6) : Z; dt [s]; condition : of the
    closure's Jacobian, infinite at a fold.
    """

    bound: FloatArray
    wake: FloatArray
    onset: FloatArray
    flap: FloatArray
    turn: FloatArray
    other: FloatArray
    foreign: FloatArray
    follow_nu: FloatArray
    follow_flap: FloatArray
    follow_wash: FloatArray
    load_bound: FloatArray
    load_rate: FloatArray
    load_wash: FloatArray
    load_wake: FloatArray
    load_nu: FloatArray
    load_flap: FloatArray
    load_turn: FloatArray
    te: FloatArray
    chords: FloatArray
    sway: WakeMotion
    load_sway: FloatArray
    dt: float
    condition: float

    @property
    def at_fold(self) -> bool:
        """Tell whether the decambering has no derivative here, or next to none."""
        return not self.condition < NEAR_FOLD


def linearise(model: Model, onset: Onset, deflections: FloatArray, aero: AeroResult, *,
              density: float, dt: float, rows: int | None = None) -> LinearFlow:
    """
    Return the derivative of a step of dt [s] about a steady flow.

    aero : the loads of `solver.steady` at this onset and these deflections (controls,) [rad],
    solved closely; rows : of wake, by default as many as the march has. The wake stays in the air,
    also where the settings say that it is free, unless they say that it is frozen. Raises
    `ConfigError` where a strip has no lattice flow to linearise: its flow is more than 60 deg off
    its chord.
    """
    lattice, settings = model.lattice, model.settings
    boundary = boundary_condition(model, onset, deflections)
    _require_lattice_flow(model, boundary)
    row_G = float(np.linalg.norm(onset.velocity_G)) * dt * wake_direction(onset.velocity_G)
    length = float(np.linalg.norm(row_G))
    rows = model.wake_rows(length) if rows is None else rows

    theta = (aero.strips.delta - lattice.zero_lift)[lattice.panel_strip]
    phi = boundary.angles @ lattice.turn + theta
    # As in `boundary_condition`: theta turns what a slant brings in from the side as well.
    upright, aside = (f(boundary.angles @ lattice.slant)[:, None] for f in (np.cos, np.sin))
    span_axis = np.cross(lattice.normal, lattice.tangent)
    faded = np.cos(theta)[:, None] * span_axis
    air, air_nu = onset.at(model.collocation_arm), passing_rate(model.collocation_arm)
    cosine, sine = np.cos(phi)[:, None], np.sin(phi)[:, None]
    level = cosine * lattice.normal + sine * lattice.tangent
    across = upright * level - aside * faded
    turned = np.sum(air * upright * (cosine * lattice.tangent - sine * lattice.normal), axis=1)
    slanted = -np.sum(air * (aside * level + upright * faded), axis=1)
    onset_rate = np.einsum('ic,icm->im', across, air_nu)
    turn = np.zeros((lattice.panels, lattice.strips))
    turn[np.arange(lattice.panels), lattice.panel_strip] = turned + np.sin(theta) \
        * np.sum(air * aside * span_axis, axis=1)
    moved = lattice.angle_rate(deflections)
    flap = turned[:, None] * (lattice.turn.T @ moved) \
        + slanted[:, None] * (lattice.slant.T @ moved)

    strength = aero.circulation[lattice.te_panel]
    nodes = np.empty((rows + 2, *lattice.wake_nodes.shape))
    nodes[:-1] = lattice.wake_nodes + np.arange(rows + 1)[:, None, None] * row_G
    wake.close(nodes, wake.far_length(lattice))
    sway = wake_motion.still(model) if settings.wake is Shape.FROZEN \
        else wake_motion.moving(model, onset, nodes, strength, dt)
    velocity, at_panels, at_edges = _wake(model, nodes, strength)
    velocity += onset.at(model.edge_arm) \
        + (model.edge_influence @ aero.circulation).reshape(-1, 3)
    strips = lattice.strip_surface
    apart = strips[lattice.panel_strip][:, None] != strips[None, :]
    other = np.where(apart[:, lattice.panel_strip], model.bound, 0.0)

    # By (nu, controls, decambering, wash), side by side.
    wash = np.hstack([onset_rate, flap, turn, np.eye(lattice.panels)])
    widths = np.cumsum([6, flap.shape[1], lattice.strips])
    response = own_response(model, wake_direction(onset.velocity_G)).response
    points = operating_points(model, boundary, aero, -response @ wash, widths, moved)
    slope = closure(model, boundary, aero, points, widths) if settings.decambering \
        else np.hstack([np.zeros((lattice.strips, widths[1])), np.eye(lattice.strips),
                        np.zeros((lattice.strips, lattice.panels))])
    by_nu, by_flap, by_turn, by_wash = np.split(slope, widths, axis=1)
    condition = float(np.linalg.cond(by_turn))
    follow = [-np.linalg.solve(by_turn, by) if np.isfinite(condition) else np.full_like(by, np.nan)
              for by in (by_nu, by_flap, by_wash)]

    by_velocity, by_strength = _joukowski(model, density, velocity, aero.circulation)
    share = te_share(lattice, np.full(lattice.strips, length))
    at_edge = np.zeros((len(lattice.edge_vector), lattice.strips))
    behind = np.flatnonzero(lattice.edge_wake >= 0)
    at_edge[behind, lattice.edge_wake[behind]] = 1.0
    bound_strength = _ring_strength(model) + at_edge @ ((1.0 - share)[:, None] * model.te_rows)
    load_wake = np.einsum('ks,rsn->rkn', by_velocity, at_edges)
    load_wake[0] += by_strength @ (at_edge * share)
    section = section_loads(model, density, boundary, aero, points)
    section_nu, section_flap, section_turn, section_wash = np.split(section, widths, axis=1)
    edge_nu = passing_rate(model.edge_arm).reshape(-1, 6)
    bodies_nu = fuselage.load_slope(model.aircraft.bodies, model.aircraft.mass.cg_G,
                                    onset.velocity_G, onset.rates_G, density)
    arrays = {
        'bound': model.bound, 'wake': at_panels, 'onset': onset_rate, 'flap': flap, 'turn': turn,
        'other': other, 'foreign': np.where(apart, at_panels, 0.0),
        'follow_nu': follow[0], 'follow_flap': follow[1], 'follow_wash': follow[2],
        'load_bound': _in_body(by_velocity @ model.edge_influence + by_strength @ bound_strength),
        'load_rate': _in_body(_rate_loads(model, density)),
        'load_wash': _in_body(section_wash), 'load_wake': _in_body(load_wake),
        'load_nu': _in_body(by_velocity @ edge_nu + section_nu + bodies_nu),
        'load_flap': _in_body(section_flap), 'load_turn': _in_body(section_turn),
        'load_sway': _in_body(np.einsum('ks,rsm->rkm', by_velocity, sway.at_edges)),
        'te': model.te_rows, 'chords': boundary.strips[10] * dt / lattice.strip_chord}
    for array in arrays.values():
        array.setflags(write=False)
    return LinearFlow(sway=sway, dt=dt, condition=condition, **arrays)


def _require_lattice_flow(model: Model, boundary: Boundary) -> None:
    settings = model.settings
    if not settings.unsteady or settings.angle_form is not AngleForm.EXACT:
        raise ConfigError('the linear system is that of the unsteady lattice, with sines as sines')
    if settings.ground or settings.separation is Separation.GOMAN_KHRABROV:
        raise ConfigError('there is no linear system of a flight near the ground, nor of one with '
                          f'separation by {Separation.GOMAN_KHRABROV.value}')
    lost = (boundary.fade < 1.0) | (boundary.strips[7] == 0.0)
    if lost.any():
        name = model.lattice.strip_names[int(np.argmax(lost))]
        raise ConfigError(f'the flow at strip {name} is more than 60 deg off its chord, or there '
                          'is none: there the lattice gives way to strip theory, and there is '
                          'no linear system')


def _in_body(columns: FloatArray) -> FloatArray:
    """Return loads (..., 6, k) of geometry axes in B."""
    return columns * np.concatenate([FLIP, FLIP])[:, None]


def _wake(model: Model, nodes: FloatArray,
          strength: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return what a steady wake does: velocity (s, 3) at the edges for a strength (n,) of all rows.

    And per unit of each row's rings the normalwash (rows, p, n) and the velocity (rows, 3 s, n).
    The row that closes the wake has the strength of the last.
    """
    lattice, rows = model.lattice, len(nodes) - 2
    points = np.concatenate([lattice.collocation, lattice.edge_middle])
    owner = np.concatenate([lattice.strip_surface[lattice.panel_strip],
                            lattice.strip_surface[lattice.edge_strip[:, 0]]])
    left, right = lattice.te_node, lattice.te_node + 1
    at_panels = np.zeros((rows, lattice.panels, lattice.strips))
    at_edges = np.zeros((rows, 3 * len(lattice.edge_middle), lattice.strips))
    for row in range(rows + 1):
        rings = np.stack([nodes[row, left], nodes[row, right], nodes[row + 1, right],
                          nodes[row + 1, left]], axis=1)
        unit = influence(lattice, points, owner, rings, lattice.strip_surface)
        carrier = min(row, rows - 1)
        at_panels[carrier] += np.einsum('ijc,ic->ij', unit[:lattice.panels], lattice.normal)
        at_edges[carrier] += unit[lattice.panels:].transpose(0, 2, 1).reshape(-1, lattice.strips)
    return (at_edges.sum(axis=0) @ strength).reshape(-1, 3), at_panels, at_edges


def _joukowski(model: Model, density: float, velocity: FloatArray,
               circulation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return d(force, moment) in G by the edges' velocities (6, 3 s) and strengths (6, s).

    velocity (s, 3) at the edges; circulation (p,) of the rings. In steady flow the trailing edge
    and its wake cancel, and its edge has no strength.
    """
    lattice, edges = model.lattice, len(velocity)
    strength = _ring_strength(model) @ circulation
    behind = lattice.edge_wake >= 0
    strength[behind] += circulation[lattice.te_panel[lattice.edge_wake[behind]]]
    by_velocity, by_strength = np.zeros((3 * edges, 6)), np.zeros((edges, 6))
    one, unit = np.ones(1), np.eye(3)
    for i in range(edges):
        vector, arm = lattice.edge_vector[i:i + 1], model.edge_arm[i:i + 1]
        loads.lattice_force(density, one, velocity[i:i + 1], vector, arm, by_strength[i])
        for c in range(3):
            loads.lattice_force(
                density, strength[i:i + 1], unit[c:c + 1], vector, arm, by_velocity[3 * i + c])
    return by_velocity.T, by_strength.T


def _ring_strength(model: Model) -> FloatArray:
    """Return the edges' strength (s, p) per unit circulation of rings, without the wake's."""
    lattice, edges = model.lattice, np.arange(len(model.lattice.edge_vector))
    out = np.zeros((len(edges), lattice.panels))
    for index, sign in ((lattice.edge_plus, 1.0), (lattice.edge_minus, -1.0)):
        here = index >= 0
        out[edges[here], index[here]] += sign
    return out


def _rate_loads(model: Model, density: float) -> FloatArray:
    """Return d(force, moment) in G (6, p) by dG/dt of the rings."""
    lattice = model.lattice
    out, one = np.zeros((lattice.panels, 6)), np.ones(1)
    for i in range(lattice.panels):
        here = slice(i, i + 1)
        loads.added_mass_force(density, one, lattice.area[here], lattice.normal[here],
                               model.collocation_arm[here], out[i])
    return out.T
