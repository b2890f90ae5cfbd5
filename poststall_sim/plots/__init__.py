# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Every figure: of a flight from its bag, of a polar, of trims, of modes.

Angles are in degrees here. matplotlib is imported when something is drawn, and used without
pyplot: no display, no state. What reads bags is imported when a bag is drawn.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from poststall_sim.aero.model import Model
from poststall_sim.aircraft import Aircraft
from poststall_sim.survey import Survey

__all__ = ['aircraft_figure', 'airfoil_figure', 'derivatives_figure', 'flight_figures',
           'modes_figure', 'polar_figure', 'trim_figure']


def flight_figures(bag_path: str | os.PathLike[str], output_dir: str | os.PathLike[str], *,
                   aircraft: Aircraft | None = None) -> list[Path]:
    """
    Draw a bag and return the PNG files, the summary first.

    A figure whose topics are not in the bag is left out; what is missing is written below those
    that are drawn. ``aircraft`` goes before the one that the bag names.

    Raises
    ------
    BagError
        When the bag cannot be read or nothing in it can be drawn.

    """
    from poststall_sim.plots import bag, flight
    return flight.draw_flight(bag.flight_data(Path(bag_path), aircraft), Path(output_dir))


def polar_figure(result: Mapping[str, Any], path: str | os.PathLike[str]) -> Path:
    """Draw a polar from what ``poststall polar`` writes as JSON."""
    from poststall_sim.plots import sweeps
    return sweeps.draw_polar(result, Path(path))


def trim_figure(result: Mapping[str, Any], path: str | os.PathLike[str]) -> Path:
    """Draw trims from what ``poststall trim`` writes as JSON."""
    from poststall_sim.plots import sweeps
    return sweeps.draw_trims(result, Path(path))


def modes_figure(result: Mapping[str, Any], path: str | os.PathLike[str]) -> Path:
    """Draw root loci and modes over alpha from what ``poststall modes`` writes as JSON."""
    from poststall_sim.plots import modes
    return modes.draw_modes(result, Path(path))


def derivatives_figure(result: Mapping[str, Any], path: str | os.PathLike[str]) -> Path:
    """Draw derivatives over alpha from what ``poststall derivatives`` writes as JSON."""
    from poststall_sim.plots import derivatives
    return derivatives.draw_derivatives(result, Path(path))


def aircraft_figure(model: Model, figures: Survey, path: str | os.PathLike[str]) -> Path:
    """Draw three views and an isometric of an aircraft, with its strips and controls."""
    from poststall_sim.plots import drawing
    return drawing.draw_aircraft(model, figures, Path(path))


def airfoil_figure(result: Mapping[str, Any], path: str | os.PathLike[str]) -> Path:
    """Draw a section's curves from what ``poststall airfoil`` writes as JSON."""
    from poststall_sim.plots import airfoil
    return airfoil.draw_airfoil(result, Path(path))
