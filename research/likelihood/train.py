"""Train the conditional likelihood on the examples of `signals.py`; needs torch.

`python train.py EXAMPLES WEIGHTS [--part 0.5] [--epochs 14]` holds one of ten legs back, to stop and to
calibrate. With `--part`, it learns from this part of the other legs alone.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import torch
from model import WIDTHS, KnownLeg, Network, drift_columns, features_of, hypotheses
from torch import nn

HIDDEN, LEG, COMPONENTS, COLUMNS = 128, 16, 64, 4
PLACE, OUTSIDE = 24, 40  # components of baselines; components of signatures that show no known change


class Likelihood(nn.Module):
    """Mean and covariance of a change, as of `model.Network.answers`."""

    def __init__(self) -> None:
        super().__init__()
        self.enc1, self.enc2 = nn.Linear(PLACE + 7, HIDDEN), nn.Linear(HIDDEN, LEG)
        self.dec1, self.dec2 = nn.Linear(LEG + 3 * WIDTHS, HIDDEN), nn.Linear(HIDDEN, HIDDEN)
        self.mean_head, self.columns = nn.Linear(HIDDEN, COMPONENTS), nn.Linear(HIDDEN, COMPONENTS * COLUMNS)
        self.systematic, self.scatter = nn.Linear(HIDDEN, COMPONENTS), nn.Linear(HIDDEN, COMPONENTS)
        self.peak = nn.Linear(LEG, 1)
        with torch.no_grad():
            self.columns.weight *= 0.3

    def forward(self, leg, change):
        leg = leg + 0.1 * torch.randn_like(leg) if self.training else leg
        z = self.enc2(nn.functional.silu(self.enc1(leg)))

        def decoded(features):
            return nn.functional.silu(self.dec2(nn.functional.silu(self.dec1(torch.cat([z, features], 1)))))

        x, unchanged = decoded(change), decoded(torch.zeros_like(change))
        columns = self.columns(x).reshape(len(x), COMPONENTS, COLUMNS)
        mean = self.mean_head(x) - self.mean_head(unchanged)
        return mean, self.systematic(x), columns, self.scatter(x), self.peak(nn.functional.silu(z))[:, 0]


def misfit(rest, systematic, columns, scatter, drifts, per_cycle):
    """Minus twice the logarithm of the likelihood (n,), and the squared distance (n,)."""
    variance = torch.exp(systematic) + torch.exp(scatter) * per_cycle[:, None]
    columns = torch.cat([columns, drifts], 2)
    within = columns / variance[:, :, None]
    lower = torch.linalg.cholesky(torch.eye(columns.shape[2]) + columns.transpose(1, 2) @ within)
    explained = torch.linalg.solve_triangular(lower, (within.transpose(1, 2) @ rest[:, :, None]), upper=False)
    square = (rest**2 / variance).sum(1) - (explained[:, :, 0] ** 2).sum(1)
    return square + torch.log(variance).sum(1) + 2.0 * torch.log(lower.diagonal(dim1=1, dim2=2)).sum(
        1
    ), square


def whitened(data, legs: np.ndarray) -> dict[str, np.ndarray]:
    """Scales of baselines, and components of signatures in which a gait cycle scatters by about one."""
    within = data["within"][legs].reshape(-1, 160)
    ridge = np.repeat([0.01, 0.05], 80) ** 2
    scatter = 0.5 * np.cov(within.T) + np.diag(ridge)
    value, vector = np.linalg.eigh(scatter)
    white = vector / np.sqrt(value)
    change = (data["present"][legs] - data["base"][legs][:, :, None]).reshape(-1, 160) @ white
    _, _, across = np.linalg.svd(change[:: max(1, len(change) // 20000)], full_matrices=False)
    base = data["base"][legs].reshape(-1, 160)
    mean, std = base.mean(0), base.std(0) + 0.02
    _, _, near = np.linalg.svd((base - mean) / std, full_matrices=False)
    near_basis = near[:PLACE].T
    near_basis = near_basis / (((base - mean) / std) @ near_basis).std(0)
    one_each = data["base"][legs][:, 0]
    return {
        "basis": white @ across[:COMPONENTS].T, "outside": white @ across[-OUTSIDE:].T, "mean": mean,
        "std": std, "near_basis": near_basis, "near": ((one_each - mean) / std) @ near_basis,
    }  # fmt: skip


def tensors(data, legs: np.ndarray, parts: dict[str, np.ndarray]):
    """Inputs and targets of all examples of some legs."""
    base, present = data["base"][legs], data["present"][legs]
    number, draws, states = present.shape[:3]
    context = np.broadcast_to(data["context"][legs][:, None], (number, draws, 7))
    place = ((base - parts["mean"]) / parts["std"]) @ parts["near_basis"]
    leg = np.concatenate([place, context], axis=2)
    drifts = np.einsum("ldfc,fk->ldkc", drift_columns(base), parts["basis"])
    target = (present - base[:, :, None]) @ parts["basis"]
    change = np.broadcast_to(features_of(data["change"][legs])[:, None], (number, draws, states, 3 * WIDTHS))
    peak = np.broadcast_to(data["peak_n"][legs][:, None] / 100.0, (number, draws))
    which = np.repeat(np.arange(number * draws), states)
    found = [leg.reshape(-1, PLACE + 7), drifts.reshape(-1, COMPONENTS, 4), peak.reshape(-1)]
    per_cycle = (1.0 / data["counts"][legs]).sum(-1).reshape(-1)
    rows = [target.reshape(-1, COMPONENTS), change.reshape(-1, 3 * WIDTHS), per_cycle]
    return [
        torch.tensor(np.ascontiguousarray(one), dtype=torch.float32) for one in found + rows
    ], torch.tensor(which)


def loss_of(network, parts, which, rows):
    """Loss of some examples, and their misfit."""
    leg, drifts, peak, target, change, per_cycle = parts
    at = which[rows]
    mean, systematic, columns, scatter, load = network(leg[at], change[rows])
    both = misfit(target[rows] - mean, systematic, columns, scatter, drifts[at], per_cycle[rows])
    return 0.5 * both[0].mean() + 2.0 * ((load - peak[at]) ** 2).mean(), both[1].mean() / COMPONENTS


def trained(data, learn, held, parts, epochs: int, batch: int = 256):
    """The network that is best on the held-out legs."""
    torch.manual_seed(1)
    network, (known, which), (other, other_which) = (
        Likelihood(),
        tensors(data, learn, parts),
        tensors(data, held, parts),
    )
    steps = epochs * (len(which) // batch)
    optimiser = torch.optim.AdamW(network.parameters(), lr=2e-3, weight_decay=2e-2)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 2e-3, total_steps=steps + 1, pct_start=0.15)
    best, kept = np.inf, None
    for epoch in range(epochs):
        network.train()
        order, total = torch.randperm(len(which)), 0.0
        for i in range(len(which) // batch):
            loss, _ = loss_of(network, known, which, order[i * batch : (i + 1) * batch])
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(network.parameters(), 5.0)
            optimiser.step()
            schedule.step()
            total += loss.item()
        network.eval()
        with torch.no_grad():
            found = [
                loss_of(network, other, other_which, rows)
                for rows in torch.arange(len(other_which)).split(4096)
            ]
        loss = float(np.mean([one[0].item() for one in found]))
        if epoch % 5 == 4 or epoch == epochs - 1:
            square = np.mean([one[1].item() for one in found])
            print(
                f"epoch {epoch + 1}: {total / (len(which) // batch):.2f}, held out {loss:.2f}, {square:.2f}",
                flush=True,
            )
        if loss < best:
            best, kept = loss, {name: one.clone() for name, one in network.state_dict().items()}
    network.load_state_dict(kept)
    return network, best


def save(path: Path, network, parts: dict[str, np.ndarray], limits: dict[str, float]) -> None:
    """Write weights in half precision, and limits."""
    arrays = {name: one.numpy().astype(np.float16) for name, one in network.state_dict().items()}
    rest = {name: one.astype(np.float32 if name == "basis" else np.float16) for name, one in parts.items()}
    np.savez_compressed(path, **arrays, **rest, **{name: np.float32(one) for name, one in limits.items()})


def calibrated(path: Path, data, held: np.ndarray, draws: int = 3) -> dict[str, float]:
    """Limits that held-out legs give: inflation of the covariance, and what is far or unknown."""
    network, tried = Network(path), hypotheses()
    squares, best, outside, far = [], [], [], []
    for leg in held:
        for draw in range(draws):
            base, n0 = data["base"][leg, draw], int(data["counts"][leg, draw, 0, 1])
            true = tried._replace(change=data["change"][leg], cause=np.arange(len(data["change"][leg])))
            known = KnownLeg(network, base, n0, data["context"][leg], true)
            far.append(known.distance)
            for state, present in enumerate(data["present"][leg, draw]):
                n = int(data["counts"][leg, draw, state, 0])
                squares.append(known.squares(present, n, slice(state, state + 1))[0] / COMPONENTS)
                left = np.mean(((present - base) @ network.w["outside"]) ** 2)
                outside.append(left / (float(network.w["outside_floor"]) + 1.0 / n + 1.0 / n0))
    inflation = float(np.clip(np.mean(squares), 1.0, 3.0))
    best = np.quantile(squares, 0.998) / inflation
    return {
        "inflation": inflation, "square_limit": 1.2 * best,
        "outside_limit": 1.2 * np.quantile(outside, 0.998),
        "far": np.quantile(far, 0.99),
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("examples", type=Path)
    parser.add_argument("weights", type=Path)
    parser.add_argument("--part", type=float, default=1.0)
    parser.add_argument("--epochs", type=int, default=14)
    options = parser.parse_args()
    torch.set_num_threads(1)
    with np.load(options.examples) as file:
        data = {name: file[name] for name in file.files}
    is_held = data["seed"] // 2 % 10 == 3
    held, rest = np.flatnonzero(is_held), np.flatnonzero(~is_held)
    learn = rest[: max(1, round(options.part * len(rest)))]
    began, parts = time.process_time(), whitened(data, learn)
    network, loss = trained(data, learn, held, parts, options.epochs)
    neutral = {"inflation": 1.0, "square_limit": 1e9, "outside_limit": 1e9, "far": 1.0, "outside_floor": 0.3}
    save(options.weights, network, parts, neutral)
    limits = {**neutral, **calibrated(options.weights, data, held)}
    save(options.weights, network, parts, limits)
    print(
        f"{len(learn)} legs, {len(held)} held out: loss {loss:.2f}, "
        f"{time.process_time() - began:.0f} s, {limits}"
    )


if __name__ == "__main__":
    main()
