# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The vortex lattice, decambering and loads: arrays in, arrays out, no ROS, no files."""
