"""Clearances and other causes from signatures of which the statistics are known."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor.estimate.cause import Cause, Change
from leg_wear_monitor.estimate.clearance_fit import best_fit, fit_clearances, starts_of, with_rivals
from leg_wear_monitor.estimate.explanations import (
    Baseline,
    Explainer,
    Explanation,
    Misfits,
    Nuisance,
    OtherChannel,
    OtherNoise,
    change_of,
    with_doubt,
)
from leg_wear_monitor.estimate.leg_model import with_scatter_of
from leg_wear_monitor.estimate.signature import Changes, SignatureModel, TorqueSensor

JOINTS = ("A", "B", "G")
NEW = np.full(3, 3.0e-4)
F = 40
GRID = NEW[0] * np.array([1.0, 1.2, 1.5, 2.0, 5.0])


@pytest.fixture(scope="module")
def explainer() -> Explainer:
    """A model that is piecewise linear in logarithms, with friction and a heavier foot."""
    random = np.random.default_rng(1234)
    slopes = 3.0 * random.standard_normal((3, F))
    change = np.log(GRID / NEW[0])[None, :, None] * slopes[:, None, :]
    model = SignatureModel(
        TorqueSensor(0.005, 1.0, 10.0), np.zeros(F), Changes(np.tile(GRID, (3, 1)), change), np.eye(F), 1.0e-6
    )
    baseline = Baseline(0.1 * random.standard_normal(F), 1.0e-4 * np.eye(F))
    friction = Nuisance(Cause.FRICTION, "", np.r_[np.ones(F // 2), np.zeros(F // 2)], 0.3)
    foot = Nuisance(Cause.MASS, "foot", 10.0 * random.standard_normal(F), 0.0)
    return Explainer(model, JOINTS, baseline, (friction, foot))


def with_changes(model, change) -> SignatureModel:
    """A model with other changes (k, s, F) by its joints."""
    return attrs.evolve(model, joints=attrs.evolve(model.joints, change=change))


def measured(explainer, clearance, cycles: int, seed: int, extra=0.0):
    """Mean signature of some cycles."""
    random = np.random.default_rng(seed)
    noise = random.standard_normal(F) / np.sqrt(cycles)
    return explainer.model.at(np.asarray(clearance))[0] + explainer.baseline.offset + noise + extra


@pytest.mark.parametrize(("cycles", "scatter"), [(1, 0.0), (10, 0.3), (1000, 0.01)])
def test_whitened_signatures_are_independent(explainer, cycles: int, scatter: float) -> None:
    turned = np.random.default_rng(5).standard_normal((F, F))
    model = attrs.evolve(explainer.model, covariance=np.eye(F) + turned @ turned.T)
    own = Explainer(model, JOINTS, explainer.baseline, explainer.nuisances)
    covariance = own.covariance(cycles) + scatter * model.covariance
    whiten, log_size = own.whitening(cycles, scatter)
    np.testing.assert_allclose(whiten @ covariance @ whiten.T, np.eye(len(covariance)), atol=1e-9)
    assert log_size == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-9)


def test_the_model_passes_through_its_grid(explainer) -> None:
    model = explainer.model
    for i, clearance in enumerate(GRID):
        found = model.at(np.array([NEW[0], clearance, NEW[0]]))[0]
        np.testing.assert_allclose(found, model.joints.change[1, i], atol=1e-12)


def test_slopes_are_derivatives_by_the_logarithm(explainer) -> None:
    at = np.array([3.3e-4, 5.0e-4, 1.0e-3])
    before, slopes = explainer.model.at(at)
    for k in range(3):
        more = at.copy()
        more[k] *= 1.0 + 1.0e-6
        np.testing.assert_allclose((explainer.model.at(more)[0] - before) / 1e-6, slopes[:, k], atol=1e-4)


def test_all_clearances_are_found_within_their_standard_deviations(explainer) -> None:
    true = np.array([3.0e-4, 4.0e-4, 5.0e-4])
    off = []
    for seed in range(100):
        fit = fit_clearances(explainer, measured(explainer, true, 10, seed), 10, NEW, NEW)
        off.append((fit.clearance_m - true) / fit.sigma_m)
    assert np.abs(off).max() < 5.0
    assert 0.05 < np.std(off) < 1.3  # the model's own error is in the standard deviation, too


def test_a_joint_that_the_torque_does_not_show_is_not_known(explainer) -> None:
    """It keeps its prior, a factor of e, however many gait cycles there are."""
    model = explainer.model
    hidden = with_changes(model, model.joints.change * np.array([1.0, 1.0, 0.0])[:, None, None])
    one = Explainer(hidden, JOINTS, explainer.baseline, explainer.nuisances)
    fit = fit_clearances(one, measured(one, NEW, 1000, 1), 1000, NEW, NEW)
    assert fit.sigma_m[2] == pytest.approx(NEW[2], rel=0.1)
    assert (fit.sigma_m[:2] < 0.1 * NEW[:2]).all()


def test_joints_that_explain_a_change_as_well_widen_each_other(explainer) -> None:
    """I at 0.45 mm behind a belt looked like G at 0.33 mm, and was reported as 0.31 ± 0.01 mm."""
    model = explainer.model
    alike = with_changes(model, model.joints.change[[0, 1, 1]])
    one = Explainer(alike, JOINTS, explainer.baseline, explainer.nuisances)
    true = [3.0e-4, 3.0e-4, 4.2e-4]
    mean = measured(one, true, 10, 1)
    found = one.explanations(mean, 10, NEW)
    assert change_of(found, 5) is not None
    best = best_fit(one, mean, 10, NEW, starts_of(one, None, NEW))
    fit = with_rivals(best, found, JOINTS)
    assert (np.abs(fit.clearance_m - true) < 2.0 * fit.sigma_m).all()
    assert fit.sigma_m[0] == best.sigma_m[0]


def test_no_joint_gets_narrower_than_a_new_part_but_a_worn_one_may_have_got_one(explainer) -> None:
    """Wear only opens: with A and G opened at once, I was found at 0.21 ± 0.02 mm."""
    less = -1.5 * explainer.model.joints.change[0, 1]  # as if it were 0.76 times as wide
    new = fit_clearances(explainer, measured(explainer, NEW, 1, 1, less), 1, NEW, NEW)
    assert new.clearance_m[0] > 0.9 * NEW[0]
    worn = NEW * np.array([2.0, 1.0, 1.0])
    renewed = fit_clearances(explainer, measured(explainer, NEW, 10, 1), 10, worn, worn)
    assert abs(renewed.clearance_m[0] - NEW[0]) < 3.0 * renewed.sigma_m[0] < NEW[0]


def test_clearances_that_explain_poorly_are_not_known(explainer) -> None:
    """What several joints change does not add up: G at 0.45 mm was 0.33 ± 0.01 mm beside A."""
    true, other = NEW * np.array([1.5, 1.0, 1.0]), np.random.default_rng(7).standard_normal(F)
    for extra, explains in ((0.0, True), (2.0 * other, False)):
        fit = fit_clearances(explainer, measured(explainer, true, 10, 1, extra), 10, NEW, NEW)
        assert fit.explains is explains
        assert (fit.sigma_m >= fit.clearance_m).all() is np.bool_(not explains)


def test_more_cycles_are_better(explainer) -> None:
    sigma = [
        fit_clearances(explainer, measured(explainer, NEW, n, 1), n, NEW, NEW).sigma_m for n in (2, 10, 60)
    ]
    assert (sigma[0] > sigma[1]).all()
    assert (sigma[1] > sigma[2]).all()


@pytest.mark.parametrize("k", range(3))
def test_one_wider_joint_is_named_with_its_clearance(explainer, k: int) -> None:
    true = NEW.copy()
    true[k] *= 1.4
    found = explainer.explanations(measured(explainer, true, 10, k), 10, NEW)
    assert (found[0].cause, found[0].subject) == (Cause.CLEARANCE, JOINTS[k])
    assert found[0].value == pytest.approx(true[k], abs=4.0 * found[0].sigma)
    change = change_of(found, 5)
    assert change is not None
    assert change.is_sure
    assert change.since_ns == 5


def test_a_heavier_foot_is_a_mass_and_no_clearance(explainer) -> None:
    extra = 0.1 * explainer.nuisances[1].column
    found = explainer.explanations(measured(explainer, NEW, 10, 1, extra), 10, NEW)
    assert (found[0].cause, found[0].subject) == (Cause.MASS, "foot")
    assert found[0].value == pytest.approx(0.1, abs=4.0 * found[0].sigma)
    change = change_of(found, 5)
    assert change is not None
    assert not change.is_sure  # counted clearances are corrected by clearances alone


def test_a_name_is_sure_only_where_no_other_joint_explains_nearly_as_much() -> None:
    one = Change(
        cause=Cause.CLEARANCE, subject="B", value=5.3e-4, sigma=5e-5, since_ns=1, counted=3e-4, log_odds=287.0
    )
    assert one.is_sure
    for odds, is_sure in ((7.0, False), (14.8, True)):  # G open behind twice the friction; B open there
        other = attrs.evolve(one, runner_up="clearance G", runner_up_log_odds=odds)
        assert other.is_sure is is_sure


@pytest.mark.parametrize(("square", "is_sure"), [(1.5, True), (5.9, False)])
def test_a_name_is_less_sure_where_even_the_best_cause_explains_badly(square: float, is_sure: bool) -> None:
    """G and I at 0.60 mm behind a low-pass: I, *stop* at 1.48 mm, 38.8 before G, mean square 5.9."""

    def of(cause: Cause, subject: str, misfit: float, square: float) -> Explanation:
        return Explanation(
            cause=cause, subject=subject, value=1e-3, sigma=1e-4, counted=3e-4, misfit=misfit, square=square
        )

    found = [
        of(Cause.CLEARANCE, "I", 0.0, square),
        of(Cause.CLEARANCE, "G", 2.0 * 38.8, square + 0.6),
        of(Cause.UNKNOWN, "", 4000.0, 60.0),
    ]
    change = change_of(found, 5)
    assert (change.subject, change.is_sure) == ("I", is_sure)


@pytest.mark.parametrize(
    ("value", "square", "without", "odds", "is_sure"),
    [
        (0.45e-3, 1.8, 5.3, 14.8, True),
        (0.486e-3, 3.8, 18.3, 57.0, True),  # G at 0.52 mm
        (0.83e-3, 12.1, 144.0, 134.0, True),  # A at 0.8 mm
        (1.52e-3, 11.7, 77.7, 11.9, True),  # G at 2 mm
        (1.65e-3, 7.8, 27.3, 71.0, True),  # the same in a leg without a baseline
        (0.344e-3, 3.6, 6.5, 11.0, False),  # 1 kg on the thigh
        (0.885e-3, 6.8, 23.6, 13.4, False),  # 1.75 kg
        (1.04e-3, 16.1, 84.4, 11.0, False),  # G at 0.45 mm beside 0.48 kg on the foot
        (0.835e-3, 18.6, 255.0, 91.0, False),  # at 0.50 mm, and 60 gait cycles later
        (0.79e-3, 3.7, 65.6, 14.6, False),  # B and G at 0.50 mm
    ],
)
def test_a_joint_is_sure_only_where_it_leaves_as_little_over_as_an_opening(
    value: float, square: float, without: float, odds: float, is_sure: bool
) -> None:
    """Seen in simulated legs: even where other causes explain worse, the true one was not among them."""

    def of(cause: Cause, misfit: float, square: float) -> Explanation:
        return Explanation(
            cause=cause, value=value, sigma=5e-5, counted=3e-4, misfit=misfit, square=square, subject="I"
        )

    found = [
        of(Cause.CLEARANCE, 0.0, square),
        of(Cause.MASS, 2.0 * odds * max(1.0, square), without - 1.0),
        of(Cause.UNKNOWN, 40000.0, without),
    ]
    change = change_of(found, 5)
    assert change.is_sure
    assert with_doubt(change, found).is_sure is is_sure


def test_a_leg_as_counted_has_no_change(explainer) -> None:
    for seed in range(20):
        found = explainer.explanations(measured(explainer, NEW, 30, seed), 30, NEW)
        assert change_of(found, 5) is None


def test_usual_friction_is_no_change_of_clearances(explainer) -> None:
    extra = 0.3 * explainer.nuisances[0].column
    fit = fit_clearances(explainer, measured(explainer, NEW, 60, 1, extra), 60, NEW, NEW)
    assert (np.abs(fit.clearance_m - NEW) < 4.0 * fit.sigma_m).all()


@pytest.mark.parametrize(("spreads", "is_reported"), [(0.0, False), (1.0, False), (8.0, True)])
def test_friction_is_a_change_only_where_it_is_unusual(explainer, spreads: float, is_reported: bool) -> None:
    """Seen before: friction of -0.005 ± 0.019 N m was reported for hours, with odds of e^4."""
    extra = spreads * 0.3 * explainer.nuisances[0].column
    found = explainer.explanations(measured(explainer, NEW, 60, 2, extra), 60, NEW)
    change = change_of(found, 5)
    assert (change is not None) is is_reported
    if change is not None:
        assert change.cause is Cause.FRICTION
        assert change.value == pytest.approx(spreads * 0.3, abs=4.0 * change.sigma)


def test_what_no_leg_can_have_is_no_cause(explainer) -> None:
    """A foot three times as heavy fits best, and the next best would be a wrong clearance."""
    extra = 2.0 * explainer.nuisances[1].column
    found = explainer.explanations(measured(explainer, NEW, 10, 1, extra), 10, NEW)
    assert found[0].value == pytest.approx(2.0, abs=0.1)
    change = change_of(found, 5)
    assert change is not None
    assert (change.cause, change.subject) == (Cause.UNKNOWN, "")


def test_another_channel_is_a_lag_and_no_clearance(explainer) -> None:
    late = OtherChannel(0.01, 3.0 * np.random.default_rng(8).standard_normal(F))
    own = Explainer(
        explainer.model,
        JOINTS,
        explainer.baseline,
        explainer.nuisances,
        (OtherChannel(0.005, late.column[::-1]), late),
    )
    found = own.explanations(measured(explainer, NEW, 10, 1, late.column), 10, NEW)
    assert (found[0].cause, found[0].value) == (Cause.LAG, 0.01)


def test_a_channel_that_leaves_as_much_as_it_explains_is_no_lag(explainer) -> None:
    """Seen before: G broken out to 2 mm was a lag of 20 ms, which left over more than no cause at all."""
    random = np.random.default_rng(11)
    late = (OtherChannel(0.02, 40.0 * random.standard_normal(F)),)
    legs = Explainer(explainer.model, JOINTS, explainer.baseline, explainer.nuisances, late)
    open_wide = np.array([3.0e-4, 3.0e-4, 1.4e-3])
    off = 3.0 * random.standard_normal(F)  # of the model at such a width
    causes = [one.cause for one in legs.explanations(measured(legs, open_wide, 5, 1, off), 5, NEW)]
    assert Cause.LAG not in causes
    assert causes[0] is Cause.CLEARANCE


@pytest.fixture(scope="module")
def noisy(explainer) -> Explainer:
    """The same with noise as a cause, of which a sample has none so far."""
    power = np.r_[np.zeros(F // 2), np.ones(F // 2)]
    sizes = 2.0 ** np.arange(5)
    noises = [OtherNoise(float(n), n**2 * power, 0.1 * (n**2 * (1.0 - power) + power)) for n in sizes]
    return Explainer(explainer.model, JOINTS, explainer.baseline, explainer.nuisances, (), noises)


@pytest.mark.parametrize("size_m", [3.0e-4, 4.5e-4])
def test_noise_is_a_cause_and_a_clearance_is_found_beside_it(noisy, size_m: float) -> None:
    opened = np.array([3.0e-4, size_m, 3.0e-4])
    more = noisy.noises[2]
    mean = more.shown(measured(noisy, opened, 10, 3))
    change = change_of(noisy.explanations(mean, 10, NEW), 5)
    assert change is not None
    if size_m == NEW[0]:
        assert (change.cause, change.value, change.counted) == (Cause.NOISE, more.noise_nm, 0.0)
    else:
        assert change.is_sure
        assert change.subject == "B"
        assert abs(change.value - size_m) < 2.0 * change.sigma


def test_noise_that_is_not_alone_explains_nothing(noisy) -> None:
    """Two joints that opened while the torque became noisy are not noise alone."""
    off = 1.6 * np.random.default_rng(7).standard_normal(F)
    change = change_of(
        noisy.explanations(noisy.noises[2].shown(measured(noisy, NEW, 10, 3)) + off, 10, NEW), 5
    )
    assert change is not None
    assert change.cause is Cause.UNKNOWN


def test_less_noise_leaves_at_least_the_roughness_of_the_leg() -> None:
    less = OtherNoise(0.1, np.r_[0.0, -4.0], np.zeros(2))
    shown = less.shown(np.zeros(2))
    assert shown[0] == 0.0
    assert np.isfinite(shown[1]) and shown[1] < 0.0


def test_where_no_size_fits_those_that_fit_as_badly_are_in_the_standard_deviation(explainer) -> None:
    """Seen before: G broken out to 2 mm was 0.84 mm with a tenth of it as its standard deviation."""
    random = np.random.default_rng(5)
    change = explainer.model.joints.change.copy()
    change[2, 1:] = 3.0 * random.standard_normal((len(GRID) - 1, F))  # each size changes other phases
    legs = with_changes(explainer.model, change)
    own = Explainer(legs, JOINTS, explainer.baseline, explainer.nuisances)
    for seed in range(20):
        off = 3.0 * np.random.default_rng(seed).standard_normal(F)
        found = own.explanations(measured(own, [3.0e-4, 3.0e-4, 1.5e-3], 10, seed, off), 10, NEW)
        knee = next(one for one in found if one.subject == "G")
        assert abs(knee.value - 1.5e-3) < 3.0 * knee.sigma


@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_a_leg_that_scatters_more_has_a_larger_covariance_in_that_direction(scale: float) -> None:
    random = np.random.default_rng(3)
    along = np.ones(F) / np.sqrt(F)
    cycles = random.standard_normal((60, F)) + (scale - 1.0) * 3.0 * random.standard_normal((60, 1)) * along
    found = with_scatter_of(np.eye(F), cycles)
    assert np.linalg.eigvalsh(found)[0] > 0.1  # it can be inverted with fewer cycles than entries
    variance = along @ found @ along
    expected = 1.0 + (3.0 * (scale - 1.0)) ** 2
    # a third of the weight is the sample's; a sample variance of 60 scatters by 18 %
    assert 0.2 * expected < variance < 1.7 * expected


def test_misfits_are_those_of_normal_densities() -> None:
    random = np.random.default_rng(3)
    root, (rest, more) = random.standard_normal((4, 6, 6)), random.standard_normal((2, 4, 6))
    covariance = root @ root.transpose(0, 2, 1) + 10.0 * np.eye(6)
    found = Misfits(rest, covariance, more)
    for i in range(4):
        own = covariance[i] + np.outer(more[i], more[i])
        square = rest[i] @ np.linalg.solve(own, rest[i])
        assert found.square[i] == pytest.approx(square, rel=1e-12)
        assert found.value[i] == pytest.approx(square + np.linalg.slogdet(own)[1], rel=1e-12)


def test_causes_do_not_depend_on_the_order_of_the_joints(explainer) -> None:
    model = explainer.model
    turned = with_changes(model, model.joints.change[::-1])
    other = Explainer(turned, JOINTS[::-1], explainer.baseline, explainer.nuisances)
    mean = measured(explainer, [3.0e-4, 4.2e-4, 3.0e-4], 10, 4)
    one, two = (each.explanations(mean, 10, NEW)[0] for each in (explainer, other))
    assert one.subject == two.subject == "B"
    assert one.value == pytest.approx(two.value, rel=1e-9)
