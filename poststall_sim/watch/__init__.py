# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
A running simulator as a live page in a browser of this machine.

`scene` keeps what was heard of the simulator, `orders` reads what a page asks for, `stick` knows
which page holds the controls, `server` brings it all to the browser; live.html and its
scripts are what that gets. Nothing here knows of ROS: see `ros.watch`.
"""
