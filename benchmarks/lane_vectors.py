"""A numba type for a vector of doubles, one for each of several legs: an experiment (`lanes.py`).

numba's loops over a short last axis are unrolled or guarded by tests for overlap and stay mostly scalar; a
type of its own becomes LLVM's vectors as they are.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, overload, register_model

LANES = 8  # doubles of AVX-512; with AVX2, LLVM makes two vectors of each

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_CONTRACT = ("contract",)  # a product and a sum may become one instruction; nothing else is reordered


class _Vector(types.Type):  # type: ignore[misc]
    def __init__(self) -> None:
        super().__init__(name=f"Vector{LANES}")


_TYPE = _Vector()


@register_model(_Vector)
class _Model(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _binary(instruction: str) -> Any:
    @intrinsic  # type: ignore[misc]
    def operate(_context, a, b):  # type: ignore[no-untyped-def]
        def build(_context, builder, _signature, given):  # type: ignore[no-untyped-def]
            return getattr(builder, instruction)(*given, flags=_CONTRACT)

        return _TYPE(_TYPE, _TYPE), build

    return operate


def _unary(name: str) -> Any:
    @intrinsic  # type: ignore[misc]
    def operate(_context, a):  # type: ignore[no-untyped-def]
        def build(_context, builder, _signature, given):  # type: ignore[no-untyped-def]
            kind = ir.FunctionType(_VECTOR, [_VECTOR])
            found = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64")
            return builder.call(found, given)

        return _TYPE(_TYPE), build

    return operate


def _as_operator(which: Callable[..., Any], operate: Any) -> None:
    @overload(which)  # type: ignore[misc]
    def implement(a, b):  # type: ignore[no-untyped-def]
        if isinstance(a, _Vector) and isinstance(b, _Vector):
            return lambda a, b: operate(a, b)  # noqa: PLW0108 (numba takes functions of Python only)
        return None


for _which, _instruction in (
    (operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul"), (operator.truediv, "fdiv"),
):  # fmt: skip
    _as_operator(_which, _binary(_instruction))

root, size = _unary("sqrt"), _unary("fabs")


@intrinsic  # type: ignore[misc]
def every(_context, value):  # type: ignore[no-untyped-def]
    """The same number in all lanes."""

    def build(_context, builder, _signature, given):  # type: ignore[no-untyped-def]
        word, undefined = ir.IntType(32), ir.Constant(_VECTOR, ir.Undefined)
        first = builder.insert_element(undefined, given[0], ir.Constant(word, 0))
        return builder.shuffle_vector(first, undefined, ir.Constant(ir.VectorType(word, LANES), [0] * LANES))

    return _TYPE(types.float64), build


@intrinsic  # type: ignore[misc]
def where_above(_context, a, b, then, otherwise):  # type: ignore[no-untyped-def]
    """``then`` in the lanes where a > b, else ``otherwise``."""

    def build(_context, builder, _signature, given):  # type: ignore[no-untyped-def]
        return builder.select(builder.fcmp_ordered(">", given[0], given[1]), given[2], given[3])

    return _TYPE(_TYPE, _TYPE, _TYPE, _TYPE), build


def _place(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    first = builder.gep(data, [builder.mul(index, ir.Constant(index.type, LANES))])
    return builder.bitcast(first, _VECTOR.as_pointer())


@intrinsic  # type: ignore[misc]
def take(_context, array, index):  # type: ignore[no-untyped-def]
    """Vector ``index`` of a flat array (n LANES,)."""

    def build(context, builder, signature, given):  # type: ignore[no-untyped-def]
        loaded = builder.load(_place(context, builder, signature.args[0], *given))
        loaded.align = 8
        return loaded

    return _TYPE(array, types.int64), build


@intrinsic  # type: ignore[misc]
def put(_context, array, index, vector):  # type: ignore[no-untyped-def]
    """Store vector ``index`` of a flat array (n LANES,)."""

    def build(context, builder, signature, given):  # type: ignore[no-untyped-def]
        stored = builder.store(given[2], _place(context, builder, signature.args[0], *given[:2]))
        stored.align = 8
        return context.get_dummy_value()

    return types.void(array, types.int64, _TYPE), build
