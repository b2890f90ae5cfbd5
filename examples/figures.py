# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What the examples share: their options, and a figure where matplotlib is there."""

import argparse
import contextlib


def options(description):
    """Return the parser of an example: --figure FILE, --quick."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument('--figure', metavar='FILE', help='draw it, with matplotlib')
    parser.add_argument('--quick', action='store_true', help='less of it, for a look')
    return parser


@contextlib.contextmanager
def drawn(path, rows=1):
    """Give axes to draw into, one below the other, and write them to a file."""
    import matplotlib
    matplotlib.use('Agg')
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(rows, 1, figsize=(6.4, 2.0 + 2.0 * rows), squeeze=False)
    yield axes[:, 0]
    for each in axes[:, 0]:
        each.grid(alpha=0.3)
        if each.get_legend_handles_labels()[0]:
            each.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=80)
    pyplot.close(figure)
    print(f'drawn: {path}')
