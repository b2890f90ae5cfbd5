# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Files into records: aircraft and scenarios in YAML, section curves in CSV.

The only reader of definitions (with reader.py below it), and the only place besides the command
line and the plots where degrees exist: keys that end in ``_deg`` become radians here.
"""

import enum
import math
import os
import stat
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from poststall_sim import (
    air_reader,
    airfoil_reader,
    avl_reader,
    body_reader,
    control_reader,
    engine_reader,
    failure_reader,
)
from poststall_sim.aircraft import (
    Aircraft,
    Airfoil,
    ConfigError,
    MassProperties,
    Reference,
    Section,
    Surface,
)
from poststall_sim.airfoil_reader import airfoil
from poststall_sim.reader import (
    Reader,
    listed,
    open_yaml,
    shown,
    suggestion,
)
from poststall_sim.scenario import Channel, Scenario

_SPACINGS = {'uniform': False, 'cosine': True}


class Kind(enum.Enum):
    """What a file defines; the value is the name of its folder in config."""

    AIRCRAFT = 'aircraft'
    AIRFOIL = 'airfoils'
    SCENARIO = 'scenarios'
    CAMPAIGN = 'campaigns'

    @property
    def suffix(self) -> str:
        """The ending of such files."""
        return '.csv' if self is Kind.AIRFOIL else '.yaml'


def folders(kind: Kind | str) -> list[Path]:
    """
    Return where files of a kind may have been installed, whether the folders exist or not.

    In this order: the source tree (also of an editable install), the prefix this package is
    installed under (which is not sys.prefix for pip's --user or Debian's /usr/local), sys.prefix,
    and the share folder of the ament index, which only a ROS workspace has.
    """
    tree = Path(__file__).resolve().parents[1]
    roots = [tree]
    if tree.name in ('site-packages', 'dist-packages'):
        roots = [tree.parent.parent.parent / 'share' / 'poststall_sim']
    roots.append(Path(sys.prefix) / 'share' / 'poststall_sim')
    try:
        from ament_index_python.packages import get_package_share_directory
        roots.append(Path(get_package_share_directory('poststall_sim')))
    except (ImportError, LookupError, OSError):
        pass   # not a ROS environment, or a workspace without us
    return list(dict.fromkeys(root / 'config' / Kind(kind).value for root in roots))


def names(kind: Kind | str) -> list[str]:
    """Return the names, without suffix, that `find` knows for a kind."""
    found = set()
    for folder in folders(kind):
        try:
            found |= {path.stem for path in folder.iterdir() if path.suffix == Kind(kind).suffix}
        except OSError:
            pass   # most of the folders do not exist on any one machine
    return sorted(found)


def find(kind: Kind | str, name: str | os.PathLike[str], beside: Path | None = None) -> Path:
    """
    Return the file that a name or a path means.

    A path is tried first, from ``beside`` (else from the working directory), then the name in
    each of `folders`; everywhere as it stands and with the kind's suffix added.
    """
    kind = Kind(kind)
    given = os.path.expanduser(os.fspath(name))
    endings = ('',) if given.endswith(kind.suffix) else ('', kind.suffix)
    places = [beside or Path(), *folders(kind)]
    for place in places:
        for ending in endings:
            path = place / (given + ending)
            try:
                if stat.S_ISREG(path.stat().st_mode):
                    return path
            except (OSError, ValueError):
                pass   # not there, not allowed to look, or not a name that can exist
    if given and os.path.isdir(places[0] / given):
        raise ConfigError(f'{shown(given)} is a folder, expected a {kind.suffix} file')
    known = names(kind)
    try:
        looked = ', '.join(str(place.absolute()) for place in places)
    except OSError:   # the working directory was deleted
        looked = ', '.join(map(str, places))
    raise ConfigError(
        f'found no file {shown(given)} in {kind.value}; available: {listed(known)}; '
        f'looked in {looked}{suggestion(Path(given).stem, known)}')


def aircraft(path: str | os.PathLike[str]) -> Aircraft:
    """
    Read an aircraft from a YAML file; its section curves from the CSV files it names.

    A file that ends in .avl is one of AVL; its masses are in the .mass file beside it, if any.
    """
    if is_avl(path):
        return avl_reader.aircraft(path)
    return aircraft_in(open_yaml(path), Path(path).parent)


def is_avl(path: str | os.PathLike[str]) -> bool:
    """Tell whether a file is one of AVL, by its name."""
    return Path(path).suffix.lower() == '.avl'


def aircraft_in(read: Reader, folder: Path) -> Aircraft:
    """Read an aircraft from a mapping whose files are named from a folder."""
    read.text('description', default='', free=True)
    name = read.text('name')
    files = read.mapping('airfoils')
    airfoils = tuple(table for key in files.names()
                     for table in _airfoil(files, key, folder))
    surfaces: tuple[Surface, ...] = ()
    items = read.mappings('surfaces')
    if not items:
        raise read.where.key('surfaces').error('must be a list of at least one surface, got []')
    for item in items:
        surface = _surface(item, {key: key for key in files.names()})
        if surface.name in [other.name for other in surfaces]:
            raise item.where.key('name').error(
                f'must be a name of its own, got {surface.name} for the second time')
        surfaces += (surface,)
    controls = read.mapping('controls', default={})
    return read.build(
        Aircraft, name=name, airfoils=airfoils, surfaces=surfaces,
        reference=_reference(read.mapping('reference')),
        mass=_mass_properties(read.mapping('mass')),
        controls=tuple(control_reader.control(controls.mapping(key), key, surfaces)
                       for key in controls.names()),
        engines=tuple(engine_reader.engine(item, airfoils)
                      for item in read.mappings('engines', default=[])),
        bodies=tuple(body_reader.body(item) for item in read.mappings('bodies', default=[])))


def scenario(path: str | os.PathLike[str]) -> Scenario:
    """Read a scenario from a YAML file."""
    return scenario_in(open_yaml(path))


def scenario_in(read: Reader) -> Scenario:
    """Read a scenario from a mapping."""
    read.text('description', default='', free=True)
    name, duration = read.text('name'), read.number('duration_s', above=0, at_most=86400)
    initial = read.mapping('initial')
    airspeed = initial.number('airspeed_m_s', above=0)
    altitude = initial.number('altitude_m', above=0)
    initial.done()
    channels = read.mapping('channels', default={})
    atmosphere, weather = air_reader.air(read.mapping('air', default={}), altitude)
    return read.build(
        Scenario, name=name, duration=duration, airspeed=airspeed, altitude=altitude,
        atmosphere=atmosphere, weather=weather,
        channels=tuple(_channel(channels.mapping(key), key) for key in channels.names()),
        faults=tuple(failure_reader.fault(item) for item in read.mappings('failures', default=[])))


def _airfoil(read: Reader, key: str, folder: Path) -> list[Airfoil]:
    tables = []
    for name, where, reynolds, deflection in airfoil_reader.named(read, key):
        try:
            path = find(Kind.AIRFOIL, name, beside=folder)
        except ConfigError as error:
            raise where.error(f'must be a file with curves, but {error}') from None
        tables.append(airfoil(path, key, reynolds, deflection))
    return tables


def _surface(read: Reader, airfoils: Mapping[str, str]) -> Surface:
    name = read.name('name')
    incidence = read.number('incidence_deg', default=0.0, within=(-45, 45))
    return read.build(
        Surface, name=name, edges=read.numbers('strip_edges', default=[]),
        points=read.numbers('strip_points', default=[]),
        flat=read.boolean('flat', default=False), strips=read.count('strips', at_most=1000),
        symmetric=read.boolean('symmetric'),
        spacing_cosine=read.choice('spacing', _SPACINGS, default='uniform'),
        sections=tuple(_section(item, airfoils, incidence) for item in read.mappings('sections')))


def _section(read: Reader, airfoils: Mapping[str, str], incidence: float) -> Section:
    twist = read.number('twist_deg', default=0.0, within=(-45, 45))
    return read.build(
        Section, leading_edge_G=read.vector('leading_edge_m', 3),
        chord=read.number('chord_m', above=0), airfoil=read.choice('airfoil', airfoils),
        twist=math.radians(twist + incidence))


def _reference(read: Reader) -> Reference:
    return read.build(Reference, area=read.number('area_m2', above=0),
                      chord=read.number('chord_m', above=0),
                      span=read.number('span_m', above=0))


def _mass_properties(read: Reader) -> MassProperties:
    inertia = read.mapping('inertia_kgm2')
    xx, yy, zz = (inertia.number(key, above=0) for key in ('xx', 'yy', 'zz'))
    xy, yz, xz = (inertia.number(key, default=0.0) for key in ('xy', 'yz', 'xz'))
    inertia.done()
    return read.build(   # products are integrals, xz = integral of x z dm: minus in the tensor
        MassProperties, mass=read.number('mass_kg', above=0), cg_G=read.vector('cg_m', 3),
        inertia_B=np.array([[xx, -xy, -xz], [-xy, yy, -yz], [-xz, -yz, zz]]))


def _channel(read: Reader, name: str) -> Channel:
    relative = read.boolean('relative')
    if name == 'throttle':
        key, within, scale = 'points', (-1 if relative else 0, 1), 1.0
    else:
        key, within, scale = 'points_deg', (-90, 90), math.radians(1.0)
    points = read.points(key, within=within)
    return read.build(Channel, control=name, relative=relative,
                      points=tuple((time, value * scale) for time, value in points))
