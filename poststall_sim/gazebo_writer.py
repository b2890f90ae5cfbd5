# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Parameters of Gazebo's AdvancedLiftDrag plugin as a fragment of SDF.

The fragment goes into a model that has a link ``base_link`` with its origin at the centre of
gravity, x forward, y left, z up, and for each control a joint of its name with angle 0 where it is
neutral, turning positively with the deflection. As of revision 033d64c the plugin replaces the
pitching moment by its part from sideslip (``Cem = Cemb beta``) before controls and rates are
added, so that Cem0, Cema and Cema_stall have no effect there.
"""

import re
from pathlib import Path
from xml.etree import ElementTree as ET

from poststall_sim import atomic_file
from poststall_sim.buildup import BuildUp
from poststall_sim.lift_drag_fit import Fit

_NOTHING = 1e-12


def element(tables: BuildUp, fit: Fit) -> ET.Element:
    """Return the element ``plugin``."""
    root = ET.Element('plugin', filename='gz-sim-advanced-lift-drag-system',
                      name='gz::sim::systems::AdvancedLiftDrag')
    told = ', '.join(f'{key} {fit.rms[key][0]:.2g} ({fit.rms[key][1]:.2g})' for key in fit.rms)
    root.append(ET.Comment(
        f' {re.sub("-+", "-", tables.aircraft)}: fitted to steady coefficients. Left by the fit, '
        f'root mean square up to the stall (over all angles): {told}. '))
    root.append(ET.Comment(
        ' base_link at the centre of gravity, x forward, z up. In revision 033d64c of gz-sim '
        'Cem0, Cema and Cema_stall have no effect: the plugin overwrites what they make. '))
    _add(root, 'link_name', 'base_link')
    _add(root, 'air_density', tables.density)
    for name, value in fit.values.items():
        _add(root, name, value)
    for name, value in (('forward', '1 0 0'), ('upward', '0 0 1'), ('cp', '0 0 0')):
        _add(root, name, value)
    _add(root, 'num_ctrl_surfaces', str(len(fit.controls)))
    for name, slopes in fit.controls.items():
        control = ET.SubElement(root, 'control_surface')
        _add(control, 'name', name)
        _add(control, 'direction', '1')
        for key, slope in slopes.items():
            _add(control, key, slope)
    return root


def _add(parent: ET.Element, name: str, value: float | str) -> None:
    if not isinstance(value, str):   # what rounding leaves of a zero is none
        value = f'{value if abs(value) > _NOTHING else 0.0:.9g}'
    ET.SubElement(parent, name).text = value


def write(path: Path, tables: BuildUp, fit: Fit) -> None:
    """Write the fragment, whole or not at all."""
    root = element(tables, fit)
    ET.indent(root, '  ')
    with atomic_file.writing(path) as file:
        ET.ElementTree(root).write(file, encoding='utf-8')
