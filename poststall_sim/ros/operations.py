# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What can be asked of a simulator: pause, reset, step, trim, another state, a flight file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from poststall_sim import failure_reader, failures, flight_file, topics
from poststall_sim import trim as trims
from poststall_sim.aircraft import ConfigError
from poststall_sim.frames import (
    FloatArray,
    euler_from_quaternion,
    quaternion_from_euler,
    rotation,
)
from poststall_sim.ros import engine_failures, messages
from poststall_sim.ros.flight_setup import flight_path
from poststall_sim.state import BodyState, Controls, Status

if TYPE_CHECKING:
    from poststall_sim.ros.simulator import SimulatorNode

Answer = tuple[bool, str]
"""Whether it was done, and how it stands now or why not."""


class Operations:
    """The operations on a simulator, and the services of std_srvs that offer them."""

    def __init__(self, node: SimulatorNode) -> None:
        self._node = node
        for name, operation in TRIGGERED.items():
            node.create_service(Trigger, name, _triggered(partial(operation, self)),
                                qos_profile=messages.SERVICES)
        for name, switch in SWITCHED.items():
            node.create_service(SetBool, name, _switched(partial(switch, self)),
                                qos_profile=messages.SERVICES)

    def pause(self, paused: bool) -> Answer:
        """Pause, or fly on, as a user asks."""
        reason = self._node.flight.paused_reason
        if not paused and reason:
            return False, f'{reason}; call reset first'
        self._node.pause_for_user(paused)
        return True, 'paused' if self._node.paused else 'flying'

    def reset(self, to_zero: bool | None = None) -> Answer:
        """
        Begin the flight again, without gusts that were asked for.

        A pause stays, but for one that the flight itself asked for. to_zero : whether time goes
        back to 0, as reset.time has it unless given; never to another time than a clock that is
        followed.
        """
        node = self._node
        node.flight.weather = replace(node.flight.weather, gusts=())
        if to_zero is None:
            to_zero = node.settings.reset_time
        node.desk.reset(node.flight.reset(
            0 if to_zero and not node.follows else None).time_ns)
        return True, self._begun()

    def zero_time(self) -> Answer:
        """Call the present instant 0; the flight, its controls and a pause stay as they are."""
        node = self._node
        if node.follows:
            return False, 'time is that of the /clock that is followed'
        self.call_it(0)
        return True, 'at simulated time 0 s'

    def call_it(self, time_ns: int) -> None:
        """Call the present instant by another time [ns]; commands are awaited from there on."""
        node = self._node
        node.flight.set_time(time_ns)
        node.desk.reset(time_ns, told=self._told(node.flight.snapshot.commanded))
        node.jumped()

    def step(self, count: int | None = None) -> Answer:
        """Advance by a number of steps, step_count unless given."""
        node = self._node
        if not node.paused and node.settings.lockstep != 'service':
            return False, 'not paused: pause first'
        node.advance(node.settings.step_count if count is None else count)
        reason = node.flight.paused_reason
        return not reason, reason or f'at simulated time {node.flight.snapshot.time:.9g} s'

    def gust(self) -> Answer:
        """Put the gust that the parameters describe into the air ahead."""
        flight, air = self._node.flight, self._node.air
        snapshot = flight.snapshot
        place_N = snapshot.body.position_N - flight.carried_N
        try:
            gust = air.gust(place_N, rotation(snapshot.body.q_NB) @ snapshot.velocity_air_B)
            flight.weather = flight.weather.with_gust(
                gust, 1e-9 * (snapshot.time_ns - flight.began_ns), place_N)
        except ConfigError as error:
            return False, str(error)
        east, north, up = air.gust_velocity
        return True, (f'{air.gust_shape} of {east:g}, {north:g}, {up:g} m/s east, north, up, '
                      f'{air.gust_length:g} m long, {air.gust_distance:g} m ahead')

    def engage(self, engaged: bool) -> Answer:
        """Listen to the autopilot, or do not."""
        self._node.desk.engaged = engaged
        return True, f'autopilot {"engaged" if engaged else "not engaged"}'

    def trim(self) -> Answer:
        """Go on in straight trim from here, on this heading, at the initial altitude."""
        body = self._node.flight.snapshot.body
        try:
            return True, self.begin_at(body.position_N * [1.0, 1.0, 0.0], body.q_NB)
        except ConfigError as error:
            return False, str(error)

    def begin_at(self, position_N: FloatArray, q_NB: FloatArray) -> str:
        """
        Begin at a place and attitude, trimmed through the air; return how.

        On the ground, heading alone is taken, and the altitude is the initial one. Raises
        `ConfigError`, with nothing changed, where there is no trim.
        """
        flight, settings = self._node.flight, self._node.settings
        on_ground = position_N[2] == 0.0
        if on_ground:
            position_N = position_N - [0.0, 0.0, settings.start_altitude]
        found = trims.straight(
            flight.model, airspeed=settings.initial_airspeed, altitude=-float(position_N[2]),
            failed=flight.failed_engines)
        if found.status is not Status.CONVERGED:
            raise ConfigError(f'no trim at {settings.initial_airspeed:g} m/s: {found.message}')
        if on_ground:
            heading = float(euler_from_quaternion(q_NB)[2])
            q_NB = quaternion_from_euler(found.bank, found.pitch, heading)
        wind_N = flight.weather.mean_N(-float(position_N[2]))
        flight.place(BodyState(
            position_N, found.velocity_B + rotation(q_NB).T @ wind_N, np.zeros(3), q_NB),
            found.controls, delta0=found.aero.strips.delta)
        self._node.desk.reset(flight.snapshot.time_ns, trim=self._told(found.controls))
        values = ', '.join(
            f'{name} {value:.6g}' for name, value in self._node.desk.trim.items())
        return (f'{self._begun()}: trimmed at {found.airspeed:g} m/s and '
                f'{-position_N[2]:g} m, alpha {found.alpha:.6g} rad, climb angle '
                f'{found.climb_angle:.6g} rad, {values}; residual '
                f'{np.abs(found.residual).max():.1e} of the weight')

    def go_to(self, body: BodyState) -> str:
        """
        Go on from another state with the controls as they are; return how.

        Raises `ConfigError`, with nothing changed, where the aircraft cannot fly.
        """
        if body.altitude <= 0.0:
            raise ConfigError(f'altitude {body.altitude:g} m: the ground is at 0')
        flight = self._node.flight
        flight.place(body, flight.snapshot.controls)
        return self._begun()

    def save(self) -> Answer:
        """Write the flight to the flight file."""
        try:
            path = flight_path(self._node.settings)
            flight_file.save_state(self._node.flight, path)
        except ConfigError as error:
            return False, str(error)
        return True, f'{path}: simulated time {self._node.flight.snapshot.time:.9g} s'

    def load(self) -> Answer:
        """
        Go on with the flight in the flight file, its failures and its weather.

        The parameters say these afterwards. Time goes on unless reset.time is true.
        """
        node = self._node
        try:
            path = flight_path(node.settings)
            loaded = flight_file.load_state(node.flight.model, path)
            if loaded.dt_ns != node.flight.dt_ns:
                raise ConfigError(f'{path}: its dt is {loaded.dt_ns * 1e-9:g} s, here it is '
                                  f'{node.flight.dt_ns * 1e-9:g} s')
            if loaded.model.atmosphere != node.flight.model.atmosphere:
                raise ConfigError(f'{path}: flown in {loaded.model.atmosphere}, here it is '
                                  f'{node.flight.model.atmosphere}')
        except ConfigError as error:
            return False, str(error)
        loaded.gusts = node.flight.gusts
        if node.follows or not node.settings.reset_time:
            loaded.set_time(node.flight.snapshot.time_ns)
        node.flight = loaded
        node.desk.reset(loaded.snapshot.time_ns, trim=self._told(loaded.trim),
                        told=self._told(loaded.snapshot.commanded))
        self._say_as_flown()
        return True, f'{self._begun()}: {path}'

    def _say_as_flown(self) -> None:
        """Set the parameters of failures and weather to what the flight has."""
        node, flight, weather = self._node, self._node.flight, self._node.flight.weather
        altitude = node.settings.start_altitude
        node.set_parameters([Parameter(name, value=value) for name, value in {
            engine_failures.NAME: engine_failures.text(
                flight.failed_engines - failures.engines_off(flight.failures)),
            'failures': failure_reader.words(flight.failures) or [''],
            **node.air.unsaid(weather, altitude)}.items()])
        flight.weather = weather   # of which parameters may have said less
        unsaid = node.air.unsaid(weather, altitude)
        if unsaid:
            node.get_logger().warning(
                f'the flight goes on in a weather that {", ".join(unsaid)} cannot say here')

    def _told(self, controls: Controls) -> FloatArray:
        return np.array(list(topics.command_values(controls, self._node.layout).values()))

    def _begun(self) -> str:
        self._node.begun()
        return (f'{"paused" if self._node.paused else "flying"} at simulated time '
                f'{self._node.flight.snapshot.time:.9g} s')


TRIGGERED = {
    'reset': Operations.reset, 'step': Operations.step, 'trim': Operations.trim,
    'save_state': Operations.save, 'load_state': Operations.load, 'gust': Operations.gust}
"""Services of type std_srvs/srv/Trigger."""
SWITCHED = {'pause': Operations.pause, 'engage': Operations.engage}
"""Services of type std_srvs/srv/SetBool."""


def _triggered(operation: Callable[[], Answer]):
    """Return the callback of a Trigger service."""
    def answer(request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = operation()
        return response
    return answer


def _switched(switch: Callable[[bool], Answer]):
    """Return the callback of a SetBool service."""
    def answer(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success, response.message = switch(request.data)
        return response
    return answer
