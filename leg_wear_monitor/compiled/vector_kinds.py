"""Types of vectors of eight numbers in compiled code, as arrays without a compiler, and as rows of arrays."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import models, register_model

# Types of vectors in compiled code, and the shared parts of their operations.


WIDTH = 8

# A formula without a jump divides by the larger of this and a value that may be 0, whatever its unit.
LEAST_DIVISOR = 1.0e-300

WORD, NUMBER = ir.IntType(32), ir.DoubleType()
LLVM_VECTOR, LLVM_FLAGS = ir.VectorType(NUMBER, WIDTH), ir.VectorType(ir.IntType(1), WIDTH)


class _VectorType(types.Type):  # type: ignore[misc]
    """Eight numbers in one register."""

    def __init__(self) -> None:
        super().__init__(name="Vector")


class _FlagsType(types.Type):  # type: ignore[misc]
    """Eight answers, one for each number of a vector."""

    def __init__(self) -> None:
        super().__init__(name="VectorFlags")


VECTOR, FLAGS = _VectorType(), _FlagsType()


@register_model(_VectorType)
class _VectorModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, LLVM_VECTOR)


@register_model(_FlagsType)
class _FlagsModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, LLVM_FLAGS)


def padded(count: int) -> int:
    """Least multiple of `WIDTH` that has room for a number of entries."""
    return -(-count // WIDTH) * WIDTH


def numbered(kind: Any) -> Any:
    """The constant vector 0 to 7 of a type of whole numbers."""
    return ir.Constant(ir.VectorType(kind, WIDTH), list(range(WIDTH)))


def words(values: Any) -> Any:
    """A constant vector of whole numbers."""
    return ir.Constant(ir.VectorType(WORD, len(values)), list(values))


def spread(builder: Any, number: Any) -> Any:
    """A vector of eight times the same number."""
    undefined = ir.Constant(ir.VectorType(number.type, WIDTH), ir.Undefined)
    first = builder.insert_element(undefined, number, WORD(0))
    return builder.shuffle_vector(first, undefined, words([0] * WIDTH))


def as_vector(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """A vector, from a vector or a number."""
    if kind == VECTOR:
        return value
    return spread(builder, context.cast(builder, value, kind, types.float64))


def is_number(kind: Any) -> bool:
    """True if a type is a number type that can be combined with a vector."""
    return isinstance(kind, types.Float | types.Integer | types.Boolean)


def llvm_function(builder: Any, name: str, result: Any, *kinds: Any) -> Any:
    """One of LLVM's own functions."""
    return cgutils.get_or_insert_function(builder.module, ir.FunctionType(result, kinds), name)


def larger(builder: Any, a: Any, b: Any) -> Any:
    """The larger of two values; the second if they cannot be compared."""
    return builder.select(builder.fcmp_ordered(">", a, b), a, b)


# Vectors without a compiler: arrays of eight numbers.


Floats = np.ndarray[Any, np.dtype[np.float64]]


def _row(array: Floats, index: int | tuple[int, ...]) -> Floats:
    *row, i = index if isinstance(index, tuple) else (index,)
    return np.asarray(array[tuple(row)][i : i + WIDTH])


def loaded(array: Floats, index: int | tuple[int, ...]) -> Floats:
    """Eight entries of a row from an index on; 0 beyond its end."""
    found = np.zeros(WIDTH)
    row = _row(array, index)
    found[: len(row)] = row
    return found


def stored(array: Floats, index: int | tuple[int, ...], value: Floats) -> None:
    """Store eight entries, or those that the row has."""
    row = _row(array, index)
    row[:] = value[: len(row)]


def gathered(array: Floats, first: int, row: int, index: Floats) -> Floats:
    """Entry array[first + j, row, index[j]] for each j; 0 beyond the end of the array."""
    found = np.zeros(WIDTH)
    for j in range(min(WIDTH, len(array) - first)):
        found[j] = array[first + j, row, int(index[j])]
    return found


def folded(value: Floats, combine: Callable[[Floats, Floats], Floats]) -> float:
    """All entries combined by halves."""
    while len(value) > 1:
        half = len(value) // 2
        value = combine(value[:half], value[half:])
    return float(value[0])


def replaced(value: Floats, i: int, number: float) -> Floats:
    """A vector with a different number at an entry."""
    found = value.copy()
    found[i] = number
    return found


def chosen(flags: Any, a: Any, b: Any) -> Any:
    """A or b, entry by entry or whole."""
    if isinstance(flags, np.ndarray):
        return np.where(flags, a, b)
    return a if flags else b


def larger_of(a: Any, b: Any) -> Any:
    """The larger of two values; the second if they cannot be compared."""
    return chosen(a > b, a, b)


def whole_part_of(value: Any) -> Any:
    """The largest whole number that is not above a value, as a float."""
    return np.floor(value) if isinstance(value, np.ndarray) else float(math.floor(value))


def root_of(value: Any) -> Any:
    """Square root."""
    return np.sqrt(value) if isinstance(value, np.ndarray) else math.sqrt(value)


def picked(first: list[int]) -> Callable[[Floats, Floats], Floats]:
    """Take numbered entries of two vectors, 0 to 7 of the first and 8 to 15 of the second."""
    return lambda a, b: np.concatenate([a, b])[first]


# Rows of arrays as vectors.


_BYTES = 8  # alignment of an entry: a vector may start at any


def _place(context: Any, builder: Any, sig: Any, values: Any) -> tuple[Any, Any]:
    """Pointer to an entry of an array, and the number of entries from there to the end of its row."""
    kind, array = sig.args[0], context.make_array(sig.args[0])(context, builder, values[0])
    index = cgutils.unpack_tuple(builder, values[1]) if kind.ndim > 1 else [values[1]]
    pointer = cgutils.get_item_pointer(context, builder, kind, array, index, wraparound=False)
    length = cgutils.unpack_tuple(builder, array.shape, kind.ndim)[-1]
    return pointer, builder.sub(length, index[-1])


def _flags_below(builder: Any, count: Any) -> Any:
    """Flags of the entries with a number below a count."""
    return builder.icmp_signed("<", numbered(count.type), spread(builder, count))


def _load(context: Any, builder: Any, sig: Any, values: Any, whole: bool) -> Any:
    pointer, left = _place(context, builder, sig, values)
    dtype = sig.args[0].dtype
    entry = context.get_data_type(dtype)
    vector = ir.VectorType(entry, WIDTH)
    place = builder.bitcast(pointer, vector.as_pointer())
    size = 4 if dtype == types.float32 else _BYTES
    if whole:
        loaded = builder.load(place, align=size)
    else:
        name = f"llvm.masked.load.v{WIDTH}f{8 * size}.p0v{WIDTH}f{8 * size}"
        load = llvm_function(builder, name, vector, place.type, WORD, LLVM_FLAGS, vector)
        zero = ir.Constant(vector, [0.0] * WIDTH)
        loaded = builder.call(load, [place, WORD(size), _flags_below(builder, left), zero])
    return loaded if entry == NUMBER else builder.fpext(loaded, LLVM_VECTOR)


def _index_kind(index: Any) -> Any:
    return types.UniTuple(types.intp, len(index)) if isinstance(index, types.BaseTuple) else types.intp


def loading(whole: bool) -> Any:
    """Take eight entries from an index on: all in the row, or those beyond its end as 0."""

    def load(_context: Any, array: Any, index: Any) -> Any:
        if array.dtype not in (types.float32, types.float64):
            return None

        def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            return _load(context, builder, sig, values, whole)

        return VECTOR(array, _index_kind(index)), generate

    return load


def storing(whole: bool) -> Any:
    """Store eight entries from an index on: all in the row, or those that it has."""

    def store(_context: Any, array: Any, index: Any, _value: Any) -> Any:
        if array.dtype != types.float64:
            return None

        def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            _store(context, builder, sig, values, whole)
            return context.get_dummy_value()

        return types.void(array, _index_kind(index), VECTOR), generate

    return store


def _store(context: Any, builder: Any, sig: Any, values: Any, whole: bool) -> None:
    pointer, left = _place(context, builder, sig, values)
    pointer = builder.bitcast(pointer, LLVM_VECTOR.as_pointer())
    if whole:
        builder.store(values[-1], pointer, align=_BYTES)
        return
    name = f"llvm.masked.store.v{WIDTH}f64.p0v{WIDTH}f64"
    store = llvm_function(builder, name, ir.VoidType(), LLVM_VECTOR, pointer.type, WORD, LLVM_FLAGS)
    builder.call(store, [values[-1], pointer, WORD(_BYTES), _flags_below(builder, left)])


def gathering(_context: Any, array: Any, first: Any, row: Any, index: Any) -> Any:
    """Take entry array[first + j, row, index[j]] for each j; 0 beyond the end of the array."""

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        kind, (_, first, row, index) = sig.args[0], values
        array = context.make_array(kind)(context, builder, values[0])
        count = cgutils.unpack_tuple(builder, array.shape, 3)[0]
        last, found = builder.sub(count, first.type(1)), ir.Constant(LLVM_VECTOR, [0.0] * WIDTH)
        for j in range(WIDTH):
            at = builder.add(first, first.type(j))
            is_there = builder.icmp_signed("<", at, count)
            column = builder.fptosi(builder.extract_element(index, WORD(j)), row.type)
            place = [builder.select(is_there, at, last), row, column]
            pointer = cgutils.get_item_pointer(context, builder, kind, array, place, wraparound=False)
            entry = builder.select(is_there, builder.load(pointer), NUMBER(0.0))
            found = builder.insert_element(found, entry, WORD(j))
        return found

    if array.ndim != 3 or array.dtype != types.float64:
        return None
    return VECTOR(array, types.intp, types.intp, VECTOR), generate


def fetch_entry(_context: Any, array: Any, index: Any) -> Any:
    """Have the memory bring an entry and its neighbours."""

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        pointer, _ = _place(context, builder, sig, values)
        byte = builder.bitcast(pointer, ir.IntType(8).as_pointer())
        fetch = llvm_function(builder, "llvm.prefetch.p0i8", ir.VoidType(), byte.type, WORD, WORD, WORD)
        builder.call(fetch, [byte, WORD(0), WORD(3), WORD(1)])  # to read, soon, data
        return context.get_dummy_value()

    return types.void(array, _index_kind(index)), generate


def copy(_context: Any, source: Any, out: Any) -> Any:
    """Copy an array without gaps into a second array of as many entries."""

    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        both = zip(sig.args, values, strict=True)
        origin, goal = (context.make_array(kind)(context, builder, value) for kind, value in both)
        entries = builder.mul(goal.nitems, goal.itemsize)
        byte = ir.IntType(8).as_pointer()
        places = [builder.bitcast(array.data, byte) for array in (goal, origin)]
        cgutils.raw_memcpy(builder, *places, entries, 1)
        return context.get_dummy_value()

    if source.layout != "C" or out.layout != "C" or source.dtype != out.dtype:
        return None
    return types.void(source, out), generate
