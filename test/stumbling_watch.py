# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""`poststall watch` with a fault in it: it cannot take a place 13 m up."""

import sys
from pathlib import Path

from poststall_sim.watch.scene import Scene

SCRIPT = Path(__file__)
pose = Scene.pose


def stumbling(scene, now, time, place, *motion):
    if place[2] == 13.0:
        # An error of a kind that the command line otherwise says in one line.
        raise OSError('thirteen \u2014 ' + 100 * 'far too high ')
    pose(scene, now, time, place, *motion)


if __name__ == '__main__':
    from poststall_sim import cli

    Scene.pose = stumbling
    sys.exit(cli.main(['watch', *sys.argv[1:]]))
