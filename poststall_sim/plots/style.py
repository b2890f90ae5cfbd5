# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""How figures look: colours that the colour-blind tell apart, thin axes, one type."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

# Okabe & Ito, Color Universal Design, 2008: one meaning each.
ATTACHED = '#0072B2'
STALLED = '#D55E00'
PARTLY_STALLED = '#F0B27F'
COMMAND = '#B4BAC2'
CONTROL = '#222222'
SECOND = '#009E73'
THIRD = '#CC79A7'
LIMIT = '#8C6D1F'
INK = '#222222'
FAINT = '#C9CDD2'

DPI = 160

_RC = {
    'font.family': 'DejaVu Sans', 'font.size': 9.5, 'text.color': INK,
    'axes.titlesize': 10.5, 'axes.titleweight': 'bold', 'axes.titlelocation': 'left',
    'axes.titlepad': 7.0, 'axes.labelsize': 9.5, 'axes.labelcolor': INK,
    'axes.edgecolor': '#8A9099', 'axes.linewidth': 0.8, 'axes.spines.top': False,
    'axes.spines.right': False, 'axes.grid': True, 'axes.axisbelow': True,
    'grid.color': '#E6E8EB', 'grid.linewidth': 0.7, 'xtick.color': '#8A9099',
    'ytick.color': '#8A9099', 'xtick.labelcolor': INK, 'ytick.labelcolor': INK,
    'xtick.labelsize': 8.5, 'ytick.labelsize': 8.5, 'lines.linewidth': 1.7,
    'lines.solid_capstyle': 'round', 'legend.frameon': False, 'legend.fontsize': 8.5,
    'legend.handlelength': 1.6, 'figure.facecolor': 'white', 'savefig.facecolor': 'white',
    'mathtext.default': 'regular'}


@contextmanager
def canvas(width: float, height: float, path: Path) -> Iterator:
    """
    Give an empty figure of width x height [inches], saved when the block ends.

    Raises
    ------
    ImportError
        When there is no matplotlib, with what to do about it.

    """
    try:
        import matplotlib
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise ImportError('figures need matplotlib: pip install matplotlib') from error
    with matplotlib.rc_context(_RC):
        figure = Figure(figsize=(width, height), dpi=DPI, layout='constrained')
        FigureCanvasAgg(figure)
        yield figure
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=DPI)


def stall_colour(share: np.ndarray | float) -> np.ndarray:
    """Return colours (..., 3): attached at share 0, then from a light to a full stall colour."""
    from matplotlib.colors import to_rgb
    share = np.clip(np.asarray(share, dtype=float), 0.0, 1.0)[..., None]
    attached, least, full = (np.array(to_rgb(c)) for c in (ATTACHED, PARTLY_STALLED, STALLED))
    return np.where(share > 0.0, least + share * (full - least), attached)


def headroom(axes, top: float = 0.12, bottom: float = 0.06) -> None:
    """Widen the y range, so that lines do not touch the frame; never below a hundredth."""
    low, high = axes.dataLim.intervaly
    if not np.isfinite([low, high]).all():
        return
    size = max(high - low, 1e-2)
    axes.set_ylim(low - bottom * size, high + top * size)


def note(figure, lines: tuple[str, ...] | list[str]) -> None:
    """Write what is missing below a figure, small."""
    if lines:
        figure.supxlabel('\n'.join(lines), fontsize=7.5, color='#6B7178', ha='left', x=0.01)
