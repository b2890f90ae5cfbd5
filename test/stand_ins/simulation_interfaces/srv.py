# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""Services, see the package."""

from simulation_interfaces.msg import EntityState, Result, SimulationState, SimulatorFeatures


def _part(constants=None, **fields):
    """Return the class of a request or response with constants and fields, each by its type."""
    def __init__(self):
        for name, make in fields.items():
            setattr(self, name, make())
    return type('Part', (), {**(constants or {}), '__init__': __init__})


class GetSimulatorFeatures:
    Request = _part()
    Response = _part(features=SimulatorFeatures)


class GetSimulationState:
    Request = _part()
    Response = _part(state=SimulationState, result=Result)


class SetSimulationState:
    Request = _part(state=SimulationState)
    Response = _part({'ALREADY_IN_TARGET_STATE': 101, 'STATE_TRANSITION_ERROR': 102,
                      'INCORRECT_TRANSITION': 103}, result=Result)


class ResetSimulation:
    Request = _part({'SCOPE_DEFAULT': 0, 'SCOPE_TIME': 1, 'SCOPE_STATE': 2, 'SCOPE_SPAWNED': 4,
                     'SCOPE_ALL': 255}, scope=int)
    Response = _part(result=Result)


class StepSimulation:
    Request = _part(steps=lambda: 1)
    Response = _part(result=Result)


class GetEntityState:
    Request = _part(entity=str)
    Response = _part(result=Result, state=EntityState)


class SetEntityState:
    Request = _part(entity=str, state=EntityState)
    Response = _part(result=Result)
