"""``python -m campaign [FAMILY...]``: run families whole, print what went wrong and a table."""

import argparse
import sys
import tempfile
from pathlib import Path

from campaign import family


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m campaign", description=__doc__)
    parser.add_argument("families", nargs="*", metavar="FAMILY", help=f"of {', '.join(family.names())}")
    parser.add_argument("--short", action="store_true", help="only the first cases, some of each kind")
    parser.add_argument("--number", type=int, help="so many cases of each")
    parser.add_argument("--begin", type=int, default=0, metavar="SEED", help="leave out the seeds before")
    parser.add_argument("--case", type=int, metavar="SEED", help="one case of one family; its files are kept")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--all", action="store_true", help="print every case, not only faults")
    arguments = parser.parse_args()
    wanted = arguments.families or family.names()
    if unknown := sorted(set(wanted) - set(family.names())):
        parser.error(f"{', '.join(unknown)}: expected {', '.join(family.names())}")
    if arguments.case is not None:
        return _one(wanted[0], arguments.case)
    rows, faults = [], 0
    for name in wanted:
        if module := family.missing(name):
            print(f"{name}: left out, {module} is not installed")
            continue
        results = []
        for result in family.run_all(name, _seeds(name, arguments), arguments.jobs):
            results.append(result)
            faults += result.outcome.is_fault
            if result.outcome.is_fault or arguments.all:
                print(result, flush=True)
        rows.append(family.row(name, results))
    print(family.table(rows))
    return 1 if faults else 0


def _seeds(name: str, arguments: argparse.Namespace) -> range:
    module = family.load(name)
    number = arguments.number or (module.SHORT if arguments.short else module.LONG)
    return range(arguments.begin, arguments.begin + number)


def _one(name: str, seed: int) -> int:
    directory = Path(tempfile.mkdtemp(prefix=f"{name}_{seed}_"))
    (result,) = family.run(name, [seed], keep=directory)
    print(result)
    for stream in ("stdout", "stderr"):
        print(f"--- {stream}\n{(directory / stream).read_text(errors='replace')}", end="")
    print(f"--- files: {directory}")
    return 1 if result.outcome.is_fault else 0


if __name__ == "__main__":
    sys.exit(main())
