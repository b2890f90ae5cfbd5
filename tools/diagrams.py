# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Flowcharts of what the package does: counterparts of Figures 4.2, 5.1, 5.3 and 5.10."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.patches import FancyBboxPatch

from poststall_sim.plots import style

KINDS = {'step': '#EAF2F9', 'choice': '#FBEADD', 'data': '#F2F3F5'}


@dataclass(frozen=True, slots=True)
class Box:
    """A box: middle, width and height on the paper [inches], text, and what it is."""

    x: float
    y: float
    text: str
    width: float = 2.6
    height: float = 0.62
    kind: str = 'step'


@dataclass(frozen=True, slots=True)
class Arrow:
    """An arrow through points on the paper [inches], with a text beside its middle."""

    points: Sequence[tuple[float, float]]
    text: str = ''


def chart(file: Path, size: tuple[float, float], boxes: Sequence[Box],
          arrows: Sequence[Arrow]) -> None:
    """Draw boxes and arrows on a paper of a size [inches]."""
    with style.canvas(*size, file) as figure:
        axes = figure.subplots()
        axes.set(xlim=(0.0, size[0]), ylim=(0.0, size[1]))
        axes.set_axis_off()
        for box in boxes:
            axes.add_patch(FancyBboxPatch(
                (box.x - 0.5 * box.width, box.y - 0.5 * box.height), box.width, box.height,
                boxstyle='round,pad=0.0,rounding_size=0.08', facecolor=KINDS[box.kind],
                edgecolor='#8A9099', linewidth=0.9, zorder=3))
            axes.text(box.x, box.y, box.text, ha='center', va='center', fontsize=8.8,
                      linespacing=1.35, zorder=4)
        for arrow in arrows:
            for a, b in zip(arrow.points[:-2], arrow.points[1:-1]):
                axes.plot(*zip(a, b), color='#5A626C', linewidth=1.1)
            axes.annotate('', arrow.points[-1], arrow.points[-2], arrowprops={
                'arrowstyle': '-|>', 'color': '#5A626C', 'linewidth': 1.1, 'shrinkA': 0.0,
                'shrinkB': 0.0})
            if arrow.text:
                (x0, y0), (x1, y1) = arrow.points[len(arrow.points) // 2 - 1:][:2]
                axes.text(0.5 * (x0 + x1) + 0.07, 0.5 * (y0 + y1) + 0.05, arrow.text,
                          fontsize=8.0, color='#5A626C')


def _down(boxes: Sequence[Box]) -> list[Arrow]:
    """Return arrows from each box to the next one below it."""
    return [Arrow([(a.x, a.y - 0.5 * a.height), (b.x, b.y + 0.5 * b.height)])
            for a, b in zip(boxes, boxes[1:])]


def figure_4_2(file: Path) -> None:
    """Draw a step of a flight."""
    column = [
        Box(2.0, 7.25, 'controls through actuators and mixing;\nair: wind, gusts, turbulence',
            3.4, kind='data'),
        Box(2.0, 6.3, 'predict the body with the old loads\n(added mass on the left side)', 3.4),
        Box(2.0, 5.35, 'engines: shafts, thrust, slipstream', 3.4, 0.5),
        Box(2.0, 4.45, 'wake: shed a row, move it,\nits velocity at panels and edges', 3.4),
        Box(2.0, 3.5, 'boundary condition at the new place', 3.4, 0.5)]
    right = [
        Box(6.2, 7.25, 'closure: steady operating points\nof all strips for this decambering',
            3.4),
        Box(6.2, 6.3, '|residual| below tolerance?', 3.4, 0.5, 'choice'),
        Box(6.2, 5.35, 'circulation of the unsteady lattice,\none substitution', 3.4),
        Box(6.2, 4.4, 'loads: Joukowski + added mass\n+ section drag and moment', 3.4),
        Box(6.2, 3.45, 'correct the body: loads linear in time,\nfourth-order Runge-Kutta', 3.4),
        Box(6.2, 2.55, 'snapshot: topics, bag, figures', 3.4, 0.5, 'data')]
    arrows = [*_down(column), *_down(right),
              Arrow([(3.7, 3.5), (4.1, 3.5), (4.1, 7.25), (4.5, 7.25)]),
              Arrow([(7.9, 6.3), (8.35, 6.3), (8.35, 7.25), (7.9, 7.25)]),
              Arrow([(6.2, 2.3), (6.2, 1.95), (0.12, 1.95), (0.12, 7.25), (0.3, 7.25)])]
    paper = [Box(b.x + 0.1, b.y - 1.6, b.text, b.width, b.height, b.kind)
             for b in (*column, *right)]
    moved = [Arrow([(x + 0.1, y - 1.6) for x, y in a.points], a.text) for a in arrows]
    paper.append(Box(8.75, 5.17, 'no:\nNewton', 0.62, 0.5, 'choice'))
    paper.append(Box(3.1, 0.35, 'next step', 0.9, 0.34, 'choice'))
    chart(file, (9.2, 6.1), paper, moved)


def figure_5_1(file: Path) -> None:
    """Draw how modes come about."""
    column = [
        Box(2.3, 5.2, 'aircraft: geometry, section curves, masses', 3.9, 0.5, 'data'),
        Box(2.3, 4.35, 'trim at each angle of attack,\non the branch of the one before', 3.9),
        Box(2.3, 3.4, 'derivative of one step of the flow:\nlattice, wake rows, closure, loads',
            3.9),
        Box(2.3, 2.45, 'coupled with the small motions of the body', 3.9, 0.5),
        Box(2.3, 1.6, 'eigenvalues nearest to 1 (Arnoldi),\n$\\lambda = \\ln z / \\Delta t$', 3.9),
        Box(2.3, 0.65, "modes: named, ranked by the body's share,\nfollowed over alpha", 3.9,
            kind='data')]
    right = [
        Box(7.0, 4.35, 'decambering', 2.2, 0.45, 'choice'),
        Box(7.0, 3.75, 'fixed: held at the trim', 3.2, 0.45),
        Box(7.0, 3.2, 'variable: follows, $K_{dec}$', 3.2, 0.45),
        Box(7.0, 2.65, 'lagged: a state of its own', 3.2, 0.45),
        Box(7.0, 1.6, 'beside them: derivatives of steady\nloads, classical equations', 3.4)]
    chart(file, (9.2, 5.6), [*column, *right], [
        *_down(column), Arrow([(5.4, 3.4), (4.25, 3.4)]),
        Arrow([(5.3, 1.6), (4.25, 1.6)], 'names')])


def figure_5_3(file: Path) -> None:
    """Draw how flow and body are coupled in the linear system."""
    chart(file, (9.2, 3.6), [
        Box(1.9, 2.7, 'lattice\n$B\\,g^+ + \\sum A_r G_r^+ + W_\\nu \\nu^+ + W_d d^+ = 0$', 3.4,
            0.8),
        Box(1.9, 1.0, 'wake\n$G_0^+ = T g,\\quad G_r^+ = G_{r-1}$', 3.4, 0.8),
        Box(7.2, 2.7, 'body\n$M \\dot y = P L + R y,\\quad \\nu = N y$', 3.4, 0.8),
        Box(7.2, 1.0, 'decambering\n$d^+ = K_\\nu \\nu^+ + K_f f$', 3.4, 0.8, 'choice')], [
        Arrow([(3.6, 2.9), (5.5, 2.9)], 'loads $L$'),
        Arrow([(5.5, 2.5), (3.6, 2.5)], r'motion $\nu$'),
        Arrow([(1.5, 2.3), (1.5, 1.4)], 'shed $g$'),
        Arrow([(2.3, 1.4), (2.3, 2.3)], 'wash $A_r G_r$'),
        Arrow([(7.2, 2.3), (7.2, 1.4)], r'motion $\nu$'),
        Arrow([(5.5, 1.15), (4.55, 1.15), (4.55, 2.15), (3.2, 2.15), (3.2, 2.3)],
              'turns normals, $d$'),
        Arrow([(3.6, 0.8), (5.5, 0.8)], 'foreign wash $f$')])


def figure_5_10(file: Path) -> None:
    """Draw how a trim is found."""
    column = [
        Box(2.3, 5.2, 'asked: alpha or airspeed; climb, turn,\nsideslip, stuck controls', 3.9,
            kind='data'),
        Box(2.3, 4.3, 'start from the trim before,\nits decambering too', 3.9),
        Box(2.3, 3.4, 'steady loads, closure solved to 1e-9', 3.9, 0.5),
        Box(2.3, 2.6, 'forces and moments left over\nbelow 1e-6 of the weight?', 3.9,
            kind='choice'),
        Box(2.3, 1.6, 'trim: angles, airspeed, controls,\noperating points of all strips', 3.9,
            kind='data')]
    right = [
        Box(7.0, 3.4, 'least squares within the limits of\ncontrols and throttle (six balances);\n'
            'a glide: one equation for the elevator', 3.8, 0.95),
        Box(7.0, 1.6, 'out of reach: the nearest flight,\nand what is missing', 3.8,
            kind='data')]
    chart(file, (9.2, 5.6), [*column, *right], [
        *_down(column), Arrow([(4.25, 2.6), (6.2, 2.6), (6.2, 2.925)], 'no'),
        Arrow([(5.1, 3.4), (4.25, 3.4)]), Arrow([(8.0, 2.925), (8.0, 1.91)], 'no better')])
