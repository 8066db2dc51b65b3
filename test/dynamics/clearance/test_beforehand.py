"""What is compiled before a leg is there is what the leg calls."""

import numba
import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.dynamics.clearance.advance import ADVANCE
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceRun, advance_arguments, observe_arguments
from leg_wear_monitor.dynamics.run import new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare


def types_of(arguments):
    return [numba.typeof(one) for one in arguments]


@pytest.mark.plain
@pytest.mark.parametrize("mechanism", ["bionic_leg", "four_bar"])
@pytest.mark.parametrize("wear", [True, False])
def test_types_are_those_of_a_leg(mechanism, wear):
    leg = lw.load_mechanism(mechanism)
    setup = prepare(leg, wear=wear)
    run = ClearanceRun(setup)
    stepper, feeds_back = run.stepper, setup.surfaces.feeds_back
    statistics = new_run_statistics(len(leg.joints))
    advanced = (stepper.model, feeds_back, stepper.state, run._polynomial, 0.0, statistics, stepper.work)
    observed = (stepper.model, feeds_back, stepper.state, stepper.work)
    assert types_of(advance_arguments()) == types_of(advanced)
    assert types_of(observe_arguments()) == types_of(observed)


def test_what_is_called_by_its_address_is_what_is_compiled_beforehand():
    run = ClearanceRun(prepare(lw.load_mechanism("four_bar"), wear=True))
    address = run.stepper.advance_address(run._polynomial, new_run_statistics(4))
    assert address != 0 and address == ADVANCE.address(*advance_arguments())
