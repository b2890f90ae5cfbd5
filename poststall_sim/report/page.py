# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Data into one HTML file: the template, our script, the plotting library and the data, all inlined.

Numbers are thinned and rounded to what a screen can show, so that the page stays small.
"""

import html
import json
import math
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from poststall_sim import __version__
from poststall_sim.frames import FloatArray
from poststall_sim.plots import style

Data = dict[str, Any]
Table = tuple[str, list[tuple[str, str]]]
"""A title, and pairs of what and how much."""

MOST_INSTANTS = 2000
"""Of a time history: more than a screen has pixels for."""
_MOST_NUMBERS = 120_000
"""Of what changes with the slider on all strips: half a megabyte for each quantity."""
_FIGURES = 5
_NOTHING = (None, '', [], (), {})
_MOST_EVENTS = 60
_UNITS = {'_deg': 'deg', '_m_s': 'm/s', '_m2': 'm^2', '_m': 'm', '_s': 's', '_kg': 'kg',
          '_kg_m3': 'kg/m^3', '_K': 'K', '_Pa': 'Pa', '_chords': 'chords', '_rad': 'rad',
          '_N': 'N', '_ms': 'ms', '_us': '\u00b5s'}
"""Endings of keys, longest first where one ends another."""

COLOURS = {'attached': style.ATTACHED, 'partly': style.PARTLY_STALLED, 'stalled': style.STALLED,
           'limit': style.LIMIT, 'ink': style.INK, 'faint': style.FAINT,
           'second': style.SECOND, 'third': style.THIRD}
"""What the scripts of pages call the colours of figures."""


def write(data: Data, path: Path) -> None:
    """Write the page of what `flight` or `polar` put together."""
    path.write_text(text(data), encoding='utf-8')


def text(data: Data) -> str:
    """
    Return the page.

    Raises
    ------
    ImportError
        When there is no plotly, with what to do about it.

    """
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise ImportError('reports need plotly: pip install plotly') from error
    files = resources.files(__package__)
    # In a script element only this could end it early.
    shown = json.dumps(data | {'colours': COLOURS}, allow_nan=False,
                       separators=(',', ':')).replace('<', '\\u003c')
    scripts = [(files / name).read_text(encoding='utf-8') for name in ('figures.js', 'page.js')]
    return Template((files / 'page.html').read_text(encoding='utf-8')).substitute(
        title=html.escape(data['title']), subtitle=html.escape(data['subtitle']),
        version=html.escape(__version__), events=_events(data['events']),
        tables=_tables(data['tables']), notes=_notes(data['notes']), data=shown,
        library=get_plotlyjs(), script='\n'.join(scripts))


def numbers(values: Any, figures: int = _FIGURES) -> list:
    """Return an array as lists, rounded to so many figures of the greatest; None for a NaN."""
    values = np.asarray(values, dtype=float)
    good = np.isfinite(values)
    top = float(np.abs(values[good]).max(initial=0.0))
    if top > 0.0:
        values = np.round(values, figures - 1 - math.floor(math.log10(top)))
    return np.where(good, values + 0.0, None).tolist()


def thinned(count: int, most: int) -> np.ndarray:
    """Return the indices of at most so many of count instants, evenly, both ends among them."""
    return np.unique(np.linspace(0, count - 1, min(count, max(most, 2))).round().astype(int))


def frames(time: FloatArray, strips: int) -> np.ndarray:
    """Return the indices of the instants that the slider goes through."""
    return thinned(len(time), min(MOST_INSTANTS, _MOST_NUMBERS // max(strips, 1)))


def line(name: str, values: FloatArray, colour: str, *, command: bool = False) -> Data:
    """Return one line of a panel; that of a command lies broad and pale behind the others."""
    return {'name': name, 'values': numbers(values), 'colour': colour, 'command': command}


def panel(title: str, unit: str, lines: list[Data]) -> Data:
    """Return one panel of the histories."""
    return {'title': title, 'unit': unit, 'lines': lines}


def readout(label: str, unit: str, digits: int, values: FloatArray) -> Data:
    """Return a number that stands beside the slider and follows it."""
    return {'label': label, 'unit': unit, 'digits': digits, 'values': numbers(values)}


def table(title: str, values: Mapping[str, Any]) -> Table:
    """Return settings as a table, what is nested named after both keys, without what is empty."""
    found: list[tuple[str, str]] = []
    for key, value in values.items():
        if isinstance(value, Mapping):
            found += [(f'{_named(key)}, {name}', text) for name, text in table('', value)[1]]
        elif value not in _NOTHING:
            found.append((_named(key), _said(value)))
    return title, found


def tables(title: str, values: Mapping[str, Any]) -> list[Table]:
    """Return settings as tables: what is nested in one of its own."""
    nested = {key: value for key, value in values.items() if isinstance(value, Mapping)}
    plain = {key: value for key, value in values.items() if key not in nested}
    return [table(title, plain), *(table(_named(key[0].upper() + key[1:]), value)
                                   for key, value in nested.items() if value)]


def _named(key: str) -> str:
    """Return a key in words, its unit in brackets."""
    ending = next((each for each in _UNITS if key.endswith(each)), '')
    name = key.removesuffix(ending).replace('_', ' ')
    return f'{name} [{_UNITS[ending]}]' if ending else name


def _said(value: Any) -> str:
    if isinstance(value, bool):
        return 'yes' if value else 'no'
    if isinstance(value, float):
        return f'{value + 0.0:.6g}'
    if isinstance(value, (list, tuple)):
        return ', '.join(_said(each) for each in value)
    return str(value)


def _events(events: list[Data]) -> str:
    """Return the items of the list of events, which the script makes jump."""
    said = [f'<li><button type="button" data-frame="{event["frame"]}" class="{event["kind"]}">'
            f'<b>{html.escape(event["at"])}</b> {html.escape(event["text"])}</button></li>'
            for event in events[:_MOST_EVENTS]]
    if len(events) > _MOST_EVENTS:
        said.append(f'<li>and {len(events) - _MOST_EVENTS} more</li>')
    return '\n'.join(said) or '<li>none</li>'


def _tables(tables: list[Table]) -> str:
    return '\n'.join(
        f'<table><caption>{html.escape(title)}</caption><tbody>' + ''.join(
            f'<tr><th scope="row">{html.escape(key)}</th><td>{html.escape(value)}</td></tr>'
            for key, value in found) + '</tbody></table>'
        for title, found in tables if found)


def _notes(notes: list[str]) -> str:
    return '\n'.join(f'<li>{html.escape(note)}</li>' for note in notes)
