# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Did the demo stall, and recover? Told from its bag alone, sharing no code with the product.

    python test/check_demo_bag.py BAG [--aircraft FILE] [--strict] [--without BAG]

Reads the bag with rosbags, the aircraft's YAML and its section curves (CSV) by hand. --strict also
holds the simulator to real time with at most 1 % late ticks; --without is the bag of the same
flight with decambering switched off, which must show nothing of the kind. Exits 1 if anything is
not so.
"""

import argparse
import csv
import math
import sys
from pathlib import Path

import numpy as np
import yaml
from rosbags.highlevel import AnyReader

CONFIG = Path(__file__).resolve().parents[1] / 'config'


def read(path):
    """Return {topic: (simulated times [s], messages)}; /clock turns log time into simulated."""
    logged, messages = {}, {}
    with AnyReader([path]) as reader:
        for connection, time_ns, data in reader.messages():
            if connection.topic in ('/rosout', '/parameter_events'):
                continue
            logged.setdefault(connection.topic, []).append(time_ns)
            messages.setdefault(connection.topic, []).append(
                reader.deserialize(data, connection.msgtype))
    clock = [m.clock.sec + 1e-9 * m.clock.nanosec for m in messages['/clock']]
    times = {}
    for topic, found in messages.items():
        times[topic] = np.interp(logged[topic], logged['/clock'], clock)
        if hasattr(found[0], 'header'):
            stamps = np.array([m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for m in found])
            if stamps.any():
                times[topic] = stamps
    return {topic: (times[topic], messages[topic]) for topic in messages}


def stall_angles(path):
    """Return the angles of greatest and least lift of a section near zero [rad]."""
    with open(path, newline='') as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith('#')))
    alpha = np.array([float(row['alpha_deg']) for row in rows])
    cl = np.array([float(row['cl']) for row in rows])
    near = np.abs(alpha) <= 30.0
    return (math.radians(alpha[near][np.argmax(cl[near])]),
            math.radians(alpha[near][np.argmin(cl[near])]))


def strips_of(path):
    """Return for each strip, in the order of the file: is it the wing's, high and low stall."""
    definition = yaml.safe_load(Path(path).read_text())
    angles = {}
    for name, given in definition['airfoils'].items():
        file = given if isinstance(given, str) else given['file']
        file = file if file.endswith('.csv') else file + '.csv'
        angles[name] = stall_angles(CONFIG / 'airfoils' / file)
    wing, high, low = [], [], []
    for number, surface in enumerate(definition['surfaces']):
        found = [angles[section['airfoil']] for section in surface['sections']]
        wing += [number == 0] * surface['strips']
        high += [max(a for a, _ in found)] * surface['strips']
        low += [min(b for _, b in found)] * surface['strips']
    return np.array(wing), np.array(high), np.array(low)


class Flight:
    """What the checks need, on the times of /wrench."""

    def __init__(self, path):
        bag = read(path)
        self.bag = bag
        # A state that was shown twice, as to a late subscriber while paused, counts once.
        self.time, first = np.unique(bag['/wrench'][0], return_index=True)
        wrench = [bag['/wrench'][1][i] for i in first]
        force = np.array([[m.wrench.force.x, m.wrench.force.z] for m in wrench])
        self.alpha = self._on_time('/air_data/alpha', lambda m: m.data)
        speed = self._on_time('/air_data/airspeed', lambda m: m.data)
        self.altitude = self._on_time('/pose', lambda m: m.pose.position.z)
        self.elevator = self._on_time(
            '/joint_states', lambda m: m.position[m.name.index('elevator')])
        # FLU: lift is across the wind in the plane of symmetry, x forward and z up.
        lift = force[:, 0] * np.sin(self.alpha) + force[:, 1] * np.cos(self.alpha)
        density = 1.225 * (1.0 - 2.25577e-5 * self.altitude) ** 4.2559
        self.lift_coefficient = lift / (0.5 * density * speed ** 2)   # times the area
        pose_time, poses = bag['/pose']
        q = np.array([[m.pose.orientation.w, m.pose.orientation.x, m.pose.orientation.y,
                       m.pose.orientation.z] for m in poses])
        # The body's x axis in ENU: its third component is the sine of the pitch angle.
        nose = 2.0 * (q[:, 1] * q[:, 3] - q[:, 0] * q[:, 2])
        self.pitch = np.interp(self.time, pose_time, np.arcsin(np.clip(nose, -1.0, 1.0)))
        self.strip_time, strips = bag['/strip_alpha']
        self.strip_alpha = np.array([m.data for m in strips])

    def _on_time(self, topic, value):
        time, messages = self.bag[topic]
        return np.interp(self.time, time, [value(m) for m in messages])

    def fall_of_lift(self):
        """Return how much CL falls from its maximum while alpha still rises, and that time."""
        worst, when = 0.0, 0.0
        peak = 0
        for i in range(1, len(self.time)):
            if self.alpha[i] < self.alpha[peak] or self.time[i] - self.time[peak] > 5.0 \
                    or self.lift_coefficient[i] > self.lift_coefficient[peak]:
                peak = i   # alpha is below that of the maximum again, or lift still rises
                continue
            back = max(0, i - 5)
            rising = self.alpha[i] > self.alpha[back]
            fall = 1.0 - self.lift_coefficient[i] / self.lift_coefficient[peak]
            if rising and self.lift_coefficient[peak] > 0.0 and fall > worst:
                worst, when = fall, self.time[i]
        return worst, when


class Checks:
    """Say each thing that must hold, and remember whether all did."""

    def __init__(self):
        self.failed = 0

    def __call__(self, holds, text):
        print(('ok      ' if holds else 'FAILED  ') + text)
        self.failed += not holds


def check_recording(check, bag):
    expected = {
        '/clock', '/pose', '/odom', '/twist', '/twist/air', '/accel', '/wrench',
        '/wrench/propulsion', '/air_data/airspeed', '/air_data/alpha', '/air_data/beta',
        '/air_data/load_factor', '/wind/applied', '/joint_states', '/strip_cl', '/strip_alpha',
        '/strip_decambering', '/strip_cd', '/strip_cm', '/strip_gamma', '/strip_stalled',
        '/strip_y', '/strip_chord', '/strip_cl_max', '/diagnostics', '/pilot/surface_cmd'}
    check(expected <= set(bag), f'the bag holds every topic (missing: {expected - set(bag)})')
    backwards = [topic for topic, (time, _) in bag.items() if (np.diff(time) < 0.0).any()]
    check(not backwards, f'time never runs backwards ({backwards})')
    joints = bag['/joint_states'][1]
    check(all(len(m.name) == len(m.position) == len(m.velocity) == len(m.effort) > 0
              for m in joints), 'joint_states has four arrays of one length')
    arrays = [np.array([m.data for m in bag[topic][1]]) for topic in bag
              if topic.startswith(('/strip_', '/air_data/'))]
    check(all(np.isfinite(array).all() for array in arrays), 'every number is finite')
    time = bag['/pose'][0]
    gaps = np.diff(np.unique(time))
    check(gaps.max() <= 0.1, f'no gap in /pose above 0.1 s (largest: {gaps.max():.3f} s)')


def stall_of(flight, wing, high, low):
    """Return when the most of the wing is stalled, how much, and what sink and nose then do."""
    stalled = (flight.strip_alpha > high) | (flight.strip_alpha < low)
    share = stalled[:, wing].mean(axis=1)
    worst = int(np.argmax(share))
    facts = {'stalled': stalled, 'share': share[worst], 'time': flight.strip_time[worst],
             'sink': 0.0, 'drop': 0.0}
    # The stall itself, not the recovery: as long as the elevator is still pulled.
    begun = flight.strip_time[np.argmax(share >= 0.5)] if share[worst] >= 0.5 else math.inf
    released = flight.time[flight.elevator <= flight.elevator.min() + math.radians(1.0)][-1]
    before = (flight.time > 0.5) & (flight.time < begun - 1.0)
    pulled = (flight.time >= begun - 1.0) & (flight.time <= released)
    if before.any() and pulled.any():
        sink = -np.gradient(flight.altitude, flight.time)
        facts['sink'] = sink[pulled].max() - np.median(sink[before])
        highest = int(np.argmax(np.where(pulled, flight.pitch, -np.inf)))
        later = pulled & (flight.time >= flight.time[highest])
        facts['drop'] = math.degrees(flight.pitch[highest] - flight.pitch[later].min())
    return facts


def check_stall(check, flight, wing, high, low):
    facts = stall_of(flight, wing, high, low)
    check(facts['share'] >= 0.5,
          f'at {facts["time"]:.2f} s {100 * facts["share"]:.0f} % of the wing\'s {wing.sum()} '
          "strips are past their section's cl_max (at least 50 %)")
    fall, when = flight.fall_of_lift()
    check(fall >= 0.10, f'CL is {100 * fall:.0f} % below its maximum at {when:.2f} s while alpha '
          'still rises (at least 10 %)')
    check(facts['sink'] >= 2.0, 'while the elevator is pulled the aircraft comes to sink '
          f'{facts["sink"]:.1f} m/s faster than before (at least 2 m/s)')
    check(facts['drop'] >= 10.0,
          f'and its nose drops by {facts["drop"]:.0f} deg (at least 10)')
    last = flight.strip_time >= flight.strip_time[-1] - 1.0
    left = int(facts['stalled'][last].any(axis=0).sum())
    check(left == 0, f'in the last second all strips are attached ({left} are not)')
    decambering = np.array([m.data for m in flight.bag['/strip_decambering'][1]])
    lowest = math.degrees(decambering[:, wing].min())
    check(lowest <= -3.0, f'decambering goes down to {lowest:.1f} deg (-3 or less)')


def check_attached(check, flight, wing, high, low):
    """Hold the same flight without decambering to show nothing of the kind."""
    facts = stall_of(flight, wing, high, low)
    fall, _ = flight.fall_of_lift()
    check(fall < 0.10, f'without decambering CL falls by {100 * fall:.0f} % (below 10 %)')
    check(facts['sink'] < 2.0, f'without it sinking quickens by {facts["sink"]:.1f} m/s '
          '(below 2 m/s)')
    check(facts['drop'] < 10.0, f'without it the nose drops by {facts["drop"]:.0f} deg (below 10)')
    delta = np.array([m.data for m in flight.bag['/strip_decambering'][1]])
    check(not delta.any(), 'without decambering there is none')
    # Lift goes on with alpha: where a curve has long fallen, it is still above its maximum.
    cl = np.array([m.data for m in flight.bag['/strip_cl'][1]])[:, wing]
    cl_max = np.array(flight.bag['/strip_cl_max'][1][0].data)[wing]
    past = (flight.strip_alpha > high)[:, wing]
    check(past.any(axis=0).mean() >= 0.5, f'without it {100 * past.any(axis=0).mean():.0f} % of '
          "the wing's strips pass their section's stall angle (at least 50 %)")
    least = (cl / cl_max)[past].min(initial=math.inf)
    check(least >= 0.95, f'and past it no section loses lift: cl is {least:.2f} of cl_max or more '
          '(at least 0.95)')
    most = (cl / cl_max).max()
    check(most >= 1.5, f'and goes up to {most:.2f} of cl_max (at least 1.5; the mean over a chord '
          'of span alone allows 1.1)')
    stalled = np.array([m.data for m in flight.bag['/strip_stalled'][1]])
    check(stalled.size > 0 and not stalled.any(), 'without it strip_stalled is 0 throughout')


def check_pace(check, bag, strict):
    values = {}
    for message in bag['/diagnostics'][1]:
        for status in message.status:
            values.update({item.key: item.value for item in status.values})
    if 'late_ticks' not in values:
        check(not strict, 'late ticks are in the diagnostics')
        return
    steps, late = int(values['steps']), int(values['late_ticks'])
    factor, asked = (float(values[key]) for key in ('real_time_factor', 'real_time_factor_asked'))
    text = f'{late} of {steps} ticks late, real-time factor {factor:.3f} of {asked:g}'
    if strict:
        check(late <= 0.01 * steps and abs(factor - 1.0) <= 0.01,
              text + ' (at most 1 %, 1.0 +- 0.01)')
    else:
        print('        ' + text)
    check(int(values['diverged']) == 0, 'no step diverged')


def main():
    parser = argparse.ArgumentParser(description=__doc__.strip().splitlines()[0])
    parser.add_argument('bag', type=Path)
    parser.add_argument('--aircraft', type=Path, default=CONFIG / 'aircraft' / 'trainer.yaml')
    parser.add_argument('--strict', action='store_true')
    parser.add_argument('--without', type=Path, metavar='BAG')
    options = parser.parse_args()

    check = Checks()
    flight = Flight(options.bag)
    wing, high, low = strips_of(options.aircraft)
    check(flight.strip_alpha.shape[1] == len(wing),
          f'{flight.strip_alpha.shape[1]} strips, as many as the aircraft has ({len(wing)})')
    y = flight.bag['/strip_y'][1][0].data[wing]
    check((np.diff(y) < 0.0).all() and y[0] > 0.0, "the wing's strips run from left to right")
    check_recording(check, flight.bag)
    check_stall(check, flight, wing, high, low)
    check_pace(check, flight.bag, options.strict)
    if options.without is not None:
        check_attached(check, Flight(options.without), wing, high, low)
    print(f'{check.failed} failed' if check.failed else 'all hold')
    return 1 if check.failed else 0


if __name__ == '__main__':
    sys.exit(main())
