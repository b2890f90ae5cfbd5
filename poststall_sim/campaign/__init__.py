# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Many flights, polars, trims or modes from one definition, on one machine or on a cluster."""
