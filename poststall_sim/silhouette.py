# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The aircraft as flat polygons in base_link (x forward, y left, z up) [m], to be drawn."""

import numpy as np

from poststall_sim.aircraft import Aircraft, Surface
from poststall_sim.controls import Movable
from poststall_sim.frames import FloatArray, control_sign, geometry_to_body, swap_body_flu

Polygons = list[FloatArray]

MIRROR = np.array([1.0, -1.0, 1.0])


FLAP_LIFT = 0.01
"""A moved part is drawn twice, so far above and below the surface, to be seen on it [chords]."""


def of_aircraft(aircraft: Aircraft) -> Polygons:
    """Return the surfaces of an aircraft, each panel of a surface (4, 3), and a fuselage."""
    panels = [panel for surface in aircraft.surfaces for panel in _panels(surface)]
    return _placed(aircraft, panels) + fuselage(aircraft)


def fuselage(aircraft: Aircraft) -> Polygons:
    """Return a slender body that holds the surfaces of an aircraft together, for the eye only."""
    points = np.concatenate(
        [panel for surface in aircraft.surfaces for panel in _panels(surface)])
    front, rear = points[:, 0].min(), points[:, 0].max()
    chord = aircraft.reference.chord
    level = float(aircraft.mass.cg_G[2])
    return _placed(aircraft, _fuselage(front - 0.9 * chord, rear, 0.32 * chord, level))


def movables(aircraft: Aircraft, angles: FloatArray) -> Polygons:
    """Return the movable parts, turned about their hinges by their angles (k,) [rad]."""
    surfaces = {surface.name: surface for surface in aircraft.surfaces}
    found = [polygon for part, angle in zip(aircraft.movables, angles)
             for polygon in _turned(surfaces[part.surface], part, float(angle))]
    return _placed(aircraft, found)


def triangles(polygons: Polygons) -> FloatArray:
    """Return convex polygons as the corners (3 k, 3) of triangles, a fan for each."""
    fans = [np.stack([polygon[[0, i, i + 1]] for i in range(1, len(polygon) - 1)])
            for polygon in polygons]
    return np.concatenate(fans).reshape(-1, 3) if fans else np.zeros((0, 3))


def generic(span: float, chord: float) -> Polygons:
    """Return an aircraft of ordinary shape around a wing's span and chord [m]."""
    def wing(x: float, half: float, length: float, z: float) -> FloatArray:
        return np.array([[x, half, z], [x, -half, z], [x - length, -half, z],
                         [x - length, half, z]])
    tail = -2.7 * chord
    fin = np.array([[tail, 0.0, 0.0], [tail - 0.25 * chord, 0.0, 1.2 * chord],
                    [tail - 0.8 * chord, 0.0, 1.2 * chord], [tail - 0.8 * chord, 0.0, 0.0]])
    body = [panel * np.array([-1.0, 1.0, 1.0])
            for panel in _fuselage(-1.4 * chord, 3.4 * chord, 0.32 * chord, 0.0)]
    return [wing(0.4 * chord, 0.5 * span, chord, 0.1 * chord),
            wing(tail, 0.17 * span, 0.65 * chord, 0.0), fin, *body]


def _placed(aircraft: Aircraft, polygons: Polygons) -> Polygons:
    """Return polygons of geometry axes in base_link."""
    cg = np.array(aircraft.mass.cg_G)
    return [swap_body_flu(geometry_to_body(polygon - cg)) for polygon in polygons]


def _edges(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Return the leading and the trailing edge (sections, 3) of a surface as it is drawn."""
    leading = np.array([section.leading_edge_G for section in surface.sections])
    trailing = leading.copy()
    for i, section in enumerate(surface.sections):
        trailing[i, 0] += section.chord * np.cos(section.twist)
        trailing[i, 2] -= section.chord * np.sin(section.twist)
    return leading, trailing


def _panels(surface: Surface) -> Polygons:
    leading, trailing = _edges(surface)
    half = [np.stack([leading[i], leading[i + 1], trailing[i + 1], trailing[i]])
            for i in range(len(leading) - 1)]
    return half + [panel * MIRROR for panel in half] if surface.symmetric else half


def _turned(surface: Surface, part: Movable, angle: float) -> Polygons:
    """Return a movable part of a surface, each panel of it twice (4, 3)."""
    leading, trailing = _edges(surface)
    steps = np.linalg.norm(np.diff(leading[:, 1:], axis=0), axis=1)
    share = np.concatenate([[0.0], np.cumsum(steps)]) / steps.sum()
    low, high = part.span
    cuts = np.array([low, *share[(share > low) & (share < high)], high])
    front, rear = (np.column_stack([np.interp(cuts, share, edge[:, k]) for k in range(3)])
                   for edge in (leading, trailing))
    hinge = front + part.hinge * (rear - front)
    mirror = MIRROR if part.side < 0 else 1.0
    axis, edge = hinge * mirror, rear * mirror
    found = []
    for i in range(len(cuts) - 1):
        chord = edge[i:i + 2] - axis[i:i + 2]
        normal = np.cross(chord[0], axis[i + 1] - axis[i])
        normal /= np.linalg.norm(normal)
        # Positive is trailing edge down, or left on a vertical surface.
        down = -control_sign(normal) * normal
        length = np.linalg.norm(chord, axis=1)[:, None]
        moved = axis[i:i + 2] + np.cos(angle) * chord + np.sin(angle) * length * down
        quad = np.stack([axis[i], axis[i + 1], moved[1], moved[0]])
        found += [quad + FLAP_LIFT * length[0] / (1.0 - part.hinge) * sign * normal
                  for sign in (1.0, -1.0)]
    return found


def _fuselage(front: float, rear: float, radius: float, level: float) -> Polygons:
    """Return a slender body from front to rear (x aft) in its two planes of symmetry."""
    length = rear - front
    x = front + length * np.array([0.0, 0.06, 0.3, 1.0])
    r = radius * np.array([0.25, 0.75, 1.0, 0.15])
    outline_x, outline_r = np.append(x, x[::-1]), np.append(r, -r[::-1])
    zero = np.zeros(len(outline_x))
    return [np.column_stack([outline_x, outline_r, zero + level]),
            np.column_stack([outline_x, zero, outline_r + level])]
