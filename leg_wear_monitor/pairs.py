"""Two neighbouring numbers of an array as one value, for kernels that work along short rows.

The rows of a leg in clearance coordinates have an even number of entries, x and y of each joint. A loop over
ten of them is too short for the compiler's own vector code, and sums in memory wait for each other. A pair is
added and multiplied in one instruction and stays in a register. Every entry is rounded as a number by itself
would be, so the results do not depend on the machine.

Without a compiler a pair is an array of two numbers.
"""

import operator
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

Floats = np.ndarray[Any, np.dtype[np.float64]]

_LLVM = ir.VectorType(ir.DoubleType(), 2)
_BYTES = 8  # alignment of an entry: a pair may start at any


class _PairType(types.Type):  # type: ignore[misc]
    """Two numbers in one register."""

    def __init__(self) -> None:
        super().__init__(name="Pair")


PAIR = _PairType()


@register_model(_PairType)
class _PairModel(models.PrimitiveModel):  # type: ignore[misc]
    """A vector of two numbers, of the machine's own kind."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _LLVM)


def _place(context: Any, builder: Any, kind: Any, values: Any) -> Any:
    """Pointer to the pair at an array's row and column."""
    array = context.make_array(kind)(context, builder, values[0])
    pointer = cgutils.get_item_pointer(context, builder, kind, array, list(values[1:3]), wraparound=False)
    return builder.bitcast(pointer, _LLVM.as_pointer())


def _load(_context: Any, array: Any, _row: Any, _i: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        return builder.load(_place(context, builder, sig.args[0], values), align=_BYTES)

    return PAIR(array, types.intp, types.intp), generate


def _store(_context: Any, array: Any, _row: Any, _i: Any, value: Any) -> Any:
    def generate(context: Any, builder: Any, sig: Any, values: Any) -> Any:
        builder.store(values[3], _place(context, builder, sig.args[0], values), align=_BYTES)
        return context.get_dummy_value()

    return types.void(array, types.intp, types.intp, value), generate


def _sum(_context: Any, value: Any) -> Any:
    def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        first, second = (builder.extract_element(values[0], ir.IntType(32)(i)) for i in range(2))
        return builder.fadd(first, second)

    return types.float64(value), generate


def _loaded(array: Floats, row: int, i: int) -> Floats:
    return array[row, i : i + 2].copy()


def _stored(array: Floats, row: int, i: int, value: Floats) -> None:
    array[row, i : i + 2] = value


def _summed(value: Floats) -> float:
    return float(value[0] + value[1])


_COMPILED = not numba.config.DISABLE_JIT

# pair_at(array, row, i): entries i and i + 1 of a row of a two-dimensional array
pair_at: Any = intrinsic(_load) if _COMPILED else _loaded
# put_pair(array, row, i, value): store a pair there
put_pair: Any = intrinsic(_store) if _COMPILED else _stored
# pair_sum(value): sum of both entries
pair_sum: Any = intrinsic(_sum) if _COMPILED else _summed


class _Elementwise(AbstractTemplate):  # type: ignore[misc]
    """Types of a sum or a difference: two pairs."""

    def generic(self, args: Any, kws: Any) -> Any:
        return signature(PAIR, PAIR, PAIR) if tuple(args) == (PAIR, PAIR) and not kws else None


class _Product(AbstractTemplate):  # type: ignore[misc]
    """Types of a product: two pairs, or a number and a pair."""

    def generic(self, args: Any, kws: Any) -> Any:
        if kws or len(args) != 2 or args[1] != PAIR:
            return None
        if args[0] == PAIR:
            return signature(PAIR, PAIR, PAIR)
        return signature(PAIR, types.float64, PAIR) if isinstance(args[0], types.Float) else None


for _operator in (operator.add, operator.sub, operator.iadd, operator.isub):
    infer_global(_operator)(_Elementwise)
infer_global(operator.mul)(_Product)


def _register(name: str, *operators: Any) -> None:
    def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        return getattr(builder, name)(*values)

    for one in operators:
        lower_builtin(one, PAIR, PAIR)(generate)


_register("fadd", operator.add, operator.iadd)
_register("fsub", operator.sub, operator.isub)
_register("fmul", operator.mul)


@lower_builtin(operator.mul, types.float64, PAIR)  # type: ignore[untyped-decorator]
def _scaled(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
    both = ir.Constant(_LLVM, ir.Undefined)
    for i in range(2):
        both = builder.insert_element(both, values[0], ir.IntType(32)(i))
    return builder.fmul(both, values[1])
