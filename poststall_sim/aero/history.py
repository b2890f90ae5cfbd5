# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Where the rows of a wake are kept once they do not change any more.

A wake loses a row and gains one at every step. Moving all of them would cost as much as the
memory takes; overwriting the oldest in place would change the wake that the step started from.
So a row is written once, into a slot that nobody reads yet, and a wake is a stretch of slots:
older wakes stay what they were, and stepping twice from one of them is allowed.
"""

import numpy as np

from poststall_sim.frames import FloatArray

ROOM = 2
"""Slots of a store, times the rows that it begins with: it lasts as many steps as rows."""


class History:
    """
    Slots for rows of nodes (slots, nodes, 3) [m] and rings (slots, strips) [m^2/s].

    Filled from the last slot to the first, so that a wake reads its rows, newest first, as a
    slice. The ring of a slot lies between its row of nodes and that of the next slot.
    """

    __slots__ = ('_free', 'nodes', 'rings')

    def __init__(self, nodes: FloatArray, rings: FloatArray):
        """Take in rows (k, nodes, 3) and (k, strips), the newest first; see `first`."""
        slots = ROOM * len(nodes) + 1
        self._free = slots - len(nodes)
        self.nodes = np.empty((slots, *nodes.shape[1:]))
        self.rings = np.empty((slots, *rings.shape[1:]))
        self.nodes[self._free:] = nodes
        self.rings[self._free:] = rings

    @property
    def first(self) -> int:
        """The slot of the newest row."""
        return self._free

    def with_row(self, first: int, rows: int, nodes: FloatArray,
                 ring: FloatArray) -> tuple['History', int]:
        """
        Return a store with one more row before slot `first`, and the slot of that row.

        rows : how many from `first` on the caller still wants. The store is this one, unless the
        slot is taken by another wake or there is none; then a new one, with a copy of the rows.
        """
        store = self
        if first != self._free or first == 0:
            kept = slice(first, first + rows)
            store = History(self.nodes[kept], self.rings[kept])
        store._free -= 1
        store.nodes[store._free] = nodes
        store.rings[store._free] = ring
        return store, store._free
