# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
Closed-form solutions that the product is held to.

Nothing here is imported by the product, and nothing here imports it: numpy and scipy only.
Each function states its source, and test_exact.py tests each one against limits, identities
and an independent numerical integration, so that a failing test of the product can be trusted.

Units are SI and radians. Reduced quantities use the semichord b = c/2:

    s = V t/b = 2 V t/c    distance travelled [semichords]
    k = omega b/V          reduced frequency [-];  motion proportional to exp(i k s)

Plates have unit slope in lift: where a function says "share", it is Cl divided by 2 pi times
the incidence (or the plunge velocity over V), so that the steady value is 1.
"""

import itertools
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy import special

FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]


def theodorsen(k: npt.ArrayLike) -> ComplexArray:
    """
    Return Theodorsen's function, the circulatory lift in oscillation over its steady value.

        C(k) = H1(k)/(H1(k) + i H0(k)),    Hn = Hankel functions of the second kind

    Parameters
    ----------
    k : (...,) array
        Reduced frequency omega c/(2 V) [-], k >= 0.

    Returns
    -------
    (...,) complex array
        Share [-], from 1 at k = 0 towards 1/2; the imaginary part is negative (a lag).

    References
    ----------
    T. Theodorsen, NACA TR 496, 1935.

    """
    k = np.asarray(k, dtype=float)
    moving = np.where(k == 0.0, 1.0, k)
    # Both Hankel functions carry the same exponential, which cancels.
    h0, h1 = special.hankel2e(0, moving), special.hankel2e(1, moving)
    return np.where(k == 0.0, 1.0, h1 / (h1 + 1j * h0))


def wagner(s: npt.ArrayLike) -> FloatArray:
    """
    Return the circulatory lift after a step in incidence, as a share of its final value.

    Wagner's function is the inverse Laplace transform of C(p)/p, where Theodorsen's function
    is C(p) = K1(p)/(K0(p) + K1(p)), p = i k. Turning the path of integration around the cut
    of K0 and K1 along the negative axis leaves a real integral without oscillation:

        phi(s) = 1 - int_0^inf  exp(-x s)/(x^2 D(x)) dx
        D(x) = (K0(x) - K1(x))^2 + pi^2 (I0(x) + I1(x))^2

    Exact to round-off for every s; the usual fits by exponentials are 1 % off.

    Parameters
    ----------
    s : (...,) array
        Distance travelled since the step 2 V t/c [semichords].

    Returns
    -------
    (...,) array
        Lift ratio [-]: 0 for s < 0, 1/2 at s = 0, towards 1 as 1 - 1/s.

    References
    ----------
    H. Wagner, ZAMM 5, 1925. W. R. Sears, J. Franklin Inst. 230, 1940 (operational form).

    """
    s = np.asarray(s, dtype=float)
    x, _, denominator = _cut()
    lag = _integrate_along_cut(x, s, np.exp(-2.0 * x) / denominator)
    return np.where(s < 0.0, 0.0, 1.0 - lag)


def kuessner(s: npt.ArrayLike) -> FloatArray:
    """
    Return the lift of a plate entering a sharp-edged gust, as a share of its final value.

    Kuessner's function is the inverse Laplace transform of exp(-p) S(p)/p, where Sears'
    function is S(p) = 1/(p (K0(p) + K1(p))), p = i k. Around the cut, as for Wagner's:

        psi(s) = 1 - int_0^inf  exp(-x (s - 1)) (I0(x) + I1(x))/(x^2 D(x)) dx
        D(x) = (K0(x) - K1(x))^2 + pi^2 (I0(x) + I1(x))^2

    Circulatory and apparent-mass lift together, in a gust that stands still in the air.

    Parameters
    ----------
    s : (...,) array
        Distance travelled since the leading edge met the gust 2 V t/c [semichords].

    Returns
    -------
    (...,) array
        Lift ratio [-]: 0 for s <= 0, rising as sqrt(2 s)/pi, towards 1.

    References
    ----------
    H. G. Kuessner, Luftfahrtforschung 13, 1936. W. R. Sears, J. Aeronaut. Sci. 8, 1941.

    """
    s = np.asarray(s, dtype=float)
    x, sum_i, denominator = _cut()
    lag = _integrate_along_cut(x, s, sum_i / denominator)
    return np.where(s <= 0.0, 0.0, 1.0 - lag)


def sears(k: npt.ArrayLike) -> ComplexArray:
    """
    Return the lift of a plate in a sinusoidal gust over its quasi-steady value.

        S(k) = C(k) (J0(k) - i J1(k)) + i J1(k)

    The phase is relative to the gust velocity at midchord.

    Parameters
    ----------
    k : (...,) array
        Reduced frequency of the gust omega c/(2 V) [-], k >= 0.

    Returns
    -------
    (...,) complex array
        Share [-], 1 at k = 0.

    References
    ----------
    W. R. Sears, J. Aeronaut. Sci. 8, 1941.

    """
    k = np.asarray(k, dtype=float)
    j0, j1 = special.j0(k), special.j1(k)
    return theodorsen(k) * (j0 - 1j * j1) + 1j * j1


def plunging_plate_lift(k: npt.ArrayLike) -> ComplexArray:
    """
    Return the lift of a plunging plate over 2 pi hdot/V, apparent mass included.

        Cl/(2 pi hdot/V) = C(k) + i k/2,    h positive downward

    Parameters
    ----------
    k : (...,) array
        Reduced frequency omega c/(2 V) [-], k >= 0.

    Returns
    -------
    (...,) complex array
        Share [-] with the phase relative to the plunge velocity hdot.

    References
    ----------
    T. Theodorsen, NACA TR 496, 1935, eq. XVIII.

    """
    return theodorsen(k) + 0.5j * np.asarray(k, dtype=float)


def plunging_plate_moment(k: npt.ArrayLike, axis: npt.ArrayLike) -> ComplexArray:
    """
    Return the moment of a plunging plate about an axis over 2 pi hdot/V.

        Cm/(2 pi hdot/V) = (a + 1/2) C(k)/2 + i k a/4

    Parameters
    ----------
    k : (...,) array
        Reduced frequency omega c/(2 V) [-], k >= 0.
    axis : (...,) array
        Place a of the axis [semichords] behind midchord: -1 leading edge, -1/2 quarter chord.

    Returns
    -------
    (...,) complex array
        Share [-], nose up positive, Cm with the chord as length.

    References
    ----------
    T. Theodorsen, NACA TR 496, 1935, eq. XX.

    """
    k, a = np.asarray(k, dtype=float), np.asarray(axis, dtype=float)
    return 0.5 * (a + 0.5) * theodorsen(k) + 0.25j * k * a


def pitching_plate_lift(k: npt.ArrayLike, axis: npt.ArrayLike) -> ComplexArray:
    """
    Return the lift of a plate pitching about an axis over 2 pi alpha, apparent mass included.

        Cl/(2 pi alpha) = C(k) (1 + i k (1/2 - a)) + i k/2 + a k^2/2

    Parameters
    ----------
    k : (...,) array
        Reduced frequency omega c/(2 V) [-], k >= 0.
    axis : (...,) array
        Place a of the axis [semichords] behind midchord: -1 leading edge, -1/2 quarter chord.

    Returns
    -------
    (...,) complex array
        Share [-] with the phase relative to the pitch angle alpha.

    References
    ----------
    T. Theodorsen, NACA TR 496, 1935, eq. XVIII.

    """
    k, a = np.asarray(k, dtype=float), np.asarray(axis, dtype=float)
    return theodorsen(k) * (1.0 + 1j * k * (0.5 - a)) + 0.5j * k + 0.5 * a * k**2


def pitching_plate_moment(k: npt.ArrayLike, axis: npt.ArrayLike) -> ComplexArray:
    """
    Return the moment of a plate pitching about an axis, about that axis, over 2 pi alpha.

        Cm/(2 pi alpha) = (a + 1/2) C(k) (1 + i k (1/2 - a))/2
                          + ((1/8 + a^2) k^2 - i k (1/2 - a))/4

    Parameters
    ----------
    k : (...,) array
        Reduced frequency omega c/(2 V) [-], k >= 0.
    axis : (...,) array
        Place a of the axis [semichords] behind midchord: -1 leading edge, -1/2 quarter chord.

    Returns
    -------
    (...,) complex array
        Share [-], nose up positive, Cm with the chord as length.

    References
    ----------
    T. Theodorsen, NACA TR 496, 1935, eq. XX.

    """
    k, a = np.asarray(k, dtype=float), np.asarray(axis, dtype=float)
    circulatory = 0.5 * (a + 0.5) * theodorsen(k) * (1.0 + 1j * k * (0.5 - a))
    return circulatory + 0.25 * ((0.125 + a**2) * k**2 - 1j * k * (0.5 - a))


_CUT_STEP = 0.1   # of log x: the error of the trapezium rule is far below round-off


def _cut() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return x, I0 + I1 scaled by exp(-x) and D scaled by exp(-2 x) along the cut."""
    # The lower end leaves out exp(-60) of an integrand that tends to 1, the upper end
    # exp(-45) of Kuessner's, which at s = 0 falls only as x^(-3/2).
    x = np.exp(np.arange(-60.0, 90.0, _CUT_STEP))
    sum_i = special.i0e(x) + special.i1e(x)
    difference_k = (special.k0e(x) - special.k1e(x)) * np.exp(-2.0 * x)
    return x, sum_i, difference_k**2 + (np.pi * sum_i) ** 2


def _integrate_along_cut(x: FloatArray, s: FloatArray, factor: FloatArray) -> FloatArray:
    """Return the integral of factor exp(-x s)/x^2 over x, for each s (0 where negative)."""
    decay = np.exp(-x * np.maximum(s, 0.0)[..., np.newaxis])
    return _CUT_STEP * np.sum(decay * factor / x, axis=-1)   # dx/x^2 = d(log x)/x


def flap_effectiveness(hinge: npt.ArrayLike) -> FloatArray:
    """
    Return the change of zero-lift angle per flap deflection, as a positive number.

        tau = 1 - (theta - sin theta)/pi,    cos theta = 1 - 2 x_h

    A deflection eta, trailing edge down, lifts like an incidence tau eta.

    Parameters
    ----------
    hinge : (...,) array
        Hinge x_h behind the leading edge [chords], 0 to 1.

    Returns
    -------
    (...,) array
        tau [-], from 1 (all-moving) to 0.

    References
    ----------
    H. Glauert, The Elements of Aerofoil and Airscrew Theory, 1926, ch. VII and R&M 1095.

    """
    theta = np.arccos(1.0 - 2.0 * np.asarray(hinge, dtype=float))
    return 1.0 - (theta - np.sin(theta)) / np.pi


def flap_moment_slope(hinge: npt.ArrayLike) -> FloatArray:
    """
    Return the moment about the quarter chord per flap deflection at constant lift.

        dCm/deta = -sin theta (1 - cos theta)/2,    cos theta = 1 - 2 x_h

    Parameters
    ----------
    hinge : (...,) array
        Hinge x_h behind the leading edge [chords], 0 to 1.

    Returns
    -------
    (...,) array
        Slope [1/rad], nose up positive, hence negative.

    References
    ----------
    H. Glauert, R&M 1095, 1927.

    """
    theta = np.arccos(1.0 - 2.0 * np.asarray(hinge, dtype=float))
    return -0.5 * np.sin(theta) * (1.0 - np.cos(theta))


def decambering_2d(
        cl: npt.ArrayLike, alpha: npt.ArrayLike, alpha_0L: npt.ArrayLike) -> FloatArray:
    """
    Return the decambering that puts a potential section on a viscous point, linear form.

        delta = cl/(2 pi) - (alpha - alpha_0L)

    Zero for the potential line cl = 2 pi (alpha - alpha_0L).

    Parameters
    ----------
    cl : (...,) array
        Viscous lift coefficient of the section [-] at alpha.
    alpha, alpha_0L : (...,) array
        Incidence and zero-lift incidence of the section [rad].

    Returns
    -------
    (...,) array
        Decambering angle [rad], negative where lift is lost.

    References
    ----------
    R. Mukherjee and A. Gopalarathnam, J. Aircraft 43(3), 2006, with delta1 alone.

    """
    cl, alpha, alpha_0L = (np.asarray(a, dtype=float) for a in (cl, alpha, alpha_0L))
    return cl / (2.0 * np.pi) - (alpha - alpha_0L)


def decambering_2d_exact(
        cl: npt.ArrayLike, alpha: npt.ArrayLike, alpha_0L: npt.ArrayLike) -> FloatArray:
    """
    Return the decambering that puts a flat plate at any incidence on a viscous point.

        delta = asin(cl/(2 pi)) - (alpha - alpha_0L)

    Zero for the lift of a plate cl = 2 pi sin(alpha - alpha_0L) while alpha - alpha_0L lies
    within a right angle; beyond it the principal value of asin is kept on purpose, so that
    delta is continuous in cl.

    Parameters
    ----------
    cl : (...,) array
        Viscous lift coefficient of the section [-] at alpha, within +-2 pi.
    alpha, alpha_0L : (...,) array
        Incidence and zero-lift incidence of the section [rad].

    Returns
    -------
    (...,) array
        Decambering angle [rad], negative where lift is lost.

    References
    ----------
    The linear form of `decambering_2d`, with the lift of a plate by Joukowski's theorem:
    H. Glauert, The Elements of Aerofoil and Airscrew Theory, 1926, ch. VI.

    """
    cl, alpha, alpha_0L = (np.asarray(a, dtype=float) for a in (cl, alpha, alpha_0L))
    return np.arcsin(cl / (2.0 * np.pi)) - (alpha - alpha_0L)


def helmbold_slope(aspect_ratio: npt.ArrayLike) -> FloatArray:
    """
    Return the lift slope of an unswept wing by Helmbold's equation.

        CL_alpha = 2 pi AR/(2 + sqrt(AR^2 + 4))

    An interpolation with both limits right, 2 pi for AR -> inf and pi AR/2 for AR -> 0;
    lifting-surface theory puts rectangular wings a few per cent below it.

    Parameters
    ----------
    aspect_ratio : (...,) array
        Span squared over area [-], positive.

    Returns
    -------
    (...,) array
        Slope [1/rad].

    References
    ----------
    H. B. Helmbold, Jahrbuch 1942 der deutschen Luftfahrtforschung, I 111.

    """
    aspect_ratio = np.asarray(aspect_ratio, dtype=float)
    return 2.0 * np.pi * aspect_ratio / (2.0 + np.sqrt(aspect_ratio**2 + 4.0))


def prandtl_slope(aspect_ratio: npt.ArrayLike) -> FloatArray:
    """
    Return the lift slope of an elliptic wing by lifting-line theory.

        CL_alpha = 2 pi AR/(AR + 2)

    Parameters
    ----------
    aspect_ratio : (...,) array
        Span squared over area [-], positive.

    Returns
    -------
    (...,) array
        Slope [1/rad]; an upper bound to lifting-surface theory.

    References
    ----------
    L. Prandtl, NACA TR 116, 1921.

    """
    aspect_ratio = np.asarray(aspect_ratio, dtype=float)
    return 2.0 * np.pi * aspect_ratio / (aspect_ratio + 2.0)


def slender_slope(aspect_ratio: npt.ArrayLike) -> FloatArray:
    """
    Return the lift slope of a slender pointed wing, the limit AR -> 0 of every wing.

        CL_alpha = pi AR/2

    Parameters
    ----------
    aspect_ratio : (...,) array
        Span squared over area [-], positive and small.

    Returns
    -------
    (...,) array
        Slope [1/rad].

    References
    ----------
    R. T. Jones, NACA TR 835, 1946.

    """
    return 0.5 * np.pi * np.asarray(aspect_ratio, dtype=float)


def elliptic_induced_drag(
        lift_coefficient: npt.ArrayLike, aspect_ratio: npt.ArrayLike) -> FloatArray:
    """
    Return the induced drag coefficient of elliptic loading, the least for its span and lift.

        CD = CL^2/(pi AR)

    Parameters
    ----------
    lift_coefficient : (...,) array
        CL [-].
    aspect_ratio : (...,) array
        Span squared over area [-], positive.

    Returns
    -------
    (...,) array
        CD [-].

    References
    ----------
    L. Prandtl, NACA TR 116, 1921. M. M. Munk, NACA TR 121, 1921.

    """
    lift_coefficient = np.asarray(lift_coefficient, dtype=float)
    return lift_coefficient**2 / (np.pi * np.asarray(aspect_ratio, dtype=float))


def roll_damping_strip(taper: npt.ArrayLike) -> FloatArray:
    """
    Return the roll damping of a straight-tapered wing of infinite aspect ratio.

        Clp = -(2 pi/12) (1 + 3 taper)/(1 + taper)

    Strip theory with the section slope 2 pi; the bound that no finite wing reaches.

    Parameters
    ----------
    taper : (...,) array
        Tip chord over root chord [-]: 1 rectangular (Clp = -pi/3), 0 pointed (-pi/6).

    Returns
    -------
    (...,) array
        Clp [-], rolling moment over q S b per p b/(2 V).

    References
    ----------
    B. Etkin and L. D. Reid, Dynamics of Flight, 3rd ed., 1996, strip integral of sec. 5.6.

    """
    taper = np.asarray(taper, dtype=float)
    return -np.pi / 6.0 * (1.0 + 3.0 * taper) / (1.0 + taper)


def roll_damping_elliptic(aspect_ratio: npt.ArrayLike) -> FloatArray:
    """
    Return the roll damping of an elliptic wing by lifting-line theory.

        Clp = -(pi/4) AR/(AR + 4)

    The antisymmetric incidence of rolling loads the second Fourier term alone.

    Parameters
    ----------
    aspect_ratio : (...,) array
        Span squared over area [-], positive.

    Returns
    -------
    (...,) array
        Clp [-], rolling moment over q S b per p b/(2 V).

    References
    ----------
    H. Glauert, The Elements of Aerofoil and Airscrew Theory, 1926, ch. XI (Fourier form).

    """
    aspect_ratio = np.asarray(aspect_ratio, dtype=float)
    return -0.25 * np.pi * aspect_ratio / (aspect_ratio + 4.0)


def roll_damping_slender(aspect_ratio: npt.ArrayLike) -> FloatArray:
    """
    Return the roll damping of a slender pointed wing, the limit AR -> 0.

        Clp = -pi AR/32

    Parameters
    ----------
    aspect_ratio : (...,) array
        Span squared over area [-], positive and small.

    Returns
    -------
    (...,) array
        Clp [-], rolling moment over q S b per p b/(2 V).

    References
    ----------
    H. S. Ribner, NACA TN 1423, 1947.

    """
    return -np.pi / 32.0 * np.asarray(aspect_ratio, dtype=float)


def ring_axis_velocity(
        distance: npt.ArrayLike, circulation: npt.ArrayLike, radius: npt.ArrayLike) -> FloatArray:
    """
    Return the velocity on the axis of a circular vortex ring.

        V = Gamma R^2/(2 (R^2 + z^2)^(3/2))

    Parameters
    ----------
    distance : (...,) array
        Distance z from the ring's plane along its axis [m].
    circulation : (...,) array
        Gamma [m^2/s], positive right-handed about the axis.
    radius : (...,) array
        R [m], positive.

    Returns
    -------
    (...,) array
        Velocity along the axis [m/s].

    References
    ----------
    H. Lamb, Hydrodynamics, 6th ed., 1932, art. 161.

    """
    z, gamma, r = (np.asarray(a, dtype=float) for a in (distance, circulation, radius))
    return 0.5 * gamma * r**2 / (r**2 + z**2) ** 1.5


def line_vortex_velocity(
        points: npt.ArrayLike, origin: npt.ArrayLike, direction: npt.ArrayLike,
        circulation: float) -> FloatArray:
    """
    Return the velocity around an infinite straight vortex.

        V = Gamma/(2 pi) (u x r)/|u x r|^2,    u = unit direction, r from the line

    Parameters
    ----------
    points : (..., 3) array
        Where the velocity is wanted [m], off the line.
    origin, direction : (3,) array
        A point of the line [m] and its direction, of any length.
    circulation : float
        Gamma [m^2/s], positive right-handed about the direction.

    Returns
    -------
    (..., 3) array
        Velocity [m/s], in the axes of the arguments.

    References
    ----------
    J. Katz and A. Plotkin, Low-Speed Aerodynamics, 2nd ed., 2001, sec. 2.11.

    """
    points, origin, direction = (
        np.asarray(a, dtype=float) for a in (points, origin, direction))
    around = np.cross(direction / np.linalg.norm(direction), points - origin)
    return circulation / (2.0 * np.pi) * around / np.sum(around**2, axis=-1, keepdims=True)


def segment_velocity(
        points: npt.ArrayLike, start: npt.ArrayLike, end: npt.ArrayLike,
        circulation: float) -> FloatArray:
    """
    Return the velocity that a straight vortex segment induces.

        V = Gamma/(4 pi h) (cos beta1 + cos beta2) e

    h is the distance from the line, beta1 and beta2 the angles of the triangle at the two
    ends, and e points along (end - start) x (point - start).

    Parameters
    ----------
    points : (..., 3) array
        Where the velocity is wanted [m], off the line through the segment.
    start, end : (3,) array
        The two ends [m].
    circulation : float
        Gamma [m^2/s], positive right-handed about start -> end.

    Returns
    -------
    (..., 3) array
        Velocity [m/s], in the axes of the arguments.

    References
    ----------
    J. Katz and A. Plotkin, Low-Speed Aerodynamics, 2nd ed., 2001, eqs. 2.68 and 2.69.

    """
    points, start, end = (np.asarray(a, dtype=float) for a in (points, start, end))
    along = (end - start) / np.linalg.norm(end - start)
    cos_beta1 = (points - start) @ along / np.linalg.norm(points - start, axis=-1)
    cos_beta2 = (end - points) @ along / np.linalg.norm(points - end, axis=-1)
    around = np.cross(along, points - start)   # h e
    h_squared = np.sum(around**2, axis=-1)
    strength = circulation / (4.0 * np.pi) * (cos_beta1 + cos_beta2) / h_squared
    return strength[..., np.newaxis] * around


def fall_with_drag(t: npt.ArrayLike, terminal: float, start: float = 0.0,
                   gravity: float = 9.80665) -> FloatArray:
    """
    Return the speed of a body that falls straight with drag by the square of its speed.

        dv/dt = g (1 - v^2/vt^2),    v = vt tanh(g t/vt + artanh(v0/vt))

    Parameters
    ----------
    t : (...,) array
        Time [s].
    terminal, start : float
        Last speed vt and first speed v0 [m/s], 0 <= v0 < vt.
    gravity : float
        [m/s^2].

    Returns
    -------
    (...,) array
        Speed [m/s].

    """
    return terminal * np.tanh(
        gravity * np.asarray(t, dtype=float) / terminal + np.arctanh(start / terminal))


def torque_free_rates(
        inertia: npt.ArrayLike, rates0: npt.ArrayLike, t: npt.ArrayLike) -> FloatArray:
    """
    Return the body rates of a rigid body without torque, from any initial rates.

    Euler's equations in principal axes have the solution, with 2 the axis of the middle
    moment of inertia and 3 the axis that the angular momentum circles about,

        w1 = +-A1 cn(tau, m)    w2 = +-A2 sn(tau, m)    w3 = +-A3 dn(tau, m)
        A1^2 = (2T I3 - H^2)/(I1 (I3 - I1))    A2^2 = (2T I3 - H^2)/(I2 (I3 - I2))
        A3^2 = (H^2 - 2T I1)/(I3 (I3 - I1))
        tau = tau0 + t sqrt((I3 - I2) (H^2 - 2T I1)/(I1 I2 I3))
        m = (I2 - I1) (2T I3 - H^2)/((I3 - I2) (H^2 - 2T I1))

    3 is the axis of largest inertia if H^2 > 2T I2 and of smallest if H^2 < 2T I2. At
    equality (m = 1) the body turns over once, and the functions become tanh and sech.

    Parameters
    ----------
    inertia : (3,) array
        Principal moments Ixx, Iyy, Izz [kg m^2], positive, in any order, also equal.
    rates0 : (3,) array
        Rates p, q, r about these axes at t = 0 [rad/s].
    t : (...,) array
        Time [s], of any sign.

    Returns
    -------
    (..., 3) array
        Rates [rad/s] at t.

    References
    ----------
    L. D. Landau and E. M. Lifshitz, Mechanics, 3rd ed., 1976, sec. 37.
    E. T. Whittaker, Analytical Dynamics, 4th ed., 1937, art. 69.

    """
    inertia, rates0, t = (np.asarray(a, dtype=float) for a in (inertia, rates0, t))
    if not np.any(np.cross(rates0, inertia * rates0)):
        return np.broadcast_to(rates0, (*t.shape, 3)).copy()   # a permanent axis

    order = np.argsort(inertia, kind='stable')
    low, middle, high = order
    circles_high = (
        inertia[high] * (inertia[high] - inertia[middle]) * rates0[high] ** 2
        >= inertia[low] * (inertia[middle] - inertia[low]) * rates0[low] ** 2)
    axes = order if circles_high else order[::-1]
    i1, i2, i3 = inertia[axes]
    w1, w2, w3 = rates0[axes]

    # |2T I3 - H^2| and |H^2 - 2T I1|, as sums of terms of one sign.
    d21, d31, d32 = abs(i2 - i1), abs(i3 - i1), abs(i3 - i2)
    from_axis_3 = i1 * d31 * w1**2 + i2 * d32 * w2**2
    from_axis_1 = i2 * d21 * w2**2 + i3 * d31 * w3**2
    amplitudes = np.sqrt([
        from_axis_3 / (i1 * d31), from_axis_3 / (i2 * d32), from_axis_1 / (i3 * d31)])
    m = min(d21 * from_axis_3 / (d32 * from_axis_1), 1.0)

    # Even orders of the axes keep Euler's equations, odd ones reverse time.
    parity = np.linalg.det(np.eye(3)[axes])
    sign1, sign3 = np.copysign(1.0, w1), np.copysign(1.0, w3)
    sign2 = sign1 * sign3 * np.sign(parity * (i3 - i1))
    phase = np.arctan2(sign2 * w2 * np.sqrt(i2 * d32), abs(w1) * np.sqrt(i1 * d31))
    tau = special.ellipkinc(phase, m) + t * np.sqrt(d32 * from_axis_1 / (i1 * i2 * i3))
    sn, cn, dn, _ = special.ellipj(tau, m)

    rates = np.empty((*t.shape, 3))
    rates[..., axes[0]] = sign1 * amplitudes[0] * cn
    rates[..., axes[1]] = sign2 * amplitudes[1] * sn
    rates[..., axes[2]] = sign3 * amplitudes[2] * dn
    return rates


def falling_sphere(
        t: npt.ArrayLike, *, mass: float, diameter: float, drag_coefficient: float,
        density: float, gravity: float) -> tuple[FloatArray, FloatArray]:
    """
    Return how far and how fast a sphere has fallen from rest, with drag as speed squared.

        v = v_inf tanh(g t/v_inf)    d = v_inf^2/g log cosh(g t/v_inf)
        v_inf^2 = 2 m g/(rho S CD),  S = pi diameter^2/4

    Parameters
    ----------
    t : (...,) array
        Time since release [s], t >= 0.
    mass : float
        m [kg].
    diameter : float
        Of the sphere [m].
    drag_coefficient : float
        CD [-] on the frontal area, positive.
    density : float
        Of the air [kg/m^3], constant; buoyancy is left out.
    gravity : float
        g [m/s^2], constant.

    Returns
    -------
    distance : (...,) array
        Fallen [m].
    speed : (...,) array
        Downward [m/s].

    References
    ----------
    I. Newton, Principia, 1687, book II, sec. II (resistance as the square of the speed).

    """
    t = np.asarray(t, dtype=float)
    area = 0.25 * np.pi * diameter**2
    terminal_speed = np.sqrt(2.0 * mass * gravity / (density * area * drag_coefficient))
    x = gravity * t / terminal_speed
    # log cosh: the first form keeps its digits near zero, the second does not overflow.
    log_cosh = np.where(
        x < 1.0, np.log1p(2.0 * np.sinh(0.5 * np.minimum(x, 1.0)) ** 2),
        x + np.log1p(np.exp(-2.0 * x)) - np.log(2.0))
    return terminal_speed**2 / gravity * log_cosh, terminal_speed * np.tanh(x)


def projectile(
        t: npt.ArrayLike, position0_N: npt.ArrayLike, velocity0_N: npt.ArrayLike,
        gravity: float) -> tuple[FloatArray, FloatArray]:
    """
    Return the flight of a body without air over a flat earth, in north-east-down axes.

        r = r0 + v0 t + g t^2/2    v = v0 + g t    g = (0, 0, gravity)

    Parameters
    ----------
    t : (...,) array
        Time [s].
    position0_N, velocity0_N : (3,) array
        Position [m] and velocity [m/s] at t = 0.
    gravity : float
        [m/s^2], constant.

    Returns
    -------
    position_N : (..., 3) array
        [m].
    velocity_N : (..., 3) array
        [m/s].

    References
    ----------
    G. Galilei, Discorsi, 1638, fourth day.

    """
    t = np.asarray(t, dtype=float)[..., np.newaxis]
    position0_N, velocity0_N = (
        np.asarray(a, dtype=float) for a in (position0_N, velocity0_N))
    gravity_N = np.array([0.0, 0.0, gravity])
    return position0_N + velocity0_N * t + 0.5 * gravity_N * t**2, velocity0_N + gravity_N * t


class StandardAir(NamedTuple):
    """One row of the standard atmosphere; `altitude` as its table or function says."""

    altitude: float      # [m]
    temperature: float   # [K]
    pressure: float      # [Pa]
    density: float       # [kg/m^3]
    sound_speed: float   # [m/s]


# U.S. Standard Atmosphere 1976 (NOAA-S/T 76-1562, NASA-TM-X-74335), Table I, against
# GEOMETRIC altitude, with the digits printed there (some of them cut, not rounded).
ISA_TABLE_GEOMETRIC = (
    StandardAir(0.0, 288.150, 1.01325e5, 1.2250, 340.29),
    StandardAir(1000.0, 281.651, 8.9876e4, 1.1117, 336.43),
    StandardAir(2000.0, 275.154, 7.9501e4, 1.0066, 332.53),
    StandardAir(5000.0, 255.676, 5.4048e4, 7.3643e-1, 320.55),
    StandardAir(10000.0, 223.252, 2.6499e4, 4.1351e-1, 299.53),
    StandardAir(15000.0, 216.650, 1.2111e4, 1.9476e-1, 295.07),
    StandardAir(20000.0, 216.650, 5.5293e3, 8.8910e-2, 295.07),
    StandardAir(25000.0, 221.552, 2.5492e3, 4.0084e-2, 298.39),
    StandardAir(30000.0, 226.509, 1.1970e3, 1.8410e-2, 301.71),
)

# The same atmosphere at the bases of its layers, against GEOPOTENTIAL altitude.
ISA_TABLE_GEOPOTENTIAL = (
    StandardAir(0.0, 288.15, 101325.0, 1.2250, 340.294),
    StandardAir(11000.0, 216.65, 22632.06, 0.363918, 295.070),
    StandardAir(20000.0, 216.65, 5474.889, 0.0880349, 295.070),
    StandardAir(32000.0, 228.65, 868.0187, 0.0132250, 303.131),
)

_EARTH_RADIUS = 6356766.0      # [m], of the conversion between the altitudes
_GRAVITY = 9.80665             # [m/s^2]
_GAS_CONSTANT = 8314.32 / 28.9644   # [J/(kg K)], R* and M0 of 1976
_HEAT_RATIO = 1.4
# Base geopotential altitude [m] and temperature gradient [K/m] of each layer.
_LAYERS = ((0.0, -0.0065), (11000.0, 0.0), (20000.0, 0.001), (32000.0, 0.0))


def geopotential_altitude(altitude: npt.ArrayLike) -> FloatArray:
    """
    Return the geopotential altitude of a geometric one in the standard atmosphere.

        H = r0 Z/(r0 + Z),    r0 = 6356766 m

    Parameters
    ----------
    altitude : (...,) array
        Geometric altitude Z above mean sea level [m].

    Returns
    -------
    (...,) array
        H [m], 17 m less than Z at 10.4 km.

    References
    ----------
    U.S. Standard Atmosphere 1976, NASA-TM-X-74335, eq. 18.

    """
    altitude = np.asarray(altitude, dtype=float)
    return _EARTH_RADIUS * altitude / (_EARTH_RADIUS + altitude)


def isa(altitude: float) -> StandardAir:
    """
    Return the standard atmosphere at a GEOPOTENTIAL altitude from -5 km to 32 km.

        T = Tb + L (H - Hb)
        p = pb (Tb/T)^(g0/(R L)),  or  pb exp(-g0 (H - Hb)/(R Tb)) where L = 0
        rho = p/(R T)    a = sqrt(1.4 R T)

    Parameters
    ----------
    altitude : float
        Geopotential altitude H above mean sea level [m].

    Returns
    -------
    StandardAir
        Temperature [K], pressure [Pa], density [kg/m^3], speed of sound [m/s].

    References
    ----------
    U.S. Standard Atmosphere 1976, NASA-TM-X-74335, eqs. 23, 33a, 33b, 42 and 50.

    """
    if not -5000.0 <= altitude <= _LAYERS[-1][0]:
        raise ValueError(f'altitude must lie within -5 km and 32 km, got {altitude!r} m')
    temperature, pressure = 288.15, 101325.0
    for (base, gradient), (top, _) in itertools.pairwise(_LAYERS):
        rise = min(altitude, top) - base
        if gradient == 0.0:
            pressure *= np.exp(-_GRAVITY * rise / (_GAS_CONSTANT * temperature))
        else:
            ratio = temperature / (temperature + gradient * rise)
            pressure *= ratio ** (_GRAVITY / (_GAS_CONSTANT * gradient))
        temperature += gradient * rise
        if altitude <= top:
            break
    return StandardAir(
        float(altitude), float(temperature), float(pressure),
        float(pressure / (_GAS_CONSTANT * temperature)),
        float(np.sqrt(_HEAT_RATIO * _GAS_CONSTANT * temperature)))
