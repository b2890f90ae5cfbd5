# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""From the parameters of the simulator to the flight that it begins with."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from poststall_sim import definition, simulation
from poststall_sim.aero.decambering import AngleForm, Closure
from poststall_sim.aero.model import Settings
from poststall_sim.aero.schemes import Scheme, Start
from poststall_sim.aero.separation import Separation
from poststall_sim.aero.wake import Shape
from poststall_sim.aero.wash import Precision
from poststall_sim.aircraft import ConfigError
from poststall_sim.fields import FRD, NED
from poststall_sim.frames import quaternion_from_euler
from poststall_sim.ros import engine_failures, surfaces
from poststall_sim.ros.air_settings import AirSettings
from poststall_sim.ros.parameters import SimulatorSettings


def aero_settings(settings: SimulatorSettings) -> Settings:
    """Return how the aerodynamics are computed; `ConfigError` for what does not go together."""
    attached = settings.decambering_start == 'attached'
    if attached and settings.decambering_closure != 'local':
        raise ConfigError('parameter decambering.start: attached is for decambering.closure '
                          'local: the non-local one has one solution, wherever a search begins')
    return Settings(
        chordwise=settings.uvlm_chordwise,
        wake_length=settings.uvlm_wake_length or None, core=settings.uvlm_core,
        wake=Shape(settings.uvlm_wake),
        free_rows=settings.uvlm_free_rows, free_every=settings.uvlm_free_every,
        precision=Precision(settings.uvlm_precision), coarsen=settings.uvlm_coarsen,
        interpolate=settings.uvlm_interpolate, ground=settings.ground_effect,
        closure=Closure[settings.decambering_closure.upper()],
        angle_form=AngleForm(settings.decambering_angle_form),
        start=Start.ZERO if attached else Start.GIVEN,
        ell=settings.decambering_ell, scheme=Scheme(settings.decambering_scheme),
        damping=settings.decambering_relaxation, tolerance=settings.decambering_tolerance,
        limit=settings.decambering_max_iterations,
        separation=Separation(settings.separation), lag=settings.separation_lag,
        relaxation=settings.separation_relaxation, delay=settings.separation_delay,
        decambering=settings.decambering_enabled)


def require_frames(settings: SimulatorSettings) -> None:
    """Raise `ConfigError` for frames that are not four, those of aviation among them."""
    fixed, body = settings.frames_map, settings.base_frame
    for name in (fixed, body):
        if name.startswith('/') or any(letter.isspace() for letter in name):
            raise ConfigError('parameters frames.*: a frame has no slash at its beginning and no '
                              f'space, got {name!r}')
    frames = fixed, body, fixed + NED, body + FRD
    if len(set(frames)) < len(frames):
        raise ConfigError('parameters frames.*: map and body must be two frames, and two more '
                          f'with _ned and _frd added, got {", ".join(frames)}')


def flight_path(settings: SimulatorSettings) -> Path:
    """Return the path of the flight file; raise `ConfigError` where there can be none."""
    path = Path(settings.flight_file)
    if path.suffix != '.npz':
        raise ConfigError(f'flight_file is {settings.flight_file!r}: set it to the path of a '
                          '.npz file')
    return path


def flight_from_settings(settings: SimulatorSettings, air: AirSettings,
                         progress) -> simulation.Flight:
    """Read the aircraft, build its model and trim it; ``progress`` hears what is being done."""
    require_frames(settings)
    if settings.flight_file:
        flight_path(settings)
    path = definition.find(definition.Kind.AIRCRAFT, settings.aircraft)
    progress(f'aircraft {path}')
    aircraft = surfaces.with_controls(definition.aircraft(path), settings)
    for assumption in aircraft.assumptions:
        progress(f'assumed: {assumption}')
    failed = surfaces.failed(aircraft, settings)
    if settings.uvlm_spanwise:
        aircraft = replace(aircraft, surfaces=tuple(
            surface.cut(settings.uvlm_spanwise) for surface in aircraft.surfaces))
    east, north, up = settings.initial_position
    if up < 0.0:
        raise ConfigError(
            f'parameter initial.position: up must not be below the ground, got {up:g} m')
    roll, pitch, heading = np.radians(settings.initial_euler)
    if settings.initial_trim and (roll or pitch):
        raise ConfigError('parameter initial.euler_deg: roll and pitch are those of trim, set '
                          f'initial.trim to false for others; got {settings.initial_euler}')
    flight = simulation.start(
        aircraft, aero_settings(settings), airspeed=settings.initial_airspeed,
        altitude=settings.start_altitude, north_east=(north, east), heading=heading,
        attitude=None if settings.initial_trim else quaternion_from_euler(roll, pitch, heading),
        atmosphere=air.atmosphere, weather=air.weather(settings.start_altitude),
        dt=settings.dt or None,
        failed=engine_failures.failed(aircraft, settings.engine_failures),
        progress=progress)
    if failed:
        flight.failures = failed
        flight.reset(time_ns=0)
    return flight
