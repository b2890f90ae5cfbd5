# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Modes of flight: eigenvalues with the motion of the body that goes with them, named and followed.

A vector holds (u, v, w, p, q, r, phi, theta, psi): changes of velocity [m/s] and rates [rad/s] in
body axes B, and of the Euler angles roll, pitch, yaw [rad]. Its shape is the same without units,

    (u, v, w)/V,  p b/2V,  q c/2V,  r b/2V,  phi, theta, psi,

of length one. Heading psi is left out of lengths and shares: nothing depends on it, and in
a slow spiral, where it is the integral of the yaw rate, it would hide everything else.

Names tell where a mode comes from; whether it grows is a matter of its eigenvalue. Where a pair
has split into two real modes, they keep its name, `fast` and `slow` by their eigenvalues:

* `short period`; split, a growing one is known as pitch divergence;
* `phugoid`; split, a growing one is known as speed divergence;
* `Dutch roll`; split, a growing one is known as directional divergence;
* `roll` and `spiral`; merged into an oscillation, the `lateral phugoid`;
* `coupled ...`: more than a tenth of it is motion of the other kind, longitudinal or lateral;
* `other 1`, `other 2`, ...: what is left over, such as modes of the wake.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from poststall_sim.frames import FloatArray

ComplexArray = NDArray[np.complex128]

LONGITUDINAL = (0, 2, 4, 7)
"""Where u, w, q, theta stand in a vector."""
LATERAL = (1, 3, 5, 6)
"""Where v, p, r, phi stand in a vector."""
HEADING = 8
"""Where psi stands in a vector."""

REAL = 1e-9
"""An eigenvalue is real if its imaginary part is a smaller share of it: round-off."""
NEUTRAL = 1e-5
"""The eigenvalue of the heading is below this, times V/b: a spiral that slow is not seen."""
ONLY_HEADING = 1e-3
"""The shape of the heading's mode has less than this of anything but the heading."""
Slot = tuple[complex, ComplexArray]
"""An eigenvalue and its shape (8,), without the heading."""
COUPLED = 0.1
"""Least share of the other kind of motion in a coupled mode."""
EIGENVALUES = 4
"""Of a rigid body in longitudinal motion; and in lateral motion, the heading apart."""

_COUPLED = 'coupled '
CLASSICAL = ('short period', 'phugoid', 'Dutch roll', 'roll', 'spiral', 'lateral phugoid')
"""Names of modes that are neither split nor coupled, in order."""


@dataclass(frozen=True, slots=True, eq=False)
class Mode:
    """
    A way in which small disturbances of a trimmed flight go together, as exp(eigenvalue t).

    eigenvalue [1/s], of a pair the one with imag > 0; vector (9,) complex in B, see the module,
    the largest of its shape real and positive; shape (9,) complex, the vector without units.
    """

    name: str
    eigenvalue: complex
    vector: ComplexArray
    shape: ComplexArray

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for key in ('vector', 'shape'):
            array = np.array(getattr(self, key), dtype=complex)
            array.setflags(write=False)
            object.__setattr__(self, key, array)

    @property
    def participation(self) -> FloatArray:
        """Share (9,) of each state in the squared length of the shape, 0 for the heading."""
        energy = np.abs(self.shape) ** 2
        energy[HEADING] = 0.0
        return energy / max(energy.sum(), np.finfo(float).tiny)

    @property
    def oscillates(self) -> bool:
        """Tell whether the mode stands for a pair of eigenvalues."""
        return self.eigenvalue.imag > 0.0

    @property
    def stable(self) -> bool:
        """Tell whether the mode dies out."""
        return self.eigenvalue.real < 0.0

    @property
    def natural_frequency(self) -> float:
        """|eigenvalue| [rad/s], of a real mode the inverse of its time constant."""
        return abs(self.eigenvalue)

    @property
    def damping_ratio(self) -> float:
        """Share of critical damping [-], +-1 for a real mode, NaN for one that stands still."""
        size = abs(self.eigenvalue)
        return -self.eigenvalue.real / size if size > 0.0 else math.nan

    @property
    def time_to_half_or_double(self) -> float:
        """Time in which it halves if stable, else doubles [s]; infinite if it does neither."""
        rate = abs(self.eigenvalue.real)
        return math.log(2.0) / rate if rate > 0.0 else math.inf

    @property
    def period(self) -> float:
        """Of the oscillation [s], infinite for a real mode."""
        return 2.0 * math.pi / self.eigenvalue.imag if self.oscillates else math.inf


def classify(eigenvalues: ComplexArray, vectors: ComplexArray, *, airspeed: float, span: float,
             chord: float, participation: FloatArray | None = None) -> tuple[Mode, ...]:
    """
    Return the modes of a trimmed flight by name, the classical ones first.

    Of each pair one is kept, and the heading is dropped. Modes are longitudinal or lateral by the
    larger share of their shape; each kind takes four eigenvalues, in the order of `participation`
    and then of how clearly they belong to it. Then:

    * longitudinal: the fastest eigenvalue and its partner are the short period, the other two the
      phugoid; a real eigenvalue's partner is the next fastest real one;
    * lateral: of two pairs the faster is the Dutch roll; otherwise the Dutch roll has the most
      sideslip for its bank (v against V phi), as a pair or as two real ones. What remains is roll
      and spiral, the roll faster, or the lateral phugoid.

    With fewer eigenvalues, as of a wing that is free to roll only, a single pair is the phugoid if
    it changes the airspeed more than the angle of attack, otherwise the short period, or the Dutch
    roll; one or two real ones are roll and spiral.

    Parameters
    ----------
    eigenvalues : (k,) complex array
        In continuous time [1/s].
    vectors : (9, k) complex array
        Rigid-body part of their eigenvectors, see the module; of any length and phase.
    airspeed, span, chord : float
        V [m/s], b and c [m] of the shapes.
    participation : (k,) array, optional
        Share of the rigid body in each whole eigenvector, 0 to 1; 1 if left out. What a wake adds
        to the eigenvalues has little of it.

    Returns
    -------
    tuple of Mode
        In the order of the module's list of names.

    Raises
    ------
    ValueError
        If the arrays do not fit each other.

    """
    eigenvalues = np.asarray(eigenvalues, dtype=complex)
    vectors = np.asarray(vectors, dtype=complex)
    rigid = np.ones(eigenvalues.shape) if participation is None else np.asarray(participation)
    k = eigenvalues.size
    if eigenvalues.shape != (k,) or vectors.shape != (9, k) or rigid.shape != (k,):
        raise ValueError(f'eigenvalues and participation must be (k,) and vectors (9, k), got '
                         f'{eigenvalues.shape}, {rigid.shape} and {vectors.shape}')
    found = [(float(rigid[i]), _mode(eigenvalues[i], vectors[:, i], airspeed, span, chord))
             for i in range(k) if eigenvalues[i].imag >= -REAL * abs(eigenvalues[i])]
    found = _without_heading(found, NEUTRAL * airspeed / span)
    longitudinal, lateral, rest = _shared_out(found)
    named = [*_named_longitudinal(longitudinal), *_named_lateral(lateral)]
    named = sorted((replace(mode, name=_marked(name, mode)) for name, mode in named),
                   key=lambda mode: (CLASSICAL.index(plain(mode.name)), mode.name))
    return (*named, *(replace(mode, name=f'other {i}') for i, mode in enumerate(rest, 1)))


def _mode(eigenvalue: complex, vector: ComplexArray, airspeed: float, span: float,
          chord: float) -> Mode:
    """Return a mode without a name, its vector brought to length and phase."""
    units = np.ones(9)
    units[:3] = airspeed
    units[3:6] = 2.0 * airspeed / np.array([span, chord, span])
    shape = vector / units
    length = np.linalg.norm(shape[:HEADING])
    if length <= ONLY_HEADING * abs(shape[HEADING]):
        length = np.linalg.norm(shape)
    if length > 0.0:
        shape = shape / length
        size = np.abs(shape[:HEADING])
        # The first of equals, so that round-off does not choose the phase.
        largest = int(np.argmax(size >= (1.0 - 1e-6) * size.max()))
        if size[largest] > 0.0:
            shape = shape * (size[largest] / shape[largest])
    if abs(eigenvalue.imag) <= REAL * abs(eigenvalue):
        eigenvalue = complex(eigenvalue.real, 0.0)
    return Mode('', complex(eigenvalue), shape * units, shape)


def _without_heading(found: list[tuple[float, Mode]], slow: float) -> list[tuple[float, Mode]]:
    """Return the modes without the one of the heading, which is all heading and slow [1/s]."""
    heading = [(float(np.linalg.norm(mode.shape[:HEADING])), i)
               for i, (_, mode) in enumerate(found)
               if abs(mode.eigenvalue) <= slow and mode.shape[HEADING] != 0.0
               and np.linalg.norm(mode.shape[:HEADING]) <= ONLY_HEADING]
    dropped = min(heading)[1] if heading else None
    return [each for i, each in enumerate(found) if i != dropped]


def _longitudinal_share(mode: Mode) -> float:
    return float(mode.participation[list(LONGITUDINAL)].sum())


def _count(mode: Mode) -> int:
    return 2 if mode.oscillates else 1


def _shared_out(found: list[tuple[float, Mode]]) -> tuple[list[Mode], list[Mode], list[Mode]]:
    """Return longitudinal modes, lateral modes, and what is left over, fastest first."""
    def rank(each: tuple[float, Mode]) -> tuple[float, ...]:
        rigid, mode = each
        # Rounded, so that round-off does not decide between equals.
        clear = abs(_longitudinal_share(mode) - 0.5)
        value = mode.eigenvalue
        return (-round(rigid, 6), -round(clear, 6), abs(value), value.real, value.imag)

    kinds: tuple[list[Mode], list[Mode]] = ([], [])
    rest: list[Mode] = []
    for _, mode in sorted(found, key=rank):
        share = _longitudinal_share(mode)
        wanted = [0, 1] if share >= 0.5 else [1, 0]
        if min(share, 1.0 - share) < COUPLED:
            wanted = wanted[:1]
        room = [kind for kind in wanted
                if sum(map(_count, kinds[kind])) + _count(mode) <= EIGENVALUES]
        (kinds[room[0]] if room else rest).append(mode)
    for kind in kinds:
        kind.sort(key=lambda mode: -abs(mode.eigenvalue))
    return *kinds, rest


def _named_longitudinal(modes: list[Mode]) -> Iterator[tuple[str, Mode]]:
    """Yield names and modes of up to four eigenvalues, given fastest first."""
    if len(modes) == 1 and modes[0].oscillates:
        u, w = modes[0].participation[[0, 2]]
        yield ('phugoid' if u > w else 'short period'), modes[0]
        return
    for name in ('short period', 'phugoid'):
        if modes and modes[0].oscillates:
            yield name, modes[0]
            modes = modes[1:]
        else:
            halves = [mode for mode in modes if not mode.oscillates][:2]
            yield from zip(_split(name), halves)
            modes = [mode for mode in modes if mode not in halves]


def _named_lateral(modes: list[Mode]) -> Iterator[tuple[str, Mode]]:
    """Yield names and modes of up to four eigenvalues, given fastest first."""
    pairs = [mode for mode in modes if mode.oscillates]
    reals = [mode for mode in modes if not mode.oscillates]
    slips = sorted(reals, key=_sideslip)[-2:]
    if len(reals) > 2 or (len(reals) == 2 and pairs and
                          np.mean([_sideslip(mode) for mode in slips]) > _sideslip(pairs[0])):
        yield from zip(_split('Dutch roll'), [mode for mode in reals if mode in slips])
        yield from zip(('lateral phugoid',), pairs)
        reals = [mode for mode in reals if mode not in slips]
    else:
        yield from zip(('Dutch roll', 'lateral phugoid'), pairs)
    yield from zip(('roll', 'spiral'), reals)


def _sideslip(mode: Mode) -> float:
    """Return |v|/V over the sum of |v|/V and |phi|."""
    slip, bank = abs(mode.shape[1]), abs(mode.shape[6])
    return float(slip / max(slip + bank, np.finfo(float).tiny))


def _marked(name: str, mode: Mode) -> str:
    """Return the name, with a mark if the mode is coupled."""
    share = _longitudinal_share(mode)
    return _COUPLED + name if COUPLED < share < 1.0 - COUPLED else name


def plain(name: str) -> str:
    """Return a name without what says that a mode is coupled or half of a pair."""
    return name.removeprefix(_COUPLED).removesuffix(', fast').removesuffix(', slow')


def _split(name: str) -> tuple[str, str]:
    """Return what the faster and the slower of two real modes are called where a pair splits."""
    if name == 'lateral phugoid':
        return 'roll', 'spiral'
    if ' + ' in name:
        fast, slow = name.split(' + ', 1)
        return fast, slow
    return f'{name}, fast', f'{name}, slow'


def _merged(fast: str, slow: str) -> str:
    """Return what the oscillation is called that two real modes merge into."""
    for name in (*CLASSICAL, fast.rsplit(',', 1)[0]):
        if {fast, slow} == set(_split(name)):
            return name
    return f'{fast} + {slow}'


def track(previous: Sequence[Mode], current: Sequence[Mode]) -> list[Mode]:
    """
    Return the modes of one trim under the names that they have as branches from the one before.

    Eigenvalues are matched one to one so that over all of them the sum is least of

        1 - |a^H b|^2 / (|a|^2 |b|^2)  +  |lambda_a - lambda_b| / (|lambda_a| + |lambda_b|),

    the shapes' correlation (modal assurance criterion, without the heading) and the eigenvalues'
    distance. A mode keeps the name of the branch it continues. Where a pair splits, its two real
    modes are `fast` and `slow` of its name; where two real modes merge that were one, or roll
    and spiral, the pair has its name again; any other two give theirs both, `A + B`, as the third
    oscillation of an aircraft without static stability, `short period, slow + phugoid, fast`.
    Whether a mode is coupled is said anew.

    Parameters
    ----------
    previous : sequence of Mode
        From `classify`, or from `track`, at the trim before.
    current : sequence of Mode
        From `classify` at this one.

    Returns
    -------
    list of Mode
        All of `current`, in the order of `previous`; modes that continue none come last, as
        `classify` named them or, where that name is taken, as `other`.

    References
    ----------
    R. J. Allemang, The Modal Assurance Criterion, Sound and Vibration 37(8), 2003.

    """
    before = [(i, *slot) for i, mode in enumerate(previous) for slot in slots(mode)]
    now = [(i, *slot) for i, mode in enumerate(current) for slot in slots(mode)]
    cost = np.array([[unlike(a[1:], b[1:]) for b in now]
                     for a in before]).reshape(len(before), len(now))
    origins: list[list[int]] = [[] for _ in current]
    for a, b in zip(*linear_sum_assignment(cost)):
        origins[now[b][0]].append(before[a][0])
    successors: list[list[int]] = [[] for _ in previous]
    for i in sorted(range(len(current)), key=lambda i: -abs(current[i].eigenvalue)):
        for origin in dict.fromkeys(origins[i]):
            successors[origin].append(i)

    def branch(origin: int, i: int) -> str:
        name = previous[origin].name.removeprefix(_COUPLED)
        if not previous[origin].oscillates or successors[origin] == [i]:
            return name
        return _split(name)[successors[origin].index(i)]

    names = {}
    for i, mode in enumerate(current):
        roots = sorted(set(origins[i]), key=lambda a: -abs(previous[a].eigenvalue))
        if roots:
            names[i] = _continued([branch(origin, i) for origin in roots], mode)
    ordered = sorted(names, key=lambda i: min(origins[i]))
    result = [replace(current[i], name=names[i]) for i in ordered]
    for mode in (current[i] for i in range(len(current)) if i not in names):
        taken = [each.name for each in result]
        names_to_try = itertools.chain([mode.name], (f'other {n}' for n in itertools.count(1)))
        result.append(replace(mode, name=next(
            name for name in names_to_try if name not in taken)))
    return result


def slots(mode: Mode) -> Iterator[Slot]:
    """Yield the eigenvalues of a mode, one or a pair, each with its shape."""
    yield mode.eigenvalue, mode.shape[:HEADING]
    if mode.oscillates:
        yield mode.eigenvalue.conjugate(), mode.shape[:HEADING].conj()


def unlike(a: Slot, b: Slot) -> float:
    """Return how far apart two eigenvalues and their shapes are, 0 to 2, see `track`."""
    tiny = np.finfo(float).tiny
    correlation = abs(np.vdot(a[1], b[1])) ** 2 / max(
        float(np.vdot(a[1], a[1]).real * np.vdot(b[1], b[1]).real), tiny)
    return 1.0 - correlation + abs(a[0] - b[0]) / max(abs(a[0]) + abs(b[0]), tiny)


def _continued(branches: list[str], mode: Mode) -> str:
    """Return the name of a mode that continues one branch, or two merged, the faster first."""
    name = branches[0] if len(branches) == 1 else _merged(*branches)
    return name if name.startswith('other') else _marked(name, mode)
