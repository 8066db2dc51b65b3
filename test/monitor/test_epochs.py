"""Two runs with the same stamps: left out if they are the same time, counted if the clock began anew."""

import numpy as np


def test_a_run_by_a_clock_that_began_anew_is_counted_in_an_epoch_of_its_own(begin, gait, rows) -> None:
    walk = gait(2.5)
    first = begin()
    assert not first.begin_run("one")
    first.update(walk)
    once = first.wear_of("G")
    first.close()
    second = begin()
    assert second.begin_run("two")
    assert second.counted(walk).mean() > 0.9
    second.begin_epoch(int(walk["stamp_ns"][0]), "clock")
    assert not second.counted(walk).any()
    second.update(walk)
    twice = second.wear_of("G")
    assert twice.depth.sum() > 1.9 * once.depth.sum()
    second.close()
    assert rows("SELECT spans ->> '$[0][2]', spans ->> '$[1]' FROM run ORDER BY id") == [(0, None), (1, None)]
    assert rows("SELECT epoch, boot_id FROM run ORDER BY id") == [(0, "one"), (1, "two")]
    assert rows("SELECT who, what FROM audit") == [("clock", "new_epoch")]
    third = begin()
    third.update(walk)  # a recording of either
    assert np.array_equal(third.wear_of("G").depth, twice.depth)


def test_a_clock_that_begins_anew_within_a_run_keeps_both_spans(begin, gait, rows) -> None:
    monitor = begin()
    monitor.update(gait(1.0))
    monitor.begin_epoch(1, "clock")
    monitor.update(gait(1.0, begin_s=0.5))
    monitor.close()
    spans = rows("SELECT value ->> 2, value ->> 1 > value ->> 0 FROM run, json_each(spans)")
    assert spans == [(0, 1), (1, 1)]
