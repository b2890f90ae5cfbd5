# Copyright 2026 the poststall_sim developers
# SPDX-License-Identifier: Apache-2.0
"""
The closed-form solutions of exact.py against limits, identities and independent integration.

Nothing of the product is tested here. A quadrature or an integrator in this file shares no
formula with the function that it checks.
"""

import itertools

import exact
import numpy as np
import pytest
from scipy import integrate, special

# Values quoted with four decimals can only be met to half a unit of the last.
FOUR_DECIMALS = 0.5e-4 * (1.0 + 1e-9)


def bessel_theodorsen(k):
    """Return C = K1/(K0 + K1) at i k, the operational form of Theodorsen's function."""
    return special.kv(1, 1j * k) / (special.kv(0, 1j * k) + special.kv(1, 1j * k))


def downwash_lift(k, downwash):
    """
    Return the lift over 2 pi of any downwash w(x) exp(i k s) on a plate, x in semichords.

        C(k)/pi int w sqrt((1 + x)/(1 - x)) dx + i k/pi int w sqrt(1 - x^2) dx
    """
    theta = (np.arange(64) + 0.5) * np.pi / 64   # Gauss-Chebyshev: exact for polynomials
    x = np.cos(theta)
    circulatory = np.mean(downwash(x) * (1.0 + x))
    apparent = np.mean(downwash(x) * (1.0 - x**2))
    return bessel_theodorsen(k) * circulatory + 1j * k * apparent


def discrete_vortex_plate(k, downwash, axis, panels):
    """
    Return lift over 2 pi and moment over 2 pi of an oscillating plate, by discrete vortices.

    Vortices at the quarter and tangency at the three-quarter point of each panel, panels
    crowded at both edges, and the wake exp(-i k x) to infinity integrated exactly
    (exponential integral E1). V = b = 1.
    """
    edges = -np.cos(np.linspace(0.0, np.pi, panels + 1))
    vortex = edges[:-1] + 0.25 * np.diff(edges)
    point = edges[:-1] + 0.75 * np.diff(edges)
    bound = 1.0 / (2.0 * np.pi * (point[:, np.newaxis] - vortex))
    wake = 1j * k / (2.0 * np.pi) * np.exp(1j * k * (1.0 - point)) \
        * special.exp1(1j * k * (1.0 - point))
    circulation = np.linalg.solve(bound + wake[:, np.newaxis], downwash(point))
    # Bernoulli: the jump in potential at x is the circulation in front of it.
    lift = circulation @ (1.0 + 1j * k * (1.0 - vortex))
    moment = -circulation @ (
        vortex - axis + 0.5j * k * ((1.0 - axis) ** 2 - (vortex - axis) ** 2))
    return lift / (2.0 * np.pi), moment / (4.0 * np.pi)


@pytest.mark.parametrize(('k', 'value'), [
    (0.1, 0.8319 - 0.1723j), (0.3, 0.6650 - 0.1793j), (0.5, 0.5979 - 0.1507j)])
def test_theodorsen_has_its_known_values(k, value):
    """Values of C(k) = F + i G, quoted with four decimals."""
    assert exact.theodorsen(k).real == pytest.approx(value.real, abs=FOUR_DECIMALS)
    assert exact.theodorsen(k).imag == pytest.approx(value.imag, abs=FOUR_DECIMALS)


def test_theodorsen_has_its_limits_and_its_operational_form():
    """C is 1 at rest, 1/2 + 1/(8 i k) at high frequency, and K1/(K0 + K1) in between."""
    assert exact.theodorsen(0.0) == 1.0
    k = np.array([1e-8, 1e-6, 1e-4])
    # C = 1 - pi k/2 + i k (log(k/2) + Euler's gamma) for small k.
    series = 1.0 - 0.5 * np.pi * k + 1j * k * (np.log(0.5 * k) + np.euler_gamma)
    assert np.abs(exact.theodorsen(k) - series) == pytest.approx(0.0, abs=2e-6)
    assert np.abs(exact.theodorsen(1e3) - 0.5 - 1.0 / 8e3j) < 1e-6   # next term 1/k^2
    k = np.geomspace(1e-3, 50.0, 40).reshape(8, 5)
    assert exact.theodorsen(k) == pytest.approx(bessel_theodorsen(k), rel=1e-12)


@pytest.mark.parametrize(('s', 'value'), [
    (0.5, 0.5557), (1.0, 0.6006), (2.0, 0.6693), (4.0, 0.7580), (6.0, 0.8126),
    (10.0, 0.8750), (20.0, 0.9366)])
def test_wagner_has_its_known_values(s, value):
    """Values of Wagner's function, quoted with four decimals."""
    assert exact.wagner(s) == pytest.approx(value, abs=FOUR_DECIMALS)


@pytest.mark.parametrize('s', [0.05, 0.5, 2.0, 7.0, 30.0])
def test_wagner_is_the_oscillatory_integral_of_theodorsen(s):
    """On the frequency axis, phi(s) = 2/pi int F(k) sin(k s)/k dk, Garrick's form."""
    def real_part(k):
        return bessel_theodorsen(k).real

    slow, _ = integrate.quad(
        lambda k: real_part(k) * s * np.sinc(k * s / np.pi), 0.0, 1.0,
        epsabs=1e-12, limit=400)
    fast, _ = integrate.quad(
        lambda k: real_part(k) / k, 1.0, np.inf, weight='sin', wvar=s,
        epsabs=1e-10, limit=400, limlst=400)
    # The oscillatory quadrature is asked for 1e-10.
    assert exact.wagner(s) == pytest.approx(2.0 / np.pi * (slow + fast), abs=1e-8)


def test_wagner_has_its_limits():
    """Nothing before the step, then half the lift, slope 1/8, and 1 - 1/s in the end."""
    assert exact.wagner(-1e-9) == 0.0
    assert exact.wagner(0.0) == pytest.approx(0.5, abs=1e-14)
    step = 1e-4
    slope = (exact.wagner(step) - exact.wagner(0.0)) / step
    assert slope == pytest.approx(0.125, abs=1e-4)   # first order in the step
    # The next term of the expansion is of order log(s)/s^2, and 1 - phi loses eps s.
    assert 1e6 * (1.0 - exact.wagner(1e6)) == pytest.approx(1.0, abs=1e-4)
    s = np.linspace(0.0, 50.0, 501)
    assert np.all(np.diff(exact.wagner(s)) > 0.0)
    jones = 1.0 - 0.165 * np.exp(-0.0455 * s) - 0.335 * np.exp(-0.300 * s)
    # R. T. Jones, NACA TN 682: his fit is about 1 % off.
    assert np.abs(exact.wagner(s) - jones).max() == pytest.approx(0.01, abs=0.005)


@pytest.mark.parametrize('s', [1e-3, 0.3, 1.0, 1.9, 2.0, 3.0, 10.0, 100.0])
def test_kuessner_is_wagner_summed_over_the_chord_entering_the_gust(s):
    """Duhamel's integral of Wagner's function over the gusty part, plus apparent mass."""
    covered = min(s, 2.0)
    # sqrt(sigma/(2 - sigma)) dsigma = (1 - cos theta) dtheta with sigma = 1 - cos theta
    circulatory, _ = integrate.quad(
        lambda theta: exact.wagner(s - 1.0 + np.cos(theta)) * (1.0 - np.cos(theta)),
        0.0, np.arccos(1.0 - covered) * (1.0 - 1e-12), epsabs=1e-12)
    apparent = np.sqrt(covered * (2.0 - covered))
    assert exact.kuessner(s) == pytest.approx((circulatory + apparent) / np.pi, abs=1e-10)


def test_kuessner_has_its_limits():
    """Nothing before the gust, then sqrt(2 s)/pi, and 1 - 1/s in the end."""
    assert exact.kuessner(-1.0) == 0.0
    assert exact.kuessner(0.0) == 0.0
    s = np.array([1e-10, 1e-8, 1e-6])
    assert exact.kuessner(s) == pytest.approx(np.sqrt(2.0 * s) / np.pi, rel=1e-6)
    # No jump at the start hides in the special value at 0; round-off of some 1e-14 does.
    assert exact.kuessner(1e-30) == pytest.approx(0.0, abs=1e-13)
    assert 1e6 * (1.0 - exact.kuessner(1e6)) == pytest.approx(1.0, abs=1e-4)
    assert np.all(np.diff(exact.kuessner(np.linspace(0.0, 50.0, 501))) > 0.0)


def test_step_responses_keep_the_shape_of_their_argument():
    """Scalars give scalars, arrays give arrays, element by element."""
    s = np.linspace(-1.0, 9.0, 12).reshape(3, 4)
    for function in (exact.wagner, exact.kuessner, exact.theodorsen):
        values = function(np.abs(s))
        assert values.shape == (3, 4)
        assert np.ndim(function(2.0)) == 0
        assert values[2, 3] == pytest.approx(function(9.0), rel=1e-14)


def test_sears_is_the_plate_in_a_sinusoidal_downwash():
    """A gust exp(-i k x) is a downwash like any other; 1/(i k (K0 + K1)) says the same."""
    for k in (0.01, 0.2, 1.0, 3.0):
        lift = downwash_lift(k, lambda x, k=k: np.exp(-1j * k * x))
        assert exact.sears(k) == pytest.approx(lift, rel=1e-12)
        operational = 1.0 / (1j * k * (special.kv(0, 1j * k) + special.kv(1, 1j * k)))
        assert exact.sears(k) == pytest.approx(operational, rel=1e-12)
    assert exact.sears(0.0) == 1.0


@pytest.mark.parametrize(('k', 'amplitude', 'phase_deg'), [
    (0.1, 0.8409, -8.36), (0.3, 0.6656, -2.52), (0.5, 0.6061, 9.43)])
def test_plunging_plate_has_its_known_values(k, amplitude, phase_deg):
    """Amplitude and phase of C(k) + i k/2, quoted with four and two decimals."""
    lift = exact.plunging_plate_lift(k)
    assert np.abs(lift) == pytest.approx(amplitude, abs=FOUR_DECIMALS)
    assert np.degrees(np.angle(lift)) == pytest.approx(phase_deg, abs=0.005)


@pytest.mark.parametrize('axis', [-1.0, -0.5, 0.0, 0.3])
def test_oscillating_plate_lift_is_that_of_its_downwash(axis):
    """Plunge is a constant downwash, pitch about a gives 1 + i k (x - a)."""
    k = 0.7
    plunge = downwash_lift(k, np.ones_like)
    pitch = downwash_lift(k, lambda x: 1.0 + 1j * k * (x - axis))
    assert exact.plunging_plate_lift(k) == pytest.approx(plunge, rel=1e-12)
    assert exact.pitching_plate_lift(k, axis) == pytest.approx(pitch, rel=1e-12)


def test_pitch_about_another_axis_is_pitch_and_plunge():
    """Moving the axis back by d semichords adds a plunge -i k d and a moment d/2 Cl."""
    k, front, rear = np.array([0.1, 0.6, 2.0]), -0.7, 0.4
    arm = rear - front
    plunge = -1j * k * arm
    lift = exact.pitching_plate_lift(k, front) + plunge * exact.plunging_plate_lift(k)
    assert exact.pitching_plate_lift(k, rear) == pytest.approx(lift, rel=1e-12)
    moment = exact.pitching_plate_moment(k, front) \
        + plunge * exact.plunging_plate_moment(k, front) + 0.5 * arm * lift
    assert exact.pitching_plate_moment(k, rear) == pytest.approx(moment, rel=1e-12)


def test_oscillating_plate_at_rest_is_the_steady_plate():
    """At k = 0 the lift share is 1 and acts at the quarter chord."""
    axis = np.array([-1.0, -0.5, 0.0, 1.0])
    assert exact.plunging_plate_lift(0.0) == 1.0
    assert exact.pitching_plate_lift(0.0, axis) == pytest.approx(np.ones(4))
    # Distance from the quarter chord in chords.
    arm = 0.5 * (axis + 0.5)
    assert exact.pitching_plate_moment(0.0, axis) == pytest.approx(arm)
    assert exact.plunging_plate_moment(0.0, axis) == pytest.approx(arm)


@pytest.mark.parametrize('k', [0.05, 0.3, 1.0])
@pytest.mark.parametrize('axis', [-0.5, 0.2])
def test_oscillating_plate_agrees_with_discrete_vortices(k, axis):
    """Lift and moment in pitch and plunge, with a wake integrated to infinity."""
    def pitch(x):
        return 1.0 + 1j * k * (x - axis)

    expected = np.array([
        exact.plunging_plate_lift(k), exact.plunging_plate_moment(k, axis),
        exact.pitching_plate_lift(k, axis), exact.pitching_plate_moment(k, axis)])
    found = np.array([
        [*discrete_vortex_plate(k, np.ones_like, axis, panels),
         *discrete_vortex_plate(k, pitch, axis, panels)] for panels in (100, 200, 400)])
    # The bound vorticity does not vanish at the trailing edge, where the wake begins: first
    # order on panels that crowd there (and only order 1/2 on equal ones).
    errors = np.abs(found - expected).max(axis=1)
    order = np.log2(errors[:-1] / errors[1:])
    assert order == pytest.approx([1.0, 1.0], abs=0.03)
    # Richardson's limit; its own error falls as the square, from 1e-2 at 100 panels.
    assert np.abs(2.0 * found[2] - found[1] - expected).max() < 1e-4


@pytest.mark.parametrize('hinge', [0.1, 0.5, 0.7, 0.8, 0.95])
def test_flap_is_glauerts_series_of_a_kinked_camber_line(hinge):
    """A unit flap is a camber line of slope -1 behind the hinge; its Fourier terms."""
    kink = np.arccos(1.0 - 2.0 * hinge)   # flap from here to pi
    a0 = integrate.quad(lambda theta: 1.0, kink, np.pi)[0] / np.pi
    a1, a2 = (-2.0 / np.pi * integrate.quad(lambda theta, n=n: np.cos(n * theta), kink, np.pi)[0]
              for n in (1, 2))
    # Cl = 2 pi A0 + pi A1 and Cm about c/4 = -pi/4 (A1 - A2)
    assert exact.flap_effectiveness(hinge) == pytest.approx(a0 + 0.5 * a1, rel=1e-12)
    assert exact.flap_moment_slope(hinge) == pytest.approx(-0.25 * np.pi * (a1 - a2), rel=1e-12)


def test_flap_has_its_limits():
    """A flap of the whole chord is an incidence, one of no chord does nothing."""
    assert exact.flap_effectiveness([0.0, 1.0]) == pytest.approx([1.0, 0.0], abs=1e-15)
    assert exact.flap_moment_slope([0.0, 1.0]) == pytest.approx([0.0, 0.0], abs=1e-15)
    small = 1e-6   # of chord e: tau = 4 sqrt(e)/pi, next term of order e^(3/2)
    assert exact.flap_effectiveness(1.0 - small) == pytest.approx(
        4.0 * np.sqrt(small) / np.pi, rel=1e-5)


def test_potential_sections_need_no_decambering():
    """Each form vanishes on its own potential lift."""
    alpha, alpha_0L = np.radians(np.linspace(-90.0, 80.0, 35)), np.radians(-4.3)
    linear = exact.decambering_2d(2.0 * np.pi * (alpha - alpha_0L), alpha, alpha_0L)
    plate = exact.decambering_2d_exact(
        2.0 * np.pi * np.sin(alpha - alpha_0L), alpha, alpha_0L)
    assert linear == pytest.approx(0.0, abs=1e-15)
    # asin is vertical at a right angle and loses half the digits within 1e-8 of it.
    assert plate == pytest.approx(0.0, abs=1e-12)


def test_decambered_section_has_the_viscous_lift():
    """The section turned by delta has the viscous lift as its potential lift."""
    cl, alpha, alpha_0L = np.array([-1.2, 0.0, 0.9, 1.6]), np.radians(20.0), np.radians(-4.3)
    delta = exact.decambering_2d(cl, alpha, alpha_0L)
    assert 2.0 * np.pi * (alpha - alpha_0L + delta) == pytest.approx(cl, abs=1e-14)
    delta = exact.decambering_2d_exact(cl, alpha, alpha_0L)
    assert 2.0 * np.pi * np.sin(alpha - alpha_0L + delta) == pytest.approx(cl, abs=1e-14)
    # The stalled section of the worked case: -9.65 deg at 20 deg means Cl = 1.61.
    assert np.degrees(exact.decambering_2d(1.6066, alpha, alpha_0L)) == pytest.approx(
        -9.65, abs=0.001)


def lifting_line_elliptic(aspect_ratio, incidence, terms=40):
    """Return CL, CDi and rolling moment of an elliptic wing by collocated lifting line."""
    theta = np.pi * (np.arange(terms) + 0.5) / terms
    n = np.arange(1, terms + 1)
    mu = 2.0 / aspect_ratio * np.sin(theta)   # c a0/(4 b) with the section slope 2 pi
    matrix = np.sin(np.outer(theta, n)) * (
        np.outer(mu, n) + np.sin(theta)[:, np.newaxis])
    a = np.linalg.solve(matrix, mu * incidence(np.cos(theta)) * np.sin(theta))
    return (np.pi * aspect_ratio * a[0], np.pi * aspect_ratio * (n @ a**2),
            0.25 * np.pi * aspect_ratio * a[1])


@pytest.mark.parametrize(('aspect_ratio', 'helmbold', 'prandtl'), [
    (4.0, 3.883, 4.189), (6.0, 4.529, 4.712), (8.0, 4.906, 5.027)])
def test_lift_slopes_have_their_known_values(aspect_ratio, helmbold, prandtl):
    """Quoted with three decimals, hence half a unit of the third."""
    assert exact.helmbold_slope(aspect_ratio) == pytest.approx(helmbold, abs=0.5e-3)
    assert exact.prandtl_slope(aspect_ratio) == pytest.approx(prandtl, abs=0.5e-3)


def test_lift_slopes_have_their_limits():
    """2 pi for a long wing, pi AR/2 for a slender one, Helmbold below lifting line."""
    assert exact.helmbold_slope(1e9) == pytest.approx(2.0 * np.pi, rel=1e-8)
    assert exact.prandtl_slope(1e9) == pytest.approx(2.0 * np.pi, rel=1e-8)
    assert exact.helmbold_slope(1e-9) == pytest.approx(exact.slender_slope(1e-9), rel=1e-8)
    aspect_ratio = np.geomspace(0.1, 100.0, 30)
    helmbold = exact.helmbold_slope(aspect_ratio)
    assert np.all(helmbold < exact.prandtl_slope(aspect_ratio))
    assert np.all(helmbold < exact.slender_slope(aspect_ratio))


@pytest.mark.parametrize('aspect_ratio', [2.0, 8.0, 30.0])
def test_elliptic_wing_agrees_with_a_collocated_lifting_line(aspect_ratio):
    """Slope, induced drag and roll damping of the same Fourier series, solved by points."""
    lift, drag, moment = lifting_line_elliptic(aspect_ratio, np.ones_like)
    assert lift == pytest.approx(exact.prandtl_slope(aspect_ratio), rel=1e-12)
    assert drag == pytest.approx(
        exact.elliptic_induced_drag(lift, aspect_ratio), rel=1e-12)
    assert moment == pytest.approx(0.0, abs=1e-12)
    # p b/(2 V) = 1 gives the incidence 2 y/b, and the moment opposes it.
    lift, _, moment = lifting_line_elliptic(aspect_ratio, lambda eta: eta)
    assert lift == pytest.approx(0.0, abs=1e-12)
    assert -moment == pytest.approx(exact.roll_damping_elliptic(aspect_ratio), rel=1e-12)


@pytest.mark.parametrize('taper', [0.0, 0.3, 0.7, 1.0])
def test_roll_damping_strip_is_its_integral(taper):
    """Strips of slope 2 pi at the incidence p y/V, summed over the span."""
    def chord(eta):   # eta = 2 y/b; chord over mean chord
        return 2.0 * (1.0 - (1.0 - taper) * eta) / (1.0 + taper)

    # Clp = -2 pi int eta (eta/2) chord d(eta) over half the span, twice, halved by b/2.
    integral, _ = integrate.quad(lambda eta: chord(eta) * eta**2, 0.0, 1.0)
    assert exact.roll_damping_strip(taper) == pytest.approx(-np.pi * integral, rel=1e-12)


def test_roll_damping_has_its_limits():
    """Rectangular -pi/3 = -1.047, elliptic -pi/4 as AR -> inf, slender -pi AR/32."""
    assert exact.roll_damping_strip(1.0) == pytest.approx(-1.047, abs=0.5e-3)
    integral, _ = integrate.quad(   # elliptic chord over its mean
        lambda eta: 4.0 / np.pi * np.sqrt(1.0 - eta**2) * eta**2, 0.0, 1.0)
    assert exact.roll_damping_elliptic(1e9) == pytest.approx(-np.pi * integral, rel=1e-7)
    # Slender wing: the potential jump p y sqrt(b^2/4 - y^2) at the trailing edge, b = 2:
    # moment/(rho V p) = int y^2 sqrt(1 - y^2), over q S b (p b/2V)/(rho V p) = S b^2/4.
    integral, _ = integrate.quad(lambda y: y**2 * np.sqrt(1.0 - y**2), -1.0, 1.0)
    area = 4.0 / 0.5   # AR = 0.5
    assert exact.roll_damping_slender(0.5) == pytest.approx(-integral / area, rel=1e-9)
    # Lifting line doubles the damping of a slender wing, as it doubles the lift slope.
    assert exact.roll_damping_elliptic(1e-9) == pytest.approx(
        2.0 * exact.roll_damping_slender(1e-9), rel=1e-8)


def biot_savart(point, curve, tangent, circulation, interval):
    """Return the velocity of the filament curve(u) by quadrature of Biot and Savart's law."""
    def integrand(u, axis):
        r = point - curve(u)
        return np.cross(tangent(u), r)[axis] / np.linalg.norm(r) ** 3

    return circulation / (4.0 * np.pi) * np.array([
        integrate.quad(integrand, *interval, args=(axis,), epsabs=1e-13, epsrel=1e-13,
                       limit=200)[0]
        for axis in range(3)])


@pytest.mark.parametrize('distance', [0.0, 0.4, -1.3])
def test_ring_agrees_with_biot_and_savart(distance):
    """On the axis, the quadrature around the ring."""
    radius, circulation = 0.7, 3.0
    velocity = biot_savart(
        np.array([0.0, 0.0, distance]),
        lambda u: radius * np.array([np.cos(u), np.sin(u), 0.0]),
        lambda u: radius * np.array([-np.sin(u), np.cos(u), 0.0]),
        circulation, (0.0, 2.0 * np.pi))
    expected = exact.ring_axis_velocity(distance, circulation, radius)
    assert velocity == pytest.approx([0.0, 0.0, expected], abs=1e-12)


def test_segment_agrees_with_biot_and_savart():
    """Beside, before and behind a slanted segment."""
    start, end = np.array([0.1, -0.4, 0.2]), np.array([1.0, 0.3, -0.5])
    points = np.array([[0.3, 0.2, 0.6], [-1.0, 0.1, 0.1], [2.0, 2.0, 2.0]])
    velocity = exact.segment_velocity(points, start, end, -1.7)
    assert velocity.shape == (3, 3)
    for point, found in zip(points, velocity):
        expected = biot_savart(
            point, lambda u: start + u * (end - start), lambda u: end - start,
            -1.7, (0.0, 1.0))
        assert found == pytest.approx(expected, abs=1e-12)
    # The two ends exchanged turn the velocity round.
    assert exact.segment_velocity(points, end, start, 1.7) == pytest.approx(velocity)


def test_long_segment_becomes_the_infinite_line():
    """The ends at +-L leave out a share h^2/(2 L^2) of the velocity."""
    origin, direction = np.array([0.3, -0.2, 0.5]), np.array([1.0, 2.0, -2.0])   # length 3
    points = np.array([[1.0, 0.0, 0.0], [0.0, -3.0, 1.0]])
    line = exact.line_vortex_velocity(points, origin, direction, 2.5)
    segment = exact.segment_velocity(
        points, origin - 1e4 * direction, origin + 1e4 * direction, 2.5)
    assert segment == pytest.approx(line, rel=1e-7)
    assert line @ direction == pytest.approx([0.0, 0.0], abs=1e-14)


def test_line_vortex_is_right_handed():
    """Gamma/(2 pi h), along y at a point on x beside a vortex along z."""
    velocity = exact.line_vortex_velocity([2.0, 0.0, 7.0], [0.0, 0.0, 0.0], [0.0, 0.0, 5.0], 3.0)
    assert velocity == pytest.approx([0.0, 3.0 / (4.0 * np.pi), 0.0], abs=1e-15)


def test_closed_polygon_approaches_the_ring():
    """Segments in a polygon approach the ring on its axis as 1/n^2."""
    radius, circulation, point = 0.7, 3.0, np.array([0.0, 0.0, 0.4])
    errors = []
    for n in (40, 80, 160):
        angle = np.linspace(0.0, 2.0 * np.pi, n + 1)
        ring = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(n + 1)])
        velocity = sum(
            exact.segment_velocity(point, a, b, circulation) for a, b in itertools.pairwise(ring))
        errors.append(velocity[2] - exact.ring_axis_velocity(0.4, circulation, radius))
    order = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert order == pytest.approx([2.0, 2.0], abs=0.01)


# The tumbling brick of the NASA check case Atmos_02 (slug ft^2, only ratios matter).
BRICK = np.array([0.001894220, 0.006211019, 0.007194665])


def integrated_rates(inertia, rates0, t):
    """Return the rates by Euler's equations and an 8th-order integrator near round-off."""
    ixx, iyy, izz = inertia
    solution = integrate.solve_ivp(
        lambda _, w: [(iyy - izz) / ixx * w[1] * w[2],
                      (izz - ixx) / iyy * w[2] * w[0],
                      (ixx - iyy) / izz * w[0] * w[1]],
        (0.0, t[-1]), rates0, method='DOP853', t_eval=t, rtol=1e-13, atol=1e-15)
    return solution.y.T


def circles_largest(inertia, rates0):
    """Say whether H^2 > 2T I2, that is, whether H circles the axis of largest inertia."""
    inertia, rates0 = np.asarray(inertia), np.asarray(rates0)
    return inertia**2 @ rates0**2 > np.sort(inertia)[1] * (inertia @ rates0**2)


@pytest.mark.parametrize(('rates0_deg', 'about_largest'), [
    ((10.0, 20.0, 30.0), True), ((40.0, 10.0, 5.0), False)])
def test_brick_agrees_with_integration(rates0_deg, about_largest):
    """30 s of the tumbling brick, on either side of the separatrix."""
    rates0, t = np.radians(rates0_deg), np.linspace(0.0, 30.0, 301)
    assert circles_largest(BRICK, rates0) == about_largest
    rates = exact.torque_free_rates(BRICK, rates0, t)
    assert rates[0] == pytest.approx(rates0, rel=1e-14)
    # The integrator, not the functions, sets the tolerance [rad/s]: 6e-9 deg/s.
    assert rates == pytest.approx(integrated_rates(BRICK, rates0, t), abs=1e-10)


@pytest.mark.parametrize('inertia', list(itertools.permutations((1.0, 2.3, 2.9))))
def test_any_order_of_axes_and_any_signs_agree_with_integration(inertia):
    """All orders of the moments with all signs of the rates, H about either axis."""
    t = np.linspace(0.0, 20.0, 41)
    cases = {True: 0, False: 0}
    for signs in itertools.product((1.0, -1.0), repeat=3):
        for size in ((0.3, 0.5, 1.1), (1.1, 0.5, 0.3), (0.5, 1.1, 0.3)):
            rates0 = np.array(signs) * size
            cases[bool(circles_largest(inertia, rates0))] += 1
            rates = exact.torque_free_rates(inertia, rates0, t)
            assert rates == pytest.approx(integrated_rates(inertia, rates0, t), abs=1e-10)
    assert min(cases.values()) > 0


@pytest.mark.parametrize('rates0', [
    (0.0, 0.7, 1.0), (1.0, 0.0, 0.2), (0.5, 0.3, 0.0), (1.0, 1e-9, 0.0), (0.0, 0.7, -1e-3)])
def test_rates_that_start_at_zero_agree_with_integration(rates0):
    """A component that starts at zero, which puts the phase at its ends."""
    inertia, t = (1.0, 2.3, 2.9), np.linspace(0.0, 20.0, 41)
    rates = exact.torque_free_rates(inertia, rates0, t)
    # Near the unstable axis the integrator's error itself grows by some 1e3 in 20 s.
    assert rates == pytest.approx(integrated_rates(inertia, rates0, t), abs=1e-9)


def test_torque_free_rates_keep_energy_and_momentum():
    """Over 10^4 s, where an integrator drifts, energy and |H| stay to round-off."""
    t = np.linspace(-1e4, 1e4, 1001).reshape(7, 143)
    rates = exact.torque_free_rates(BRICK, np.radians([10.0, 20.0, 30.0]), t)
    assert rates.shape == (7, 143, 3)
    energy, momentum_squared = rates**2 @ BRICK, rates**2 @ BRICK**2
    assert energy == pytest.approx(energy[3, 71], rel=1e-12)
    assert momentum_squared == pytest.approx(momentum_squared[3, 71], rel=1e-12)


@pytest.mark.parametrize('inertia', [
    (2.0, 2.0, 3.1), (2.0, 2.0, 0.6), (3.1, 2.0, 2.0), (2.0, 0.6, 2.0)])
def test_axisymmetric_body_precesses_uniformly(inertia):
    """With two equal moments the spin is constant and the rest turns at a constant rate."""
    inertia, rates0, t = np.array(inertia), np.array([0.4, -0.9, 1.3]), np.linspace(0.0, 40.0, 81)
    spin = next(i for i in range(3) if np.sum(inertia == inertia[i]) == 1)
    across = [(spin + 1) % 3, (spin + 2) % 3]   # right-handed with the spin axis
    turning = (inertia[spin] / inertia[across[0]] - 1.0) * rates0[spin]
    turned = (rates0[across[0]] + 1j * rates0[across[1]]) * np.exp(1j * turning * t)
    rates = exact.torque_free_rates(inertia, rates0, t)
    assert rates[:, spin] == pytest.approx(np.full(81, rates0[spin]), rel=1e-14)
    assert rates[:, across[0]] == pytest.approx(turned.real, abs=1e-13)
    assert rates[:, across[1]] == pytest.approx(turned.imag, abs=1e-13)


def test_permanent_axes_and_spheres_keep_their_rates():
    """Nothing changes about a principal axis, for a sphere, or at rest."""
    for inertia, rates0 in (
            (BRICK, (0.0, 2.0, 0.0)), (BRICK, (0.0, 0.0, -1.0)),
            ((2.0, 2.0, 2.0), (1.0, 2.0, 3.0)), ((2.0, 2.0, 3.0), (1.0, 2.0, 0.0)),
            (BRICK, (0.0, 0.0, 0.0))):
        rates = exact.torque_free_rates(inertia, rates0, [0.0, 1.0, 100.0])
        assert rates == pytest.approx(np.tile(rates0, (3, 1)), abs=1e-15)
        assert exact.torque_free_rates(inertia, rates0, 3.0).shape == (3,)


@pytest.mark.parametrize('nudge', [0.0, 1e-14, -1e-14])
def test_separatrix_turns_over_as_tanh(nudge):
    """At H^2 = 2T I2 the rates are tanh and sech; from the middle to the unstable axis."""
    inertia, middle = np.array([1.0, 2.0, 3.0]), 1.5
    rate = middle * np.sqrt((3.0 - 2.0) * (2.0 - 1.0) / (3.0 * 1.0))
    # From H = 2T/w2 and H^2 = I2 2T on both sides of the middle.
    side = middle * np.array([np.sqrt(2.0 * 1.0 / (1.0 * 2.0)), np.sqrt(2.0 * 1.0 / (3.0 * 2.0))])
    t = np.linspace(0.0, 8.0, 17)
    expected = np.column_stack([
        side[0] / np.cosh(rate * t), middle * np.tanh(rate * t), side[1] / np.cosh(rate * t)])
    rates = exact.torque_free_rates(inertia, [side[0], 0.0, side[1] * (1.0 + nudge)], t)
    # A nudge of 1e-14 grows by exp(rate t) = 1e3 in the sides.
    assert rates == pytest.approx(expected, abs=1e-10)


def test_sphere_falls_as_integrated():
    """The equation of motion, 8th order near round-off."""
    body = {'mass': 5.0, 'diameter': 0.3, 'drag_coefficient': 0.47, 'density': 1.225,
            'gravity': 9.81}
    drag = 0.5 * 1.225 * 0.47 * np.pi * 0.15**2 / 5.0   # over mass and speed squared
    t = np.linspace(0.0, 30.0, 61)
    solution = integrate.solve_ivp(
        lambda _, y: [y[1], 9.81 - drag * y[1] * abs(y[1])], (0.0, 30.0), [0.0, 0.0],
        method='DOP853', t_eval=t, rtol=1e-13, atol=1e-13)
    distance, speed = exact.falling_sphere(t, **body)
    assert distance == pytest.approx(solution.y[0], rel=1e-10, abs=1e-10)
    assert speed == pytest.approx(solution.y[1], rel=1e-10, abs=1e-10)


def test_sphere_has_its_limits():
    """Free fall at first, the terminal speed in the end, without overflow."""
    body = {'mass': 5.0, 'diameter': 0.3, 'drag_coefficient': 0.47, 'density': 1.225,
            'gravity': 9.81}
    distance, speed = exact.falling_sphere(1e-4, **body)
    assert distance == pytest.approx(0.5 * 9.81 * 1e-8, rel=1e-8)
    assert speed == pytest.approx(9.81e-4, rel=1e-8)
    distance, speed = exact.falling_sphere(1e5, **body)
    weight = 5.0 * 9.81
    assert 0.5 * 1.225 * speed**2 * np.pi * 0.15**2 * 0.47 == pytest.approx(weight, rel=1e-12)
    # It lags the terminal speed by v_inf^2 log(2)/g for ever.
    assert speed * 1e5 - distance == pytest.approx(speed**2 / 9.81 * np.log(2.0), rel=1e-7)


def test_a_fall_with_drag_keeps_its_equation_and_its_limits():
    t, step = np.linspace(0.0, 4.0, 41), 1e-5
    v = exact.fall_with_drag(t, 12.0, 3.0)
    slope = (exact.fall_with_drag(t + step, 12.0, 3.0)
             - exact.fall_with_drag(t - step, 12.0, 3.0)) / (2.0 * step)
    assert v[0] == pytest.approx(3.0)
    assert slope == pytest.approx(9.80665 * (1.0 - (v / 12.0) ** 2), abs=1e-7)
    # Without drag g t, and in the end the last speed.
    assert exact.fall_with_drag(0.5, 1e4) == pytest.approx(0.5 * 9.80665, rel=1e-6)
    assert exact.fall_with_drag(60.0, 12.0) == pytest.approx(12.0)


def test_projectile_flies_its_parabola():
    """It keeps its energy and lands v0^2 sin(2 climb)/g away."""
    speed, climb, gravity = 50.0, np.radians(35.0), 9.81
    velocity0_N = np.array([0.0, speed * np.cos(climb), -speed * np.sin(climb)])   # eastward
    landing = 2.0 * speed * np.sin(climb) / gravity
    position_N, velocity_N = exact.projectile(
        [0.0, 0.3 * landing, landing], [7.0, 0.0, -100.0], velocity0_N, gravity)
    assert position_N.shape == velocity_N.shape == (3, 3)
    reach = speed**2 * np.sin(2.0 * climb) / gravity
    assert position_N[2] == pytest.approx([7.0, reach, -100.0], rel=1e-12)
    energy = 0.5 * np.sum(velocity_N**2, axis=-1) - gravity * position_N[:, 2]
    assert energy == pytest.approx(energy[0], rel=1e-12)


def last_digit(value):
    """Return one unit of the fifth digit of a printed value."""
    return 10.0 ** (np.floor(np.log10(value)) - 4)


@pytest.mark.parametrize('row', exact.ISA_TABLE_GEOMETRIC, ids=lambda row: f'{row.altitude:.0f}')
def test_atmosphere_agrees_with_the_printed_table(row):
    """Table I of 1976, to one unit of its fifth digit: it cuts off as often as it rounds."""
    air = exact.isa(float(exact.geopotential_altitude(row.altitude)))
    assert air.temperature == pytest.approx(row.temperature, abs=0.5e-3 + 1e-9)
    assert air.pressure == pytest.approx(row.pressure, abs=last_digit(row.pressure))
    assert air.density == pytest.approx(row.density, abs=last_digit(row.density))
    assert air.sound_speed == pytest.approx(row.sound_speed, abs=0.01)


@pytest.mark.parametrize(
    'row', exact.ISA_TABLE_GEOPOTENTIAL, ids=lambda row: f'{row.altitude:.0f}')
def test_atmosphere_agrees_at_the_bases_of_its_layers(row):
    """To half a unit of the last digit quoted, or a little more."""
    air = exact.isa(row.altitude)
    assert air.temperature == pytest.approx(row.temperature, abs=1e-9)
    assert air.pressure == pytest.approx(row.pressure, rel=1e-6)
    assert air.density == pytest.approx(row.density, rel=3e-6)
    assert air.sound_speed == pytest.approx(row.sound_speed, abs=0.5e-3)


def test_atmosphere_is_in_hydrostatic_balance():
    """dp/dH = -g0 rho through every layer, by integration from the ground."""
    top = [0.0, 5000.0, 11000.0, 15000.0, 20000.0, 26000.0, 32000.0]
    for low, high in itertools.pairwise(top):
        weight, _ = integrate.quad(lambda h: 9.80665 * exact.isa(h).density, low, high)
        assert exact.isa(low).pressure - exact.isa(high).pressure == pytest.approx(
            weight, rel=1e-10)
    below = exact.isa(-1000.0)
    assert below.temperature == pytest.approx(294.65)
    assert below.pressure == pytest.approx(113929.1, abs=0.05)   # seven digits quoted


def test_atmosphere_refuses_what_it_does_not_know():
    """Beyond its layers it says so."""
    for altitude in (-5001.0, 32001.0, float('nan')):
        with pytest.raises(ValueError, match='altitude must lie'):
            exact.isa(altitude)


def test_geopotential_altitude_is_the_work_against_gravity():
    """H = 1/g0 int g dZ with gravity falling as the inverse square of the radius."""
    radius = 6356766.0
    for altitude in (-300.0, 1000.0, 11019.0, 30000.0):
        work, _ = integrate.quad(lambda z: (radius / (radius + z)) ** 2, 0.0, altitude)
        assert exact.geopotential_altitude(altitude) == pytest.approx(work, rel=1e-12)
