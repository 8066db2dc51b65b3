"""A life that several tests look at."""

import pytest

import leg_wear_monitor as lw


@pytest.fixture(scope="module")
def lived(leg):
    """Two joints' life to where the first has opened by a fifth."""
    run = lw.LifeRun(leg, lw.LifeSettings(legs=2, cycles=3, settle_cycles=1), clearances=("A", "B"))
    return run, lw.simulate_life(run, limit_m=3.6e-4, horizon_cycles=1e9)
