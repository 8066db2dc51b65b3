"""Eight neighbouring numbers of an array as one value, for kernels that work along short rows.

A leg in clearance coordinates has rows of two to twenty numbers: x and y of each joint, or one number for
each joint. A loop over them is too short for the compiler's own vector code, and a branch on the state of a
joint is a jump that the processor often guesses wrong. A vector is computed in one instruction (AVX-512), two
(AVX2) or four, stays in a register, and has a choice of two values in place of a jump. Every entry is rounded
as a single number would be, and sums have a fixed order, so the results do not depend on the machine.

Formulas written with `root`, `largest` and `where` hold for numbers and for vectors.

Without a compiler a vector is an array of eight numbers.
"""

import operator
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin

from leg_wear_monitor.compiled import vector_kinds
from leg_wear_monitor.compiled.vector_kinds import (
    FLAGS,
    LEAST_DIVISOR,
    LLVM_VECTOR,
    NUMBER,
    VECTOR,
    WIDTH,
    WORD,
    as_vector,
    is_number,
    larger,
    llvm_function,
    numbered,
    padded,
    spread,
    words,
)

# Entries of vectors: picked, combined, replaced.


def shuffling(first: list[int]) -> Any:
    """Take numbered entries of two vectors, 0 to 7 of the first and 8 to 15 of the second."""

    def shuffle(_context: Any, _a: Any, _b: Any) -> Any:
        def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
            return builder.shuffle_vector(*values, words(first))

        return VECTOR(VECTOR, VECTOR), generate

    return shuffle


def _fold(builder: Any, vector: Any, combine: Callable[[Any, Any], Any]) -> Any:
    """The first entry after eight entries were combined by halves."""
    half = WIDTH // 2
    while half:
        other = builder.shuffle_vector(vector, vector, words([(i + half) % WIDTH for i in range(WIDTH)]))
        vector, half = combine(vector, other), half // 2
    return builder.extract_element(vector, WORD(0))


def total(_context: Any, _value: Any) -> Any:
    """Sum of all entries, by halves."""

    def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        return _fold(builder, values[0], builder.fadd)

    return types.float64(VECTOR), generate


def greatest(_context: Any, _value: Any) -> Any:
    """Maximum of all entries."""

    def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        return _fold(builder, values[0], lambda a, b: larger(builder, a, b))

    return types.float64(VECTOR), generate


def entry(_context: Any, _value: Any, _i: Any) -> Any:
    """Entry i."""

    def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        return builder.extract_element(*values)

    return types.float64(VECTOR, types.intp), generate


def replaced(_context: Any, _value: Any, _i: Any, _number: Any) -> Any:
    """The vector with a different number at entry i."""

    def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        vector, i, number = values
        return builder.insert_element(vector, number, i)

    return VECTOR(VECTOR, types.intp, types.float64), generate


def single(_context: Any, _number: Any, _i: Any) -> Any:
    """A vector with a number at entry i, and 0 elsewhere."""

    def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        number, i = values
        here = builder.icmp_signed("==", numbered(i.type), spread(builder, i))
        return builder.select(here, spread(builder, number), ir.Constant(LLVM_VECTOR, [0.0] * WIDTH))

    return VECTOR(types.float64, types.intp), generate


def repeated(_context: Any, _number: Any) -> Any:
    """A vector of eight times the same number."""

    def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        return spread(builder, values[0])

    return VECTOR(types.float64), generate


def any_flag(_context: Any, _flags: Any) -> Any:
    """True if one of eight answers is true."""

    def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        bits = ir.IntType(WIDTH)
        return builder.icmp_unsigned("!=", builder.bitcast(values[0], bits), bits(0))

    return types.boolean(FLAGS), generate


# Functions in formulas for numbers and for vectors.


def of_llvm(name: str) -> Any:
    """A function of LLVM's own, of a number or of a vector, by its name there."""

    def find(_context: Any, value: Any) -> Any:
        def generate(_context: Any, builder: Any, sig: Any, values: Any) -> Any:
            whole, suffix = (LLVM_VECTOR, f"v{WIDTH}f64") if sig.args[0] == VECTOR else (NUMBER, "f64")
            return builder.call(llvm_function(builder, f"llvm.{name}.{suffix}", whole, whole), values)

        kind = VECTOR if value == VECTOR else types.float64
        return kind(kind), generate

    return find


def bits(_context: Any, number: Any) -> Any:
    """The bits of a number as a whole number: sign, exponent plus 1023 above 52 binary digits."""

    def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        return builder.bitcast(values[0], ir.IntType(64))

    return types.int64(types.float64), generate


def of_bits(_context: Any, whole: Any) -> Any:
    """The number with these bits."""

    def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        return builder.bitcast(values[0], NUMBER)

    return types.float64(types.int64), generate


def larger_value(_context: Any, a: Any, b: Any) -> Any:
    """The larger of two numbers or vectors; the second if they cannot be compared."""

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        if VECTOR in sig.args:
            values = [as_vector(context, builder, *each) for each in zip(sig.args, values, strict=True)]
        return larger(builder, *values)

    kinds = [VECTOR if kind == VECTOR else types.float64 for kind in (a, b)]
    return (VECTOR if VECTOR in kinds else types.float64)(*kinds), generate


def choice(_context: Any, flags: Any, a: Any, b: Any) -> Any:
    """One of two numbers or vectors, by an answer or by eight."""

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        if sig.args[0] == FLAGS:
            both = zip(sig.args[1:], values[1:], strict=True)
            values = [values[0], *(as_vector(context, builder, *each) for each in both)]
        return builder.select(*values)

    kinds = [VECTOR if kind == VECTOR else types.float64 for kind in (a, b)]
    if flags == FLAGS:
        return VECTOR(FLAGS, *kinds), generate
    return types.float64(types.boolean, types.float64, types.float64), generate


# Operators of vectors, for numba.


class _Arithmetic(AbstractTemplate):  # type: ignore[misc]
    """Types of a sum, difference, product or quotient: a vector, and a vector or a number."""

    def generic(self, args: Any, kws: Any) -> Any:
        if kws or len(args) != 2 or VECTOR not in args:
            return None
        if not all(kind == VECTOR or is_number(kind) for kind in args):
            return None
        return signature(VECTOR, *(VECTOR if kind == VECTOR else types.float64 for kind in args))


class _Comparison(_Arithmetic):
    """Types of a comparison."""

    def generic(self, args: Any, kws: Any) -> Any:
        found = super().generic(args, kws)
        return signature(FLAGS, *found.args) if found else None


class _Both(AbstractTemplate):  # type: ignore[misc]
    """Types of `and` and `or` of two times eight answers."""

    def generic(self, args: Any, kws: Any) -> Any:
        return signature(FLAGS, FLAGS, FLAGS) if tuple(args) == (FLAGS, FLAGS) and not kws else None


class _One(AbstractTemplate):  # type: ignore[misc]
    """Types of a negation and of an absolute value."""

    def generic(self, args: Any, kws: Any) -> Any:
        return signature(VECTOR, VECTOR) if tuple(args) == (VECTOR,) and not kws else None


def _combined(name: str) -> Callable[[Any, Any, Any], Any]:
    """Builds a sum, difference, product or quotient."""
    return lambda builder, a, b: getattr(builder, name)(a, b)


def _compared(sign: str) -> Callable[[Any, Any, Any], Any]:
    """Builds a comparison; it is false for values that cannot be compared."""
    return lambda builder, a, b: builder.fcmp_ordered(sign, a, b)


def _lower_binary(one: Any, template: Any, build: Callable[[Any, Any, Any], Any]) -> None:
    """Register with numba the types and the code of an operator between a vector and a vector or a number."""

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        a, b = (as_vector(context, builder, *each) for each in zip(sig.args, values, strict=True))
        return build(builder, a, b)

    infer_global(one)(template)
    for kinds in ((VECTOR, VECTOR), (VECTOR, types.float64), (types.float64, VECTOR)):
        lower_builtin(one, *kinds)(generate)


def _lower(one: Any, template: Any, build: Callable[..., Any], *kinds: Any) -> None:
    """Tell numba the types and the code of an operator."""

    def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        return build(builder, *values)

    infer_global(one)(template)
    lower_builtin(one, *kinds)(generate)


def _size(builder: Any, value: Any) -> Any:
    fabs = llvm_function(builder, f"llvm.fabs.v{WIDTH}f64", LLVM_VECTOR, LLVM_VECTOR)
    return builder.call(fabs, [value])


def register_operators() -> None:
    """Tell numba all operators."""
    for name, both in {
        "fadd": (operator.add, operator.iadd),
        "fsub": (operator.sub, operator.isub),
        "fmul": (operator.mul, operator.imul),
        "fdiv": (operator.truediv, operator.itruediv),
    }.items():
        for one in both:
            _lower_binary(one, _Arithmetic, _combined(name))
    for sign, one in {
        ">": operator.gt, ">=": operator.ge, "<": operator.lt, "<=": operator.le, "==": operator.eq,
    }.items():  # fmt: skip
        _lower_binary(one, _Comparison, _compared(sign))
    _lower(operator.and_, _Both, lambda builder, a, b: builder.and_(a, b), FLAGS, FLAGS)
    _lower(operator.or_, _Both, lambda builder, a, b: builder.or_(a, b), FLAGS, FLAGS)
    _lower(operator.neg, _One, lambda builder, a: builder.fneg(a), VECTOR)
    _lower(abs, _One, _size, VECTOR)


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


# vector_at(array, index): entries of a row of an array from an index on; the row must have as many
vector_at: Any = _kernel(vector_kinds.loading(whole=True), vector_kinds.loaded)
# part_at(array, index): the same; entries beyond the row's end are 0
part_at: Any = _kernel(vector_kinds.loading(whole=False), vector_kinds.loaded)
# put_vector(array, index, value), put_part(array, index, value): store a vector, or the part that fits
put_vector: Any = _kernel(vector_kinds.storing(whole=True), vector_kinds.stored)
put_part: Any = _kernel(vector_kinds.storing(whole=False), vector_kinds.stored)
# copy_array(source, out): copy an array into a second array of as many entries; both without gaps
copy_array: Any = _kernel(
    vector_kinds.copy, lambda source, out: np.copyto(out.reshape(-1), source.reshape(-1))
)
# fetch(array, index): have the memory bring an entry and its neighbours, for use a little later
fetch: Any = _kernel(vector_kinds.fetch_entry, lambda _array, _index: None)
# gather(array, first, row, index): entry array[first + j, row, index[j]] for each j; 0 beyond the array's end
gather: Any = _kernel(vector_kinds.gathering, vector_kinds.gathered)
# evens(a, b), odds(a, b): every second entry of two vectors: x, or y, of eight joints
evens: Any = _kernel(shuffling(_EVENS), vector_kinds.picked(_EVENS))
odds: Any = _kernel(shuffling(_ODDS), vector_kinds.picked(_ODDS))
# zip_first(a, b), zip_last(a, b): entries of two vectors in turn, the inverse of evens and odds
zip_first: Any = _kernel(shuffling(_ZIPPED[:WIDTH]), vector_kinds.picked(_ZIPPED[:WIDTH]))
zip_last: Any = _kernel(shuffling(_ZIPPED[WIDTH:]), vector_kinds.picked(_ZIPPED[WIDTH:]))
# vector_sum(value), vector_max(value): of all entries
vector_sum: Any = _kernel(total, lambda value: vector_kinds.folded(value, np.add))
vector_max: Any = _kernel(greatest, lambda value: vector_kinds.folded(value, vector_kinds.larger_of))
# entry_of(value, i), with_entry(value, i, number): an entry, and a vector with a different entry there
entry_of: Any = _kernel(entry, lambda value, i: float(value[i]))
with_entry: Any = _kernel(replaced, vector_kinds.replaced)
# every(number), only(number, i): a vector of the same number everywhere, or at entry i and 0 elsewhere
every: Any = _kernel(repeated, lambda number: np.full(WIDTH, number, dtype=float))
only: Any = _kernel(single, lambda number, i: vector_kinds.replaced(np.zeros(WIDTH), i, number))
# any_of(flags): whether one of them is set
any_of: Any = _kernel(any_flag, lambda flags: bool(flags.any()))
# bits_of(number), number_of(bits): a number, and its bits as a whole number
bits_of: Any = _kernel(bits, lambda number: int(np.float64(number).view(np.int64)))
number_of: Any = _kernel(of_bits, lambda bits: float(np.int64(bits).view(np.float64)))
# root(a), floor(a), largest(a, b), where(flags, a, b): square root, whole number below, larger value, a or b;
# of numbers and of vectors
root: Any = _kernel(of_llvm("sqrt"), vector_kinds.root_of)
floor: Any = _kernel(of_llvm("floor"), vector_kinds.whole_part_of)
largest: Any = _kernel(larger_value, vector_kinds.larger_of)
where: Any = _kernel(choice, vector_kinds.chosen)
