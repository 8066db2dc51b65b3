"""The trial step of `dynamics.clearance.step` in lanes, without worn walls and films: of `lanes.py`.

Vectors (rows of LANES doubles) of flat arrays are addressed by their index; d = 2 k eccentricities. Joints
without contact are masked: their normals, and with them their rows of the system, are 0.
"""

# mypy: disable-error-code="no-untyped-def"
import math

from lane_vectors import every, put, root, size, take, where_above
from numba import njit

GAMMA = 1.0 - math.sqrt(0.5)

_OPTIONS = {"error_model": "numpy", "_nrt": False}


@njit(forceinline=True, **_OPTIONS)
def _largest(a, b):
    return where_above(a, b, a, b)


@njit(forceinline=True, **_OPTIONS)
def _accelerate(k, inverse_mass, lever, response, lever_drive, speed, drift, laws, e, v, out_a, out_start):
    zero, one, d = every(0.0), every(1.0), 2 * k
    for i in range(d):
        put(out_a, i, take(drift, i))
    for j in range(k):
        ex, ey, vx, vy = take(e, 2 * j), take(e, 2 * j + 1), take(v, 2 * j), take(v, 2 * j + 1)
        length = root(ex * ex + ey * ey)
        inverse = one / _largest(length, every(1.0e-300))
        nx, ny = ex * inverse, ey * inverse
        delta = length - take(laws, 2 * k + j)
        inside, loss = _largest(delta, zero), take(laws, k + j)
        elastic = take(laws, j) * inside * root(inside)
        f_n = _largest(elastic * (one + loss * (nx * vx + ny * vy)), zero)
        slip = nx * vy - ny * vx + take(lever_drive, j) * take(speed, 0)
        for i in range(d):
            slip = slip + take(lever, j * d + i) * take(v, i)
        fraction = _largest((size(slip) - take(laws, 4 * k + j)) * take(laws, 5 * k + j), zero)
        f_t = take(laws, 3 * k + j) * where_above(fraction, one, one, fraction) * f_n
        f_t = where_above(slip, zero, zero - f_t, f_t)
        fx, fy = zero - f_n * nx - f_t * ny, f_t * nx - f_n * ny
        for i in range(d):
            pushed = take(inverse_mass, 2 * j * d + i) * fx + take(inverse_mass, (2 * j + 1) * d + i) * fy
            put(out_a, i, take(out_a, i) + (pushed + take(response, j * d + i) * f_t))
        put(out_start, j, f_n)
        put(out_start, k + j, nx)
        put(out_start, 2 * k + j, ny)
        stiffness = every(1.5) * f_n / _largest(delta, every(1.0e-300))
        put(out_start, 3 * k + j, where_above(f_n, zero, stiffness, zero))
        put(out_start, 4 * k + j, where_above(f_n, zero, elastic * loss, zero))


@njit(forceinline=True, **_OPTIONS)
def _factorise(k, g, inverse_mass, start, out_response, out_factor, out_ratio, out_normal):
    zero, one, d = every(0.0), every(1.0), 2 * k
    for a in range(k):
        f_n, stiffness = take(start, a), take(start, 3 * k + a)
        nx = where_above(f_n, zero, take(start, k + a), zero)
        ny = where_above(f_n, zero, take(start, 2 * k + a), zero)
        put(out_normal, 2 * a, nx)
        put(out_normal, 2 * a + 1, ny)
        compliance = one / where_above(f_n, zero, g * (take(start, 4 * k + a) + g * stiffness), one)
        put(out_ratio, a, where_above(f_n, zero, g * stiffness * compliance, zero))
        for i in range(d):
            row = nx * take(inverse_mass, 2 * a * d + i) + ny * take(inverse_mass, (2 * a + 1) * d + i)
            put(out_response, a * d + i, row)
        for b in range(a + 1):
            along = nx * take(out_response, b * d + 2 * a) + ny * take(out_response, b * d + 2 * a + 1)
            put(out_factor, a * k + b, along)
        put(out_factor, a * k + a, take(out_factor, a * k + a) + compliance)
    for i in range(k):
        for j in range(i):
            entry = take(out_factor, i * k + j)
            for c in range(j):
                entry = entry - take(out_factor, i * k + c) * take(out_factor, j * k + c)
            put(out_factor, i * k + j, entry)
        pivot = take(out_factor, i * k + i)
        for c in range(i):
            entry = take(out_factor, i * k + c)
            scaled = entry * take(out_factor, c * k + c)
            pivot = pivot - scaled * entry
            put(out_factor, i * k + c, scaled)
        put(out_factor, i * k + i, one / pivot)


@njit(forceinline=True, **_OPTIONS)
def _solve(k, g, response, factor, ratio, normal, r_e, r_v, out_e, out_v, out_p):
    for a in range(k):
        nx, ny = take(normal, 2 * a), take(normal, 2 * a + 1)
        p = nx * take(r_v, 2 * a) + ny * take(r_v, 2 * a + 1)
        p = p + take(ratio, a) * (nx * take(r_e, 2 * a) + ny * take(r_e, 2 * a + 1))
        for b in range(a):
            p = p - take(factor, a * k + b) * take(out_p, b)
        put(out_p, a, p)
    for back in range(k):
        a = k - 1 - back
        p = take(out_p, a) * take(factor, a * k + a)
        for b in range(a + 1, k):
            p = p - take(factor, b * k + a) * take(out_p, b)
        put(out_p, a, p)
    for i in range(2 * k):
        rate = take(r_v, i)
        for a in range(k):
            rate = rate - take(response, a * 2 * k + i) * take(out_p, a)
        put(out_v, i, rate)
        put(out_e, i, take(r_e, i) + g * rate)


@njit(forceinline=True, **_OPTIONS)
def _room(room, lanes, at, vectors):
    return room[at * lanes : (at + vectors) * lanes], at + vectors


@njit(nogil=True, **_OPTIONS)
def trials(
    count, k, step, tolerance, inverse_mass, lever, response, lever_drive, speed, e0, v0, a0, drift,
    start, laws, out_e, out_v, out_error, room,
):  # fmt: skip
    """The step of lengths (LANES,) [s] many times over; results: e and v at its end, error over tolerance.

    ``start``: normal force, normal, stiffness and damping of each joint; ``laws``: coefficient, loss,
    clearance, friction coefficient, begin and inverse width of the ramp.
    """
    d, lanes = 2 * k, len(out_error)
    k1e, at = _room(room, lanes, 0, d)
    k1v, at = _room(room, lanes, at, d)
    k2e, at = _room(room, lanes, at, d)
    k2v, at = _room(room, lanes, at, d)
    r_e, at = _room(room, lanes, at, d)
    r_v, at = _room(room, lanes, at, d)
    e, at = _room(room, lanes, at, d)
    v, at = _room(room, lanes, at, d)
    a1, at = _room(room, lanes, at, d)
    end, at = _room(room, lanes, at, 5 * k)
    by_normal, at = _room(room, lanes, at, k * d)
    factor, at = _room(room, lanes, at, k * k)
    ratio, at = _room(room, lanes, at, k)
    normal, at = _room(room, lanes, at, d)
    p, at = _room(room, lanes, at, k)
    two, half = every(2.0), every(0.5)
    for _ in range(count):
        h = take(step, 0)
        g = every(GAMMA) * h
        _factorise(k, g, inverse_mass, start, by_normal, factor, ratio, normal)
        _solve(k, g, by_normal, factor, ratio, normal, v0, a0, k1e, k1v, p)
        for i in range(d):
            put(e, i, take(e0, i) + h * take(k1e, i))
            put(v, i, take(v0, i) + h * take(k1v, i))
        _accelerate(k, inverse_mass, lever, response, lever_drive, speed, drift, laws, e, v, r_v, end)
        for i in range(d):
            put(r_e, i, take(v, i) - two * take(k1e, i))
            put(r_v, i, take(r_v, i) - two * take(k1v, i))
        _solve(k, g, by_normal, factor, ratio, normal, r_e, r_v, k2e, k2v, p)
        for i in range(d):
            put(out_e, i, take(e0, i) + h * (every(1.5) * take(k1e, i) + half * take(k2e, i)))
            put(out_v, i, take(v0, i) + h * (every(1.5) * take(k1v, i) + half * take(k2v, i)))
        _accelerate(k, inverse_mass, lever, response, lever_drive, speed, drift, laws, out_e, out_v, a1, end)
        for i in range(d):
            curve = h * h * every(1.0 / 6.0) * (two * take(a0, i) + take(a1, i))
            put(r_e, i, take(out_e, i) - take(e0, i) - h * take(v0, i) - curve)
            put(r_v, i, take(out_v, i) - take(v0, i) - half * h * (take(a0, i) + take(a1, i)))
        _solve(k, g, by_normal, factor, ratio, normal, r_e, r_v, k2e, k2v, p)
        worst = every(0.0)
        for i in range(d):
            worst = _largest(worst, size(take(k2e, i)) * every(tolerance[0]))
            worst = _largest(worst, size(take(k2v, i)) * every(tolerance[1]))
        put(out_error, 0, worst)
        put(e0, 0, take(e0, 0) + every(0.0) * worst)  # a step waits for the one before
