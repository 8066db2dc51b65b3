"""Run the tests as other machines would: `make test-machines`, and one of them with ``MACHINE=haswell``.

A machine differs from another by the kernels of its BLAS and of its C library, by the processor that numba
compiles for, by its Python, or by a last bit of where a motion starts. Motion with clearances is chaotic: it
takes another course on each of them, and what the tests state must hold for all.
"""

import argparse
import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import attrs
from llvmlite import binding

BUILD = Path("build/machines").absolute()
SELECTION = "not slow and not uncompiled"
PYTHONS = ("3.11", "3.12", "3.13")
OF_VENV = f"{sys.version_info.major}.{sys.version_info.minor}"


@attrs.frozen
class Machine:
    """What differs: variables, what the processor must have, and the environment if of another Python."""

    name: str
    what: str
    variables: dict[str, str] = attrs.field(factory=dict)
    environment: str = ".venv"
    needs: frozenset[str] = frozenset()

    def lacks(self) -> list[str]:
        """Features that it needs and this processor does not have, by LLVM's names: it would end at once."""
        has = binding.get_host_cpu_features()
        return sorted(feature for feature in self.needs if not has.get(feature, False))

    def run(self, *line: str) -> int:
        """Exit code of a command of its Python."""
        python = f"{self.environment}/bin/python"
        return subprocess.run([python, *line], env=os.environ | self.variables, check=False).returncode


MACHINES = (
    Machine(
        "haswell",
        "OpenBLAS as on Haswell",
        {"OPENBLAS_CORETYPE": "Haswell"},
        needs=frozenset({"avx2", "fma"}),
    ),
    Machine(
        "skylakex",
        "OpenBLAS as on Skylake with AVX-512",
        {"OPENBLAS_CORETYPE": "SkylakeX"},
        needs=frozenset({"avx512f", "avx512cd", "avx512bw", "avx512dq", "avx512vl"}),
    ),
    Machine("nehalem", "OpenBLAS as on Nehalem", {"OPENBLAS_CORETYPE": "Nehalem"}),
    Machine(
        "no-fma",
        "the C library's functions without FMA and AVX2",
        {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2_Usable,-FMA_Usable,-FMA,-AVX2"},
    ),
    Machine(
        "generic",
        "compiled for any processor of this architecture, stored apart",
        {"NUMBA_CPU_NAME": "generic", "NUMBA_CACHE_DIR": str(BUILD / "generic")},
    ),
    Machine("moved", "every start moved by a relative 1e-12", {"MOVED_STARTS": "1"}),
)
OTHER_PYTHONS = tuple(
    Machine(f"python{version}", f"Python {version}", environment=f".venv-python{version}")
    for version in PYTHONS
    if version != OF_VENV
)


@attrs.frozen
class Outcome:
    """How it ended on a machine."""

    machine: str
    said: str
    is_good: bool


def try_on(machine: Machine, options: list[str]) -> Outcome:
    """Compile the kernels and run the tests."""
    print(f"== {machine.name}: {machine.what}", flush=True)
    if lacking := machine.lacks():
        return Outcome(machine.name, f"not run: this processor lacks {', '.join(lacking)}", True)
    if machine in OTHER_PYTHONS:
        if not _is_there(machine.name):
            return Outcome(machine.name, "not run: this Python, with venv, is not on the machine", True)
        if subprocess.run(["make", f"{machine.environment}/installed"], check=False).returncode:
            return Outcome(machine.name, "not run: its environment could not be made", False)
    report = BUILD / f"{machine.name}.xml"
    report.unlink(missing_ok=True)
    code = machine.run("-m", "leg_wear_monitor", "cache", "--fill")
    code = code or machine.run("-m", "pytest", *options, f"--junit-xml={report}")
    if not report.is_file():
        return Outcome(machine.name, f"ended with code {code} before there was a report", False)
    return Outcome(machine.name, _counted(report), code == 0)


def _is_there(python: str) -> bool:
    """Whether a Python is installed, runs, and can make an environment; a name may be there without."""
    line = [python, "-c", "import ensurepip, venv"]
    return (
        bool(shutil.which(python)) and not subprocess.run(line, capture_output=True, check=False).returncode
    )


def _counted(report: Path) -> str:
    """Tests by outcome, and the time that they took, from a report in JUnit's format."""
    suite = next(ET.parse(report).iter("testsuite")).attrib
    failed, skipped = int(suite["failures"]) + int(suite["errors"]), int(suite["skipped"])
    passed, minutes = int(suite["tests"]) - failed - skipped, float(suite["time"]) / 60.0
    return f"{passed} passed, {failed} failed, {skipped} skipped, {minutes:.1f} min"


def chosen(name: str, turn: int | None) -> tuple[Machine, ...]:
    """The machines to try: all, one by name, or one in turn that runs here, in this environment."""
    if turn is not None:
        here = [machine for machine in MACHINES if not machine.lacks()]
        return (here[turn % len(here)],)
    return tuple(machine for machine in (*MACHINES, *OTHER_PYTHONS) if name in ("all", machine.name))


def main() -> None:
    """Try all machines that are asked for, red or not, and say at the end how each of them did."""
    names = ["all", *(machine.name for machine in (*MACHINES, *OTHER_PYTHONS))]
    arguments = argparse.ArgumentParser(description="Run the tests as other machines would.")
    arguments.add_argument("--machine", default="all", choices=names)
    arguments.add_argument("--turn", type=int, help="instead: one in turn, by a number that counts up")
    arguments.add_argument("--select", default=SELECTION, help="tests, as pytest's -m")
    asked, options = arguments.parse_known_args()
    BUILD.mkdir(parents=True, exist_ok=True)
    options = ["-m", asked.select, *options]
    outcomes = [try_on(machine, options) for machine in chosen(asked.machine, asked.turn)]
    print(f"\n== summary (Python of .venv: {OF_VENV})")
    for outcome in outcomes:
        print(f"{'ok ' if outcome.is_good else 'RED'} {outcome.machine:12} {outcome.said}")
    if not all(outcome.is_good for outcome in outcomes):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
