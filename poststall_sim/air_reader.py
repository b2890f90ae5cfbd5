# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""The air out of the mapping ``air`` of a scenario: atmosphere, wind, gusts and turbulence."""

import math

import numpy as np

from poststall_sim.atmosphere import SEA_LEVEL_DENSITY, SEA_LEVEL_PRESSURE, Atmosphere
from poststall_sim.frames import FloatArray, swap_ned_enu
from poststall_sim.reader import Reader
from poststall_sim.turbulence import Severity, Spectrum, Turbulence, intensity, military
from poststall_sim.weather import (
    REFERENCE_HEIGHT,
    Gust,
    GustShape,
    Shear,
    ShearLaw,
    Weather,
)

SPECTRA = {each.value: each for each in Spectrum}
SEVERITIES = {each.name.lower(): each for each in Severity}
SHAPES = {each.value: each for each in GustShape}
_LAWS = {each.value: each for each in ShearLaw}


def air(read: Reader, altitude: float) -> tuple[Atmosphere, Weather]:
    """Read the air of a flight that begins at an altitude [m]."""
    given = read.names()
    # All keys are asked for, so that a wrong one is told of the nearest.
    density = read.number('density_kg_m3', default=SEA_LEVEL_DENSITY)
    shear, rough = (read.mapping(key, default={}) for key in ('shear', 'turbulence'))
    atmosphere = read.where.build(
        Atmosphere, temperature_offset=read.number('temperature_offset_K', default=0.0),
        sea_level_pressure=read.number('sea_level_pressure_Pa', default=SEA_LEVEL_PRESSURE),
        density=density if 'density_kg_m3' in given else None)
    weather = read.build(
        Weather, wind_N=_velocity(read, 'wind_enu_m_s', [0.0, 0.0, 0.0]),
        gusts=tuple(_gust(each) for each in read.mappings('gusts', default=[])),
        shear=_shear(shear) if 'shear' in given else None,
        turbulence=_turbulence(rough, altitude) if 'turbulence' in given else None)
    return atmosphere, weather


def _velocity(read: Reader, key: str, *default: list[float]) -> FloatArray:
    given = {'default': default[0]} if default else {}
    return swap_ned_enu(np.array(read.vector(key, 3, within=(-100, 100), **given)))


def _shear(read: Reader) -> Shear:
    law = read.choice('law', _LAWS)
    constant = read.number('exponent') if law is ShearLaw.POWER else read.number('roughness_m')
    return read.build(Shear, law=law, constant=constant, reference_height=read.number(
        'reference_height_m', default=REFERENCE_HEIGHT))


def _gust(read: Reader) -> Gust:
    heading = math.radians(read.number('heading_deg', default=0.0, within=(-360, 360)))
    return read.build(
        Gust, velocity_N=_velocity(read, 'velocity_enu_m_s'), length=read.number('length_m'),
        begin=read.number('begin_m'), speed=read.number('speed_m_s', default=0.0),
        direction_N=np.array([math.cos(heading), math.sin(heading), 0.0]),
        shape=read.choice('shape', SHAPES, default=GustShape.ONE_MINUS_COSINE.value))


def _turbulence(read: Reader, altitude: float) -> Turbulence:
    """Read a turbulence of the specification, or one whose scale is given."""
    given = read.names()
    spectrum = read.choice('spectrum', SPECTRA, default=Spectrum.DRYDEN.value)
    seed = whole_seed(read)
    if ('level' in given) == ('sigma_m_s' in given):
        raise read.where.error('expected either level or sigma_m_s, got '
                               + ('both' if 'level' in given else 'neither'))
    if 'level' in given:
        vertical = intensity(read.choice('level', SEVERITIES), altitude)
    else:
        vertical = read.number('sigma_m_s')
    if 'scale_m' in given:
        scale = read.number('scale_m')
        return read.build(Turbulence, spectrum=spectrum, horizontal=vertical, vertical=vertical,
                          horizontal_scale=scale, vertical_scale=scale, seed=seed)
    return read.build(lambda: military(spectrum, vertical, altitude=altitude, seed=seed))


def whole_seed(read: Reader) -> int:
    """Read what random numbers begin with, 0 where nothing is said."""
    seed = read.number('seed', default=0, within=(0, 2 ** 53))
    if seed != int(seed):
        raise read.where.key('seed').error(f'must be a whole number, got {seed!r}')
    return int(seed)
