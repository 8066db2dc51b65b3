"""Types of vectors in compiled code, and what their operations have in common."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import models, register_model

WIDTH = 8

# a formula without a jump divides by the larger of this and what may be 0, whatever its unit
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
    """Whether a type is that of numbers that a vector may be combined with."""
    return isinstance(kind, types.Float | types.Integer | types.Boolean)


def llvm_function(builder: Any, name: str, result: Any, *kinds: Any) -> Any:
    """One of LLVM's own functions."""
    return cgutils.get_or_insert_function(builder.module, ir.FunctionType(result, kinds), name)


def larger(builder: Any, a: Any, b: Any) -> Any:
    """The larger of two values; the second if they cannot be compared."""
    return builder.select(builder.fcmp_ordered(">", a, b), a, b)
