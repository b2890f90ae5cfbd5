# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The commands of `poststall`, a module each: its options, and what it does with them."""
