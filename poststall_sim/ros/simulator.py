# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The simulator node: flies an aircraft in step with wall time and publishes what happens."""

import gc
import sys
import time
from typing import Any

import numpy as np
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool, Trigger

from poststall_sim import cdr, definition, simulation, topics
from poststall_sim.aero.decambering import Closure
from poststall_sim.aero.model import Settings
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.wake import Shape
from poststall_sim.aero.wash import Precision
from poststall_sim.fields import Fields
from poststall_sim.frames import swap_ned_enu
from poststall_sim.ros import messages, parameters, process
from poststall_sim.ros.commands import CommandDesk, OnTimeout, Source
from poststall_sim.ros.health import Health
from poststall_sim.ros.pacing import Pacer
from poststall_sim.ros.parameters import SimulatorSettings
from poststall_sim.ros.sensor_settings import SensorSettings
from poststall_sim.state import Controls
from poststall_sim.topics import Rate, Topic
from poststall_sim.views import Views

PAUSED_PERIOD = 0.05
"""While paused, /clock is repeated and new subscribers are looked for this often [s]."""


def flight_from_settings(settings: SimulatorSettings, progress) -> simulation.Flight:
    """Read the aircraft, build its model and trim it; ``progress`` hears what is being done."""
    path = definition.find(definition.Kind.AIRCRAFT, settings.aircraft)
    progress(f'aircraft {path}')
    return simulation.start(
        definition.aircraft(path),
        Settings(
            chordwise=settings.uvlm_chordwise,
            wake_length=settings.uvlm_wake_length or None, wake=Shape(settings.uvlm_wake),
            free_rows=settings.uvlm_free_rows, free_every=settings.uvlm_free_every,
            precision=Precision(settings.uvlm_precision), coarsen=settings.uvlm_coarsen,
            interpolate=settings.uvlm_interpolate, ground=settings.ground_effect,
            closure=Closure[settings.decambering_closure.upper()],
            ell=settings.decambering_ell, tolerance=settings.decambering_tolerance,
            separation=Separation(settings.separation), lag=settings.separation_lag,
            relaxation=settings.separation_relaxation, delay=settings.separation_delay,
            decambering=settings.decambering_enabled),
        airspeed=settings.initial_airspeed, altitude=settings.initial_altitude,
        wind_N=swap_ned_enu(np.array(settings.wind_velocity)),
        dt=settings.dt or None, progress=progress)


class SimulatorNode(Node):
    """
    Fly one aircraft: simulated time kept beside wall time, commands in, state out.

    The constructor reads the aircraft, compiles and trims, which takes a while the first time.
    It raises `ConfigError` for parameters or an aircraft that cannot be flown.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__('simulator', **node_options)
        self._settings, sensors = parameters.declare_all(self, SimulatorSettings, SensorSettings)
        parameters.refuse_sim_time(self)
        self._flight = flight_from_settings(self._settings, self.get_logger().info)
        self._layout = topics.layout(
            self._flight, map_frame=self._settings.frames_map,
            base_frame=self._settings.base_frame)
        names = self._layout.command_names
        parameters.declare_names(self, 'surfaces', names, 'Names in the order of the values of '
                                 'surface_commands')
        parameters.declare_names(self, 'strip_names', self._layout.strip_names,
                                 'Names in the order of the values of strip_*')

        self._desk = CommandDesk(names, self._layout.command_limits, np.array(list(
            topics.command_values(self._flight.trim, self._layout).values())))
        self._told = np.full(len(names), np.nan)
        self._controls = self._flight.trim
        self._paused = self._settings.start_paused
        self._reason: str | None = None
        self._fly_after_reset = False
        self._warned_names: set[str] = set()
        self._pacer = Pacer(self._flight.dt_ns, factor=self._settings.real_time_factor,
                            max_steps=self._settings.max_steps_per_wake)
        self._health = Health(
            self.get_fully_qualified_name().lstrip('/'), self._settings.decambering_closure
            if self._settings.decambering_enabled else 'off: attached flow')
        rates = self._settings.rates | sensors.rates
        self._instruments = sensors.instruments(self._layout)
        self._views = Views(self._flight.model, self._layout, rates[Rate.VIEWS])
        self._views.follow(self._flight)
        self._schedule = topics.Schedule(rates)

        self._outlets = self._open_outlets({rate for rate, hz in rates.items() if hz == 0.0})
        self._listeners = dict.fromkeys(self._outlets, 0)
        self._shown_ns: dict[Topic, int] = {}
        self._open_inlets()
        self.create_service(SetBool, 'pause', self._on_pause)
        self.create_service(Trigger, 'reset', self._on_reset)
        self.create_service(Trigger, 'step', self._on_step)
        parameters.follow(self, self._settings, self._on_settings)

        # This node makes simulated time, so its timers must not wait for it.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._wake_timer = self.create_timer(self._wake_period(), self._wake, clock=steady)
        self.create_timer(PAUSED_PERIOD, self._tend, clock=steady)
        self.create_timer(1.0 / self._settings.rates_diagnostics, self._report, clock=steady)
        self._publish_all()
        gc.collect()
        gc.freeze()   # what exists now stays: the collector need not look at it at every turn
        self.get_logger().info(
            f'ready: {self._flight.model.aircraft.name}, {len(self._layout.strip_names)} strips, '
            f'dt {self._flight.dt_ns * 1e-6:g} ms, '
            + ('paused' if self._paused else
               f'real-time factor {self._settings.real_time_factor:g}'))

    def _open_outlets(self, off: set[Rate]) -> dict[Topic, tuple[Publisher, Any]]:
        """Create the publishers, each with the message that it keeps and refills."""
        outlets, missing = {}, {}
        if not self._settings.publish_clock:
            off = off | {Rate.CLOCK}
        for topic in topics.PUBLISHED:
            if topic.rate in off:
                continue
            if topic is topics.JOINT_STATES and not self._layout.command_names:
                continue   # nothing to move: its arrays would be empty
            if not messages.available(topic.type):
                missing.setdefault(topic.type.partition('/')[0], []).append(topic.name)
                continue
            kind = messages.message_class(topic.type)
            outlets[topic] = (
                self.create_publisher(kind, topic.name, messages.qos_profile(topic.qos)), kind())
        for package, names in missing.items():
            self.get_logger().info(
                f'{package} is not installed, so there is no {" and no ".join(names)}')
        return outlets

    def _open_inlets(self) -> None:
        for topic, source in ((topics.AUTOPILOT, Source.AUTOPILOT), (topics.PILOT, Source.PILOT)):
            self.create_subscription(
                JointState, topic.name,
                lambda message, source=source: self._on_joint_command(source, message),
                messages.qos_profile(topic.qos))
        self.create_subscription(
            Float64MultiArray, topics.SURFACES.name, self._on_array_command,
            messages.qos_profile(topics.SURFACES.qos))

    def _wake_period(self) -> float:
        """Return how often to look whether steps are due [s of wall time]."""
        if self._settings.real_time_factor == 0.0:
            return 0.0
        return min(max(self._flight.dt_ns * 1e-9 / self._settings.real_time_factor, 1e-3), 1e-2)

    def _wake(self) -> None:
        """Take the steps that are due."""
        if self._paused:
            return
        for _ in range(self._pacer.due(time.monotonic_ns())):
            self._step(paced=True)
            if self._paused:
                break

    def _step(self, *, paced: bool) -> None:
        """Fly one step and publish what is due after it; paced : as wall time asked for it."""
        begin = time.perf_counter_ns()
        settings = self._settings
        told = self._desk.choose(
            self._flight.snapshot.time_ns, allowed=settings.command_source,
            timeout=settings.command_timeout,
            on_timeout=OnTimeout(settings.command_on_timeout))
        if not np.array_equal(told, self._told):
            self._told = told.copy()
            n = len(self._layout.control_names)
            self._controls = Controls(told[:n], float(told[n]) if self._layout.engines else 0.0)
        before = self._flight.snapshot
        snapshot = self._flight.step(self._controls)
        stepped = time.perf_counter_ns()
        if snapshot is not before:
            self._views.follow(self._flight)
            for topic, values in self._instruments.step(snapshot):
                if self._heard(topic):
                    self._emit(topic, values)
            for topic in self._schedule.due(snapshot.time_ns):
                self._publish(topic)
            self._health.stepped(snapshot, stepped - begin, time.perf_counter_ns() - begin)
            if paced:
                self._pacer.stepped()
        if self._flight.paused_reason and self._flight.paused_reason != self._reason:
            self._stop_for(self._flight.paused_reason)

    def _stop_for(self, reason: str) -> None:
        """
        Pause because the flight cannot go on, on the ground or diverged.

        The reset service then makes it fly again, unless a user has asked for a pause, before
        or since.
        """
        self._reason = reason
        self._fly_after_reset = not self._paused
        self._health.stopped(reason)
        self._pause(True)
        self.get_logger().error(f'paused: {reason}; call the reset service to ' + (
            'fly again' if self._fly_after_reset else 'begin again, paused as before'))
        self._report()

    def _pause(self, paused: bool) -> None:
        self._paused = paused
        self._pacer.stop()
        if paused:
            for topic in self._outlets:
                if topic.rate is not Rate.ONCE and (
                        self._shown_ns.get(topic) != self._flight.snapshot.time_ns):
                    self._publish(topic)

    def _publish(self, topic: Topic) -> None:
        """Publish a topic of the present snapshot, unless nobody would hear it."""
        if topic not in self._outlets or not topic.rate.shows_state:
            return
        snapshot = self._flight.snapshot
        self._shown_ns[topic] = snapshot.time_ns
        if topic.rate in (Rate.CLOCK, Rate.ONCE) or self._heard(topic):
            self._emit(topic, topic.fields(snapshot, self._layout) if topic.fields
                       else self._views.fields(topic, self._flight))

    def _heard(self, topic: Topic) -> int:
        return self._outlets[topic][0].get_subscription_count()

    def _emit(self, topic: Topic, values: Fields) -> None:
        publisher, message = self._outlets[topic]
        publisher.publish(cdr.serialize(topic.type, values) if topic.bulk
                          else messages.fill(message, values))

    def _publish_all(self) -> None:
        """Publish every topic of the present snapshot."""
        self._schedule.due(self._flight.snapshot.time_ns)
        for topic in self._outlets:
            self._publish(topic)

    def _tend(self) -> None:
        """While paused, repeat /clock; show new subscribers what they would wait for."""
        for topic, (publisher, _) in self._outlets.items():
            before = self._listeners[topic]
            self._listeners[topic] = publisher.get_subscription_count()
            new = self._listeners[topic] > before
            if (self._paused and topic.rate is not Rate.ONCE and (
                    topic.rate is Rate.CLOCK or new)) or (topic is topics.PATH and new):
                self._publish(topic)

    def _report(self) -> None:
        """Publish the diagnostics."""
        snapshot, health = self._flight.snapshot, self._health
        publisher, message = self._outlets[topics.DIAGNOSTICS]
        clock = self.resolve_topic_name(topics.CLOCK.name)
        publisher.publish(messages.fill(message, topics.diagnostics_fields(
            snapshot.time_ns, self._flight.model.aircraft.name, [
                health.flight(snapshot, paused=self._paused, reason=self._flight.paused_reason,
                              clock=clock, clock_sources=self.count_publishers(clock)),
                health.pace(self._pacer),
                health.solver(snapshot),
                health.commands(self._desk, snapshot.time_ns, self._settings.command_source)])))

    def _on_settings(self, settings: SimulatorSettings) -> None:
        before, self._settings = self._settings, settings
        if settings.real_time_factor != before.real_time_factor:
            self._pacer.factor = settings.real_time_factor
            self._pacer.stop()
            self._wake_timer.timer_period_ns = round(self._wake_period() * 1e9)
        if settings.wind_velocity != before.wind_velocity:
            self._flight.wind_N = swap_ned_enu(np.array(settings.wind_velocity))

    def _on_joint_command(self, source: Source, message: JointState) -> None:
        try:
            commands = messages.commands_from_joint_state(message, self._layout.command_names)
        except messages.RefusedCommand as error:
            self._refuse(source, error)
            return
        for name in commands.unknown:
            self._health.unknown_names += 1
            if name not in self._warned_names and len(self._warned_names) < 100:
                self._warned_names.add(name)
                self.get_logger().warning(
                    f'{source.value}: there is no control {name}, it is ignored; there are '
                    f'{", ".join(self._layout.command_names)}')
        self._receive(source, commands.values)

    def _on_array_command(self, message: Float64MultiArray) -> None:
        try:
            commands = messages.commands_from_array(message, self._layout.command_names)
        except messages.RefusedCommand as error:
            self._refuse(Source.AUTOPILOT, error)
            return
        self._receive(Source.AUTOPILOT, commands.values)

    def _receive(self, source: Source, values: dict[str, float]) -> None:
        if not values:
            return
        beyond = self._desk.receive(source, values, self._flight.snapshot.time_ns)
        if beyond:
            self.get_logger().warning(
                f'{source.value}: {", ".join(beyond)} beyond limits, cut', throttle_duration_sec=5)

    def _refuse(self, source: Source, error: messages.RefusedCommand) -> None:
        self._health.refused[error.refusal] += 1
        self.get_logger().warning(
            f'{source.value}: command refused: {error}', throttle_duration_sec=1)

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response):
        response.success = True
        if not request.data and self._flight.paused_reason:
            response.success = False
            response.message = f'{self._flight.paused_reason}; call reset first'
        else:
            self._fly_after_reset = False   # from here on it is as the user asks
            if request.data != self._paused:
                self._pause(request.data)
        if response.success:
            response.message = 'paused' if self._paused else 'flying'
        return response

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response):
        """Begin the flight again; a pause stays, but for one of `_stop_for`."""
        snapshot = self._flight.reset(0 if self._settings.reset_time else None)
        self._reason = None
        self._desk.reset(snapshot.time_ns)
        if self._fly_after_reset:
            self._paused = self._fly_after_reset = False
        self._pacer.stop()
        self._publish_all()
        response.success = True
        response.message = (f'{"paused" if self._paused else "flying"} at simulated time '
                            f'{snapshot.time:.9g} s')
        return response

    def _on_step(self, request: Trigger.Request, response: Trigger.Response):
        if not self._paused:
            response.message = 'not paused: pause first'
            return response
        for _ in range(self._settings.step_count):
            if self._flight.paused_reason or not self.context.ok():
                break
            self._step(paced=False)
        self._publish_all()
        response.success = not self._flight.paused_reason
        response.message = (self._flight.paused_reason
                            or f'at simulated time {self._flight.snapshot.time:.9g} s')
        return response


def main(args: list[str] | None = None) -> int:
    """Fly the aircraft that the parameters name until told to stop; return the exit code."""
    return process.run('simulator', SimulatorNode, args)


if __name__ == '__main__':
    sys.exit(main())
