"""Time integration in clearance coordinates: adaptive steps, contact events (physics.md section 7).

The state exists at whole intervals of time. Within an interval, or within each of its parts where the linkage
moves fast, the tables hold the values at the middle, and the steps adapt to a local error (Rosenbrock, order
2). The result therefore does not depend on how the time is divided into calls, and the cost of a call is
bounded by its number of intervals.
"""

import math

from leg_wear_monitor.compiled import numba
from leg_wear_monitor.compiled.kernel import ByAddress, entry, kernel
from leg_wear_monitor.compiled.vectors import (
    WIDTH,
    bits_of,
    copy_array,
    every,
    number_of,
    part_at,
    put_vector,
    vector_at,
    vector_sum,
)
from leg_wear_monitor.dynamics.clearance.contact import (
    A0,
    BY_V,
    CAM,
    DV,
    E0,
    LIFT,
    RUB,
    V0,
    accelerate_clearances,
    force_in_joint,
)
from leg_wear_monitor.dynamics.clearance.model import (
    ACCELERATION,
    ANGLE,
    PARTS,
    SPEED,
    STIFFNESS,
    blend,
    crank_between,
)
from leg_wear_monitor.dynamics.clearance.step import (
    coupling_torque,
    deposit_due,
    deposit_pending,
    gather_wear,
    integrate_joints,
    leave_pending,
    load_state,
    release,
    sample_start,
    shift_start,
    take_pending,
    try_step,
    turn_crank,
)
from leg_wear_monitor.dynamics.joint import (
    F_N,
    F_T,
    NEVER,
    contact_energy,
    first_contact_event,
    pushed_through,
    update_contacts,
)
from leg_wear_monitor.dynamics.run import (
    DONE,
    FORCE,
    FORCE_SQUARED,
    INVALID_DRIVE,
    JOINT_RATES,
    POWER,
    PUSHED_THROUGH,
    STEP_TOO_SMALL,
    TORQUE,
    TORQUE_ERROR,
    TORQUE_SQUARED,
    bin_of,
    drive_at,
)
from leg_wear_monitor.wear import Surfaces

# Drive torque, reactions of ideal joints and toe motion from the eccentricities (physics.md section 7).


@kernel
def drive_torque(now, x, sample):
    """Drive torque [N m] from rows E0, V0, A0 and BY_V of x, and its smooth part [N m].

    The smooth part lacks the terms of e'' and of the contact forces, which impacts change suddenly.
    """
    steady, abrupt = every(0.0), every(0.0)
    for i in range(0, now.torque_a.shape[0], WIDTH):
        steady += vector_at(x, (BY_V, i)) * vector_at(x, (V0, i))
        steady += part_at(now.torque_by_e, i) * vector_at(x, (E0, i))
        abrupt += part_at(now.torque_a, i) * vector_at(x, (A0, i))
    for k in range(0, sample.shape[1], WIDTH):
        abrupt += vector_at(sample, (F_N, k)) * vector_at(sample, (CAM, k))
        abrupt -= part_at(now.lever_drive, k) * vector_at(sample, (F_T, k))
    smooth = now.torque_0[0] + vector_sum(steady)
    return smooth + vector_sum(abrupt), smooth


@kernel
def sudden_impulse(now, x, added):
    """Integral over a step [N m s] of the drive torque without its smooth part.

    The term of e'' follows from the change of the rates, row DV, which is exact for the torque peaks of
    impacts. The terms of the contact forces follow from their integrals in ``added``, which use the same rule
    as the losses.
    """
    total = every(0.0)
    for i in range(0, now.torque_a.shape[0], WIDTH):
        total += part_at(now.torque_a, i) * vector_at(x, (DV, i))
    for k in range(0, added.shape[1], WIDTH):
        total += vector_at(added, (LIFT, k)) - part_at(now.lever_drive, k) * vector_at(added, (RUB, k))
    return vector_sum(total)


@kernel
def reactions(tables, angle, now, x, sample, out_by, out_reaction):
    """Drive torque [N m] and reactions of the ideal joints [N] at a crank angle, in the tables' order.

    ``out_by`` (3 + 2 d + k,) contains the factors of the table's columns; out_reaction has room for vectors.
    """
    table, speed, d = tables.reaction, now.speed[0], now.torque_a.shape[0]
    out_by[0], out_by[1], out_by[2] = 1.0, now.speed[1], speed * speed
    for i in range(d):
        out_by[3 + i], out_by[3 + d + i] = x[A0, i], speed * x[V0, i]
    for k in range(now.lever_drive.shape[0]):
        out_by[3 + 2 * d + k] = sample[F_T, k]
    i, w = blend(table.shape[0] - 1, angle)
    for r in range(0, out_reaction.shape[0], WIDTH):
        before, after = every(0.0), every(0.0)
        for c in range(out_by.shape[0]):
            before += out_by[c] * vector_at(table, (i, c, r))
            after += out_by[c] * vector_at(table, (i + 1, c, r))
        put_vector(out_reaction, r, (1.0 - w) * before + w * after)


@kernel
def outside_power(now, x):
    """Power of loads [W] for the rates in row V0."""
    d, speed = now.torque_a.shape[0], now.speed[0]
    total = every(0.0)
    for i in range(0, d, WIDTH):
        total += part_at(now.load_power, i) * vector_at(x, (V0, i))
    return now.load_power[d] * speed + vector_sum(total)


@kernel
def toe_deviation(now, x, out_response):
    """Update the toe's largest deviations from the ideal linkage: position, velocity, acceleration."""
    along = _along_toe(0, now, x), _along_toe(1, now, x)
    for i in range(3):
        square = along[0][i] ** 2 + along[1][i] ** 2
        if square > out_response[i] ** 2:
            out_response[i] = math.sqrt(square)


@kernel
def _along_toe(row, now, x):
    """Deviation of the toe along x (row 0) or y (1): position, velocity, acceleration."""
    d, toe, double = now.torque_a.shape[0], now.toe, 2.0 * now.speed[0]
    position, velocity, acceleration = every(0.0), every(0.0), every(0.0)
    for i in range(0, d, WIDTH):
        e, v, a = vector_at(x, (E0, i)), vector_at(x, (V0, i)), vector_at(x, (A0, i))
        by, turning = part_at(toe, (row, 1 + i)), double * part_at(toe, (row, 1 + d + i))
        position += by * e
        velocity += by * v + 0.5 * turning * e
        acceleration += by * a + turning * v
    return vector_sum(position), vector_sum(velocity), vector_sum(acceleration)


# intervals between two evaluations of the ideal joints' reactions; their maxima are evaluated in impacts, and
# means over all steps would make a gait cycle of five clearance joints an eighth longer
RENEWAL = 2
WEARING = 8  # intervals after which pending wear is deposited, to spread its cost over many steps

MOST_TRIALS = 20000  # trial steps in a part of an interval before the run stops

_SHORTEST_STEP = 1.0e-13  # s
_CUBE_ROOT_GUESS = 0x553EF0FF289DD796  # bits of 1, times 4/3, minus the offset with the least maximal error
# A rest equal to one step up to rounding is one step; otherwise the last bit would decide between one and two
# steps.
_NEARLY = 1.0 + 1.0e-6
# largest ratio of a step to the previous step: no growth after a trial with too large an error
_FASTEST_GROWTH = 3.0
# drive at one end of a step: torque [N m], its smooth part [N m], power of loads [W]
WHOLE, SMOOTH, OUTSIDE = 0, 1, 2

_FURTHEST = 1.0  # rad: largest turn of a crank behind a coupling in half a part of an interval
_FASTEST = 1.0e4  # largest crank speed, and largest change of it in an interval [rad/s]: far above any leg


@entry
def advance_clearances(model, feeds_back, state, polynomial, t_end, statistics, work):
    """Advance the state by all whole intervals up to t_end [s] and add to the run statistics.

    ``polynomial`` (7,) is the crank's motion from the present time to t_end, as in `run.drive`.

    Returns
    -------
    status, k
        DONE, or the reason for stopping and the clearance joint concerned (-1 if none). The state is then
        the state of the last whole interval; it is finite and can be continued.
    """
    surfaces = Surfaces(state.depth, feeds_back)
    while (state.intervals[0] + 1.0) * model.interval <= t_end * (1.0 + 1.0e-12) + 1.0e-15:
        copy_array(state.motion, work.backup)
        take_pending(state.pending, work.pending)
        status, k = _interval(model, surfaces, state, polynomial, statistics, work)
        if status != DONE:
            copy_array(work.backup, state.motion)
        leave_pending(work.pending, state.pending)  # deposited wear must not become pending again
        if status != DONE:
            return status, k
    return DONE, -1


# Address for kernels that call it indirectly: they need not contain it, which would double the code to
# compile.
ADVANCE = ByAddress(advance_clearances, numba.types.UniTuple(numba.types.int64, 2))


@kernel
def _interval(model, surfaces, state, polynomial, statistics, work):
    """Advance by one interval, in smaller parts where the linkage moves fast; returns status and joint."""
    i, _ = blend(model.parts.shape[0], state.drive[ANGLE])
    parts, status, k = model.parts[i], DONE, -1
    if model.coupling.law[STIFFNESS] > 0.0:
        parts *= int(model.coupling.law[PARTS])
    for part in range(parts):
        begin, end = state.intervals[0] + part / parts, state.intervals[0] + (part + 1.0) / parts
        status, k = _part(
            model, surfaces, state, polynomial, begin * model.interval, end * model.interval, statistics, work
        )
        if status != DONE:
            break
    _add_sums(model.contacts.joint, work.sums, statistics)
    if status == DONE:
        state.intervals[0] += 1.0
        _finish(model, surfaces, state, statistics, work)
    return status, k


@kernel
def _add_sums(joint, sums, statistics):
    """Add the integrals of an interval (JOINT_RATES, room) to the run statistics, and set them to 0."""
    for k in range(joint.shape[0]):
        for r in range(JOINT_RATES):
            statistics.integral[joint[k], r] += sums[r, k]
            sums[r, k] = 0.0


@kernel
def _part(model, surfaces, state, polynomial, begin, end, statistics, work):
    """Advance by a part of an interval, from begin to end [s], with the tables of its middle."""
    length = end - begin
    copy_array(state.drive, work.crank)
    coupled, torque = model.coupling.law[STIFFNESS] > 0.0, 0.0
    if coupled:
        drive_at(polynomial, begin + 0.5 * length, state.drive)
        speed, acceleration = work.crank[SPEED], 0.0
        angle = work.crank[ANGLE] + 0.5 * length * speed
        law = model.coupling.law
        torque = coupling_torque(law, state.drive[ANGLE], state.drive[SPEED], angle, speed)
    else:
        drive_at(polynomial, end, state.drive)
        angle, speed, acceleration = crank_between(work.crank, state.drive, length)
    if not (abs(speed) < _FASTEST and abs(acceleration) * length < _FASTEST):
        return INVALID_DRIVE, -1
    load_state(model, surfaces, state, angle, speed, acceleration, 0.5 * length, work)
    whole, steeper = 1.0, 0.0
    if coupled:
        whole, steeper = release(model.coupling, angle, length, torque, work)
    impulse = statistics.drive_integral[TORQUE]
    turned = -0.5 * length * speed  # crank angle at the start, relative to the tables' angle
    sample_start(model, surfaces, state, turned, begin, statistics, work)
    status, k = _steps(model, surfaces, state, begin, length, statistics, work)
    if status == DONE:
        if coupled:
            law = model.coupling.law
            turn_crank(law, whole, steeper, length, torque, impulse, state, statistics, work)
            if not (abs(state.drive[SPEED]) < _FASTEST and abs(state.drive[ANGLE] - angle) < _FURTHEST):
                return INVALID_DRIVE, -1
        for i in range(state.e.shape[0]):
            state.e[i], state.v[i] = work.x[E0, i], work.x[V0, i]
    return status, k


@kernel
def _steps(model, surfaces, state, begin, length, statistics, work):
    """All steps of a part of the given begin and length [s]; returns status and joint."""
    x, now, start, end, approach = work.x, work.now, work.start, work.end, state.approach
    contacts = model.contacts
    done, trials, cut, growth = 0.0, 0, NEVER, _FASTEST_GROWTH
    speed = now.speed[0]
    _sample_drive(now, x, start, work.drive_start, statistics)
    while done < length:
        left = length - done
        h = state.step[0]
        if left < 2.0 * h:
            h = left if left <= _NEARLY * h else 0.5 * left
        if cut < NEVER:
            h = cut
        turned = speed * (done + h - 0.5 * length)
        error = try_step(model, surfaces, approach, h, turned, now, work.system, x, start, end)
        trials += 1
        statistics.steps[0] += 1
        if not error <= 1.0:
            state.step[0] = h * max(0.2, 0.9 * inverse_cube_root(error)) if error < 1.0e9 else 0.1 * h
            cut, growth = NEVER, 1.0
            if state.step[0] < _SHORTEST_STEP or trials > MOST_TRIALS:
                return STEP_TOO_SMALL, pushed_through(contacts.bushing_radius, end)
            continue
        fraction = first_contact_event(approach, h, start, end)
        if fraction < 1.0 and fraction * h > _SHORTEST_STEP and trials <= MOST_TRIALS:
            cut = fraction * h
            continue
        pushed = pushed_through(contacts.bushing_radius, end)
        if pushed >= 0:
            return PUSHED_THROUGH, pushed
        if cut == NEVER:
            state.step[0] = h * _next_over(error, growth)
        cut, growth = NEVER, _FASTEST_GROWTH
        _accept(model, surfaces, state, begin + done, h, turned, statistics, work)
        done = length if h >= left * (1.0 - 1.0e-9) else done + h
    return DONE, -1


@kernel
def _next_over(error, growth):
    """Ratio of the next step's length to this step's length, by the local error relative to the tolerance."""
    return growth if error * growth**3 <= 0.9**3 else 0.9 * inverse_cube_root(error)


@kernel
def inverse_cube_root(x):
    """x^(-1/3) to 1.2e-5, for a normal positive x: a guess by the bits, nearly a logarithm, and Newton.

    The library's power would take as long as the forces of all joints.
    """
    y = number_of(_CUBE_ROOT_GUESS - bits_of(x) // 3)
    y *= (4.0 - x * y * y * y) / 3.0
    return y * (4.0 - x * y * y * y) / 3.0


@kernel
def _accept(model, surfaces, state, t, h, turned, statistics, work):
    """Accept the trial step of length h [s] from time t [s]: statistics, wear, contact events.

    ``turned``: crank angle at the end of the step, relative to the crank angle of the tables [rad].
    """
    x, now, start, end, contacts = work.x, work.now, work.start, work.end, model.contacts
    statistics.steps[1] += 1
    integrate_joints(model, state.approach, h, start, end, work.added)
    gather_wear(work.added, start, end, work.pending)
    for k in range(0, work.added.shape[1], WIDTH):
        for r in range(JOINT_RATES):
            put_vector(work.sums, (r, k), vector_at(work.sums, (r, k)) + vector_at(work.added, (r, k)))
    _, peaked = update_contacts(
        contacts.joint, contacts.speed_floor, t, h, start, end,
        state.approach, state.recent, statistics.peak, statistics.impact, statistics.impacts,
    )  # fmt: skip
    if peaked and model.coupling.law[STIFFNESS] == 0.0:  # behind a coupling, the crank's acceleration follows
        reactions(model.tables, state.drive[ANGLE], now, x, start, work.by, work.reaction)
        _add_reactions(model.tables.reaction_joint, work.reaction, 0.0, statistics)
    shift_start(now, x)
    copy_array(end, start)
    statistics.worn_energy[0] += deposit_due(
        contacts, surfaces, state.approach, start, now, turned, work.pending, work.weight
    )
    _sample_drive(now, x, start, work.drive_end, statistics)
    toe_deviation(now, x, statistics.response)
    first, last = work.drive_start, work.drive_end
    impulse = 0.5 * h * (first[SMOOTH] + last[SMOOTH]) + sudden_impulse(now, x, work.added)
    statistics.drive_integral[TORQUE] += impulse
    statistics.drive_integral[TORQUE_SQUARED] += 0.5 * h * (first[WHOLE] ** 2 + last[WHOLE] ** 2)
    statistics.drive_integral[POWER] += impulse * now.speed[0] + 0.5 * h * (first[OUTSIDE] + last[OUTSIDE])
    copy_array(last, first)


@kernel
def _sample_drive(now, x, sample, out_drive, statistics):
    """Drive torque, its smooth part [N m] and the power of loads [W], (3,); updates the extremes."""
    torque, smooth = drive_torque(now, x, sample)
    out_drive[WHOLE], out_drive[SMOOTH], out_drive[OUTSIDE] = torque, smooth, outside_power(now, x)
    statistics.drive_range[0] = min(statistics.drive_range[0], torque)
    statistics.drive_range[1] = max(statistics.drive_range[1], torque)
    statistics.response[TORQUE_ERROR] = max(statistics.response[TORQUE_ERROR], abs(torque - now.torque_0[0]))


@kernel
def _finish(model, surfaces, state, statistics, work):
    """Finish an interval: deposit wear; add to the distributions and to the ideal joints' reactions."""
    joint, now, sample, interval = model.contacts.joint, work.now, work.start, model.interval
    count = int(state.intervals[0])
    here = 0.5 * interval * now.speed[0]
    amid = (1 - WEARING) * here
    statistics.time[0] += interval
    for k in range(state.approach.shape[0]):
        if (count + k) % WEARING == 0:
            statistics.worn_energy[0] += deposit_pending(
                model.contacts, surfaces, k, sample, now, here, amid, work.pending, work.weight
            )
        force = force_in_joint(k, sample)
        statistics.force_time[joint[k], bin_of(force)] += interval
    torque = work.drive_start[WHOLE]
    statistics.torque_time[1 if torque > 0.0 else 0, bin_of(abs(torque))] += interval
    if count % RENEWAL == 0:
        reactions(model.tables, state.drive[ANGLE], now, work.x, sample, work.by, work.reaction)
        _add_reactions(model.tables.reaction_joint, work.reaction, RENEWAL * interval, statistics)


@kernel
def _add_reactions(joints, reaction, weight, statistics):
    """Add the ideal joints' reactions (r,) to the run statistics, for a time ``weight`` [s]."""
    row = 1
    while row < joints.shape[0]:
        joint = joints[row]
        squared = reaction[row] ** 2 + reaction[row + 1] ** 2
        force = math.sqrt(squared)
        statistics.integral[joint, FORCE] += weight * force
        statistics.integral[joint, FORCE_SQUARED] += weight * squared
        statistics.peak[joint] = max(statistics.peak[joint], force)
        statistics.force_time[joint, bin_of(force)] += weight
        row += 2


@entry
def observe(model, feeds_back, state, work):
    """Evaluate the leg in its present state, without a change of the state.

    Fills the samples ``start``, ``reaction`` and ``toe`` of the work arrays; returns the elastic energy of
    the contacts [J].
    """
    surfaces, now, x = Surfaces(state.depth, feeds_back), work.now, work.x
    copy_array(state.motion, work.backup)
    angle, speed = state.drive[ANGLE], state.drive[SPEED]
    load_state(model, surfaces, state, angle, speed, state.drive[ACCELERATION], 0.0, work)
    accelerate_clearances(model, surfaces, state.approach, now, 0.0, x, E0, V0, A0, work.start, True)
    copy_array(work.backup, state.motion)
    reactions(model.tables, angle, now, x, work.start, work.by, work.reaction)
    work.reaction[0] = drive_torque(now, x, work.start)[0]
    d = state.e.shape[0]
    for i in range(2):
        work.toe[i] = now.toe[i, 0]
        for j in range(d):
            work.toe[i] += now.toe[i, 1 + j] * x[E0, j]
    energy = 0.0
    for k in range(state.approach.shape[0]):
        ex, ey = state.e[2 * k], state.e[2 * k + 1]
        energy += contact_energy(model.contacts, surfaces, k, ex, ey, now.angle[k, 0], now.angle[k, 1])
    return energy
