#!/usr/bin/env bash
# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
#
# Build a clean copy of the last commit with colcon, as a user's workspace would, and start the
# simulator from where colcon installed it. Needs .venv (`make test` makes it) and git.

set -euo pipefail
cd "$(dirname "$0")/.."

# As in the Makefile: a sourced ROS and the venv's own do not mix.
unset PYTHONPATH LD_LIBRARY_PATH AMENT_PREFIX_PATH RMW_IMPLEMENTATION
unset _ROS_WHEELS_BOOTSTRAP_COMPLETE

python=$PWD/.venv/bin/python
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

mkdir -p "$work/ws/src/poststall_sim"
git archive HEAD | tar -x -C "$work/ws/src/poststall_sim"

# An executable that colcon installs starts with the python that ran colcon, so that must be the
# one that has rclpy and numba. colcon itself stays out of it: it holds setuptools below 80.
"$python" -m pip install -q --disable-pip-version-check --target "$work/colcon" \
    colcon-common-extensions
cd "$work/ws"
PYTHONPATH=$work/colcon "$python" "$work/colcon/bin/colcon" build

prefix=$work/ws/install/poststall_sim
for path in lib/poststall_sim/{simulator,pilot,autopilot,poststall} \
        share/ament_index/resource_index/packages/poststall_sim \
        share/poststall_sim/{package.xml,launch/{sim,two_aircraft}.launch.py} \
        share/poststall_sim/config/{simulator.yaml,aircraft,airfoils,scenarios}; do
    [ -e "$prefix/$path" ] || { echo "colcon did not install $path" >&2; exit 1; }
done
for name in page.html page.js; do
    find "$prefix" -path "*/poststall_sim/report/$name" | grep -q . ||
        { echo "colcon did not install report/$name" >&2; exit 1; }
done

set +u  # colcon's setup files read variables that nobody set
. install/setup.bash
set -u

cat > "$work/watch.py" <<'PYTHON'
"""Start the simulator, see its clock go forward, end it with SIGINT."""

import pathlib
import signal
import subprocess
import sys
import time

import poststall_sim
import rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

prefix = pathlib.Path(sys.argv[1])
assert prefix in pathlib.Path(poststall_sim.__file__).parents, poststall_sim.__file__

simulator = subprocess.Popen([prefix / 'lib/poststall_sim/simulator'])
try:
    stamps = []
    rclpy.init()
    node = rclpy.create_node('watch')
    node.create_subscription(
        Clock, '/clock', lambda msg: stamps.append(msg.clock.sec + 1e-9 * msg.clock.nanosec),
        QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
    # The kernels are compiled first: this install has no cache.
    deadline = time.monotonic() + 120
    while not stamps or stamps[-1] < stamps[0] + 1.0:
        assert simulator.poll() is None, f'it ended by itself, with {simulator.returncode}'
        assert time.monotonic() < deadline, f'/clock did not go on: {stamps[-3:]}'
        rclpy.spin_once(node, timeout_sec=0.2)
    print(f'/clock went from {stamps[0]:.3f} s to {stamps[-1]:.3f} s')
    simulator.send_signal(signal.SIGINT)
    assert simulator.wait(10) == 0, f'exit code {simulator.returncode} after SIGINT'
finally:
    simulator.kill()
PYTHON

cd "$work"  # not in a checkout, whose package would be found first
export ROS_DOMAIN_ID=$((RANDOM % 100 + 1)) ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
"$prefix/lib/poststall_sim/poststall" --help > /dev/null
"$python" "$work/watch.py" "$prefix"
echo 'colcon: built, installed, started and stopped'
