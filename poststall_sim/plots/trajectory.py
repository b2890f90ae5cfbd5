# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The path of a flight in space, with the aircraft drawn along it."""

from collections.abc import Callable

import numpy as np

from poststall_sim.frames import FloatArray
from poststall_sim.plots import style
from poststall_sim.plots.bag import FlightData

_TICKS = (1.0, 2.0, 5.0)
_ELEVATION = 24.0
"""From how high above the horizon to look [deg]."""


Frame = tuple[float, float, float, float]
"""Left, bottom, width and height as shares of a figure."""


def draw(figure, flight: FlightData, frame: Frame) -> None:
    """
    Draw path, aircraft and shadow in a frame of a figure, from the side with equal scales.

    Stalled stretches have the colour of stall. The aircraft is drawn larger than it is, see
    `scale_of`.
    """
    axes = figure.add_axes(frame, projection='3d')
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
    path = flight.position
    share = flight.stalled_share
    share = np.zeros(len(path)) if share is None else share
    low, high = box(path)
    axes.set_proj_type('persp', focal_length=0.9)
    axes.computed_zorder = False
    axes.plot(path[:, 0], path[:, 1], np.full(len(path), low[2]), color='#B4B9C0',
              linewidth=1.3, zorder=1)

    marks = moments(flight)
    scale = _scale(flight, marks, float(np.linalg.norm(high - low)))
    faces, colours, shadows = [], [], []
    towards = camera(path)
    for i in marks:
        for polygon in flight.shape:
            corners = path[i] + scale * polygon @ flight.attitude[i].T
            faces.append(corners)
            colours.append(style.stall_colour(share[i]))
            shadows.append(np.column_stack([corners[:, :2], np.full(len(corners), low[2])]))
    axes.add_collection3d(Poly3DCollection(
        shadows, facecolor='#DFE2E6', edgecolor='none', zorder=2))
    axes.add_collection3d(Line3DCollection(
        np.stack([path[:-1], path[1:]], axis=1), colors=style.stall_colour(share[:-1]),
        linewidths=1.8, zorder=3))
    # From far to near, for matplotlib sorts within a collection by means only.
    order = np.argsort([face.mean(axis=0) @ towards for face in faces])
    axes.add_collection3d(Poly3DCollection(
        [faces[k] for k in order], facecolor=[(*colours[k], 0.92) for k in order],
        edgecolor=[tuple(0.72 * colours[k]) for k in order], linewidth=0.5, zorder=4))
    _label_times(axes, flight, marks, scale, float(low[2]))
    for artist in (*axes.collections, *axes.lines):
        artist.set_clip_on(False)
    _set_up(axes, path, low, high)
    _fit(axes, low, high, frame)


def scale_of(flight: FlightData) -> float:
    """Return how many times larger than it is the aircraft is drawn."""
    low, high = box(flight.position)
    return _scale(flight, moments(flight), float(np.linalg.norm(high - low)))


def box(path: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the corners of what is shown: the path, not too thin, down to a round height."""
    low, high = path.min(axis=0), path.max(axis=0)
    length = max(float(np.max(high - low)), 1.0)
    middle, size = 0.5 * (low + high), high - low
    size = np.maximum(1.12 * size, np.array([0.34, 0.34, 0.22]) * length)
    low, high = middle - 0.5 * size, middle + 0.5 * size
    step = _round_step((high[2] - low[2]) / 4.0)
    low[2] = step * np.floor((path[:, 2].min() - 0.12 * size[2]) / step)
    if path[:, 2].min() >= 0.0:
        low[2] = max(low[2], 0.0)
    return low, high


def _round_step(value: float) -> float:
    power = 10.0 ** np.floor(np.log10(max(value, 1e-9)))
    return float(power * min((t for t in (*_TICKS, 10.0) if t * power >= value * 0.999),
                             default=10.0))


def moments(flight: FlightData) -> list[int]:
    """Return the indices at which the aircraft is drawn: each second, or fewer if it is long."""
    duration = float(flight.time[-1] - flight.time[0])
    every = max(1.0, _round_step(duration / 30.0))
    wanted = np.arange(flight.time[0], flight.time[-1] + 1e-9, every)
    return sorted({int(np.argmin(np.abs(flight.time - time))) for time in wanted})


def _scale(flight: FlightData, marks: list[int], extent: float) -> float:
    """Return the factor that makes the wing a fitting share of the picture, a round number."""
    span = max(float(np.ptp(np.concatenate(flight.shape)[:, 1])), 1e-6)
    wanted = 0.08 * extent
    if len(marks) > 1:
        steps = np.linalg.norm(np.diff(flight.position[marks], axis=0), axis=1)
        wanted = min(wanted, 1.9 * float(np.median(steps)))
    factor = wanted / span
    return max(1.0, float(np.round(factor))) if factor > 1.0 else 1.0


def _azimuth(path: FloatArray) -> float:
    """Return from where to look [deg]: so that the flight goes from left to right."""
    flat = path[:, :2] - path[:, :2].mean(axis=0)
    axis = np.linalg.svd(flat, full_matrices=False)[2][0]
    if axis @ (path[-1, :2] - path[0, :2]) < 0.0:
        axis = -axis
    return float(np.degrees(np.arctan2(axis[1], axis[0]))) - 90.0 - 28.0


def camera(path: FloatArray) -> FloatArray:
    """Return the direction to the viewer (3,)."""
    azimuth, elevation = np.radians(_azimuth(path)), np.radians(_ELEVATION)
    return np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth),
                     np.sin(elevation)])


def _label_times(axes, flight: FlightData, marks: list[int], scale: float,
                 floor: float) -> None:
    """Write the time beside every fifth aircraft, and drop a line from it to its shadow."""
    from matplotlib.patheffects import withStroke
    span = float(np.ptp(np.concatenate(flight.shape)[:, 1]))
    for i in marks[::5]:
        x, y, z = flight.position[i]
        axes.plot([x, x], [y, y], [floor, z], color='#C3C8CE', linewidth=0.8,
                  linestyle=(0, (2, 2)), zorder=2)
        axes.text(x, y, z + 0.5 * scale * span, f'{flight.time[i]:.0f} s', fontsize=8.5,
                  ha='center', color='#4A5058', zorder=9,
                  path_effects=[withStroke(linewidth=2.5, foreground='white')])


def _set_up(axes, path: FloatArray, low: FloatArray, high: FloatArray) -> None:
    """Set limits, view and grid; what matplotlib writes on its axes is left out, see `_rulers`."""
    from matplotlib.ticker import FixedLocator
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.view_init(elev=_ELEVATION, azim=_azimuth(path))
    for k, axis in enumerate((axes.xaxis, axes.yaxis, axes.zaxis)):
        axis.set_major_locator(FixedLocator(_ticks(low, high, k)))
        axis.pane.set(facecolor='#F7F8F9' if k == 2 else 'white', edgecolor='#D5D9DE', alpha=1)
        axis.line.set_color('#C3C8CE')
        axis._axinfo['grid'].update(color='#E6E8EB', linewidth=0.6)
        axis._axinfo['tick'].update(inward_factor=0.0, outward_factor=0.0)
        axis.set_ticklabels([])


def _ticks(low: FloatArray, high: FloatArray, k: int) -> FloatArray:
    """Return round values along one edge of the box."""
    step = _round_step(max((high - low)[k] / 4.0, float(np.max(high - low)) / 12.0))
    return step * np.arange(np.ceil(low[k] / step - 1e-9), np.floor(high[k] / step + 1e-9) + 1)


def _fit(axes, low: FloatArray, high: FloatArray, frame: Frame) -> None:
    """Zoom and shift the axes until the box just fits into the frame, then write its scales."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform
    corners = np.stack(np.meshgrid(*zip(low, high), indexing='ij'), axis=-1).reshape(8, 3)
    size = axes.figure.get_size_inches() * axes.figure.dpi
    left, bottom, width, height = frame

    def in_figure(points: FloatArray) -> FloatArray:
        axes.set_box_aspect(high - low, zoom=zoom)
        axes.apply_aspect()
        x, y, _ = proj_transform(*points.T, axes.get_proj())
        return axes.transData.transform(np.column_stack([x, y])) / size

    zoom = 1.0
    for _ in range(6):
        seen = in_figure(corners)
        middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
        zoom *= float(np.min(np.array([width, height]) / np.ptp(seen, axis=0)))
        place = axes.get_position(original=True)
        axes.set_position((place.x0 + left + 0.5 * width - middle[0],
                           place.y0 + bottom + 0.5 * height - middle[1],
                           place.width, place.height))
    _rulers(axes, low, high, corners, in_figure)


def _rulers(axes, low: FloatArray, high: FloatArray, corners: FloatArray,
            in_figure: Callable[[FloatArray], FloatArray]) -> None:
    """Write the scales along the near edges of the floor and up the left edge of the box."""
    aspect = axes.figure.get_size_inches()
    centre = in_figure(corners).mean(axis=0) * aspect
    for k, label in enumerate(('east [m]', 'north [m]', 'altitude [m]')):
        begins = corners[np.isclose(corners[:, k], low[k])]
        if k < 2:
            begins = begins[np.isclose(begins[:, 2], low[2])]
        ends = begins.copy()
        ends[:, k] = high[k]
        middles = in_figure(0.5 * (begins + ends))
        chosen = int(np.argmin(middles[:, 1 if k < 2 else 0]))
        along = np.diff(in_figure(np.stack([begins[chosen], ends[chosen]])), axis=0)[0] * aspect
        along /= np.linalg.norm(along)
        out = np.array([along[1], -along[0]])
        if out @ (middles[chosen] * aspect - centre) < 0.0:
            out = -out
        ticks = _ticks(low, high, k)
        points = np.repeat(begins[chosen][None], len(ticks), axis=0)
        points[:, k] = ticks
        for value, place in zip(ticks, in_figure(points)):
            _write(axes, f'{value + 0.0:g}'.replace('-', '\u2212'), place, 11.0 * out, 8.5, 0.0)
        if k == 2:   # matplotlib draws only the one it would write on
            axes.plot(*np.stack([begins[chosen], ends[chosen]]).T, color='#C3C8CE',
                      linewidth=0.8, clip_on=False, zorder=0)
        angle = (np.degrees(np.arctan2(along[1], along[0])) + 90.0) % 180.0 - 90.0
        _write(axes, label, middles[chosen], 31.0 * out, 9.5, 90.0 if k == 2 else angle)


def _write(axes, text: str, place: FloatArray, offset: FloatArray, size: float,
           angle: float) -> None:
    axes.annotate(text, place, xycoords='figure fraction', xytext=offset,
                  textcoords='offset points', fontsize=size, rotation=angle,
                  rotation_mode='anchor', ha='center', va='center', annotation_clip=False)
