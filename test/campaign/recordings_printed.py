"""Recordings through the command line: what a user reads of them, and the figures in the summary."""

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from campaign.case import Case, Ran, command_line
from campaign.recordings_damaged import DAMAGES
from campaign.recordings_stored import write_mcap
from leg_wear_monitor.messages import encode

Generator = np.random.Generator
_BAG = Path(__file__).parents[2] / "bags" / "healthy.mcap"
_SECONDS = 3.2
_COUNTED = ("cycles", "joints", "gait")


@cache
def walk() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps [ns], crank angles [rad] and torques [N m] of a healthy leg."""
    from leg_wear_monitor.bags.reader import Recording
    from leg_wear_monitor.monitor.config.settings import MonitorConfig
    from leg_wear_monitor.twin import CRANK, TORQUE

    with Recording([_BAG], MonitorConfig()) as recording:
        samples = np.concatenate([block.samples for block in recording.blocks()])
    cranks, torques = samples[samples["kind"] == CRANK], samples[samples["kind"] == TORQUE]
    kept = cranks["stamp_ns"] - cranks["stamp_ns"][0] < _SECONDS * 1e9
    stamps = cranks["stamp_ns"][kept]
    torque = np.interp(stamps, torques["stamp_ns"], torques["torque_nm"])
    return stamps.astype(np.int64), cranks["crank_angle_rad"][kept], torque


def write(
    path: Path, stamps: np.ndarray, angle: np.ndarray, torque: np.ndarray | None, name: str = "crank"
) -> None:
    """Write a recording; messages are logged when they were stamped first."""
    joints = encode.joint_states(stamps, ["hip", name], position=np.stack([0.0 * angle, angle], axis=1))
    logged = walk()[0][: len(stamps)].tolist()
    sent = [("/joint_states", time, bytes(raw)) for time, raw in zip(logged, joints, strict=True)]
    if torque is not None:
        wrenches = encode.wrenches(
            stamps, torque=np.stack([0.0 * angle, 0.0 * angle, torque], axis=1), frame_id="p"
        )
        sent += [("/drive_torque", time + 1, bytes(raw)) for time, raw in zip(logged, wrenches, strict=True)]
    write_mcap(path, sorted(sent, key=lambda each: each[1]))


def _still(stamps: Any, angle: Any, torque: Any, rng: Generator) -> Any:
    return "stands still", stamps, 0.0 * angle, torque


def _slow(stamps: Any, angle: Any, torque: Any, rng: Generator) -> Any:
    factor = float(rng.choice([0.05, 0.3, 3.0]))
    return f"wheel at {60 * factor:g} rpm", stamps, angle[0] + factor * (np.unwrap(angle) - angle[0]), None


def _backwards(stamps: Any, angle: Any, torque: Any, rng: Generator) -> Any:
    return "turns backwards", stamps, -angle, torque


def _other_torque(stamps: Any, angle: Any, torque: Any, rng: Generator) -> Any:
    scale = float(rng.choice([0.0, 1.0e-3, 50.0]))
    return f"torque of noise, {scale:g} N m", stamps, angle, scale * rng.normal(size=len(torque))


def _jumps(stamps: Any, angle: Any, torque: Any, rng: Generator) -> Any:
    jump = int(rng.choice([-(10**18), 10**17, -(2**33), 10**9 * 3600]))
    shifted = np.where(np.arange(len(stamps)) > len(stamps) // 2, stamps + jump, stamps)
    return f"stamps jump by {jump} ns", shifted, angle, torque


def _zeros(stamps: Any, angle: Any, torque: Any, rng: Generator) -> Any:
    return "stamps are zero", 0 * stamps, angle, torque


def _not_finite(stamps: Any, angle: Any, torque: Any, rng: Generator) -> Any:
    value = float(rng.choice([np.nan, np.inf, 1e308, -1e300]))
    return f"angles are {value}", stamps, np.full(len(angle), value), torque


def _sparse(stamps: Any, angle: Any, torque: Any, rng: Generator) -> Any:
    step = int(rng.choice([50, 150, 640]))
    return f"every {step}th sample", stamps[::step], angle[::step], torque[::step]


_KINDS: tuple[Callable[..., Any], ...] = (
    _still, _slow, _backwards, _other_torque, _jumps, _zeros, _not_finite, _sparse
)  # fmt: skip


def unlikely(seed: int) -> Case:
    """A sound file of what is no gait of this leg: no table of forces, and exit code 1 or 2."""
    rng = np.random.default_rng(seed)
    what, stamps, angle, torque = _KINDS[seed % len(_KINDS)](*walk(), rng)
    return Case(
        description=f"no gait: {what}",
        prepare=lambda directory: write(directory / "x.mcap", stamps, angle, torque),
        run=command_line("replay", "x.mcap"),
        is_reported=lambda ran: ran.code == 1 and bool(ran.complaints) and " pm/cycle" not in ran.stdout,
        unsound=lambda ran: _impossible(ran) if what.startswith("stamps jump") else f"exit {ran.code}",
    )


def _impossible(ran: Ran) -> str:
    """What cannot be in the last lines: a leg whose clock jumps is one, but its time has a length."""
    (line,) = [line for line in ran.stdout.splitlines() if line.startswith("speed")] or [""]
    seconds = float(line.split()[1]) if line else 0.0
    return "" if 0.0 <= seconds < 10.0 * _SECONDS else line


@cache
def _true() -> bytes:
    import tempfile

    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "x.mcap"
        write(path, *walk())
        return path.read_bytes()


@cache
def _summary() -> dict[str, Any]:
    import tempfile

    from leg_wear_monitor.playback.replay import replay

    with tempfile.TemporaryDirectory() as place:
        (Path(place) / "x.mcap").write_bytes(_true())
        record = json.loads(replay(Path(place) / "x.mcap").summary().to_json())
    return {key: record[key] for key in _COUNTED}


def _differs(ran: Ran) -> str:
    record = json.loads(ran.stdout)
    wrong = [key for key in _COUNTED if record[key] != _summary()[key]]
    return f"{', '.join(wrong)} differ" if wrong else ""


def printed(seed: int) -> Case:
    """A damaged recording of a healthy leg through the command line; reported, or the undamaged summary."""
    _summary()
    rng = np.random.default_rng(seed)
    content = bytearray(_true())
    what = DAMAGES[seed % len(DAMAGES)](content, rng)
    return Case(
        description=f"replay --json: {what}",
        prepare=lambda directory: (directory / "x.mcap").write_bytes(content),
        run=command_line("replay", "x.mcap", "--json", "-"),
        unsound=_differs,
    )
