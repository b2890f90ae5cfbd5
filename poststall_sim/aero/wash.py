# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The velocity that a wake induces on the surfaces, at a cost that its age does not raise.

The wake of each surface is seen by each surface at its own distance, and three savings go by
that distance; each can be switched off:

* Rows are taken together until a ring is `LONGEST` of its distance long: some sixteen rows
  behind a trailing edge one by one, and then as many for each doubling of the distance. A tail
  in the wake of its wing has the rows beside it one by one, and fewer of those ahead and behind.
* What lies more than `NEAR` chords away is computed on the skeleton of the surface only.
* All but the trailing edge as it meets itself is computed in float32, from nodes that were
  brought to the surface's own axes in float64; sums over surfaces are in float64 again.
"""

import enum
from dataclasses import dataclass

import numpy as np
from numba import njit

from poststall_sim.aero.kernels import grid_edges, grid_velocity
from poststall_sim.aero.lattice import Lattice
from poststall_sim.aero.skeleton import Skeleton, skeleton
from poststall_sim.aero.wake import Placement, Wake, close, core, far_length
from poststall_sim.frames import FloatArray

LONGEST = 0.125
"""Length of a ring made of several rows, as a share of its distance."""
NEAR = 1.5
"""Distance in chords of a surface up to which a ring is felt at each of its points."""

_EXACT = {'cache': True, 'nogil': True}


class Precision(enum.Enum):
    """Float type in which the far reaching sums are computed."""

    FLOAT32 = 'float32'
    FLOAT64 = 'float64'


@dataclass(frozen=True, slots=True, eq=False)
class Felt:
    """
    Where wakes are felt, surface by surface: collocation points and edges' middles.

    bounds (surfaces + 1, 5) : first node, strip, point and skeleton point of each surface, and
    the first of its points on the trailing edge, which are its last; points (k, 3) [m]; rounded,
    skeleton : those and the skeletons' in the precision of the computation; weights : of each
    skeleton; box (surfaces, 2, 3) : least and greatest coordinates; reach (surfaces,) : distance
    beyond which the skeleton is enough [m]; cores (source, target) [m]; far : length of the
    closing row [m]; panel (p,), edge (s,) : the point of each panel and edge.
    """

    bounds: np.ndarray
    points: FloatArray
    rounded: np.ndarray
    skeleton: np.ndarray
    weights: tuple[FloatArray, ...]
    box: FloatArray
    reach: FloatArray
    cores: FloatArray
    far: float
    panel: np.ndarray
    edge: np.ndarray


def felt(lattice: Lattice, precision: Precision, interpolate: bool) -> Felt:
    """Return where the wakes are felt by the surfaces of a lattice."""
    grids = range(len(lattice.grids))
    everything = [np.concatenate([lattice.collocation[g.panels], lattice.edge_middle[g.edges]])
                  for g in lattice.grids]
    points, bounds, panel, edge = [], np.zeros((len(grids) + 1, 5), dtype=np.int64), [], []
    skeletons = [skeleton(lattice, g) for g in lattice.grids]
    if not interpolate:
        skeletons = [Skeleton(k.points_G[:0], k.weights[:, :0]) for k in skeletons]
    for s, g in enumerate(lattice.grids):
        panels, strips = g.panels.stop - g.panels.start, g.strips.stop - g.strips.start
        behind = np.concatenate([
            np.zeros(panels, dtype=bool), lattice.edge_wake[g.edges] >= 0])
        order = np.argsort(behind, kind='stable')
        place = np.empty_like(order)
        place[order] = bounds[s, 2] + np.arange(len(order))
        points.append(everything[s][order])
        skeletons[s] = Skeleton(skeletons[s].points_G, skeletons[s].weights[order])
        bounds[s + 1] = (g.nodes.stop, g.strips.stop, bounds[s, 2] + len(order),
                         bounds[s, 3] + len(skeletons[s].points_G), 0)
        bounds[s, 4] = bounds[s + 1, 2] - strips
        panel.append(place[:panels])
        edge.append(place[panels:])
    real = np.dtype(precision.value)
    return Felt(
        bounds=bounds, points=np.concatenate(points),
        rounded=np.concatenate(points).astype(real),
        skeleton=np.concatenate([k.points_G for k in skeletons]).astype(real),
        weights=tuple(k.weights for k in skeletons),
        box=np.array([[p.min(axis=0), p.max(axis=0)] for p in points]),
        reach=np.array([
            NEAR * lattice.strip_chord[g.strips].mean() if len(k.points_G) else np.inf
            for g, k in zip(lattice.grids, skeletons)]),
        cores=np.array([[core(lattice, s, t) for t in grids] for s in grids]),
        far=far_length(lattice), panel=np.concatenate(panel), edge=np.concatenate(edge))


def velocity(wake: Wake, lattice: Lattice, where: Felt, placement: Placement,
             coarsen: bool) -> tuple[FloatArray, int]:
    """
    Return the velocity (k, 6) that the wake induces at all points, in geometry axes [m/s].

    The first three columns are of each surface's own wake, the last three of the others'. Also
    returned: how many pairs of a node and a point that took.
    """
    rows, width = wake.rows, lattice.wake_nodes.shape[0]
    nodes = np.empty((rows + 2, width, 3))
    # The first row is where the trailing edge is, to the last bit: there the edges of the ring
    # at the trailing edge and of the fresh row cancel.
    nodes[0] = lattice.wake_nodes
    origin, moving = placement.origin_N - wake.drift_N, len(wake.moving_A)
    _turned(wake.moving_A[1:], origin, placement.rotation_NG, nodes[1:moving])
    _turned(wake.settled_A, origin, placement.rotation_NG, nodes[moving:rows + 1])
    close(nodes, where.far)
    circulation = wake.circulation
    found = np.zeros((len(where.points), 6))
    on_skeleton = np.zeros((len(where.skeleton), 6))
    pairs = _induced(nodes, circulation, coarsen, where.bounds, where.cores, where.box,
                     where.reach, where.points, where.rounded, where.skeleton, found, on_skeleton)
    for s, weights in enumerate(where.weights):
        if weights.shape[1]:
            here, few = where.bounds[s:s + 2, 2], where.bounds[s:s + 2, 3]
            found[here[0]:here[1]] += weights @ on_skeleton[few[0]:few[1]]
    return found, pairs


def on_lattice(found: FloatArray, where: Felt,
               normal: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return what the panels and edges have of a velocity (k, 6), see `velocity`.

    Normalwash (p,) of all wakes and that of other surfaces' alone, on panels with normals (p, 3),
    and the velocity (s, 3) of all wakes at the edges' middles.
    """
    everything, foreign = np.empty(len(where.panel)), np.empty(len(where.panel))
    at_edges = np.empty((len(where.edge), 3))
    _on_lattice(found, where.panel, where.edge, normal, everything, foreign, at_edges)
    return everything, foreign, at_edges


@njit(**_EXACT)
def _on_lattice(found, panel, edge, normal, everything, foreign, at_edges):
    for i in range(panel.size):
        own = other = 0.0
        for c in range(3):
            own += found[panel[i], c] * normal[i, c]
            other += found[panel[i], 3 + c] * normal[i, c]
        everything[i], foreign[i] = own + other, other
    for i in range(edge.size):
        for c in range(3):
            at_edges[i, c] = found[edge[i], c] + found[edge[i], 3 + c]


@njit(**_EXACT)
def _turned(rows, origin, rotation, out):
    """Fill `out` with rows of nodes (k, n, 3) in geometry axes, (r - origin) R."""
    for i in range(rows.shape[0]):
        for k in range(rows.shape[1]):
            x, y, z = rows[i, k, 0] - origin[0], rows[i, k, 1] - origin[1], \
                rows[i, k, 2] - origin[2]
            for c in range(3):
                out[i, k, c] = x * rotation[0, c] + y * rotation[1, c] + z * rotation[2, c]


@njit(**_EXACT)
def lengths(nodes, out):
    """Fill `out` (rows,) with the greatest distance between nodes of a row and of the next."""
    for i in range(out.size):
        longest = 0.0
        for k in range(nodes.shape[1]):
            square = 0.0
            for c in range(3):
                square += (nodes[i + 1, k, c] - nodes[i, k, c]) ** 2
            longest = max(longest, square)
        out[i] = np.sqrt(longest)


@njit(**_EXACT)
def distances(nodes, box, out):
    """Fill `out` (rows,) with the distance of each row of nodes from a box (2, 3)."""
    for i in range(out.size):
        nearest = np.inf
        for k in range(nodes.shape[1]):
            square = 0.0
            for c in range(3):
                outside = max(box[0, c] - nodes[i, k, c], nodes[i, k, c] - box[1, c], 0.0)
                square += outside * outside
            nearest = min(nearest, square)
        out[i] = np.sqrt(nearest)


@njit(**_EXACT)
def ladder(length, distance, coarsen, marks):
    """
    Fill `marks` with the rows at which groups of rows begin, and the end; return how many groups.

    length (rows,), distance (rows + 1,) [m] : see `lengths`, `distances`. A group is as long as
    `LONGEST` of the distance of its nearest row allows, and one row at least.
    """
    rows, groups, row = length.size, 0, 0
    marks[0] = 0
    while row < rows:
        total, nearest = length[row], min(distance[row], distance[row + 1])
        row += 1
        while coarsen and row < rows:
            total += length[row]
            nearest = min(nearest, distance[row + 1])
            # In level flight the two are equal but for round-off, which must not decide.
            if not total <= LONGEST * nearest * (1.0 + 1e-6):
                break
            row += 1
        groups += 1
        marks[groups] = row
    return groups


@njit(**_EXACT)
def _add(nodes, circulation, length, marks, begin, end, on_edge, width_core, points, out):
    """
    Add to `out` (n, 3) the velocity of the groups begin to end at points; return pairs.

    nodes (rows, n, 3) and circulation (rows, strips) of one surface's wake. A ring has the
    mean circulation of its rows by length, so that its moment is theirs. on_edge : the first row
    of nodes lies on the points, and its edges are left to `_add_edge`.
    """
    if begin == end or points.shape[0] == 0:
        return 0
    count, width, strips = end - begin, nodes.shape[1], circulation.shape[1]
    corners, ring = np.empty((count + 1, width, 3)), np.zeros((count, strips))
    corners[0] = nodes[marks[begin]]
    for g in range(count):
        first, last = marks[begin + g], marks[begin + g + 1]
        corners[g + 1] = nodes[last]
        total = 0.0
        for row in range(first, last):
            total += length[row]
        for row in range(first, last):
            share = length[row] / total if total > 0.0 else 1.0 / (last - first)
            for j in range(strips):
                ring[g, j] += share * circulation[row, j]
    edges = np.empty((6, (count + 1) * width), points.dtype)
    grid_edges(corners, ring, np.full(count + 1, width_core), edges)
    if on_edge:
        edges[3, :width] = 0.0
    velocity = np.empty(points.shape, points.dtype)
    grid_velocity(edges[0], edges[1], edges[2], edges[3], edges[4], edges[5], width, points,
                  velocity)
    for i in range(points.shape[0]):
        for c in range(3):
            out[i, c] += velocity[i, c]
    return (count + 1) * width * points.shape[0]


@njit(**_EXACT)
def _add_edge(nodes, circulation, width_core, points, out):
    """
    Add to `out` (n, 3) the velocity of the front edges of a wake, in float64; return pairs.

    nodes (2, n, 3), circulation (1, strips). The middles of the trailing edge lie on them: the
    round-off of float32 in their distance is more than the core.
    """
    width = nodes.shape[1]
    edges = np.empty((6, 2 * width))
    grid_edges(nodes, circulation, np.full(2, width_core), edges)
    edges[4] = 0.0   # those towards the next row belong to `_add`
    velocity = np.empty(points.shape)
    grid_velocity(edges[0, :width], edges[1, :width], edges[2, :width], edges[3, :width],
                  edges[4, :width], edges[5, :width], width, points, velocity)
    out += velocity
    return width * points.shape[0]


@njit(**_EXACT)
def _induced(nodes, circulation, coarsen, bounds, cores, box, reach, points, rounded, skeleton,
             found, on_skeleton):
    """Fill `found` and add to `on_skeleton`, see `velocity`; return the pairs of both."""
    rows = circulation.shape[0]
    length, distance = np.empty(rows + 1), np.empty(rows + 2)
    marks, pairs = np.empty(rows + 2, np.int64), 0
    for s in range(bounds.shape[0] - 1):
        own = np.ascontiguousarray(nodes[:, bounds[s, 0]:bounds[s + 1, 0]])
        strength = np.empty((rows + 1, bounds[s + 1, 1] - bounds[s, 1]))
        strength[:rows] = circulation[:, bounds[s, 1]:bounds[s + 1, 1]]
        strength[rows] = strength[rows - 1]
        lengths(own, length)
        for t in range(bounds.shape[0] - 1):
            here = slice(bounds[t, 2], bounds[t + 1, 2])
            few = slice(bounds[t, 3], bounds[t + 1, 3])
            columns = slice(0, 3) if s == t else slice(3, 6)
            distances(own, box[t], distance)
            groups = ladder(length[:rows], distance[:rows + 1], coarsen, marks)
            marks[groups + 1] = rows + 1
            begin, end = groups + 1, 0
            for g in range(groups + 1):
                if min(distance[marks[g]], distance[marks[g + 1]]) < reach[t]:
                    begin, end = min(begin, g), g + 1
            end = max(begin, end)
            if s == t:
                edge = slice(bounds[t, 4], bounds[t + 1, 2])
                here = slice(bounds[t, 2], bounds[t, 4])
                pairs += _add_edge(own[:2], strength[:1], cores[s, t], points[edge],
                                   found[edge, columns])
                pairs += _add(own, strength, length, marks, begin, end, True, cores[s, t],
                              rounded[edge], found[edge, columns])
            pairs += _add(own, strength, length, marks, begin, end, False, cores[s, t],
                          rounded[here], found[here, columns])
            for first, last in ((0, begin), (end, groups + 1)):
                pairs += _add(own, strength, length, marks, first, last, False, cores[s, t],
                              skeleton[few], on_skeleton[few, columns])
    return pairs
