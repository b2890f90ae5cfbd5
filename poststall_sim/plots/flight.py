# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The figures of one flight, all drawn from its bag."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from poststall_sim.frames import FloatArray
from poststall_sim.plots import style, trajectory
from poststall_sim.plots.bag import FlightData
from poststall_sim.plots.strips import StripData
from poststall_sim.recording import BagError

_ABOVE = ('One strip may lie above the greatest $C_l$ of its section: by the non-local closure '
          'that holds for the mean over about a chord of the span.')


def draw_flight(flight: FlightData, output_dir: Path) -> list[Path]:
    """Draw every figure that the flight has the data for."""
    lasts = len(flight.time) > 1
    figures: tuple[tuple[str, bool, Callable], ...] = (
        ('summary', lasts and flight.alpha is not None, _summary),
        ('trajectory', lasts and flight.position is not None, _trajectory),
        ('elevator_alpha', lasts and flight.alpha is not None, _elevator_alpha),
        ('rudder_beta', lasts and flight.beta is not None, _rudder_beta),
        ('strip_cl', flight.strips is not None, _strip_cl),
        ('history', lasts, _history))
    drawn = []
    for name, possible, draw in figures:
        if possible:
            path = output_dir / f'{name}.png'
            draw(flight, path)
            drawn.append(path)
    if not drawn:
        raise BagError('nothing in the bag can be drawn: ' + '; '.join(flight.notes))
    return drawn


def _trajectory(flight: FlightData, path: Path) -> None:
    with style.canvas(10.0, 6.2, path) as figure:
        figure.set_layout_engine('none')
        trajectory.draw(figure, flight, (0.085, 0.09, 0.885, 0.76))
        _title(figure, flight)


def _title(figure, flight: FlightData) -> None:
    """Write name, scale and key of the colours at the top left of a 3-D view."""
    from matplotlib.patches import Patch
    factor = trajectory.scale_of(flight)
    size = '' if factor == 1.0 else f', aircraft drawn {factor:.0f} times its size'
    figure.text(0.02, 0.965, f'Flight of {flight.name}', fontsize=11.5, fontweight='bold',
                va='top')
    figure.text(0.02, 0.92, f'{flight.time[-1] - flight.time[0]:.0f} s{size}', fontsize=9,
                va='top', color='#4A5058')
    if flight.stalled_share is not None and flight.stalled_share.any():
        figure.legend(
            handles=[Patch(color=style.ATTACHED, label='attached'),
                     Patch(color=style.STALLED, label='wing stalled')],
            loc='upper left', bbox_to_anchor=(0.02, 0.885), ncols=2, borderpad=0.0,
            borderaxespad=0.0, handlelength=1.0, handleheight=1.0)


def _elevator_alpha(flight: FlightData, path: Path) -> None:
    _control_response(flight, path, 'elevator', flight.alpha, r'angle of attack $\alpha$ [deg]')


def _rudder_beta(flight: FlightData, path: Path) -> None:
    _control_response(flight, path, 'rudder', flight.beta, r'sideslip $\beta$ [deg]')


def _control_response(flight: FlightData, path: Path, control: str, response: FloatArray,
                      label: str) -> None:
    share = flight.stalled_share
    heights = (1.0, 1.35) if share is None else (1.0, 1.35, 0.45)
    with style.canvas(8.2, 5.0, path) as figure:
        rows = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
        draw_control(rows[0], flight, control)
        rows[0].set_title(f'{control.capitalize()} and response, {flight.name}')
        draw_response(rows[1], flight, response, label)
        if share is not None:
            draw_share(rows[2], flight)
        _time_axis(rows, flight)
        style.note(figure, flight.notes)


def draw_control(axes, flight: FlightData, control: str) -> None:
    """Draw the command and the deflection of a control."""
    command, deflection = flight.commands.get(control), flight.deflections.get(control)
    if command is not None:
        axes.plot(command[0], np.degrees(command[1]), color=style.COMMAND, linewidth=4.0,
                  label='command')
    if deflection is not None:
        axes.plot(flight.time, np.degrees(deflection), color=style.CONTROL, label='deflection')
    if command is None and deflection is None:
        _absent(axes, f'no {control} in the bag')
    else:
        axes.legend(loc='best')
        style.headroom(axes)
    axes.set_ylabel(f'{control} [deg]')
    shade(axes, flight)


def draw_response(axes, flight: FlightData, values: FloatArray | None, label: str,
                  colour: str = style.ATTACHED, factor: float = 180.0 / np.pi) -> None:
    """Draw a quantity over time; factor turns it into the label's unit."""
    if values is None:
        _absent(axes, 'not in the bag')
    else:
        axes.plot(flight.time, factor * values, color=colour)
        style.headroom(axes)
    axes.set_ylabel(label)
    shade(axes, flight)


def draw_share(axes, flight: FlightData) -> None:
    """Draw the share of the wing's strips past their stall."""
    strips = flight.strips
    axes.fill_between(strips.time, 100.0 * strips.stalled_share, step='post',
                      color=style.STALLED, alpha=0.75, linewidth=0.0)
    axes.set(ylim=(0.0, 104.0), yticks=(0, 50, 100), ylabel='wing strips\nstalled [%]')


def shade(axes, flight: FlightData) -> None:
    """Tint the background while strips of the wing are stalled, more while half of them are."""
    share = flight.stalled_share
    for least, strength in ((1e-6, 0.07), (0.5, 0.08)):
        if share is None:
            return
        inside = np.concatenate([[False], share >= least, [False]])
        turns = np.flatnonzero(np.diff(inside.astype(int)))
        for begin, end in zip(turns[::2], turns[1::2]):
            axes.axvspan(flight.time[begin], flight.time[min(end, len(flight.time) - 1)],
                         color=style.STALLED, alpha=strength, linewidth=0.0, zorder=0)


def _time_axis(rows, flight: FlightData) -> None:
    rows[-1].set_xlabel('simulated time [s]')
    rows[-1].set_xlim(flight.time[0], flight.time[-1])
    rows[0].figure.align_ylabels(list(rows))


def _absent(axes, text: str) -> None:
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha='center', va='center',
              color='#6B7178')
    axes.set_yticks([])


def _instants(strips: StripData) -> list[tuple[str, int]]:
    """Return the two instants of the spanwise figure: what to call them, and their index."""
    deepest = strips.deepest()
    if deepest is None:
        first = ('greatest lift', int(np.argmax(strips.cl[:, strips.wing].mean(axis=1))))
    else:
        first = ('deepest stall', deepest)
    after = deepest is not None and strips.recovered()
    return [first, ('after recovery' if after else 'at the end', len(strips.time) - 1)]


def _strip_cl(flight: FlightData, path: Path) -> None:
    with style.canvas(10.0, 4.3, path) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        _draw_instants(panels, flight)
        handles = {label: handle for axes in panels
                   for handle, label in zip(*axes.get_legend_handles_labels())}
        # At the top: notes stand at the bottom, and would lie on it.
        figure.legend(handles.values(), handles.keys(), loc='outside upper center',
                      ncols=len(handles))
        style.note(figure, [*([_ABOVE] if _may_exceed(flight.strips) else []), *flight.notes])


def _may_exceed(strips: StripData) -> bool:
    """Tell whether strips may lie above the line of greatest lift that is drawn with them."""
    return strips.cl_max is not None and strips.averaged


def _draw_instants(panels, flight: FlightData) -> None:
    """Draw both instants of the spanwise figure, to one scale."""
    strips = flight.strips
    for axes, (what, index) in zip(panels, _instants(strips)):
        draw_strips(axes, strips, index)
        axes.set_title(f'{what[0].upper()}{what[1:]}, t = {strips.time[index]:.1f} s')
        said = []
        if flight.alpha is not None:
            alpha = np.interp(strips.time[index], flight.time, flight.alpha)
            said.append(f'$\\alpha$ = {np.degrees(alpha):.1f}\u00b0')
        if strips.stalled is not None:
            stalled = strips.stalled[index, strips.wing]
            said.append(f'{stalled.sum()} of {stalled.size} strips stalled')
        axes.text(0.5, 0.985, ', '.join(said), transform=axes.transAxes, ha='center', va='top',
                  fontsize=8.5, color='#4A5058')
    low = min(axes.dataLim.intervaly[0] for axes in panels)
    high = max(axes.dataLim.intervaly[1] for axes in panels)
    for axes in panels:
        axes.set_ylim(low - 0.12 * (high - low), high + 0.2 * (high - low))
    panels[1].set_ylabel('')


def draw_strips(axes, strips: StripData, index: int) -> None:
    """Draw Cl over the span at one time, port on the left; fins have no span and are not drawn."""
    for number, group in enumerate(strips.groups):
        place = strips.y[group.strips]
        if np.ptp(place) < 1e-6:
            continue
        wing = number == 0
        values = strips.cl[index, group.strips]
        stalled = np.zeros(len(place), dtype=bool) if strips.stalled is None \
            else strips.stalled[index, group.strips]
        axes.plot(place, values, color='#9AA1A9', linewidth=1.3 if wing else 0.9, zorder=2)
        size = 34 if wing else 17
        for chosen, colour, marker, label in (
                (~stalled, style.ATTACHED, 'o', 'attached'),
                (stalled, style.STALLED, 'v', 'past its stall')):
            if strips.stalled is None:
                colour, label = style.CONTROL, 'wing'
            axes.scatter(place[chosen], values[chosen], s=size, color=colour, marker=marker,
                         linewidth=0, zorder=3,
                         label=label if wing and (chosen.any() or stalled.any()) else None)
        if not wing:
            side = np.argmin(place)
            axes.annotate(group.name, (place[side], values[side]), xytext=(5, 0),
                          textcoords='offset points', fontsize=8, color='#6B7178', va='center')
        elif strips.cl_max is not None:
            axes.plot(place, strips.cl_max[group.strips], color=style.LIMIT, linewidth=1.2,
                      linestyle=(0, (5, 2)), label='greatest $C_l$ of the section', zorder=1)
    axes.axhline(0.0, color='#8A9099', linewidth=0.8, zorder=0)
    half = 0.54 * max(float(np.ptp(strips.y[strips.wing])), 1e-6)
    axes.set(xlim=(half, -half), xlabel='$y$ in base_link [m]', ylabel='strip $C_l$ [-]')
    for place, side in ((0.015, 'port'), (0.985, 'starboard')):
        axes.text(place, 0.03, side, transform=axes.transAxes, fontsize=8, color='#6B7178',
                  ha='left' if place < 0.5 else 'right')


def _history(flight: FlightData, path: Path) -> None:
    altitude = None if flight.position is None else flight.position[:, 2]
    panels = (('airspeed [m/s]', flight.airspeed, 1.0), ('altitude [m]', altitude, 1.0),
              ('pitch [deg]', flight.pitch, 180.0 / np.pi),
              ('sink rate [m/s]', flight.sink_rate, 1.0),
              ('load factor [-]', flight.load_factor, 1.0), ('$C_L$ [-]', flight.lift, 1.0))
    with style.canvas(10.0, 7.4, path) as figure:
        axes = figure.subplots(4, 2, sharex=True)
        for panel, (label, values, factor) in zip(axes.flat, panels):
            draw_response(panel, flight, values, label, factor=factor)
        if flight.stalled_share is None:
            _absent(axes[3, 0], 'stalled strips: not known')
        else:
            draw_share(axes[3, 0], flight)
        _draw_solver(axes[3, 1], flight)
        axes[0, 0].set_title(f'Time history, {flight.name}')
        for column in axes.T:
            _time_axis(column, flight)
        style.note(figure, flight.notes)


def _draw_solver(axes, flight: FlightData) -> None:
    """Draw the largest residual so far, and say how many iterations it took."""
    solver = flight.solver
    if 'residual_max' not in solver or not (solver['residual_max'][1] > 0.0).any():
        _absent(axes, 'no residuals in the diagnostics')
        return
    for key, label, line in (('residual_now', 'of a step', ':'),
                             ('residual_max', 'largest so far', '-')):
        if key in solver:
            time, values = solver[key]
            axes.semilogy(time, np.where(values > 0.0, values, np.nan), color=style.SECOND,
                          linestyle=line, marker='.', markersize=3, linewidth=1.2, label=label)
    axes.set_ylabel('residual [rad]')
    axes.legend(loc='upper right', ncols=2, columnspacing=1.0)
    low, high = axes.get_ylim()
    axes.set_ylim(low / 3.0, high * 100.0)
    if 'iterations_mean' in solver and 'iterations_max' in solver:
        axes.text(0.02, 0.95, f'iterations: mean {solver["iterations_mean"][1][-1]:.2f}, '
                  f'max {solver["iterations_max"][1][-1]:.0f}', transform=axes.transAxes,
                  va='top', fontsize=8.5)


def _summary(flight: FlightData, path: Path) -> None:
    """Draw the picture that says it all: path, controls and response, lift over the span."""
    with style.canvas(15.0, 6.6, path) as figure:
        figure.set_layout_engine('none')
        if flight.position is not None:
            trajectory.draw(figure, flight, (0.05, 0.085, 0.53, 0.76))
            _title(figure, flight)
        left, width = (0.63, 0.355) if flight.position is not None else (0.08, 0.88)
        rows = [figure.add_axes((left, bottom, width, height)) for bottom, height in (
            (0.80, 0.15), (0.605, 0.165), (0.41, 0.165))]
        draw_control(rows[0], flight, 'elevator')
        draw_response(rows[1], flight, flight.alpha, r'$\alpha$ [deg]')
        draw_response(rows[2], flight, flight.lift, '$C_L$ [-]', colour=style.SECOND, factor=1.0)
        rows[0].set_title('Elevator, angle of attack, lift'
                          + (' (shaded: wing stalled)' if flight.stalled_share is not None
                             and flight.stalled_share.any() else ''))
        for axes in rows[:-1]:
            axes.tick_params(labelbottom=False)
            axes.set_xlim(flight.time[0], flight.time[-1])
        _time_axis(rows, flight)
        if flight.strips is not None:
            half = 0.5 * (width - 0.035)
            panels = [figure.add_axes((left + k * (half + 0.035), 0.085, half, 0.215))
                      for k in range(2)]
            _draw_instants(panels, flight)
            if flight.strips.cl_max is not None and flight.strips.recovered():
                panels[1].annotate(
                    'greatest $C_l$ of the section'
                    + ',\nof the mean over a chord of span' * flight.strips.averaged,
                    (0.0, flight.strips.cl_max[flight.strips.wing].mean()), xytext=(0, -5),
                    textcoords='offset points', fontsize=7.5, ha='center', va='top',
                    color=style.LIMIT)
