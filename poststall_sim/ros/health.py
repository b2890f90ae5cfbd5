# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""What the simulator counts while it flies, and the diagnostics made from it."""

import math
from collections.abc import Iterable
from dataclasses import replace

from poststall_sim import run_settings
from poststall_sim.aero.model import Settings
from poststall_sim.envelope import Excess
from poststall_sim.fields import Layout, command_values
from poststall_sim.frames import rotation
from poststall_sim.ros import optional
from poststall_sim.ros.commands import CommandDesk, Refusal, Source
from poststall_sim.ros.pacing import Follower, Pacer
from poststall_sim.simulation import Flight
from poststall_sim.state import Snapshot, Status
from poststall_sim.topics import Condition, Level, SolverTally


class Health:
    """Counters of one node, and the conditions that say how it does."""

    def __init__(self, node_name: str) -> None:
        self._name = node_name
        self._missing = ', '.join(optional.missing()) or 'none'
        self.tally = SolverTally()
        self.refused = dict.fromkeys(Refusal, 0)
        self.refused_states = 0
        self.unknown_names = 0
        self.step_ns = 0
        self.step_max_ns = 0
        self.busy_ns = 0
        self._pace_before = (0, 0, 0, 0)   # steps, running, late, lost
        self._refused_before = 0

    def stepped(self, snapshot: Snapshot, step_ns: int, busy_ns: int) -> None:
        """Count one step, the wall time of its computing and of all that came with it [ns]."""
        self.tally.add(snapshot)
        self.step_ns += step_ns
        self.step_max_ns = max(self.step_max_ns, step_ns)
        self.busy_ns += busy_ns

    def stopped(self, reason: str) -> None:
        """Count a flight that could not go on, if that was the solver's doing."""
        if not reason.startswith('ground'):
            self.tally.statuses[Status.DIVERGED] += 1

    def flight(self, snapshot: Snapshot, *, paused: bool, reason: str | None,
               clock: str, clock_sources: int, waits_for: str = '',
               outside: tuple[Excess, ...] = ()) -> Condition:
        """
        Say whether the flight goes on, and if not, why.

        clock : the name of its topic; waits_for : what in lock-step makes the next step; outside :
        see `envelope`.
        """
        if clock_sources > 1:
            level, text = Level.ERROR, (f'{clock_sources} nodes publish {clock}, one may: set '
                                        'publish_clock to false on all but one')
        elif reason:
            level, text = Level.WARN if reason.startswith('ground') else Level.ERROR, reason
        else:
            level, text = Level.OK, ('paused' if paused else f'waits for {waits_for}'
                                     if waits_for else 'flying')
        beyond = ', '.join(each.text for each in outside)
        if beyond and level is Level.OK:
            level, text = Level.WARN, f'outside the method: {beyond}'
        return Condition(level, f'{self._name}: flight', text, {
            'paused': paused,
            'paused_reason': reason or '',
            'time_s': snapshot.time,
            'airspeed_m_s': float(snapshot.airspeed),
            'alpha_rad': float(snapshot.alpha),
            'beta_rad': float(snapshot.beta),
            'mach': snapshot.mach,
            'outside_the_method': beyond,
            'altitude_m': snapshot.body.altitude,
            'density_kg_m3': f'{snapshot.density:.9g}',
            'sink_rate_m_s': float(
                (rotation(snapshot.body.q_NB) @ snapshot.body.velocity_B)[2]),
            'optional_parts_missing': self._missing})

    def pace(self, pacer: Pacer, waits_for: str = '') -> Condition:
        """Say how well simulated time keeps up with wall time, or what it waits for instead."""
        steps, running, late, lost = self._pace_before
        self._pace_before = (pacer.steps, pacer.running_ns, pacer.late, pacer.lost_ns)
        passed = pacer.running_ns - running
        now = (pacer.steps - steps) * pacer.dt_ns / passed if passed else 0.0
        slow = pacer.lost_ns > lost
        late_now = pacer.late - late
        level, text = Level.OK, f'waits for {waits_for}' if waits_for else 'on time'
        if slow:
            level, text = Level.WARN, 'slower than asked: time was lost'
        elif late_now > 0.01 * max(pacer.steps - steps, 1):
            level, text = Level.WARN, f'{late_now} late steps since the last report'
        count = max(self.tally.steps, 1)
        return Condition(level, f'{self._name}: pace', text, {
            'real_time_factor_asked': pacer.factor,
            'real_time_factor': pacer.achieved,
            'real_time_factor_now': now,
            'dt_s': pacer.dt_ns * 1e-9,
            'steps': self.tally.steps,
            'steps_unpaced': self.tally.steps - pacer.steps,
            'late_ticks': pacer.late,
            'lag_max_ms': pacer.lag_max_ns * 1e-6,
            'lost_time_s': pacer.lost_ns * 1e-9,
            'lost_wall_time_s': pacer.lost_wall_ns * 1e-9,
            'step_time_mean_us': self.step_ns / count * 1e-3,
            'step_time_max_us': self.step_max_ns * 1e-3,
            'headroom': self.tally.steps * pacer.dt_ns / self.busy_ns if self.busy_ns else 0.0})

    def following(self, follower: Follower, time_ns: int, sources: int) -> Condition:
        """Say how well the flight follows the clock of another."""
        lag_ns = follower.lag_ns(time_ns)
        level, text = Level.OK, 'follows /clock'
        if follower.clock_ns is None or not sources:
            level, text = Level.WARN, 'waits for /clock: nobody publishes it'
        elif lag_ns > max(2 * follower.dt_ns, Pacer.LATE_NS):
            level, text = Level.WARN, f'{lag_ns * 1e-9:.3f} s behind /clock'
        count = max(self.tally.steps, 1)
        return Condition(level, f'{self._name}: pace', text, {
            'dt_s': follower.dt_ns * 1e-9,
            'steps': self.tally.steps,
            'lag_s': lag_ns * 1e-9,
            'lost_time_s': follower.lost_ns * 1e-9,
            'clock_jumps_back': follower.jumps_back,
            'step_time_mean_us': self.step_ns / count * 1e-3,
            'step_time_max_us': self.step_max_ns * 1e-3,
            'headroom': self.tally.steps * follower.dt_ns / self.busy_ns if self.busy_ns else 0.0})

    def solver(self, snapshot: Snapshot, settings: Settings) -> Condition:
        """Say how the decambering does."""
        return self.tally.condition(
            f'{self._name}: solver', snapshot, run_settings.closure(settings))

    def settings(self, flight: Flight, idle: Iterable[str]) -> Condition:
        """Say how the flight is computed, in which air, and which parameters are idle."""
        found = run_settings.condition(self._name, flight)
        return replace(found, values={
            **found.values, 'parameters_without_effect': ', '.join(idle) or 'none'})

    def engines(self, snapshot: Snapshot, names: tuple[str, ...]) -> Condition:
        """Say what each engine does, and which of them do not work."""
        found = snapshot.engines
        failed = [name for name, gone in zip(names, found.failed) if gone]
        empty = [name for name, charge in zip(names, found.charge) if charge <= 0.0]
        values = {}
        for i, name in enumerate(names):
            values[f'{name}_thrust_N'] = float(found.thrust[i])
            if found.speed[i]:
                values[f'{name}_rpm'] = float(found.speed[i]) * 30.0 / math.pi
            if found.voltage[i]:
                values |= {f'{name}_voltage_V': float(found.voltage[i]),
                           f'{name}_current_A': float(found.current[i]),
                           f'{name}_charge': float(found.charge[i])}
        text = '; '.join(
            [f'failed: {", ".join(failed)}'] * bool(failed)
            + [f'battery empty: {", ".join(empty)}'] * bool(empty)) or 'at work'
        return Condition(Level.WARN if failed or empty else Level.OK,
                         f'{self._name}: engines', text if names else 'none', values)

    def controls(self, snapshot: Snapshot, layout: Layout, failed: list[str]) -> Condition:
        """Say what the controls are told and where they are [rad; throttle 0..1]."""
        told = command_values(snapshot.commanded, layout)
        values: dict[str, float | str] = {'failed': ', '.join(failed)}
        for name, actual in command_values(snapshot.controls, layout).items():
            values |= {f'{name}_commanded': told[name], f'{name}_actual': actual}
        return Condition(
            Level.WARN if failed else Level.OK, f'{self._name}: controls',
            f'failed: {values["failed"]}' if failed else 'none has failed', values)

    def commands(self, desk: CommandDesk, time_ns: int, source_asked: str,
                 repeated: int, dropped: int) -> Condition:
        """
        Say who flies, and what was not obeyed.

        repeated : commands sent again in lock-step; dropped : messages that rclpy stumbled over.
        """
        age = desk.age(time_ns)
        bad = (sum(self.refused.values()) + self.refused_states + self.unknown_names
               + desk.clamped + dropped)
        news = bad > self._refused_before
        self._refused_before = bad
        flown = {Source.NONE: 'nobody commands', Source.SUM: 'pilot and autopilot fly'}.get(
            desk.source, f'{desk.source.value} flies')
        values = {
            'source_asked': source_asked, 'source': desk.source.value,
            'age_s': -1.0 if age is None else age, 'engaged': desk.engaged,
            'accepted': desk.accepted, 'beyond_limits': desk.clamped,
            'unknown_names': self.unknown_names, 'refused_states': self.refused_states,
            'repeated_in_lockstep': repeated, 'dropped_by_rclpy': dropped}
        values.update({refusal.value: count for refusal, count in self.refused.items()})
        return Condition(
            Level.WARN if news else Level.OK, f'{self._name}: commands',
            f'{flown}; commands were refused, cut or named the unknown' if news else flown, values)
