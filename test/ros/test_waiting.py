"""What a node says while it gets ready."""

import threading

from leg_wear_monitor.ros.running import repeated


def test_the_time_that_passes_is_said_again_and_again_and_no_more_afterwards():
    said, thrice, before = [], threading.Event(), threading.active_count()

    def say(passed_s):
        said.append(passed_s)
        if len(said) == 3:
            thrice.set()

    with repeated(say, every_s=0.001):
        assert thrice.wait(60.0)
    assert said[:3] == [0.001, 0.002, 0.003]
    assert threading.active_count() == before


def test_what_ends_at_once_says_nothing():
    said = []
    with repeated(said.append, every_s=3600.0):
        pass
    assert said == []
