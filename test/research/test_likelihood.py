"""The research on a trained likelihood still runs, without torch: a signature, and a posterior."""

from pathlib import Path

import numpy as np
import pytest

RESEARCH = Path(__file__).parents[2] / "research" / "likelihood"
HIDDEN, LEG, COMPONENTS, COLUMNS = 12, 6, 20, 2


@pytest.fixture(autouse=True)
def as_its_scripts_import(monkeypatch):
    monkeypatch.syspath_prepend(RESEARCH)


def weights(path: Path) -> Path:
    """A network that nobody trained."""
    rng = np.random.default_rng(1)
    shapes = {
        "enc1": (HIDDEN, 3 + 7), "enc2": (LEG, HIDDEN), "dec1": (HIDDEN, LEG + 42), "dec2": (HIDDEN, HIDDEN),
        "mean_head": (COMPONENTS, HIDDEN), "scatter": (COMPONENTS, HIDDEN), "peak": (1, LEG),
        "systematic": (COMPONENTS, HIDDEN), "columns": (COMPONENTS * COLUMNS, HIDDEN),
    }  # fmt: skip
    arrays = {f"{name}.weight": rng.standard_normal(shape) for name, shape in shapes.items()}
    arrays |= {f"{name}.bias": np.zeros(shape[0]) for name, shape in shapes.items()}
    for name in ("columns", "systematic", "scatter"):
        arrays[f"{name}.weight"] *= 0.01
    arrays["mean_head.weight"] *= 10.0
    basis = np.linalg.qr(rng.standard_normal((160, COMPONENTS + 5)))[0]
    arrays |= {"basis": basis[:, :COMPONENTS], "outside": basis[:, COMPONENTS:], "near": np.zeros((4, 3))}
    arrays |= {"mean": np.zeros(160), "std": np.ones(160), "near_basis": np.zeros((160, 3))}
    arrays["size_errors"] = np.full(2, -3.0)
    limits = {"inflation": 1, "square_limit": 3, "outside_limit": 3, "far": 1}
    np.savez(path, **arrays, **{name: np.float32(one) for name, one in limits.items()})
    return path


def test_a_change_is_named_that_is_as_predicted(tmp_path):
    from model import UNKNOWN, KnownLeg, Network

    network = Network(weights(tmp_path / "weights.npz"))
    leg = KnownLeg(network, np.zeros(160), 40, np.zeros(7))
    for cause in ("none", "A", "J", "mass", "friction"):
        hypothesis = int(np.flatnonzero(leg.tried.cause == leg.tried.names.index(cause))[-1])
        answer = leg.posterior(network.basis @ leg.mean[hypothesis], 10)
        assert answer.found == cause
        assert answer.square < 1e-9
        assert sum(answer.probability.values()) == pytest.approx(1.0)
    assert leg.posterior(100.0 * network.w["outside"][:, 0], 10).found == UNKNOWN


def test_a_signature_behind_a_drive():
    from signals import PHASES, Drive, Stored

    walked = np.sin(np.linspace(0.0, 2.0 * np.pi, 512, endpoint=False))
    new = 20.0 * np.tile(walked, (6, 1))
    same = np.zeros(8)
    truth = {"speed": 2.0 * np.pi, "cosine": same, "sine": same, "new": new, "changed": new[None]}
    stored = Stored(truth)
    drive = Drive(noise_nm=0.0, coulomb_nm=1.0, lag_s=0.0125)  # by a phase
    direct, behind = (
        stored.signatures(0, one, np.random.default_rng(1))[1:-1].mean(axis=0)
        for one in (Drive(noise_nm=0.0), drive)
    )
    expected = np.roll(direct[:PHASES], 1) + 1.0 / stored.size_nm
    np.testing.assert_allclose(behind[:PHASES], expected, atol=2e-3 * np.ptp(expected))
