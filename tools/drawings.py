# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Aircraft and lattices drawn in space: counterparts of the dissertation's geometric figures.

Figures 2.2, 4.1, 4.3, 5.2, 5.4, 5.9 and 5.11. Angles are in degrees here.
"""

import math
from pathlib import Path

import numpy as np
from demo_flight import flown
from trainer_modes import ALPHAS, trainer, trimmed
from wing_tail import AIR, DEG, model, section

from poststall_sim import polar, silhouette, views
from poststall_sim.aero.model import Model
from poststall_sim.frames import geometry_to_body, rotation, swap_body_flu, swap_ned_enu
from poststall_sim.plots import decambering as plots
from poststall_sim.plots import style
from poststall_sim.plots.decambering import Curve, Kind, Panel, draw
from poststall_sim.polar import Condition
from poststall_sim.state import BodyState

RING, WAKE, PICKED = '#4A5058', '#9DB4C8', style.ATTACHED
ROLL_RATE = 0.1
"""pb/2V of the wing that rolls."""


def seen_from(azimuth: float, elevation: float) -> np.ndarray:
    """Return the rows across, up and towards the viewer (3, 3) in axes with z up."""
    a, e = math.radians(azimuth), math.radians(elevation)
    towards = np.array([math.cos(a) * math.cos(e), math.sin(a) * math.cos(e), math.sin(e)])
    across = np.array([-math.sin(a), math.cos(a), 0.0])
    return np.array([across, np.cross(towards, across), towards])


def faces(axes, polygons, view: np.ndarray, **looks) -> None:
    """Draw polygons (k, 3) from far to near."""
    from matplotlib.collections import PolyCollection
    on_paper = sorted((polygon @ view.T for polygon in polygons), key=lambda p: p[:, 2].mean())
    axes.add_collection(PolyCollection([p[:, :2] for p in on_paper], **looks))


def line(axes, points: np.ndarray, view: np.ndarray, **looks) -> None:
    """Draw a line (k, 3)."""
    on_paper = np.asarray(points) @ view.T
    axes.plot(on_paper[:, 0], on_paper[:, 1], **looks)


def axis_arrow(axes, begin, along, view: np.ndarray, name: str, colour: str = style.INK) -> None:
    """Draw an arrow from a point along a vector, and its name at the tip."""
    a, b = np.asarray(begin) @ view.T, (np.asarray(begin) + along) @ view.T
    axes.annotate('', b[:2], a[:2], arrowprops={
        'arrowstyle': '-|>', 'color': colour, 'linewidth': 1.4, 'shrinkA': 0.0, 'shrinkB': 0.0})
    c = b + 0.2 * (b - a)
    axes.plot(*c[:2], alpha=0.0)   # what the limits go by
    axes.text(c[0], c[1], name, ha='center', va='center', color=colour, fontsize=9.5)


def bare(axes) -> None:
    """Leave out all but what is drawn, to one scale."""
    axes.set_axis_off()
    axes.set_aspect('equal')
    axes.autoscale_view()


def figure_2_2(file: Path) -> None:
    """Draw the wing and tail from above, strips numbered as in the results."""
    lattice = model().lattice
    with style.canvas(9.2, 5.2, file) as figure:
        axes = figure.subplots()
        for grid in lattice.grids:
            nodes = lattice.wake_nodes[grid.nodes]
            chord = lattice.strip_chord[grid.strips].mean()
            for edge in nodes:
                x = edge[0] - 0.25 * chord - chord
                axes.plot([edge[1], edge[1]], [-x, -(x + chord)], color=RING, linewidth=0.9)
            for x in (nodes[0, 0] - 1.25 * chord, nodes[0, 0] - 0.25 * chord):
                axes.plot([nodes[0, 1], nodes[-1, 1]], [-x, -x], color=RING, linewidth=1.4)
            fifth = [grid.strips.start + 4] if grid.name == 'wing' else []
            for strip in (grid.strips.start, *fifth, grid.strips.stop - 1):
                place = lattice.quarter_chord[strip]
                axes.text(place[1], -place[0] - 0.22 * chord, str(strip + 1), ha='center',
                          va='center', fontsize=8.0, color=style.STALLED)
        axes.annotate('', (0.0, 0.15), (0.0, 1.5), arrowprops={'arrowstyle': '-|>'})
        axes.text(0.15, 1.1, r'$V_\infty$', fontsize=11.0)
        axes.text(-5.9, -2.4, 'wing: chord $c$ = 1, aspect ratio 12, 20 strips\n'
                  'tail: chord 0.67 $c$, aspect ratio 5, 6 strips, 7.5 $c$ behind\n'
                  'NACA 4415, no twist, no incidence', va='top', fontsize=9.0)
        axes.set(xlim=(-6.5, 6.5), ylim=(-8.8, 1.8))
        axes.set_aspect('equal')
        axes.set_axis_off()


def figure_4_1(file: Path) -> None:
    """Draw the lattice and the wake that the wing has shed in a stall, as it flies."""
    flight = flown()
    view = seen_from(-50.0, 30.0)
    state = flight.kept
    lattice, wake = flight.model.lattice, state.flow.wake
    body = state.body
    with style.canvas(9.2, 4.4, file) as figure:
        axes = figure.subplots()
        nodes = swap_ned_enu(wake.nodes_N - body.position_N)
        for grid in lattice.grids:
            rows = nodes[:40, grid.nodes]
            for row in rows:
                line(axes, row, view, color=WAKE, linewidth=0.6)
            for k in range(rows.shape[1]):
                line(axes, rows[:, k], view, color=WAKE, linewidth=0.6)
        turn = rotation(body.q_NB)
        rings = swap_ned_enu(geometry_to_body(
            lattice.ring_corners - np.array(flight.model.aircraft.mass.cg_G)) @ turn.T)
        faces(axes, rings, view, facecolor='#DCE9F4', edgecolor=RING, linewidth=0.6, zorder=3)
        bare(axes)
        axes.set_title('bound rings, and the wake that they have shed, '
                       f'{1e-9 * state.time_ns:.1f} s into the flight')


def figure_4_3(file: Path) -> None:
    """Draw the ring vortices of wing and tail, those of a strip in colour."""
    lattice = model(chordwise=4).lattice
    view = seen_from(-55.0, 32.0)
    picked = lattice.panel_strip == 14
    with style.canvas(9.2, 4.2, file) as figure:
        axes = figure.subplots()
        faces(axes, lattice.ring_corners[~picked], view, facecolor='none', edgecolor='#8A9099',
              linewidth=0.7)
        faces(axes, lattice.ring_corners[picked], view, facecolor='#CFE2F1', edgecolor=PICKED,
              linewidth=1.6, zorder=4)
        bare(axes)


def figure_5_2(file: Path) -> None:
    """Draw the axes: N of the earth, B of the body, G of the drawing."""
    aircraft = trainer().aircraft
    view = seen_from(35.0, 24.0)
    with style.canvas(9.2, 4.6, file) as figure:
        axes = figure.subplots()
        faces(axes, silhouette.of_aircraft(aircraft), view, facecolor='#EDF0F3',
              edgecolor='#8A9099', linewidth=0.7)
        for along, name in (((1.0, 0, 0), '$x_B$, $u$, $p$'), ((0, -1.9, 0), '$y_B$, $v$, $q$'),
                            ((0, 0, -0.8), '$z_B$, $w$, $r$')):
            axis_arrow(axes, np.zeros(3), np.array(along, float), view, name, style.STALLED)
        drawn_from = swap_body_flu(geometry_to_body(-np.array(aircraft.mass.cg_G)))
        for along, name in (((-0.9, 0, 0), '$x_G$'), ((0, -1.0, 0), '$y_G$'),
                            ((0, 0, 0.6), '$z_G$')):
            axis_arrow(axes, drawn_from, np.array(along, float), view, name, style.ATTACHED)
        corner = np.array([0.9, 2.5, -0.5])
        for along, name in (((0.7, 0, 0), 'north'), ((0, -0.7, 0), 'east'),
                            ((0, 0, -0.6), 'down')):
            axis_arrow(axes, corner, np.array(along, float), view, name, style.SECOND)
        bare(axes)


def figure_5_4(file: Path) -> None:
    """Draw what a steady roll does to the strips: their angles, and their decambering."""
    chosen = model(tail=False)
    span = chosen.aircraft.reference.span
    place = chosen.lattice.quarter_chord[:, 1] / (0.5 * span)
    panels = []
    for alpha in (6.0, 22.0):
        level, rolling = (polar.point(chosen, Condition(
            math.radians(alpha), rates=np.array([rate, 0.0, 0.0])), **AIR)
            for rate in (0.0, ROLL_RATE))
        strips, other = level.aero.strips, rolling.aero.strips
        panels.append(Panel(Kind.CHANGES, rf'wing at {alpha:g}{DEG}, pb/2V = {ROLL_RATE:g}', (
            Curve('of the incidence by the motion', place,
                  np.degrees(np.arctan(ROLL_RATE * place)), style.INK, '--', width=1.1),
            Curve('of the angle at which the section works', place,
                  np.degrees(other.alpha - strips.alpha), style.ATTACHED, marker='o', size=3.5),
            Curve('of the decambering', place, np.degrees(other.delta - strips.delta),
                  style.STALLED, marker='s', size=3.5)), limits=(-1.0, 1.0, None, None)))
    draw(file, panels, height=3.2, shared=True)


def figure_5_9(file: Path) -> None:
    """Draw the aircraft whose stability is computed, and the curve of its wing's section."""
    chosen: Model = trainer()
    view = seen_from(-38.0, 26.0)
    curve, alpha = section('naca4415_re4e5'), np.linspace(-10.0, 40.0, 300)
    values = curve.at(np.radians(alpha))
    with style.canvas(9.2, 3.7, file) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
        faces(left, [*views.strip_quads(chosen), *silhouette.fuselage(chosen.aircraft)], view,
              facecolor='#EAF2F9', edgecolor=RING, linewidth=0.7)
        bare(left)
        left.set_title('(a) trainer')
        for k, (name, colour) in enumerate((('$C_l$', style.ATTACHED), ('$C_d$', style.STALLED),
                                            ('$C_m$', style.SECOND))):
            right.plot(alpha, values[:, k], color=colour, label=name)
        right.set(xlabel=r'section $\alpha$ [deg]', xlim=(-10.0, 40.0))
        right.set_title('(b) NACA 4415, Re 4e5')
        right.legend()


def figure_5_11(file: Path) -> None:
    """Draw attitude and operating points in gliding trim at 1 and at 20 degrees."""
    chosen = trainer()
    wing = chosen.lattice.grids[0].strips
    curve = plots.section_curves(section('naca4415_re4e5'), low=-6.0, high=30.0, deltas=())[0]
    with style.canvas(9.2, 5.6, file) as figure:
        grid = figure.subplots(2, 2, height_ratios=(1.0, 1.25))
        for column, alpha in zip(grid.T, (1, 20)):
            trim = trimmed()[ALPHAS.index(alpha)]
            above, below = column
            body = BodyState(np.zeros(3), trim.velocity_B, np.zeros(3), trim.q_NB)
            turn = rotation(body.q_NB)
            # From the right: north, where it flies to, to the right of the paper, up is up.
            view = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
            shape = [*silhouette.of_aircraft(chosen.aircraft), *silhouette.movables(
                chosen.aircraft, chosen.lattice.angles(trim.controls.deflections))]
            faces(above, [swap_ned_enu(swap_body_flu(p) @ turn.T) for p in shape], view,
                  facecolor='#DCE4EB', edgecolor=RING, linewidth=0.7)
            path = np.array([math.cos(trim.climb_angle), math.sin(trim.climb_angle)])
            above.annotate('', 1.3 * path, -1.3 * path, arrowprops={
                'arrowstyle': '-|>', 'color': style.SECOND, 'linewidth': 1.2})
            above.axhline(0.0, color=style.FAINT, linewidth=0.8, linestyle='--', zorder=0)
            above.set_title(
                rf'$\alpha$ = {alpha}{DEG}: {trim.airspeed:.1f} m/s, path '
                f'{math.degrees(trim.climb_angle):.1f}{DEG}, pitch '
                f'{math.degrees(trim.pitch):.1f}{DEG}')
            above.set(xlim=(-1.6, 1.6), ylim=(-0.6, 0.6))
            above.set_aspect('equal')
            above.set_axis_off()
            strips = trim.aero.strips
            below.plot(curve.x, curve.y, color=style.INK, linewidth=1.4)
            below.scatter(np.degrees(strips.alpha[wing]), strips.cl[wing], s=20.0, zorder=4,
                          color=np.where(strips.stalled[wing], style.STALLED, style.ATTACHED))
            below.set(xlabel=r'section $\alpha$ [deg]', ylabel='strip $C_l$ [-]',
                      xlim=(-6.0, 30.0), ylim=(-0.2, 1.6))
