# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Where a flight leaves what the method is made for: it goes on, but its numbers mean less."""

import math
from dataclasses import dataclass

import numpy as np

from poststall_sim.aero.lattice import Lattice
from poststall_sim.aero.model import Model
from poststall_sim.atmosphere import Air
from poststall_sim.state import Snapshot

GREATEST_MACH = 0.3
"""Above it density changes by more than 5 % on the way round a section: the lattice has none."""
GREATEST_ALPHA = math.radians(40.0)
"""Beyond it wakes of whole wings roll up and shed as no section's curve says [rad]."""
REYNOLDS_FACTOR = 3.0
"""Section curves are good for Reynolds numbers this much below and above those of their tables."""


@dataclass(frozen=True, slots=True)
class Excess:
    """
    A quantity outside its limits.

    beyond : how far, as value over limit where that is too great, limit over value where it is
    too small: the worse the greater. text : for people.
    """

    quantity: str
    beyond: float
    text: str


def exceeded(snapshot: Snapshot, model: Model) -> tuple[Excess, ...]:
    """Return what is outside the envelope of the method at an instant, mostly nothing."""
    found = []
    if snapshot.mach > GREATEST_MACH:
        found.append(Excess('Mach', snapshot.mach / GREATEST_MACH,
                            f'Mach {snapshot.mach:.2f}, above {GREATEST_MACH:g}'))
    if abs(snapshot.alpha) > GREATEST_ALPHA:
        found.append(Excess(
            'alpha', abs(snapshot.alpha) / GREATEST_ALPHA,
            f'alpha {math.degrees(snapshot.alpha):.0f} deg, beyond '
            f'{math.degrees(GREATEST_ALPHA):g}'))
    return (*found, *reynolds(snapshot.airspeed, snapshot.air, model.lattice))


def reynolds(airspeed: float, air: Air, lattice: Lattice) -> tuple[Excess, ...]:
    """
    Return where sections are farthest from their tables at an airspeed [m/s], if they are too far.

    A strip's Reynolds number is made with its chord and the airspeed; tables that do not say
    theirs are not complained of.
    """
    if airspeed <= 0.0:
        return ()
    flown = airspeed / air.kinematic_viscosity * lattice.strip_chord
    low, high = lattice.reynolds_range.T
    beyond = np.nan_to_num(np.maximum(low / flown, flown / high) / REYNOLDS_FACTOR)
    worst = int(np.argmax(beyond))
    if not beyond[worst] > 1.0:
        return ()
    to = f' to {high[worst]:.2g}' if high[worst] > low[worst] else ''
    return (Excess('Reynolds', float(beyond[worst]),
                   f'Reynolds number {flown[worst]:.2g} at {lattice.strip_names[worst]}, its '
                   f'tables are of {low[worst]:.2g}{to}'),)
