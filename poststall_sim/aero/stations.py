# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Where along its span a surface has its sections, and where its strips end."""

import math

import numpy as np

from poststall_sim.aircraft import Section, Surface
from poststall_sim.frames import FloatArray


def of_surface(surface: Surface) -> tuple[list[Section], list[float]]:
    """Return the sections from left to right, both sides, and their place along the span [m]."""
    sections = list(surface.sections)
    if surface.symmetric:
        mirrored = [
            Section((s.leading_edge_G[0], -s.leading_edge_G[1], s.leading_edge_G[2]),
                    s.chord, s.airfoil, s.twist)
            for s in reversed(sections[1:])]
        sections = mirrored + sections
    place = list(surface.section_places)
    if surface.symmetric:
        place = [place[-1] - x for x in place[:0:-1]] + [place[-1] + x for x in place]
    return sections, place


def strip_edges(surface: Surface, place: list[float]) -> FloatArray:
    """
    Return the strip edges (strips + 1,) along the span [m].

    Those of the surface, or uniform or cosine over the whole span; then the nearest edge is moved
    onto each section, so that no strip straddles a kink. A symmetric surface is cut on one half
    and mirrored.
    """
    total, strips = place[-1], surface.strips
    cosine, symmetric = surface.spacing_cosine, surface.symmetric
    if surface.edges:
        share = np.array(surface.edges)
        for section in surface.section_shares:   # to the last bit: interpolation knows no kink
            share[np.argmin(np.abs(share - section))] = section
        return 0.5 * total * np.concatenate([1.0 - share[:0:-1], 1.0 + share]) if symmetric \
            else total * share
    share = np.linspace(0.0, 1.0, strips + 1)
    edges = total * (0.5 - 0.5 * np.cos(math.pi * share) if cosine else share)
    kinks = place[1:-1]
    if symmetric:
        kinks = [kink for kink in kinks if kink > 0.5 * total * (1.0 + 1e-12)]
        edges[strips // 2] = 0.5 * total
    first = strips // 2 + 1 if symmetric else 1
    for i, kink in enumerate(kinks):
        last = strips - (len(kinks) - 1 - i)    # an edge each is left for the kinks to come
        k = first + int(np.argmin(np.abs(edges[first:last] - kink)))
        edges[k] = kink
        first = k + 1
    if symmetric:
        edges[:strips // 2] = total - edges[:strips // 2:-1]
    return edges


def collocation_shares(surface: Surface) -> FloatArray:
    """Return where between its left and right end (strips,) each strip's flow is tangent, 0..1."""
    if not surface.points:
        return np.full(surface.strips, 0.5)
    edges = np.array(surface.edges)
    share = (np.array(surface.points) - edges[:-1]) / np.diff(edges)
    return np.concatenate([1.0 - share[::-1], share]) if surface.symmetric else share
