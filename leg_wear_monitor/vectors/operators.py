"""Operators of vectors, for numba."""

import operator
from collections.abc import Callable
from typing import Any

from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin

from leg_wear_monitor.vectors.kinds import (
    FLAGS,
    LLVM_VECTOR,
    VECTOR,
    WIDTH,
    as_vector,
    is_number,
    llvm_function,
)


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
    """Builds a comparison, whose answer for what cannot be compared is no."""
    return lambda builder, a, b: builder.fcmp_ordered(sign, a, b)


def _lower_binary(one: Any, template: Any, build: Callable[[Any, Any, Any], Any]) -> None:
    """Tell numba the types and the code of an operator of a vector, and a vector or a number."""

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
