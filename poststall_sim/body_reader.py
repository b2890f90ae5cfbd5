# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Bodies that do not lift out of the mappings of an aircraft file."""

from poststall_sim.nonlifting import NonliftingBody
from poststall_sim.reader import Reader


def body(read: Reader) -> NonliftingBody:
    """Read a fuselage or a gear."""
    return read.build(
        NonliftingBody, name=read.name('name'), position_G=read.vector('position_m', 3),
        drag_area=read.vector('drag_area_m2', 3, at_least=0),
        length=read.number_if_any('length_m', above=0),
        volume=read.number_if_any('volume_m3', above=0))
