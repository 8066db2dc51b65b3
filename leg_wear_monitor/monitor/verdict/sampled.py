"""What a sampled replay adds to a verdict: how much of the gait was followed, and the standard errors."""

from collections.abc import Sequence

import attrs

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.verdict.verdict import Evidence, Finding
from leg_wear_monitor.twin.statistics import Sampling


def sampled_words(sampling: Sampling) -> str:
    """Words on a sampled replay."""
    cycles = sampling.followed_cycles + sampling.estimated_cycles
    return (
        f"sampled: {sampling.followed_cycles} of {cycles:.0f} gait cycles were followed, "
        "wear of the others is estimated, their impacts are not seen"
    )


def with_sampling(
    findings: Sequence[Finding], sampling: Sampling, joints: Sequence[str], sigma_m: Floats
) -> tuple[Finding, ...]:
    """Findings that tell of a sampled replay.

    Parameters
    ----------
    findings : sequence of Finding
    sampling : Sampling
    joints : sequence of str
        The clearance joints.
    sigma_m : (k,) array
        Standard errors of their clearances.
    """
    evidence = [Evidence("sampled fraction", sampling.fraction, None, "")]
    evidence += [
        Evidence(f"standard error {joint}", sigma, None, "m")
        for joint, sigma in zip(joints, sigma_m.tolist(), strict=True)
    ]
    words = sampled_words(sampling)
    return tuple(
        attrs.evolve(one, why=f"{one.why}; {words}", evidence=(*one.evidence, *evidence)) for one in findings
    )
