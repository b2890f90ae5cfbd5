# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""From what the controls are told to where the movable parts are: actuators, mixing, failures."""

from dataclasses import dataclass

import numpy as np

from poststall_sim import actuators, failures
from poststall_sim.actuators import Actuation
from poststall_sim.aero.model import Model
from poststall_sim.failures import Failed
from poststall_sim.frames import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ControlState:
    """
    Where all that moves is.

    actuation : of the controls' actuators; angles (k,) : of the movable parts [rad]; floating
    (k,) : where they would be if nothing held them, by the flow of this step [rad].
    """

    actuation: Actuation
    angles: FloatArray
    floating: FloatArray


def at_rest(model: Model, deflections: FloatArray, failed: Failed, dt: float) -> ControlState:
    """Return controls that have been where they are (c,) for long, for steps of dt [s]."""
    asked = model.lattice.angles(deflections)
    return ControlState(
        actuators.at_rest([c.actuator for c in model.aircraft.controls], deflections, dt),
        failures.angles(failed, asked, asked, asked), asked)


def advance(model: Model, before: ControlState, command: FloatArray, failed: Failed,
            dt: float) -> ControlState:
    """Return the controls a step later; command (c,) [rad] is within limits."""
    controls = model.aircraft.controls
    actuation = actuators.advance(
        [control.actuator for control in controls], [control.limits for control in controls],
        before.actuation, command, dt)
    return ControlState(actuation, failures.angles(
        failed, model.lattice.angles(actuation.position), before.angles, before.floating),
        before.floating)


def in_flow(model: Model, state: ControlState, alpha: FloatArray) -> ControlState:
    """Return the controls in a flow in which the strips work at alpha (n,) [rad]."""
    return ControlState(
        state.actuation, state.angles, model.lattice.floating_angles(state.angles, alpha))


def shown(model: Model, state: ControlState) -> FloatArray:
    """
    Return the controls' deflections (c,) as their parts show them [rad].

    The actuators' positions, but where parts have failed or are at their stops what is nearest
    to all parts' angles: an elevator that is stuck shows where it is stuck.
    """
    position = state.actuation.position
    missed = state.angles - model.lattice.mixing @ position
    if not missed.any():
        return position
    return position + np.linalg.lstsq(model.lattice.mixing, missed, rcond=None)[0]
