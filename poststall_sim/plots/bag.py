# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""A bag's topics put together into one flight, as far as they are there."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from poststall_sim import definition, recording, silhouette
from poststall_sim.aircraft import Aircraft, ConfigError
from poststall_sim.atmosphere import standard_air
from poststall_sim.frames import FloatArray, body_to_stability, rotation, swap_body_flu
from poststall_sim.plots.lookup import Lookup, Pair, onto
from poststall_sim.plots.strips import StripData, strip_data
from poststall_sim.recording import BagError

DENSITY = 'density_kg_m3'
"""The key under which the diagnostics of a flight tell it."""
_WANTED = ('odom', 'joint_states', 'wrench', 'air_data/alpha', 'strip_cl', 'strip_alpha')


@dataclass(frozen=True, slots=True, eq=False)
class FlightData:
    """
    One flight on one time base (n,), in ROS axes [m, s, rad]; None what the bag has not.

    aircraft: as it is defined here; position (n, 3) in map; attitude (n, 3, 3) base_link in map;
    rates (n, 3) of the aircraft in B; lift: lift coefficient of the aircraft without thrust;
    deflections on the time base, commands over their own, by name; solver: numbers in its
    diagnostics by key; reported: the last text of each key of each diagnostic; shape: polygons of
    the aircraft in base_link; notes: what is missing or assumed.
    """

    name: str
    aircraft: Aircraft | None
    time: FloatArray
    position: FloatArray | None
    attitude: FloatArray | None
    rates: FloatArray | None
    airspeed: FloatArray | None
    alpha: FloatArray | None
    beta: FloatArray | None
    sink_rate: FloatArray | None
    load_factor: FloatArray | None
    lift: FloatArray | None
    deflections: dict[str, FloatArray]
    commands: dict[str, Pair]
    strips: StripData | None
    solver: dict[str, Pair]
    reported: dict[str, dict[str, str]]
    shape: list[FloatArray]
    notes: tuple[str, ...]

    @property
    def pitch(self) -> FloatArray | None:
        """Angle of the nose above the horizon (n,) [rad]."""
        if self.attitude is None:
            return None
        return np.arcsin(np.clip(self.attitude[:, 2, 0], -1.0, 1.0))

    @property
    def bank(self) -> FloatArray | None:
        """Angle of the wings to the horizon, positive right wing down (n,) [rad]."""
        if self.attitude is None:
            return None
        return np.arctan2(self.attitude[:, 2, 1], self.attitude[:, 2, 2])

    @property
    def stalled_share(self) -> FloatArray | None:
        """Share of the wing's strips past their stall (n,)."""
        if self.strips is None or self.strips.stalled is None:
            return None
        return np.interp(self.time, self.strips.time, self.strips.stalled_share)


def flight_data(path: str | Path, aircraft: Aircraft | None = None) -> FlightData:
    """
    Return the flight that a bag holds; ``aircraft`` goes before the one that the bag names.

    Raises
    ------
    BagError
        When it cannot be read or holds none of the simulator's topics.

    """
    return of_topics(Lookup(recording.read(path)), Path(path).resolve().name, aircraft)


def of_topics(bag: Lookup, name: str, aircraft: Aircraft | None = None) -> FlightData:
    """Return the flight in topics that have been read, of a bag of this name; see above."""
    if aircraft is None:
        aircraft = _named_aircraft(bag)
    strips = strip_data(bag, aircraft)
    place = _place(bag)
    time = _time_base(bag, place, strips)
    air = _air(bag, time)
    position, attitude = (None, None) if place is None else place[1:]
    missing = [topic for topic in _WANTED if bag.find(topic) is None]
    if missing:
        bag.notes.append('not in the bag: ' + ', '.join(missing))
    load = bag.column('air_data/load_factor', 'data')
    return FlightData(
        name=aircraft.name if aircraft else name, aircraft=aircraft,
        time=time, position=position, attitude=attitude,
        rates=_rates(bag, time), **air,
        sink_rate=_sink_rate(bag, time, position, attitude),
        load_factor=None if load is None else onto(time, load),
        lift=_lift(bag, time, position, air,
                   aircraft.reference.area if aircraft else strips and strips.wing_area),
        deflections={name: np.interp(time, *pair)
                     for name, pair in bag.joints('joint_states').items()},
        commands=bag.joints('autopilot/surface_cmd') | bag.joints('pilot/surface_cmd'),
        strips=strips, solver=_solver(bag), reported=_reported(bag),
        shape=_shape(aircraft, strips),
        notes=tuple(bag.notes))


def _named_aircraft(bag: Lookup) -> Aircraft | None:
    """Return the aircraft that the diagnostics name as their hardware."""
    for name in dict.fromkeys(row[2] for row in bag.diagnostics() if row[2]):
        try:
            return definition.aircraft(definition.find(definition.Kind.AIRCRAFT, name))
        except ConfigError:
            bag.notes.append(f'the aircraft {name} is not known here: with its file its shape '
                             'and stall angles are')
    return None


def _place(bag: Lookup) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return time, position and attitude from odom or pose, whichever has more."""
    found = [bag.column(topic, *(f'{prefix}position.{axis}' for axis in 'xyz'),
                        *(f'{prefix}orientation.{axis}' for axis in 'wxyz'))
             for topic, prefix in (('odom', 'pose.pose.'), ('pose', 'pose.'))]
    found = [pair for pair in found if pair is not None]
    if not found:
        return None
    time, values = max(found, key=lambda pair: len(pair[0]))
    norm = np.linalg.norm(values[:, 3:], axis=1, keepdims=True)
    quaternion = values[:, 3:] / np.where(norm > 0.0, norm, 1.0)
    return time, values[:, :3], np.moveaxis(rotation(quaternion.T), -1, 0)


def _time_base(bag: Lookup, place, strips: StripData | None) -> FloatArray:
    if place is not None:
        return place[0]
    for topic, key in (('air_data/alpha', 'data'), ('twist/air', 'twist.linear.x'),
                       ('joint_states', 'header.stamp.sec')):
        found = bag.column(topic, key)
        if found is not None:
            return found[0]
    if strips is None:
        raise BagError('nothing in the bag can be drawn: ' + '; '.join(bag.notes))
    return strips.time


def _air(bag: Lookup, time: FloatArray) -> dict[str, FloatArray | None]:
    """Return airspeed, alpha and beta: as published, else from a velocity."""
    velocity_B, over_ground = None, False
    for topic, prefix in (('twist/air', 'twist.'), ('odom', 'twist.twist.')):
        found = bag.column(topic, *(f'{prefix}linear.{axis}' for axis in 'xyz'))
        if velocity_B is None and found is not None:
            velocity_B, over_ground = swap_body_flu(onto(time, found)), topic == 'odom'
    derived: dict[str, FloatArray | None] = {'airspeed': None, 'alpha': None, 'beta': None}
    if velocity_B is not None:
        speed = np.linalg.norm(velocity_B, axis=1)
        derived = {'airspeed': speed, 'alpha': np.arctan2(velocity_B[:, 2], velocity_B[:, 0]),
                   'beta': np.arcsin(velocity_B[:, 1] / np.maximum(speed, 1e-9))}
    published = {key: bag.column(f'air_data/{key}', 'data') for key in derived}
    if over_ground and None in published.values():
        bag.notes.append('airspeed, alpha or beta is that of the velocity over the ground')
    return {key: derived[key] if pair is None else onto(time, pair)
            for key, pair in published.items()}


def _rates(bag: Lookup, time: FloatArray) -> FloatArray | None:
    for topic, prefix in (('odom', 'twist.twist.'), ('twist', 'twist.')):
        found = bag.column(topic, *(f'{prefix}angular.{axis}' for axis in 'xyz'))
        if found is not None:
            return swap_body_flu(onto(time, found))
    return None


def _sink_rate(bag: Lookup, time: FloatArray, position: FloatArray | None,
               attitude: FloatArray | None) -> FloatArray | None:
    velocity = bag.column('odom', *(f'twist.twist.linear.{axis}' for axis in 'xyz'))
    if attitude is not None and velocity is not None:
        return -np.einsum('ij,ij->i', attitude[:, 2], onto(time, velocity))
    if position is not None and len(time) > 2:
        return -np.gradient(position[:, 2], time)
    return None


def _lift(bag: Lookup, time: FloatArray, position: FloatArray | None,
          air: dict[str, FloatArray | None], area: float | None) -> FloatArray | None:
    """Return the lift coefficient (n,)."""
    force = bag.column('wrench', *(f'wrench.force.{axis}' for axis in 'xyz'))
    airspeed, alpha = air['airspeed'], air['alpha']
    if force is None or position is None or airspeed is None or alpha is None or not area:
        return None
    lift = -body_to_stability(swap_body_flu(onto(time, force)), alpha)[:, 2]
    density = _density(bag, time, position[:, 2])
    return lift / np.maximum(0.5 * density * airspeed ** 2 * area, 1e-9)


def _density(bag: Lookup, time: FloatArray, altitude: FloatArray) -> FloatArray:
    """Return the density (n,) [kg/m^3] that the diagnostics tell, else the standard one."""
    def standard(heights: FloatArray) -> FloatArray:
        return np.array([standard_air(height).density for height in heights])

    told = np.array([(at, float(values[DENSITY])) for at, _, _, values in bag.diagnostics()
                     if DENSITY in values])
    if not len(told):
        bag.notes.append('CL in the standard atmosphere: the bag does not say the density')
        return standard(altitude)
    # Told once a second: in between it changes with height as it does in the standard atmosphere.
    at, density = told.T
    ratio = density / standard(np.interp(at, time, altitude))
    return np.interp(time, at, ratio) * standard(altitude)


def _solver(bag: Lookup) -> dict[str, Pair]:
    """Return the numbers of the solver's diagnostics by key."""
    rows: dict[str, list[tuple[float, float]]] = {}
    for time, name, _, values in bag.diagnostics():
        for key, value in values.items() if name.endswith('solver') else ():
            try:
                rows.setdefault(key, []).append((time, float(value)))
            except ValueError:
                pass   # a word, such as the name of the closure
    return {key: tuple(np.array(pairs).T) for key, pairs in rows.items() if pairs}


def _reported(bag: Lookup) -> dict[str, dict[str, str]]:
    result: dict[str, dict[str, str]] = {}
    for _, name, _, values in bag.diagnostics():
        result.setdefault(name, {}).update(values)
    return result


def _shape(aircraft: Aircraft | None, strips: StripData | None) -> list[FloatArray]:
    if aircraft is not None:
        return silhouette.of_aircraft(aircraft)
    if strips is None or strips.span == 0.0:
        return silhouette.generic(3.0, 0.4)
    chord = strips.span / 8.0 if strips.chord is None else strips.chord[strips.wing].mean()
    return silhouette.generic(strips.span, float(chord))


def extremes(flight: FlightData) -> dict[str, float]:
    """Return the flight in a few numbers, those that the bag allows; angles in degrees."""
    result = {'begin_s': float(flight.time[0]), 'end_s': float(flight.time[-1])}
    for key, values in (('alpha', flight.alpha), ('beta', flight.beta), ('pitch', flight.pitch)):
        if values is not None:
            result[f'{key}_min_deg'] = float(np.degrees(values.min()))
            result[f'{key}_max_deg'] = float(np.degrees(values.max()))
    for key, values in (
            ('airspeed_min_m_s', flight.airspeed), ('airspeed_max_m_s', flight.airspeed),
            ('altitude_min_m', None if flight.position is None else flight.position[:, 2]),
            ('sink_rate_max_m_s', flight.sink_rate), ('CL_max', flight.lift),
            ('load_factor_min', flight.load_factor), ('load_factor_max', flight.load_factor),
            ('stalled_wing_share_max', flight.strips and flight.strips.stalled_share)):
        if values is not None:
            result[key] = float(values.min() if '_min' in key else values.max())
    return result
