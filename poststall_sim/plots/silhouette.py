# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The aircraft as flat polygons in base_link (x forward, y left, z up) [m], to be drawn."""

import numpy as np

from poststall_sim.aircraft import Aircraft, Surface
from poststall_sim.frames import FloatArray, geometry_to_body, swap_body_flu

Polygons = list[FloatArray]


def of_aircraft(aircraft: Aircraft) -> Polygons:
    """Return the surfaces of an aircraft, each panel of a surface (4, 3), and a fuselage."""
    panels = [panel for surface in aircraft.surfaces for panel in _panels(surface)]
    points = np.concatenate(panels)
    front, rear = points[:, 0].min(), points[:, 0].max()
    chord = aircraft.reference.chord
    level = float(aircraft.mass.cg_G[2])
    panels += _fuselage(front - 0.9 * chord, rear, 0.32 * chord, level)
    cg = np.array(aircraft.mass.cg_G)
    return [swap_body_flu(geometry_to_body(panel - cg)) for panel in panels]


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


def _panels(surface: Surface) -> Polygons:
    leading = np.array([section.leading_edge_G for section in surface.sections])
    trailing = leading.copy()
    for i, section in enumerate(surface.sections):
        trailing[i, 0] += section.chord * np.cos(section.twist)
        trailing[i, 2] -= section.chord * np.sin(section.twist)
    half = [np.stack([leading[i], leading[i + 1], trailing[i + 1], trailing[i]])
            for i in range(len(leading) - 1)]
    mirror = np.array([1.0, -1.0, 1.0])
    return half + [panel * mirror for panel in half] if surface.symmetric else half


def _fuselage(front: float, rear: float, radius: float, level: float) -> Polygons:
    """Return a slender body from front to rear (x aft) in its two planes of symmetry."""
    length = rear - front
    x = front + length * np.array([0.0, 0.06, 0.3, 1.0])
    r = radius * np.array([0.25, 0.75, 1.0, 0.15])
    outline_x, outline_r = np.append(x, x[::-1]), np.append(r, -r[::-1])
    zero = np.zeros(len(outline_x))
    return [np.column_stack([outline_x, outline_r, zero + level]),
            np.column_stack([outline_x, zero, outline_r + level])]
