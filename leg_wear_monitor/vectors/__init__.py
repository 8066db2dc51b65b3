"""Eight neighbouring numbers of an array as one value, for kernels that work along short rows.

A leg in clearance coordinates has rows of two to twenty numbers: x and y of each joint, or one number for
each joint. A loop over them is too short for the compiler's own vector code, and what depends on the state of
a joint is a jump that the processor often guesses wrong. A vector is computed in one instruction (AVX-512),
two (AVX2) or four, stays in a register, and has a choice of two values in place of a jump. Every entry is
rounded as a number by itself would be, and sums have a fixed order, so the results do not depend on the
machine.

Formulas written with `root`, `largest` and `where` hold for numbers and for vectors.

Without a compiler a vector is an array of eight numbers.
"""

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numba.extending import intrinsic

from leg_wear_monitor.vectors import entries, formulas, plain, rows
from leg_wear_monitor.vectors.kinds import LEAST_DIVISOR, WIDTH, padded
from leg_wear_monitor.vectors.operators import register_operators

__all__ = [
    "LEAST_DIVISOR", "WIDTH", "any_of", "bits_of", "copy_array", "entry_of", "evens", "every", "fetch",
    "floor", "gather", "largest", "number_of", "odds", "only", "padded", "part_at", "put_part", "put_vector",
    "root", "vector_at", "vector_max", "vector_sum", "where", "with_entry", "zip_first", "zip_last",
]  # fmt: skip

_COMPILED = not numba.config.DISABLE_JIT
_EVENS, _ODDS = list(range(0, 2 * WIDTH, 2)), list(range(1, 2 * WIDTH, 2))
_ZIPPED = [i // 2 + WIDTH * (i % 2) for i in range(2 * WIDTH)]


register_operators()


def _kernel(compiled: Any, without: Callable[..., Any]) -> Any:
    return intrinsic(compiled) if _COMPILED else without


# vector_at(array, index): entries of a row of an array from an index on, of which the row has as many
vector_at: Any = _kernel(rows.loading(whole=True), plain.loaded)
# part_at(array, index): the same; entries beyond the row's end are 0
part_at: Any = _kernel(rows.loading(whole=False), plain.loaded)
# put_vector(array, index, value), put_part(array, index, value): store a vector, or what fits of it
put_vector: Any = _kernel(rows.storing(whole=True), plain.stored)
put_part: Any = _kernel(rows.storing(whole=False), plain.stored)
# copy_array(source, out): copy an array into another of as many entries; both without gaps
copy_array: Any = _kernel(rows.copy, lambda source, out: np.copyto(out.reshape(-1), source.reshape(-1)))
# fetch(array, index): have the memory bring an entry and its neighbours, for use a little later
fetch: Any = _kernel(rows.fetch_entry, lambda _array, _index: None)
# gather(array, first, row, index): entry array[first + j, row, index[j]] for each j; 0 beyond the array's end
gather: Any = _kernel(rows.gathering, plain.gathered)
# evens(a, b), odds(a, b): every second entry of two vectors: x, or y, of eight joints
evens: Any = _kernel(entries.shuffling(_EVENS), plain.picked(_EVENS))
odds: Any = _kernel(entries.shuffling(_ODDS), plain.picked(_ODDS))
# zip_first(a, b), zip_last(a, b): entries of two vectors in turn, the inverse of evens and odds
zip_first: Any = _kernel(entries.shuffling(_ZIPPED[:WIDTH]), plain.picked(_ZIPPED[:WIDTH]))
zip_last: Any = _kernel(entries.shuffling(_ZIPPED[WIDTH:]), plain.picked(_ZIPPED[WIDTH:]))
# vector_sum(value), vector_max(value): of all entries
vector_sum: Any = _kernel(entries.total, lambda value: plain.folded(value, np.add))
vector_max: Any = _kernel(entries.greatest, lambda value: plain.folded(value, plain.larger_of))
# entry_of(value, i), with_entry(value, i, number): an entry, and a vector with another one there
entry_of: Any = _kernel(entries.entry, lambda value, i: float(value[i]))
with_entry: Any = _kernel(entries.replaced, plain.replaced)
# every(number), only(number, i): a vector of the same number everywhere, or at entry i and 0 elsewhere
every: Any = _kernel(entries.repeated, lambda number: np.full(WIDTH, number, dtype=float))
only: Any = _kernel(entries.single, lambda number, i: plain.replaced(np.zeros(WIDTH), i, number))
# any_of(flags): whether one of them is set
any_of: Any = _kernel(entries.any_flag, lambda flags: bool(flags.any()))
# bits_of(number), number_of(bits): a number, and its bits as a whole number
bits_of: Any = _kernel(formulas.bits, lambda number: int(np.float64(number).view(np.int64)))
number_of: Any = _kernel(formulas.of_bits, lambda bits: float(np.int64(bits).view(np.float64)))
# root(a), floor(a), largest(a, b), where(flags, a, b): square root, whole number below, larger value, a or b;
# of numbers and of vectors
root: Any = _kernel(formulas.of_llvm("sqrt"), plain.root_of)
floor: Any = _kernel(formulas.of_llvm("floor"), plain.whole_part_of)
largest: Any = _kernel(formulas.larger_value, plain.larger_of)
where: Any = _kernel(formulas.choice, plain.chosen)
