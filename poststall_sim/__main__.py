# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The program `poststall`, also as ``python -m poststall_sim``.

Importing what the commands need takes a second, in which Ctrl-C means what it means later on.
"""

import sys


def main() -> int:
    """Run the command line and return its exit code."""
    try:
        from poststall_sim import cli
        return cli.main()
    except KeyboardInterrupt:
        print('poststall: interrupted', file=sys.stderr)
        return 130


if __name__ == '__main__':
    sys.exit(main())
