# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 nodes and the conversion of records to messages."""
