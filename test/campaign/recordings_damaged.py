"""Bytes damaged at random: what disks, cables and malice do to a file."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from campaign import recordings_stored
from campaign.case import Case, Outcome
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.twin.sample import NO_FAULT, Samples

Generator = np.random.Generator
Damage = Callable[[bytearray, Generator], str]


def cut(content: bytearray, rng: Generator) -> str:
    at = int(rng.integers(len(content)))
    del content[at:]
    return f"cut at byte {at}"


def flip(content: bytearray, rng: Generator) -> str:
    at, bit = int(rng.integers(len(content))), int(rng.integers(8))
    content[at] ^= 1 << bit
    return f"bit {bit} of byte {at} flipped"


def many(content: bytearray, rng: Generator) -> str:
    number = int(rng.integers(2, 200))
    for at in rng.integers(len(content), size=number).tolist():
        content[at] = int(rng.integers(256))
    return f"{number} bytes at random"


def hole(content: bytearray, rng: Generator) -> str:
    at, size = int(rng.integers(len(content))), int(rng.integers(1, 5000))
    size = min(size, len(content) - at)
    content[at : at + size] = bytes(size)
    return f"{size} bytes from {at} are zero"


def lost(content: bytearray, rng: Generator) -> str:
    at, size = int(rng.integers(len(content))), int(rng.integers(1, 5000))
    del content[at : at + size]
    return f"{size} bytes from {at} are gone"


def doubled(content: bytearray, rng: Generator) -> str:
    at, size = int(rng.integers(len(content))), int(rng.integers(1, 5000))
    content[at:at] = content[at : at + size]
    return f"{size} bytes from {at} are there twice"


def huge(content: bytearray, rng: Generator) -> str:
    """A length, a size, an offset or a time becomes what no file has."""
    at = int(rng.integers(max(1, len(content) - 8)))
    value = [2**63, 2**64 - 1, 2**31, 2**32 - 1, 2**40, 0][int(rng.integers(6))]
    content[at : at + 8] = value.to_bytes(8, "little")
    return f"{value:#x} at byte {at}"


def huge_at_an_end(content: bytearray, rng: Generator) -> str:
    """The same where heads, indexes and footers are."""
    near = int(rng.integers(min(600, len(content) - 8)))
    at = near if rng.integers(2) else len(content) - 8 - near
    value = [2**63, 2**64 - 1, 2**31, len(content), len(content) // 2, 8][int(rng.integers(6))]
    content[at : at + 8] = value.to_bytes(8, "little")
    return f"{value:#x} at byte {at}"


DAMAGES: tuple[Damage, ...] = (cut, flip, many, hole, lost, doubled, huge, huge_at_an_end, flip, cut)


def damaged(seed: int) -> Case:
    """A case of a way of storing and of a damage, all samples compared one by one."""
    rng = np.random.default_rng(seed)
    ways = sorted(recordings_stored.stored())
    way = ways[seed % len(ways)]
    named, files = recordings_stored.stored()[way]
    name = sorted(files)[int(rng.integers(len(files)))]
    content = bytearray(files[name])
    what = DAMAGES[(seed // len(ways)) % len(DAMAGES)](content, rng)
    return Case(
        description=f"{way}: {name}, {what}",
        prepare=lambda directory: recordings_stored.lay_out(directory, files | {name: bytes(content)}),
        run=lambda directory: compared(directory / named),
    )


def compared(*paths: Path, true: Samples | None = None) -> tuple[Outcome, str]:
    """What came of reading: reported, as undamaged, or wrong without a word."""
    try:
        samples, recording = recordings_stored.read(*paths)
    except LegWearError as error:
        text = str(error)
        return (Outcome.REFUSED, text) if text.isprintable() else (Outcome.CRASH, f"not one line: {text!r}")
    texts = [str(finding) for finding in recording.findings]
    if not all(text.isprintable() for text in texts):
        return Outcome.CRASH, f"findings that are not one line each: {texts}"
    true = recordings_stored.expected() if true is None else true
    if recording.is_partial:
        return Outcome.REPORTED, texts[0]
    if samples.tobytes() == true.tobytes():
        return Outcome.SOUND, ""
    known = {bytes(sample) for sample in true}
    wrong = sum(bytes(each) not in known for each in samples[samples["fault"] == NO_FAULT])
    if any("checksum" in text or "not read" in text for text in texts):
        return Outcome.REPORTED, f"could not be checked; {wrong} values are other ones"
    return Outcome.SILENT, f"{len(samples)} samples for {len(true)}, {wrong} of them other ones: {texts}"
