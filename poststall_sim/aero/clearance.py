# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Strips that are too narrow and surfaces that lie in each other: no lattice."""

import numpy as np

from poststall_sim.aero.lattice import Lattice
from poststall_sim.aircraft import ConfigError

NARROWEST = 1e-3
"""Strip width over chord below which a lattice says nothing."""
CLOSEST = 0.02
"""A point this share of a strip or less above another panel lies in that panel."""


def require_apart(lattice: Lattice, owner: np.ndarray) -> None:
    """Refuse strips without width and surfaces that lie in each other."""
    slender = lattice.strip_width / lattice.strip_chord
    if slender.min() < NARROWEST:
        name = lattice.strip_names[int(np.argmin(slender))]
        raise ConfigError(f'strip {name} is {slender.min():.1e} of its chord wide, it needs at '
                          f'least {NARROWEST:g}: fewer strips or more span')
    width = lattice.strip_width[lattice.panel_strip]
    apart = lattice.collocation[:, None] - lattice.collocation[None, :]
    above = np.abs(np.einsum('ijk,jk->ij', apart, lattice.normal))
    aft = np.abs(np.einsum('ijk,jk->ij', apart, lattice.tangent))
    beside = np.sqrt(np.maximum(np.sum(apart ** 2, axis=-1) - above ** 2 - aft ** 2, 0.0))
    within = (beside < 0.5 * width) & (aft < 0.5 * lattice.area / width) \
        & (owner[:, None] != owner[None, :])
    strip = lattice.panel_strip
    image = (lattice.mirror[strip][:, None] == strip[None, :]) & (strip[:, None] != strip[None, :])
    inside = (above < CLOSEST * width) & (
        within | image & (np.linalg.norm(apart, axis=-1) < CLOSEST * width))
    if inside.any():
        point, panel = np.argwhere(inside)[0]
        first, second = (lattice.grids[owner[i]].name for i in (point, panel))
        both = f'surfaces {first} and {second} lie' if first != second else f'the two sides of ' \
            f'surface {first} lie'
        raise ConfigError(f'{both} in each other: panels come as close as '
                          f'{above[point, panel]:.2g} m, they need {CLOSEST * width[panel]:.2g} '
                          'm at least')
