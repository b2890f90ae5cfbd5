# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The strips of a flight: which surface each belongs to, and whether it is past its stall.

A bag that has ``strip_stalled`` and ``strip_cl_max`` says so itself; else it is found from the
section angles and the section curves of the aircraft, if that is known and has the same strips.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from poststall_sim import surface_order
from poststall_sim.aero import lattice as lattices
from poststall_sim.aero.decambering import Closure
from poststall_sim.aero.flaps import look_up
from poststall_sim.aero.lattice import Lattice
from poststall_sim.aero.model import DEFAULTS
from poststall_sim.aircraft import Aircraft
from poststall_sim.frames import FloatArray, geometry_to_body, swap_body_flu
from poststall_sim.plots.lookup import Lookup, Pair, onto


@dataclass(frozen=True, slots=True)
class StripGroup:
    """The strips of one surface: its name, and where it stands among all strips."""

    name: str
    strips: slice


@dataclass(frozen=True, slots=True, eq=False)
class StripData:
    """
    What happens on the strips, (m, k) over m times and k strips; None what is not known.

    y, chord (k,) [m] in base_link; cl [-]; alpha, delta [rad]; stalled: past the section's
    greatest or least lift; cl_max (k,) [-] of the sections; groups: the surfaces by span, the wing
    first; averaged: by the non-local closure, which asks a section of the mean over
    about a chord of the span, and by which flaps fade past the stall, see `aero.flaps`.
    """

    time: FloatArray
    y: FloatArray
    chord: FloatArray | None
    cl: FloatArray
    alpha: FloatArray | None
    delta: FloatArray | None
    stalled: np.ndarray | None
    cl_max: FloatArray | None
    groups: tuple[StripGroup, ...]
    averaged: bool

    @property
    def wing(self) -> slice:
        """Where the wing's strips stand."""
        return self.groups[0].strips

    @property
    def stalled_share(self) -> FloatArray | None:
        """Share of the wing's strips past their stall (m,)."""
        return None if self.stalled is None else self.stalled[:, self.wing].mean(axis=1)

    @property
    def span(self) -> float:
        """Span of the wing [m]."""
        return float(np.sum(widths(self.y[self.wing])))

    @property
    def wing_area(self) -> float | None:
        """Area of the wing [m^2]."""
        if self.chord is None:
            return None
        return float(np.sum(self.chord[self.wing] * widths(self.y[self.wing])))

    def deepest(self) -> int | None:
        """Return the index of the time with most of the wing stalled, there with most alpha."""
        share = self.stalled_share
        if share is None or share.max() == 0.0:
            return None
        depth = -self.cl[:, self.wing].mean(axis=1) if self.alpha is None \
            else self.alpha[:, self.wing].mean(axis=1)
        return int(np.lexsort((depth, share))[-1])

    def recovered(self) -> bool:
        """Tell whether every strip is known to be attached at the end."""
        return self.stalled is not None and not self.stalled[-1].any()


def strip_data(bag: Lookup, aircraft: Aircraft | None) -> StripData | None:
    """Return the strips of a bag, None if it has no strip_cl or does not say where they are."""
    lift, place = bag.column('strip_cl', 'data'), bag.column('strip_y', 'data')
    if lift is None or lift[1].ndim != 2:
        return None
    time, cl = lift
    count = cl.shape[1]
    known = _lattice(bag, aircraft, count, None if place is None else place[1][-1])
    if place is not None and place[1].shape[1] == count:
        y = place[1][-1]
    elif known is not None:
        y = _left(known)
    else:
        bag.notes.append('no strip_y in the bag: it is latched, record it as transient local')
        return None

    def like(topic: str) -> FloatArray | None:
        found = bag.column(topic, 'data')
        if found is None or found[1].ndim != 2 or found[1].shape[1] != count:
            return None
        return onto(time, found)

    alpha, stalled, cl_max, chord = (
        like(topic) for topic in ('strip_alpha', 'strip_stalled', 'strip_cl_max', 'strip_chord'))
    closure = next((values['closure'] for *_, values in bag.diagnostics()
                    if 'closure' in values), Closure.NONLOCAL.value)
    attached, averaged = closure.startswith('off'), closure == Closure.NONLOCAL.value
    if attached:
        bag.notes.append('flown without decambering: attached flow at any angle')
    if stalled is not None:
        stalled = stalled > 0.5
    elif known is not None and alpha is not None:
        angle = looked_up(bag.joints('joint_states'), known, aircraft, time, alpha,
                          fades=averaged)
        stalled = (angle > known.stall_high) | (angle < known.stall_low)
        if attached:
            stalled[:] = False
    else:
        bag.notes.append('which strips are past their stall is not known')
    chord = None if chord is None else chord[-1]
    if cl_max is not None:
        cl_max = cl_max[-1]
    elif known is not None:
        cl_max = known.greatest_lift
    return StripData(
        time=time, y=y, chord=chord, cl=cl, alpha=alpha, delta=like('strip_decambering'),
        stalled=stalled, cl_max=cl_max, groups=_groups(y, known),
        averaged=averaged)


def _lattice(bag: Lookup, aircraft: Aircraft | None, count: int,
             y: FloatArray | None) -> Lattice | None:
    """Return the lattice of the aircraft if it has the bag's strips."""
    if aircraft is None:
        return None
    found = matching(aircraft, DEFAULTS.chordwise, count, y)
    if found is None:
        bag.notes.append(f'the strips are not those of {aircraft.name} as it is defined here')
    return found


def matching(aircraft: Aircraft, panels: int, count: int,
             y: FloatArray | None) -> Lattice | None:
    """Return the lattice of an aircraft if it has so many strips, and where y [m] says."""
    lattice = lattices.build(aircraft, panels)
    if lattice.strips == count and (
            y is None or len(y) != count or np.abs(_left(lattice) - y).max() < 1e-3):
        return lattice
    return None


def _left(lattice: Lattice) -> FloatArray:
    """Return y of the strips in base_link [m]."""
    return swap_body_flu(geometry_to_body(lattice.quarter_chord))[:, 1]


def looked_up(positions: Mapping[str, Pair], lattice: Lattice, aircraft: Aircraft,
              time: FloatArray, alpha: FloatArray, *, fades: bool) -> FloatArray:
    """
    Return the angles (m, k) at which deflections make the sections' curves be read [rad].

    fades : whether flaps lose their effect past the stall.
    """
    joints = {name: np.interp(time, *pair) for name, pair in positions.items()}
    deflections = np.zeros((len(time), len(aircraft.controls)))
    for c, name in enumerate(aircraft.control_names):
        if name in joints:
            deflections[:, c] = joints[name]
    strips = np.zeros((16, lattice.strips))
    strips[12], strips[14] = lattice.stall_high, lattice.stall_low
    strips[13], strips[15] = (
        (lattice.separated_high, lattice.separated_low) if fades else (math.inf, -math.inf))
    found, left, fall = np.empty_like(alpha), np.empty(lattice.strips), np.empty(lattice.strips)
    for i, deflected in enumerate(deflections):
        strips[6] = lattice.angles(deflected) @ lattice.shift
        look_up(alpha[i], strips, found[i], left, fall)
    return found


def _groups(y: FloatArray, lattice: Lattice | None) -> tuple[StripGroup, ...]:
    """Return the surfaces, the wing first: by the aircraft, else by how y runs."""
    if lattice is not None:
        groups = [StripGroup(grid.name, grid.strips) for grid in lattice.grids]
    else:
        # Along a surface y falls from tip to tip, up a fin it stays: else a new one begins.
        run = np.sign(np.round(np.diff(y), 6))
        starts = [0] + [i + 1 for i in range(len(run))
                        if run[i] > 0 or (i and run[i - 1] < 0 <= run[i])]
        groups = [StripGroup(f'surface {i + 1}', slice(a, b))
                  for i, (a, b) in enumerate(zip(starts, [*starts[1:], len(y)]))]
    order = surface_order.by_span([group.strips for group in groups], y)
    if lattice is None:
        groups[order[0]] = StripGroup('wing', groups[order[0]].strips)
    return tuple(groups[number] for number in order)


def widths(y: FloatArray) -> FloatArray:
    """Return the widths of strips with these middles [m], 0 on a fin."""
    if len(y) < 2:
        return np.zeros(len(y))
    edges = np.concatenate([[1.5 * y[0] - 0.5 * y[1]], 0.5 * (y[1:] + y[:-1]),
                            [1.5 * y[-1] - 0.5 * y[-2]]])
    return np.abs(np.diff(edges))
