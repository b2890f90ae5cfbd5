# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Fields and constants of simulation_interfaces 1.x that a simulator of one aircraft has to do with.

Names and numbers are those of its definitions (github.com/ros-simulation/simulation_interfaces);
it is not on PyPI. There is no type support here, so that nothing of it goes over DDS.
"""
