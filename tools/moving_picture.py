# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The demo's flight as a moving picture, for the README.

Flown here as `make demo` flies it, but as fast as it goes. On the left the aircraft as it stands
in the air, seen from behind on its left, its strips coloured as in RViz; on the right where the
wing's strips work on their section's curve, and angle of attack and altitude over time.
"""

import io
from pathlib import Path

import numpy as np
from demo_flight import Flown, flown
from matplotlib.collections import PolyCollection
from PIL import Image

from poststall_sim import silhouette, views
from poststall_sim.aero.polars import sections
from poststall_sim.frames import rotation, swap_body_flu, swap_ned_enu
from poststall_sim.plots import style

BEGIN, END, STEP = 4.5, 14.5, 0.1
"""The stretch that is shown, and the time from picture to picture [s]."""
SIZE = (8.8, 4.3)
WIDTH = 860
"""Of the finished picture [pixels]."""
TRAIL = 2.0
"""How long the way of the wing tips stays in sight [s]."""
AZIMUTH, ELEVATION = np.radians((236.0, 22.0))
"""Where the eye is: from north over east, and above the horizon."""
COLOURS = 112


def eye() -> np.ndarray:
    """Return the rows across, up and towards the viewer in east-north-up, (3, 3)."""
    towards = np.array([np.sin(AZIMUTH) * np.cos(ELEVATION),
                        np.cos(AZIMUTH) * np.cos(ELEVATION), np.sin(ELEVATION)])
    across = np.cross([0.0, 0.0, 1.0], towards)
    across /= np.linalg.norm(across)
    return np.array([across, np.cross(towards, across), towards])


class Picture:
    """A figure that is filled again for each instant."""

    def __init__(self, flight: Flown) -> None:
        """Draw what stays: axes, the section's curve, the histories."""
        import matplotlib
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
        self.flight, self.eye = flight, eye()
        model = flight.model
        self.quads = np.array(views.strip_quads(model))
        self.body = silhouette.fuselage(model.aircraft)
        self.wing = model.lattice.grids[0].strips
        # The rear corners of its outermost strips: left tip, right tip.
        self.tips = np.array([self.quads[self.wing.start, 3], self.quads[self.wing.stop - 1, 2]])
        with matplotlib.rc_context({
                'font.size': 9.0, 'axes.spines.top': False, 'axes.spines.right': False,
                'axes.edgecolor': '#8A9099', 'xtick.color': '#8A9099', 'ytick.color': '#8A9099',
                'xtick.labelcolor': style.INK, 'ytick.labelcolor': style.INK,
                'axes.labelcolor': style.INK, 'axes.titlelocation': 'left',
                'axes.titlesize': 9.5, 'text.antialiased': True}):
            self.figure = Figure(figsize=SIZE, dpi=WIDTH / SIZE[0])
            FigureCanvasAgg(self.figure)
            self.scene = self.figure.add_axes((0.0, 0.0, 0.53, 1.0))
            curve = self.figure.add_axes((0.615, 0.58, 0.37, 0.34))
            self.angle = self.figure.add_axes((0.615, 0.30, 0.37, 0.155))
            self.height = self.figure.add_axes((0.615, 0.115, 0.37, 0.155))
            self._curve(curve)
            self._histories()
        self.scene.set_axis_off()
        self.moving: list = []

    def _curve(self, axes) -> None:
        lattice = self.flight.model.lattice
        alpha = np.linspace(-4.0, 32.0, 200)
        values = np.empty((alpha.size, 4))
        sections(lattice.curves, np.full(alpha.size, lattice.polar_index[self.wing][0]),
                 np.radians(alpha), values)
        axes.plot(alpha, values[:, 0], color=style.INK, linewidth=1.2)
        axes.set(xlim=(-4.0, 32.0), ylim=(0.0, 1.65), xlabel='section angle of attack [deg]')
        axes.set_title("$C_l$ of each strip of the wing on its section's curve")
        self.points = axes.scatter([], [], s=22.0, zorder=4, edgecolor='white', linewidth=0.4)

    def _histories(self) -> None:
        snapshots = self.flight.between(BEGIN, END)
        time = [s.time for s in snapshots]
        for axes, values, label in (
                (self.angle, np.degrees([s.alpha for s in snapshots]), r'$\alpha$ [deg]'),
                (self.height, [s.body.altitude for s in snapshots], 'altitude [m]')):
            axes.plot(time, values, color=style.FAINT, linewidth=1.2)
            axes.set(xlim=(BEGIN, END))
            axes.set_ylabel(label, fontsize=8.5)
            axes.yaxis.set_label_coords(-0.125, 0.5)
        self.angle.set_xticklabels([])
        self.height.set_xlabel('time [s]')

    def at(self, time: float) -> Image.Image:
        """Return the picture of an instant."""
        for artist in self.moving:
            artist.remove()
        shown = self.flight.between(BEGIN, time)
        snapshot = shown[-1]
        self.moving = []
        self._aircraft(snapshot)
        strips = snapshot.strips
        self.points.set_offsets(np.column_stack(
            [np.degrees(strips.alpha[self.wing]), strips.cl[self.wing]]))
        self.points.set_facecolor(views.strip_colours(snapshot, self.flight.layout)[self.wing])
        times = [s.time for s in shown]
        for axes, values in ((self.angle, np.degrees([s.alpha for s in shown])),
                             (self.height, [s.body.altitude for s in shown])):
            self.moving += axes.plot(times, values, color=style.ATTACHED, linewidth=1.6)
            self.moving += axes.plot(times[-1:], values[-1:], 'o', color=style.ATTACHED,
                                     markersize=4.5)
        buffer = io.BytesIO()
        self.figure.savefig(buffer, format='png')
        return Image.open(buffer).convert('RGB')

    def _aircraft(self, snapshot) -> None:
        """Draw strips and body from far to near, and the way of the tips."""
        body = snapshot.body
        turn = rotation(body.q_NB)
        colours = views.strip_colours(snapshot, self.flight.layout)

        def paper(points: np.ndarray) -> np.ndarray:
            return swap_ned_enu(swap_body_flu(points) @ turn.T) @ self.eye.T

        faces = [(paper(quad), colour) for quad, colour in zip(self.quads, colours)]
        faces += [(paper(polygon), (0.80, 0.82, 0.85, 1.0)) for polygon in self.body]
        faces.sort(key=lambda face: face[0][:, 2].mean())
        trail = self.flight.between(max(snapshot.time - TRAIL, 0.0), snapshot.time)
        for tip in self.tips:
            way = np.array([swap_ned_enu(
                s.body.position_N + rotation(s.body.q_NB) @ swap_body_flu(tip)
                - body.position_N) for s in trail]) @ self.eye.T
            self.moving += self.scene.plot(way[:, 0], way[:, 1], color='#B9CBDD', linewidth=1.0,
                                           zorder=1)
        self.moving.append(self.scene.add_collection(PolyCollection(
            [face[:, :2] for face, _ in faces], facecolor=[colour for _, colour in faces],
            edgecolor='white', linewidth=0.5, zorder=3)))
        stalled = int(np.count_nonzero(snapshot.strips.stalled[self.wing]))
        strips = self.wing.stop - self.wing.start
        said = f'{stalled} of {strips} strips of the wing stalled' if stalled else 'attached'
        self.moving.append(self.scene.text(
            0.03, 0.955, f'{snapshot.time:4.1f} s    {snapshot.airspeed:4.1f} m/s',
            transform=self.scene.transAxes, fontsize=10.5, color=style.INK, va='top'))
        self.moving.append(self.scene.text(
            0.03, 0.895, said, transform=self.scene.transAxes, fontsize=10.5, va='top',
            color=style.STALLED if stalled else style.ATTACHED))
        wide, high = 2.1, 2.1 * SIZE[1] / (0.53 * SIZE[0])
        self.scene.set(xlim=(-wide, wide), ylim=(-high, high))


def moving_picture(file: Path) -> None:
    """Draw the flight as an animated GIF."""
    picture = Picture(flown())
    frames = [picture.at(time) for time in np.arange(BEGIN + STEP, END + 1e-9, STEP)]
    # One palette for all, from pictures that between them have every colour: else they flicker.
    sample = Image.new('RGB', (frames[0].width, 4 * frames[0].height))
    for i, k in enumerate(np.linspace(0, len(frames) - 1, 4).astype(int)):
        sample.paste(frames[k], (0, i * frames[0].height))
    palette = sample.quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
    small = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    still = round(1e3 * STEP)
    small[0].save(file, save_all=True, append_images=small[1:], loop=0, optimize=True,
                  duration=[still] * (len(small) - 1) + [1500])
