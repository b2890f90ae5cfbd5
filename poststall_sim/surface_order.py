# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Which surface is called the wing: that of the greatest span, on every page, figure and table.

By span and not by area: where strips are is known of every flight and polar, their chords are not,
and a fuselage that is modelled as a plate may have more area than the wing.
"""

from collections.abc import Sequence

import numpy as np

from poststall_sim.frames import FloatArray


def by_span(runs: Sequence[slice | np.ndarray], y: FloatArray) -> list[int]:
    """
    Return the numbers of the surfaces, the wing's first.

    runs : which strips are of each, as one indexes with; y (n,) : of all strips, to one side [m].
    """
    spans = [float(np.ptp(y[run])) for run in runs]
    return sorted(range(len(runs)), key=lambda number: -spans[number])
