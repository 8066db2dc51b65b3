"""Foot loads of the walks: each gait cycle once, over runs, logs, repairs and formats."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor.monitor.ledger.entry import WalkedLoad, together, walked_words
from leg_wear_monitor.monitor.ledger.ledger import read_ledger

pytestmark = pytest.mark.plain

AIR, LOADED = WalkedLoad(0, 7200, 7200.0, 0.0, 0.0), WalkedLoad(300, 43200, 43200.0, 290.0, 8.0)


def test_cycles_together_have_the_mean_and_scatter_of_all():
    peaks = 300.0 + 12.0 * np.random.default_rng(4).standard_normal(50)
    one = ()
    for peak in peaks:
        one = together((*one, WalkedLoad.of_cycle(float(peak), 1.25)))
    two = together([WalkedLoad.of_cycle(float(peak), 1.25) for peak in peaks] + [AIR])
    (found,) = one
    assert (found.about_n, found.cycles, found.moving_s) == (300, 50, 62.5)
    assert (found.mean_n, found.sigma_n) == pytest.approx((peaks.mean(), peaks.std()), rel=1e-9)
    assert [load.about_n for load in two] == [0, 300]
    assert attrs.astuple(two[1]) == pytest.approx(attrs.astuple(found), rel=1e-9)


@pytest.mark.parametrize(
    ("peak_n", "about_n"), [(0.0, 0), (49.0, 0), (51.0, 100), (340.0, 300), (-60.0, -100)]
)
def test_a_load_is_of_its_nearest_hundred_newtons(peak_n, about_n):
    assert WalkedLoad.of_cycle(peak_n, 1.0).about_n == about_n


def test_words_have_the_longest_walk_first_and_none_of_a_leg_in_the_air():
    assert walked_words([AIR, LOADED]) == "walked 12 h at 290 N, 2 h at 0 N"
    short = [attrs.evolve(LOADED, moving_s=91.0), attrs.evolve(AIR, moving_s=3.0)]
    assert walked_words(short) == "walked 1.52 min at 290 N, 3 s at 0 N"
    assert walked_words([AIR]) == walked_words([]) == ""


def loaded(entry, *loads):
    return attrs.evolve(entry, loads=loads)


@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize("closed", [True, False])
def test_runs_add_up_whether_killed_or_closed(open_ledger, entry_at, binding, whole, closed):
    ledger = open_ledger()
    assert ledger.loads == ()
    ledger.keep(loaded(entry_at(1), AIR))
    ledger.keep(loaded(entry_at(2), AIR, LOADED), whole=whole)
    if closed:
        ledger.keep(loaded(entry_at(2), AIR, LOADED), closed=True)
    ledger.close()
    for run in (1, 2):  # the second start finds what the first one left, which has counted nothing
        found = open_ledger()
        assert found.loads == (AIR, LOADED)
        if run == 2:
            found.keep(loaded(entry_at(3), LOADED), whole=False)
            found.keep(loaded(entry_at(4), LOADED), whole=False)
        found.close()
    both = (AIR, attrs.evolve(LOADED, cycles=86400, moving_s=86400.0))
    assert read_ledger(ledger.path, binding).loads == both
    assert open_ledger().loads == both


def test_an_entry_that_a_repair_replaces_counts_no_load_again(open_ledger, entry_at):
    ledger = open_ledger()
    ledger.keep(loaded(entry_at(1), LOADED))
    ledger.close()
    for _ in range(2):
        repair = open_ledger()
        repair.record(repair.entry)
        repair.close()
    assert open_ledger().loads == (LOADED,)
