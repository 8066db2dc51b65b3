"""A life under a duty: each load has its share of the gait cycles, at the same surfaces."""

import attrs
import numpy as np
import pytest

import leg_wear_monitor as lw

FEW = lw.LifeSettings(legs=2, cycles=3)
ARRAYS = (
    "cycles", "clearance_m", "peak_force_n", "growth_m_per_cycle", "growth_error_m_per_cycle", "depth",
    "rubbing_j_per_cycle",
)  # fmt: skip


def begun(leg, settings=FEW, **options):
    """A life by one jump."""
    run = lw.LifeRun(leg, settings, **options)
    run.jump()
    return run.life


@pytest.mark.parametrize("peak_n", [0.0, 300.0])
def test_a_duty_of_one_load_is_the_life_under_it(leg, peak_n):
    """Bit for bit; under 0 N that of the leg as it is."""
    alone = begun(lw.with_ground_reaction(leg, peak_n) if peak_n else leg, clearances=("A", "G"))
    found = begun(leg, clearances=("A", "G"), duty=lw.Duty({peak_n: 5.0}))
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(found, name), getattr(alone, name), err_msg=name)
    np.testing.assert_array_equal(found.part_growth_m_per_cycle[:, 0], found.growth_m_per_cycle)


def test_a_stance_is_that_of_the_direction_asked_for(leg):
    """A leg that is turned clockwise by the option is the one whose file says so, bit for bit."""
    own = attrs.evolve(leg, drive=attrs.evolve(leg.drive, speed=-leg.drive.speed))
    options = {"clearances": ("G",), "speed_rpm": -60.0, "duty": lw.Duty({600.0: 5.0})}
    by_file, by_option = (
        lw.LifeRun(each, lw.LifeSettings(legs=1, cycles=2), **options).life for each in (own, leg)
    )
    np.testing.assert_array_equal(by_option.growth_m_per_cycle, by_file.growth_m_per_cycle)


def test_growth_is_that_of_the_loads_by_their_hours(leg):
    """At the surfaces of the mixed life, which no load alone would leave; only shares of hours matter."""
    life = begun(leg, clearances=("A", "G"), duty=lw.Duty({0.0: 2.0, 600.0: 6.0}))
    parts = life.part_growth_m_per_cycle
    np.testing.assert_allclose(0.25 * parts[:, 0] + 0.75 * parts[:, 1], life.growth_m_per_cycle, rtol=1e-12)
    assert (parts.min(axis=1) < life.growth_m_per_cycle).all()
    assert (life.growth_m_per_cycle < parts.max(axis=1)).all()
    opened = life.clearance_m[1] - life.clearance_m[0]
    assert (0.5 * life.cycles[1] * parts.min(axis=1).sum(axis=0) < opened).all()
    assert (opened < 0.5 * life.cycles[1] * parts.max(axis=1).sum(axis=0)).all()
    half = begun(leg, clearances=("A", "G"), duty=lw.Duty({0.0: 1.0, 600.0: 3.0}))
    np.testing.assert_array_equal(half.depth, life.depth)
    assert half.end(6e-4)["leg"]["days"] == pytest.approx(2.0 * life.end(6e-4)["leg"]["days"])


@pytest.mark.chaotic
def test_the_order_of_the_joints_is_another_on_the_ground(leg):
    """In the air A, B, G, under 600 N A, G, B, and I wears on more than any other.

    Of 6 cycles each, B exceeds G in the air by exp(0.129), sigma 0.025, G exceeds B by exp(0.078), sigma
    0.013, and I rises by exp(0.41) more than J, sigma 0.05 (30 starts moved by 1e-12, 2026-11-25); here are
    8 cycles.
    """
    duty = lw.Duty({0.0: 1.0, 600.0: 1.0})
    air, ground = lw.LifeRun(leg, lw.LifeSettings(legs=2, cycles=8), duty=duty).life.part_growth_m_per_cycle[
        0
    ]
    a, b, g, i, _ = range(5)
    assert air[a] > air[b] > air[g]
    assert ground[a] > ground[g] > ground[b]
    assert (ground / air).argmax() == i


def test_a_held_joint_grows_under_no_load(leg):
    run = lw.LifeRun(leg, FEW, clearances=("A", "B"), duty=lw.Duty({0.0: 1.0, 600.0: 1.0}))
    run.hold(1)
    run.jump()
    assert (run.life.part_growth_m_per_cycle[-1, :, 1] == 0.0).all()
    assert (run.life.part_growth_m_per_cycle[-1, :, 0] > 0.0).all()


def test_the_table_has_hours_days_and_the_growth_under_each_load(leg):
    life = begun(leg, clearances=("A", "J"), duty=lw.Duty({0.0: 2.0, 300.0: 6.0}))
    columns, record = life.columns(), life.to_dict()
    assert columns["hours"][1] == pytest.approx(life.cycles[1] / 3600.0)  # at 60 rpm
    np.testing.assert_allclose(columns["days"], np.array(columns["hours"]) / 8.0)
    for part, name in enumerate(("growth_0_n_m_per_cycle", "growth_300_n_m_per_cycle")):
        for k, joint in enumerate("AJ"):
            growth = record["joints"][joint]["part_growth_m_per_cycle"][part]
            assert columns[name][2 * k : 2 * k + 2] == growth
    assert "hours" not in begun(leg, clearances=("A",)).columns()


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "'' is not N:hours per day. Expected for example 0:2,300:5,600:1"),
        ("300", "'300' is not N:hours per day"),
        ("0:2,300:x", "'300:x' is not N:hours per day"),
        ("0:2;300:5", "'0:2;300:5' is not N:hours per day"),
        ("-5:2", "-5 N is not a peak from 0 to 10000 N"),
        ("nan:2", "nan N is not a peak"),
        ("300:0", "0 h at 300 N is not a time above 0 h"),
        ("300:inf", "inf h at 300 N is not a time above 0 h"),
        ("0:20,300:5", "25 h per day in total are more than 24 h"),
        ("300:2,300:5", "300 N occurs twice"),
    ],
)
def test_a_duty_that_cannot_be_is_refused(text, fault):
    with pytest.raises(lw.ConfigError) as error:
        lw.Duty.parse(text)
    assert str(error.value).startswith(f"duty: {fault}")


def test_a_duty_has_a_load():
    with pytest.raises(lw.ConfigError, match=r"^duty: has no load"):
        lw.Duty({})


def test_a_leg_without_a_toe_has_no_duty():
    with pytest.raises(lw.ConfigError, match="has no point called toe for the ground to push"):
        lw.Duty({300.0: 1.0}).mechanisms(lw.load_mechanism("slider_crank"))
