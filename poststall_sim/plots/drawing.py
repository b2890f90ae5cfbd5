# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""An aircraft in three views and an isometric: strips, controls, and the points that matter."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from poststall_sim import silhouette
from poststall_sim.aero.model import Model
from poststall_sim.frames import FloatArray, body_to_geometry, swap_body_flu
from poststall_sim.plots import style
from poststall_sim.survey import Survey

_TURN, _TILT = math.radians(35.0), math.radians(30.0)
_X, _Y, _Z = np.eye(3)
_VIEWS = {
    # Rows turn points of the geometry (x aft, y right, z up) into across and up on the paper.
    'from above': np.array([_Y, _X]),
    'isometric': np.array([
        [-math.sin(_TURN), math.cos(_TURN), 0.0],
        [-math.cos(_TURN) * math.sin(_TILT), -math.sin(_TURN) * math.sin(_TILT),
         math.cos(_TILT)]]),
    'from ahead': np.array([_Y, _Z]),
    'from the left': np.array([_X, _Z])}
_LABELS = {'from above': ('y, to the right [m]', 'x, aft [m]'),
           'from ahead': ('y, to the right [m]', 'z, up [m]'),
           'from the left': ('x, aft [m]', 'z, up [m]')}
_COLOURS = (style.STALLED, style.SECOND, style.THIRD, style.LIMIT, style.ATTACHED)


def draw_aircraft(model: Model, figures: Survey, path: Path) -> Path:
    """Draw an aircraft with its strips; x and y of all views are to one scale."""
    with style.canvas(10.0, 8.0, path) as figure:
        axes = figure.subplots(2, 2)
        for panel, (name, view) in zip(axes.flat, _VIEWS.items()):
            _view(panel, model, figures, view)
            panel.set_title(name)
            panel.set_aspect('equal', adjustable='datalim')
            if name in _LABELS:
                panel.set(xlabel=_LABELS[name][0], ylabel=_LABELS[name][1])
            else:   # a place on the paper is no place on an axis
                panel.tick_params(labelbottom=False, labelleft=False, length=0.0)
        axes[0, 0].yaxis.set_inverted(True)   # the nose up
        axes[1, 0].xaxis.set_inverted(True)   # who looks from ahead has the right wing to the left
        axes[0, 0].set_title(f'{model.aircraft.name}, from above')
        handles, labels = axes[0, 0].get_legend_handles_labels()
        unique = dict(zip(labels, handles))
        figure.legend(unique.values(), unique.keys(), loc='outside lower center', ncols=4)
        figure.suptitle('Axes of the aircraft file, from its origin', fontsize=9.5, x=0.01,
                        ha='left', color='#6B7178')
    return path


def _view(panel, model: Model, figures: Survey, view: FloatArray) -> None:
    from matplotlib.collections import PolyCollection
    aircraft, lattice = model.aircraft, model.lattice

    def paper(points_G) -> FloatArray:
        return np.asarray(points_G) @ view.T

    def drawn(polygons: silhouette.Polygons) -> list[FloatArray]:
        return [paper(aircraft.mass.cg_G + body_to_geometry(swap_body_flu(each)))
                for each in polygons]

    panel.add_collection(PolyCollection(
        drawn(silhouette.fuselage(aircraft)),
        facecolor='none', edgecolor=style.FAINT, linewidth=0.8))
    for grid in lattice.grids:
        strips = grid.strips.stop - grid.strips.start
        corners = lattice.ring_corners[grid.panels].reshape(grid.rows, strips, 4, 3)
        # Rings lie a quarter panel behind the panels.
        outline = np.concatenate([corners[0, :, :2], corners[-1, :, 2:]], axis=1)
        outline -= 0.25 / grid.rows * (outline[:, [3, 2, 2, 3]] - outline[:, [0, 1, 1, 0]])
        panel.add_collection(PolyCollection(
            paper(outline), facecolor='#EEF2F6', edgecolor='#8A9099', linewidth=0.5))
    for k, control in enumerate(aircraft.controls):
        alone = replace(aircraft, controls=(control,))
        moved = silhouette.movables(alone, np.zeros(len(alone.movables)))
        panel.add_collection(PolyCollection(
            drawn(moved), facecolor=_COLOURS[k % len(_COLOURS)], alpha=0.6, linewidth=0.0))
        panel.plot([], [], color=_COLOURS[k % len(_COLOURS)], linewidth=6, alpha=0.6,
                   label=control.name)
    wing = figures.planforms[0]
    cg = np.array(aircraft.mass.cg_G)
    front = np.array([wing.quarter_x - 0.25 * wing.mean_chord, 0.0, wing.quarter_z])
    chord = paper([front, front + [wing.mean_chord, 0.0, 0.0]])
    panel.plot(*chord.T, color=style.INK, linewidth=2.0, label='mean chord')
    panel.plot(*paper(cg[None]).T, 'o', color=style.INK, label='centre of gravity')
    panel.plot(*paper([[figures.neutral_point, cg[1], cg[2]]]).T, 'D', color=style.ATTACHED,
               markersize=5, label='neutral point')
    for engine in aircraft.engines:
        panel.plot(*paper([engine.position_G]).T, '^', color=style.STALLED, label='engine')
    panel.autoscale_view()
