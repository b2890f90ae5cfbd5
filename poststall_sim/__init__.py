# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Flight past the stall: an unsteady vortex lattice corrected by decambering, for ROS 2.

Importing the package imports nothing else; take what you need from its modules.
"""

__version__ = '0.1.0'
