"""Rows of arrays as vectors."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from leg_wear_monitor.vectors.kinds import (
    LLVM_FLAGS,
    LLVM_VECTOR,
    NUMBER,
    VECTOR,
    WIDTH,
    WORD,
    llvm_function,
    numbered,
    spread,
)

_BYTES = 8  # alignment of an entry: a vector may start at any


def _place(context: Any, builder: Any, sig: Any, values: Any) -> tuple[Any, Any]:
    """Pointer to an entry of an array, and the number of entries from there to the end of its row."""
    kind, array = sig.args[0], context.make_array(sig.args[0])(context, builder, values[0])
    index = cgutils.unpack_tuple(builder, values[1]) if kind.ndim > 1 else [values[1]]
    pointer = cgutils.get_item_pointer(context, builder, kind, array, index, wraparound=False)
    length = cgutils.unpack_tuple(builder, array.shape, kind.ndim)[-1]
    return pointer, builder.sub(length, index[-1])


def _flags_below(builder: Any, count: Any) -> Any:
    """Flags of the entries whose number is below a count."""
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
    """Copy an array without gaps into another of as many entries."""

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
