# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The simulator node: flies an aircraft in step with wall time and publishes what happens."""

import gc
import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rosgraph_msgs.msg import Clock as ClockMessage

from poststall_sim import envelope, failure_reader, topics
from poststall_sim.aircraft import ConfigError
from poststall_sim.ros import (
    arguments,
    declaration,
    engine_failures,
    messages,
    optional,
    process,
    surfaces,
)
from poststall_sim.ros.air_settings import AirSettings
from poststall_sim.ros.commands import CommandDesk, OnTimeout
from poststall_sim.ros.declaration import Followed
from poststall_sim.ros.flight_setup import aero_settings, flight_from_settings, flight_path
from poststall_sim.ros.health import Health
from poststall_sim.ros.inbox import Inbox
from poststall_sim.ros.operations import Operations
from poststall_sim.ros.outbox import Outbox
from poststall_sim.ros.pacing import Follower, Pacer
from poststall_sim.ros.parameters import SimulatorSettings
from poststall_sim.ros.sensor_settings import SensorSettings
from poststall_sim.state import Controls

PAUSED_PERIOD = 0.05
"""While paused, /clock is repeated and new subscribers are looked for this often [s]."""


class SimulatorNode(Node):
    """
    Fly one aircraft: simulated time kept beside wall time, commands in, state out.

    Time may as well wait for each step to be asked for (lock-step) or follow another's /clock.
    The constructor reads the aircraft, compiles and trims, which takes a while the first time.
    It raises `ConfigError` for parameters or an aircraft that cannot be flown.

    What is heard comes by way of an `Inbox`, what is said goes by an `Outbox`, what is asked is
    done by `Operations`: they use ``flight``, ``layout``, ``desk``, ``health``, ``settings``,
    ``air``, ``paused``, ``follows``, the methods.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__('simulator', **node_options)
        self.settings, sensors, self.air = declaration.declare_all(
            self, SimulatorSettings, SensorSettings, AirSettings)
        self.follows = declaration.fix_sim_time(self, source=self.settings.publish_clock)
        if self.follows and self.settings.lockstep != 'off':
            raise ConfigError('lockstep makes time and use_sim_time follows another: set one')
        self.flight = flight_from_settings(
            self.settings, self.air, self.get_logger().info)
        self.layout = topics.layout(
            self.flight, map_frame=self.settings.frames_map,
            base_frame=self.settings.base_frame)
        names = self.layout.command_names
        declaration.declare_names(self, 'surfaces', names, 'Names in the order of the values of '
                                 'surface_commands')
        declaration.declare_names(self, 'strip_names', self.layout.strip_names,
                                 'Names in the order of the values of strip_*')

        self.desk = CommandDesk(names, self.layout.command_limits, np.array(list(
            topics.command_values(self.flight.trim, self.layout).values())))
        self._told = np.full(len(names), np.nan)
        self._controls = self.flight.trim
        self.paused = self.settings.start_paused
        self._reason: str | None = None
        self._fly_after_reset = False
        self._pacer = Pacer(self.flight.dt_ns, factor=self.settings.real_time_factor,
                            max_steps=self.settings.max_steps_per_wake)
        self._follower = Follower(
            self.flight.dt_ns, max_steps=self.settings.max_steps_per_wake)
        self.health = Health(self.get_fully_qualified_name().lstrip('/'))
        self._outbox = Outbox(self, sensors)
        self._tended_ns, self._tend_at = -1, 0.0
        self.operations = Operations(self)
        self.inbox = Inbox(self)
        if self.follows:
            self.create_subscription(ClockMessage, topics.CLOCK.name, self._on_clock,
                                     messages.qos_profile(topics.CLOCK.qos))
        optional.open_services(self)
        declaration.follow(self, Followed(self.settings, self._on_settings, self._require),
                           Followed(self.air, self._on_air, lambda air: air.weather(
                               self.settings.start_altitude)))

        # This node makes simulated time, so its timers must not wait for it.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._wake_timer = self.create_timer(self._wake_period(), self._look, clock=steady)
        self.create_timer(1.0 / self.settings.rates_diagnostics, self._report, clock=steady)
        self._outbox.show_all()
        gc.collect()
        gc.freeze()   # what exists now stays: the collector need not look at it at every turn
        self._say_idle()
        self.get_logger().info(
            f'ready: {self.flight.model.aircraft.name}, {len(self.layout.strip_names)} strips, '
            f'dt {self.flight.dt_ns * 1e-6:g} ms, '
            + ('paused' if self.paused else f'lock-step by {self.settings.lockstep}'
               if self.settings.lockstep != 'off' else 'following /clock' if self.follows else
               f'real-time factor {self.settings.real_time_factor:g}'))

    def _wake_period(self) -> float:
        """Return how often to look whether steps are due [s of wall time]."""
        if self.settings.real_time_factor == 0.0:
            return 0.0
        return min(max(self.flight.dt_ns * 1e-9 / self.settings.real_time_factor, 1e-3), 1e-2)

    def _look(self) -> None:
        """
        Take the steps that are due, and look around every `PAUSED_PERIOD`.

        Both by one timer: each call of another costs rclpy two rounds of all that the node has.
        """
        now = time.monotonic()
        if now >= self._tend_at:
            self._tend_at = now + PAUSED_PERIOD
            self._tend()
        self._wake()

    def _wake(self) -> None:
        """Take the steps that are due."""
        if self.paused or self.settings.lockstep != 'off':
            return
        for _ in range(self._due()):
            self.inbox.hear_commands()
            if self.paused:
                break
            self._step(paced=True)
            if self.paused:
                break

    def _due(self) -> int:
        """Return how many steps to take now."""
        if not self.follows:
            return self._pacer.due(time.monotonic_ns())
        now_ns = self.flight.snapshot.time_ns
        began_ns = self._follower.joined(now_ns)
        if began_ns != now_ns:
            self.operations.call_it(began_ns)
        return self._follower.due(began_ns)

    def _on_clock(self, message: ClockMessage) -> None:
        """Follow the clock of another; where it alone jumps back, begin again."""
        clock_ns = messages.clock_time(message)
        if clock_ns is None:
            self.get_logger().warning(
                f'/clock refused: {message.clock.sec} s is no simulated time',
                throttle_duration_sec=1)
            return
        if self._follower.heard(clock_ns):
            if self.count_publishers(self.resolve_topic_name(topics.CLOCK.name)) > 1:
                return   # which of them is right? the diagnostics say that there are several
            self.get_logger().warning('/clock jumped back: the flight begins again')
            self.desk.reset(self.flight.reset(self._follower.whole_ns).time_ns)
            self.begun()
        self._wake()

    def advance(self, count: int) -> None:
        """Take steps that somebody waits for, and show where they lead."""
        for _ in range(count):
            if self.flight.paused_reason or process.ending() or not self.context.ok():
                break
            self._step(paced=False)
        self._outbox.show()

    def _step(self, *, paced: bool) -> None:
        """Fly one step and publish what is due after it; paced : as wall time asked for it."""
        begin = time.perf_counter_ns()
        settings = self.settings
        told = self.desk.choose(
            self.flight.snapshot.time_ns, allowed=settings.command_source,
            timeout=settings.command_timeout,
            on_timeout=OnTimeout(settings.command_on_timeout),
            deadband=settings.command_deadband)
        if not np.array_equal(told, self._told):
            self._told = told.copy()
            n = len(self.layout.control_names)
            self._controls = Controls(told[:n], float(told[n]) if self.layout.engines else 0.0)
        before = self.flight.snapshot
        snapshot = self.flight.step(self._controls)
        stepped = time.perf_counter_ns()
        if snapshot is not before:
            self._outbox.stepped()
            self.health.stepped(snapshot, stepped - begin, time.perf_counter_ns() - begin)
            if paced and not self.follows:
                self._pacer.stepped()
        if self.flight.paused_reason and self.flight.paused_reason != self._reason:
            self._stop_for(self.flight.paused_reason)

    def _stop_for(self, reason: str) -> None:
        """
        Pause because the flight cannot go on, on the ground or diverged.

        The reset service then makes it fly again, unless a user has asked for a pause, before
        or since.
        """
        self._reason = reason
        self._fly_after_reset = not self.paused
        self.health.stopped(reason)
        self._pause(True)
        self.get_logger().error(f'paused: {reason}; call the reset service to ' + (
            'fly again' if self._fly_after_reset else 'begin again, paused as before'))
        self._report()

    def pause_for_user(self, paused: bool) -> None:
        """Pause or fly on; from here on it is as the user asks."""
        self._fly_after_reset = False
        if paused != self.paused:
            self._pause(paused)

    def begun(self) -> None:
        """Show a flight that was put elsewhere; a pause stays, but for one of `_stop_for`."""
        self._reason = None
        if self._fly_after_reset:
            self.paused = self._fly_after_reset = False
        self.jumped()

    def jumped(self) -> None:
        """Go on from a state or a time that does not follow from the one before, and show it."""
        self.inbox.turns.forget()
        self._pacer.forgive(time.monotonic_ns())
        self._outbox.show_all()

    def _pause(self, paused: bool) -> None:
        self.paused = paused
        self._pacer.stop()
        self._follower.stop()
        if paused:
            self._outbox.show()

    def _tend(self) -> None:
        """While time stands, tell the time and who is new the state."""
        now_ns = self.flight.snapshot.time_ns
        if self.follows and now_ns == self._tended_ns:
            self._outbox.show()   # the clock may have stopped between two states that are due
        self._tended_ns = now_ns
        self._outbox.tend(
            stands=self.paused or self.follows or self.settings.lockstep != 'off')

    def _report(self) -> None:
        """Publish the diagnostics."""
        snapshot, health = self.flight.snapshot, self.health
        clock = self.resolve_topic_name(topics.CLOCK.name)
        sources = self.count_publishers(clock)
        self._outbox.emit(topics.DIAGNOSTICS, topics.diagnostics_fields(
            snapshot.time_ns, self.flight.model.aircraft.name, [
                health.flight(snapshot, paused=self.paused, reason=self.flight.paused_reason,
                              clock=clock, clock_sources=sources, waits_for=self._waits_for(),
                              outside=envelope.exceeded(snapshot, self.flight.model)),
                health.following(self._follower, snapshot.time_ns, sources) if self.follows
                else health.pace(self._pacer, self._waits_for()),
                health.solver(snapshot, self.flight.model.settings),
                health.settings(self.flight, self.settings.idle),
                health.engines(snapshot, self.flight.model.aircraft.engine_names),
                health.controls(snapshot, self.layout,
                                failure_reader.words(self.flight.failures)),
                health.commands(self.desk, snapshot.time_ns, self.settings.command_source,
                                self.inbox.turns.repeated, process.dropped())]))

    def _waits_for(self) -> str:
        """Return what time waits for in lock-step, or nothing."""
        return {'off': '', 'service': 'the step service', 'command': 'the next command'}[
            self.settings.lockstep]

    def _require(self, settings: SimulatorSettings) -> None:
        """Raise `ConfigError` for settings that do not go together, or not with the aircraft."""
        aero_settings(settings)
        if settings.flight_file:
            flight_path(settings)
        surfaces.failed(self.flight.model.aircraft, settings)
        engine_failures.failed(self.flight.model.aircraft, settings.engine_failures)
        if settings.real_time_factor != self.settings.real_time_factor and (
                self.follows or settings.lockstep != 'off'):
            raise ConfigError('real_time_factor has no effect here: time is that of '
                              + (self._waits_for() or 'the /clock that is followed'))

    def _on_settings(self, settings: SimulatorSettings, named: frozenset[str]) -> None:
        before, self.settings = self.settings, settings
        if settings.real_time_factor != before.real_time_factor:
            self._pacer.change(settings.real_time_factor, time.monotonic_ns())
            self._wake_timer.timer_period_ns = round(self._wake_period() * 1e9)
        if settings.decambering_enabled != before.decambering_enabled:
            self.flight.model = replace(self.flight.model, settings=aero_settings(settings))
            self._say_idle()
        # Of failures what was not named now may be from a flight file, and stays.
        aircraft = self.flight.model.aircraft
        if 'engine_failures' in named:
            self.flight.failed_engines = engine_failures.failed(
                aircraft, settings.engine_failures)
        words = [word for word in settings.failures if word.strip()]
        if 'failures' in named and words != failure_reader.words(self.flight.failures):
            self.flight.failures = surfaces.failed(aircraft, settings)
            self.get_logger().warning(
                f'failed: {", ".join(words)}' if words else 'nothing fails any more')

    def _say_idle(self) -> None:
        """Warn of what was set and has no effect."""
        if self.settings.idle:
            self.get_logger().warning('without effect here: ' + '; '.join(
                f'{name}, which needs {needed}' for name, needed in self.settings.idle.items()))

    def _on_air(self, air: AirSettings, named: frozenset[str]) -> None:
        self.air = air
        self.flight.weather = replace(
            self.flight.weather, **air.asked(named, self.settings.start_altitude))


def main(args: list[str] | None = None) -> int:
    """Fly the aircraft that the parameters name until told to stop; return the exit code."""
    arguments.heed(
        'simulator', 'Fly an aircraft past the stall, and publish pose, wrench and strip Cl.',
        (SimulatorSettings, SensorSettings, AirSettings), args)
    return process.run('simulator', SimulatorNode, args, patience=None)


if __name__ == '__main__':
    sys.exit(main())
