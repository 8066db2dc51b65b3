"""Train the conditional likelihood on the examples of `signals.py`; needs torch.

`python train.py EXAMPLES WEIGHTS [--part 0.5] [--epochs 10]` holds one of ten legs back, to stop and to
calibrate. With `--part`, it learns from this part of the other legs alone.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import torch
from model import FREEDOM, WIDTHS, KnownLeg, Network, cause_of, drift_columns, features_of, hypotheses
from torch import nn

HIDDEN, LEG, COMPONENTS, COLUMNS = 128, 16, 64, 4
OTHERS, WEIGHTS = 5, torch.tensor([0.1, 3.0, 1.0])  # other changes that are tried; of the losses
PLACE, OUTSIDE = 24, 40  # components of baselines; components of signatures that show no known change


class Likelihood(nn.Module):
    """Mean and covariance of a change, as of `model.Network.answers`."""

    def __init__(self) -> None:
        super().__init__()
        self.enc1, self.enc2 = nn.Linear(PLACE + 7, HIDDEN), nn.Linear(HIDDEN, LEG)
        self.dec1, self.dec2 = nn.Linear(LEG + 3 * WIDTHS, HIDDEN), nn.Linear(HIDDEN, HIDDEN)
        self.mean_head, self.columns = nn.Linear(HIDDEN, COMPONENTS), nn.Linear(HIDDEN, COMPONENTS * COLUMNS)
        self.systematic, self.scatter = nn.Linear(HIDDEN, COMPONENTS), nn.Linear(HIDDEN, COMPONENTS)
        self.peak, self.size_errors = nn.Linear(LEG, 1), nn.Parameter(torch.tensor([-2.0, -2.0]))

    def described(self, leg):
        """Description of legs."""
        leg = leg + 0.1 * torch.randn_like(leg) if self.training else leg
        return self.enc2(nn.functional.silu(self.enc1(leg)))

    def forward(self, z, change):
        def decoded(features):
            return nn.functional.silu(self.dec2(nn.functional.silu(self.dec1(torch.cat([z, features], 1)))))

        x, unchanged = decoded(change), decoded(torch.zeros_like(change))
        columns = 0.3 * self.columns(x).reshape(len(x), COMPONENTS, COLUMNS)
        mean = self.mean_head(x) - self.mean_head(unchanged)
        return mean, self.size_errors, self.systematic(x), columns, self.scatter(x)


def misfit(target, mean, size_errors, systematic, columns, scatter, drifts, per_cycle):
    """Minus twice the logarithm of the likelihood (n,).

    The error of a large change is larger: in each component, and of all components together.
    """
    rest, (each, together) = target - mean, torch.exp(size_errors)
    variance = torch.exp(systematic) + torch.exp(scatter) * per_cycle[:, None] + each**2 * mean**2
    columns = torch.cat([columns, drifts, together * mean[:, :, None]], 2)
    within = columns / variance[:, :, None]
    lower = torch.linalg.cholesky(torch.eye(columns.shape[2]) + columns.transpose(1, 2) @ within)
    explained = torch.linalg.solve_triangular(lower, (within.transpose(1, 2) @ rest[:, :, None]), upper=False)
    square = (rest**2 / variance).sum(1) - (explained[:, :, 0] ** 2).sum(1)
    log_size = torch.log(variance).sum(1) + 2.0 * torch.log(lower.diagonal(dim1=1, dim2=2)).sum(1)
    return (FREEDOM + COMPONENTS) * torch.log1p(square / FREEDOM) + log_size


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


def losses(network, parts, which, rows):
    """Losses of some examples: misfit of the true change, its probability among others, and the load."""
    leg, drifts, peak, target, change, per_cycle = parts
    at = which[rows]
    z, each = network.described(leg[at]), []
    for other in range(OTHERS + 1):  # the true change first
        tried = change[rows[torch.randperm(len(rows))] if other else rows]
        each.append(misfit(target[rows], *network(z, tried), drifts[at], per_cycle[rows]))
    told = nn.functional.log_softmax(-0.5 * torch.stack(each, 1), 1)[:, 0]
    load = network.peak(nn.functional.silu(z))[:, 0]
    return torch.stack([0.5 * each[0].mean(), -told.mean(), ((load - peak[at]) ** 2).mean()])


def trained(data, learn, held, parts, epochs: int, batch: int = 256) -> Likelihood:
    """The network that is best on the held-out legs."""
    torch.manual_seed(1)
    network, (known, which), unknown = Likelihood(), tensors(data, learn, parts), tensors(data, held, parts)
    steps = epochs * (len(which) // batch)
    optimiser = torch.optim.AdamW(network.parameters(), lr=2e-3, weight_decay=2e-2)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 2e-3, total_steps=steps + 1, pct_start=0.15)
    best, kept = np.inf, None
    for epoch in range(epochs):
        network.train()
        for rows in torch.randperm(len(which))[: len(which) // batch * batch].split(batch):
            optimiser.zero_grad()
            (losses(network, known, which, rows) @ WEIGHTS).backward()
            nn.utils.clip_grad_norm_(network.parameters(), 5.0)
            optimiser.step()
            schedule.step()
        network.eval()
        with torch.no_grad():
            parts_of_them = torch.randperm(len(unknown[1])).split(2048)
            found = torch.stack([losses(network, *unknown, rows) for rows in parts_of_them]).mean(0)
        print(f"epoch {epoch + 1}: held out {found.numpy().round(3)}", flush=True)
        if found @ WEIGHTS < best:
            best, kept = found @ WEIGHTS, {name: one.clone() for name, one in network.state_dict().items()}
    network.load_state_dict(kept)
    return network


def save(path: Path, network, parts: dict[str, np.ndarray], limits: dict[str, float]) -> None:
    """Write weights in half precision, and limits."""
    arrays = {name: one.numpy().astype(np.float16) for name, one in network.state_dict().items()}
    arrays |= {name: one.astype(np.float32 if name == "basis" else np.float16) for name, one in parts.items()}
    np.savez_compressed(path, **arrays, **{name: np.float32(one) for name, one in limits.items()})


def calibrated(path: Path, data, held: np.ndarray, draws: int = 2) -> dict[str, float]:
    """Limits that held-out legs give: what is far or unknown, and the inflation of the covariance.

    The inflation makes the causes of the held-out legs most probable.
    """
    network, tried = Network(path), hypotheses(0.9)
    tempers = np.array([1.0, 1.4, 2.0, 2.8, 4.0, 5.7, 8.0])
    squares, outside, far, truth = [], [], [], np.zeros(len(tempers))
    for leg in held:
        causes = [tried.names.index(cause_of(change)) for change in data["change"][leg]]
        for draw in range(draws):
            known = KnownLeg(
                network,
                data["base"][leg, draw],
                int(data["counts"][leg, draw, 0, 1]),
                data["context"][leg],
                tried,
            )
            far.append(known.distance)
            for cause, present, counts in zip(
                causes, data["present"][leg, draw], data["counts"][leg, draw], strict=True
            ):
                n = int(counts[0])
                answer, square = known.posterior(present, n), known.squares(present, n)
                squares.append(answer.square)
                outside.append(answer.outside)
                for i, network.w["inflation"] in enumerate(tempers):
                    weight = known.weights(square, n)
                    truth[i] += np.log(max(weight[tried.cause == cause].sum() / weight.sum(), 1e-6))
    limits = {"square_limit": np.quantile(squares, 0.998), "outside_limit": np.quantile(outside, 0.998)}
    print(f"mean log probability of the true cause {truth.max() / len(squares):.3f}, held out")
    return {"inflation": tempers[truth.argmax()], "far": np.quantile(far, 0.99), **limits}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("examples", type=Path)
    parser.add_argument("weights", type=Path)
    parser.add_argument("--part", type=float, default=1.0)
    parser.add_argument("--epochs", type=int, default=10)
    options = parser.parse_args()
    torch.set_num_threads(1)
    with np.load(options.examples) as file:
        data = {name: file[name] for name in file.files}
    is_held = data["seed"] // 2 % 10 == 3
    held, rest = np.flatnonzero(is_held), np.flatnonzero(~is_held)
    learn = rest[: max(1, round(options.part * len(rest)))]
    began, parts = time.process_time(), whitened(data, learn)
    network = trained(data, learn, held, parts, options.epochs)
    neutral = {"inflation": 1.0, "square_limit": 1e9, "outside_limit": 1e9, "far": 1.0}
    save(options.weights, network, parts, neutral)
    limits = calibrated(options.weights, data, held)
    save(options.weights, network, parts, limits)
    print(f"{len(learn)} legs, {len(held)} held out, {time.process_time() - began:.0f} s, {limits}")


if __name__ == "__main__":
    main()
