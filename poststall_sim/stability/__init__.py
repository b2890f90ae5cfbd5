# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Small disturbances of a steady flight: the linearised lattice, its modes, derivatives."""
