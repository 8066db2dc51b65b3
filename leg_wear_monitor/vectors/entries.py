"""Entries of vectors: picked, combined, replaced."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types

from leg_wear_monitor.vectors.kinds import (
    FLAGS,
    LLVM_VECTOR,
    VECTOR,
    WIDTH,
    WORD,
    larger,
    numbered,
    spread,
    words,
)


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
    """The vector with another number at entry i."""

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
    """Whether one of eight answers is yes."""

    def generate(_context: Any, builder: Any, _sig: Any, values: Any) -> Any:
        bits = ir.IntType(WIDTH)
        return builder.icmp_unsigned("!=", builder.bitcast(values[0], bits), bits(0))

    return types.boolean(FLAGS), generate
