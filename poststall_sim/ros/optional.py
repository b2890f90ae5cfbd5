# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What a full ROS installation has and PyPI has not: used where it is found."""

from __future__ import annotations

import importlib
import importlib.util
from typing import TYPE_CHECKING, Any

from poststall_sim import fields
from poststall_sim.aircraft import ConfigError
from poststall_sim.frames import rotation, swap_ned_enu
from poststall_sim.ros import messages
from poststall_sim.state import BodyState, Snapshot

if TYPE_CHECKING:
    from poststall_sim.ros.operations import Answer
    from poststall_sim.ros.simulator import SimulatorNode

PACKAGES = ('tf2_msgs', 'simulation_interfaces')
"""Message packages of a full installation that are not on PyPI."""

INTERFACES = 'simulation_interfaces'

MOST_STEPS = 1_000_000
"""What one call may ask for, as with the parameter step_count."""

_FEATURES = (
    'ENTITY_STATE_GETTING', 'ENTITY_STATE_SETTING', 'SIMULATION_RESET',
    'SIMULATION_RESET_STATE', 'SIMULATION_STATE_GETTING', 'SIMULATION_STATE_SETTING',
    'SIMULATION_STATE_PAUSE', 'STEP_SIMULATION_SINGLE', 'STEP_SIMULATION_MULTIPLE')
_FEATURE_OF_A_SOURCE = 'SIMULATION_RESET_TIME'
"""What only a simulator can do whose time is its own."""


def missing() -> list[str]:
    """Return which optional packages cannot be imported here."""
    return [name for name in PACKAGES if importlib.util.find_spec(name) is None]


def open_services(node: SimulatorNode) -> None:
    """Offer the services of simulation_interfaces where it is installed; say what is not."""
    absent = missing()
    if absent:
        node.get_logger().info(f'not installed here, so left out: {", ".join(absent)}')
    if INTERFACES in absent:
        return
    try:
        SimulationInterfaces(node, importlib.import_module(f'{INTERFACES}.msg'),
                             importlib.import_module(f'{INTERFACES}.srv'))
    except AttributeError as error:
        node.get_logger().warning(f'{INTERFACES}: its services are left out, it is not of '
                                  f'version 1: {error}')


class SimulationInterfaces:
    """
    Services of simulation_interfaces 1.x, each one of `operations.Operations`.

    Written after its definitions, without having it: it is not on PyPI. The one entity is the
    aircraft, under the name of its file's ``name``. What a reset takes back, its scope says, time
    included, and not reset.time; what parameters have set, it leaves. Stopped is a flight that
    was told to stop and that nothing has moved since.
    msg, srv : the modules of the package.
    """

    def __init__(self, node: SimulatorNode, msg: Any, srv: Any) -> None:
        self._node = node
        self._states = msg.SimulationState
        self._stopped_at: Snapshot | None = None
        self._features = [getattr(msg.SimulatorFeatures, name) for name in _FEATURES]
        if not node.follows:
            self._features.append(getattr(msg.SimulatorFeatures, _FEATURE_OF_A_SOURCE))
        self._set = srv.SetSimulationState.Response
        self._scopes = srv.ResetSimulation.Request
        result = msg.Result
        self._ok, self._failed = result.RESULT_OK, result.RESULT_OPERATION_FAILED
        self._unsupported, self._unknown = (
            result.RESULT_FEATURE_UNSUPPORTED, result.RESULT_NOT_FOUND)
        for kind, name, answer in (
                (srv.GetSimulatorFeatures, 'get_simulator_features', self._get_features),
                (srv.GetSimulationState, 'get_simulation_state', self._get_state),
                (srv.SetSimulationState, 'set_simulation_state', self._set_state),
                (srv.ResetSimulation, 'reset_simulation', self._reset),
                (srv.StepSimulation, 'step_simulation', self._step),
                (srv.GetEntityState, 'get_entity_state', self._get_entity),
                (srv.SetEntityState, 'set_entity_state', self._set_entity)):
            node.create_service(kind, name, answer, qos_profile=messages.SERVICES)

    def _say(self, response: Any, code: int, text: str = '') -> Any:
        response.result.result, response.result.error_message = code, text
        return response

    def _answered(self, response: Any, answer: Answer) -> Any:
        done, text = answer
        return self._say(response, self._ok if done else self._failed, '' if done else text)

    def _get_features(self, request: Any, response: Any) -> Any:
        response.features.features = self._features
        return response

    def _state(self) -> int:
        if not self._node.paused:
            return self._states.STATE_PLAYING
        return (self._states.STATE_STOPPED if self._node.flight.snapshot is self._stopped_at
                else self._states.STATE_PAUSED)

    def _get_state(self, request: Any, response: Any) -> Any:
        response.state.state = self._state()
        return self._say(response, self._ok)

    def _set_state(self, request: Any, response: Any) -> Any:
        node, states, wanted = self._node, self._states, request.state.state
        if wanted == self._state():
            return self._say(response, self._set.ALREADY_IN_TARGET_STATE)
        if wanted == states.STATE_STOPPED:
            node.operations.pause(True)
            response = self._reset_to(self._scopes.SCOPE_ALL, response)
            if response.result.result == self._ok:
                self._stopped_at = node.flight.snapshot
            return response
        if wanted not in (states.STATE_PAUSED, states.STATE_PLAYING):
            return self._say(response, self._unsupported, 'stop, pause and play only: what '
                             'started this process ends it')
        self._stopped_at = None
        done, text = node.operations.pause(wanted == states.STATE_PAUSED)
        return self._say(response, self._ok) if done else self._say(
            response, self._set.STATE_TRANSITION_ERROR, text)

    def _reset(self, request: Any, response: Any) -> Any:
        return self._reset_to(request.scope, response)

    def _reset_to(self, scope: int, response: Any) -> Any:
        """Take back what the bits of a scope name; all of it, or nothing."""
        scopes = self._scopes
        if scope in (scopes.SCOPE_DEFAULT, scopes.SCOPE_ALL):
            scope = scopes.SCOPE_TIME | scopes.SCOPE_STATE   # nothing can be spawned
        time, state = (bool(scope & bit) for bit in (scopes.SCOPE_TIME, scopes.SCOPE_STATE))
        if scope & ~(scopes.SCOPE_TIME | scopes.SCOPE_STATE):
            return self._say(response, self._unsupported, 'nothing is spawned here: time, state '
                             'or all')
        if time and self._node.follows:
            return self._say(response, self._unsupported,
                             'time is that of the /clock that is followed: ask for the state only')
        operations = self._node.operations
        return self._answered(
            response, operations.reset(to_zero=time) if state else operations.zero_time())

    def _step(self, request: Any, response: Any) -> Any:
        if request.steps > MOST_STEPS:
            return self._say(response, self._failed, f'at most {MOST_STEPS} steps at once')
        return self._answered(response, self._node.operations.step(request.steps))

    def _get_entity(self, request: Any, response: Any) -> Any:
        snapshot, layout = self._node.flight.snapshot, self._node.layout
        if request.entity != self._node.flight.model.aircraft.name:
            return self._say(response, self._unknown, f'there is no {request.entity!r}')
        to_map = rotation(snapshot.body.q_NB)
        messages.fill(response.state, {
            'header': fields.header(snapshot.time_ns, layout.map_frame),
            'pose': fields.pose_fields(snapshot),
            'twist': {'linear': fields.map_xyz(to_map @ snapshot.body.velocity_B),
                      'angular': fields.map_xyz(to_map @ snapshot.body.rates_B)},
            'acceleration': {'linear': fields.map_xyz(to_map @ snapshot.acceleration_B),
                             'angular': fields.map_xyz(to_map @ snapshot.rate_change_B)}})
        return self._say(response, self._ok)

    def _set_entity(self, request: Any, response: Any) -> Any:
        if request.entity != self._node.flight.model.aircraft.name:
            return self._say(response, self._unknown, f'there is no {request.entity!r}')
        state = request.state
        try:
            messages.require_frame(
                state.header.frame_id, self._node.layout.map_frame, 'frame_id')
            position_N, q_NB = messages.place_from_pose(state.pose)
            to_body = rotation(q_NB).T
            velocity, rates = (
                to_body @ swap_ned_enu(messages.vector(part, what, messages.GREATEST[what]))
                for part, what in ((state.twist.linear, 'speed'), (state.twist.angular, 'rate')))
            self._node.operations.go_to(BodyState(position_N, velocity, rates, q_NB))
        except (messages.RefusedState, ConfigError) as error:
            return self._say(response, self._failed, str(error))
        return self._say(response, self._ok)
