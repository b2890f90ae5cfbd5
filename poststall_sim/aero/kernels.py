# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Velocity induced by straight vortex segments: the only Biot-Savart code of the package.

A segment of unit circulation from A to B induces at P, with a = P - A, b = P - B,

    u = 1/(4 pi) (r1 + r2) / (r1 r2 (r1 r2 + a.b + e)) a x b,   r^2 = |.|^2 + e,  e = core^2

(Katz & Plotkin, Low-Speed Aerodynamics, 2nd ed., sec. 10.4.5, with the denominator written so
that it needs no second branch for points on the segment's line). The core, in every squared
distance (Rosenhead, Proc. R. Soc. A 127, 1930), takes the velocity smoothly to zero within about
its length of the filament, and a segment has the velocity of its pieces, however it is cut.
Between a surface and its own wake it is a mere guard against 0/0, so that the bound trailing
edge and the fresh wake row cancel.

Arrays only, in one set of axes, in metres. All functions are compiled, one thread, without the
interpreter's lock. `grid_velocity` works in the float type of the nodes it is given: a constant
without a type would lift the whole loop to float64, silently and at half the speed.
"""

import math

import numpy as np
from numba import njit

_FOUR_PI = 4.0 * math.pi
_PER_FOUR_PI = 1.0 / _FOUR_PI

# Sums vectorise only under fastmath, which assumes finite numbers: callers check their input.
_STREAM = {'cache': True, 'nogil': True, 'fastmath': True, 'error_model': 'numpy'}
_EXACT = {'cache': True, 'nogil': True}

_ON_LINE = 1e-24
"""Squared sine of the angle between r1 and r2 that is round-off: the point is on the line."""
_BLOCK = 512
"""Wake nodes worked on at a time: four arrays of this length stay in the first-level cache."""
_VECTOR = 32
"""Nodes in whole vectors: what is left over is done one by one, each as slow as eight."""


@njit(**_EXACT)
def _segment(px, py, pz, ax, ay, az, bx, by, bz, core):
    """Return the velocity (3 floats) at P of the unit segment A to B."""
    r1x, r1y, r1z = px - ax, py - ay, pz - az
    r2x, r2y, r2z = px - bx, py - by, pz - bz
    e = core * core
    r1 = math.sqrt(r1x * r1x + r1y * r1y + r1z * r1z + e)
    r2 = math.sqrt(r2x * r2x + r2y * r2y + r2z * r2z + e)
    product = r1 * r2
    denominator = product * (product + r1x * r2x + r1y * r2y + r1z * r2z + e)
    if denominator <= 0.0:
        return 0.0, 0.0, 0.0
    cx, cy, cz = r1y * r2z - r1z * r2y, r1z * r2x - r1x * r2z, r1x * r2y - r1y * r2x
    if cx * cx + cy * cy + cz * cz < _ON_LINE * product * product:
        return 0.0, 0.0, 0.0
    k = (r1 + r2) / (_FOUR_PI * denominator)
    return k * cx, k * cy, k * cz


@njit(**_EXACT)
def ring_influence(points, corners, core, out):
    """
    Fill `out` with the velocity of unit rings at points.

    points : (n, 3); corners : (k, 4, 3) in the order of positive circulation;
    core : (n, k); out : (n, k, 3), overwritten.
    """
    for i in range(points.shape[0]):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        for j in range(corners.shape[0]):
            u = v = w = 0.0
            for a in range(4):
                b = (a + 1) % 4
                du, dv, dw = _segment(
                    px, py, pz, corners[j, a, 0], corners[j, a, 1], corners[j, a, 2],
                    corners[j, b, 0], corners[j, b, 1], corners[j, b, 2], core[i, j])
                u += du
                v += dv
                w += dw
            out[i, j, 0] = u
            out[i, j, 1] = v
            out[i, j, 2] = w


@njit(**_EXACT)
def grid_edges(nodes, ring, cores, out):
    """
    Fill `out` with what `grid_velocity` wants of a grid of rings, each edge once.

    nodes : (rows + 1, columns + 1, 3); ring : (rows, columns) circulation; cores : (rows + 1,)
    [m] of the edges that leave a row of nodes; out : (6, (rows + 1) (columns + 1)) rows x, y, z,
    span, stream, core2, overwritten, of the float type that is wanted there.
    """
    rows, width = nodes.shape[0], nodes.shape[1]
    out[3:] = 0.0
    for i in range(rows):
        for k in range(width):
            n = i * width + k
            for c in range(3):
                out[c, n] = nodes[i, k, c]
            out[5, n] = cores[i] * cores[i]
            if i + 1 < rows and k + 1 < width:
                out[3, n] += ring[i, k]
                out[3, n + width] -= ring[i, k]
                out[4, n + 1] += ring[i, k]
                out[4, n] -= ring[i, k]


@njit(**_EXACT)
def _whole(count):
    """Return the next multiple of `_VECTOR`."""
    return (count + _VECTOR - 1) // _VECTOR * _VECTOR


@njit(**_STREAM)
def grid_velocity(x, y, z, span, stream, core2, width, points, out):
    """
    Fill `out` with the velocity of a grid of vortex segments at points.

    x, y, z : (rows of nodes * width,) nodes, row after row; span, stream : circulation of the
    edge from each node to the next one in its row and in the next row, each edge once, and
    core2 : square of their core [m^2], above 0. The circulation of the edge that leaves a
    row at its last node is zero, and so is that of edges that leave the last row, so that one
    unbroken loop over nodes serves both edges.
    points : (n, 3); out : (n, 3), overwritten. Arrays but for `out` are of one type.
    """
    real = x.dtype.type
    none, one, factor = real(0.0), real(1.0), real(_PER_FOUR_PI)
    # Behind the nodes come some without circulation, so that there are whole vectors of them and
    # the last row has a next one; their edges have a core, against 0/0.
    total = x.size
    whole = _whole(total)
    beyond = _whole(width)
    edges = np.zeros((6, whole + beyond), x.dtype)
    for k in range(total):
        edges[0, k], edges[1, k], edges[2, k] = x[k], y[k], z[k]
        edges[3, k], edges[4, k], edges[5, k] = span[k], stream[k], core2[k]
    for k in range(total, whole + beyond):
        edges[0, k], edges[1, k], edges[2, k] = x[total - 1], y[total - 1], z[total - 1]
        edges[5, k] = one
    size = min(_BLOCK, whole)
    rx = np.empty(size + beyond, x.dtype)
    ry = np.empty_like(rx)
    rz = np.empty_like(rx)
    rn = np.empty_like(rx)
    for p in range(points.shape[0]):
        px, py, pz = points[p, 0], points[p, 1], points[p, 2]
        u = v = w = real(0.0)
        for start in range(0, whole, size):
            count = min(size, whole - start)
            stop = start + count
            xs, ys = edges[0, start:stop + beyond], edges[1, start:stop + beyond]
            zs, es = edges[2, start:stop + beyond], edges[5, start:stop + beyond]
            for k in range(count + beyond):
                a, b, c = px - xs[k], py - ys[k], pz - zs[k]
                rx[k], ry[k], rz[k] = a, b, c
                rn[k] = math.sqrt(a * a + b * b + c * c + es[k])
            gs, gc = edges[3, start:stop], edges[4, start:stop]
            ax, ay, az, an = rx[1:], ry[1:], rz[1:], rn[1:]
            bx, by, bz, bn = rx[width:], ry[width:], rz[width:], rn[width:]
            for k in range(count):
                a, b, c, n = rx[k], ry[k], rz[k], rn[k]
                m1 = n * an[k]
                m2 = n * bn[k]
                # On a segment what is not core vanishes; in float32 its round-off outweighs that.
                d1 = m1 * (max(m1 + a * ax[k] + b * ay[k] + c * az[k], none) + es[k])
                d2 = m2 * (max(m2 + a * bx[k] + b * by[k] + c * bz[k], none) + es[k])
                inverse = one / (d1 * d2)
                k1 = gs[k] * (n + an[k]) * d2 * inverse
                k2 = gc[k] * (n + bn[k]) * d1 * inverse
                # The two edges share r1: one cross product serves both.
                sx = k1 * ax[k] + k2 * bx[k]
                sy = k1 * ay[k] + k2 * by[k]
                sz = k1 * az[k] + k2 * bz[k]
                u += b * sz - c * sy
                v += c * sx - a * sz
                w += a * sy - b * sx
        out[p, 0] = factor * u
        out[p, 1] = factor * v
        out[p, 2] = factor * w
