"""Functions in formulas for numbers and for vectors."""

from typing import Any

from llvmlite import ir
from numba import types

from leg_wear_monitor.vectors.kinds import (
    FLAGS,
    LLVM_VECTOR,
    NUMBER,
    VECTOR,
    WIDTH,
    as_vector,
    larger,
    llvm_function,
)


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
    """The number with such bits."""

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
