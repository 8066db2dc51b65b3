"""A kernel that selects one of several kernels by a number in compiled code."""

from collections.abc import Callable, Iterable
from typing import Any

from leg_wear_monitor.compiled.kernel import kernel


def by_number(kernels: Iterable[Callable[..., Any]]) -> Callable[..., Any]:
    """Kernel that takes the number of a kernel, from 0, then the arguments of this kernel.

    It is a chain of branches, built once: compiled code cannot cheaply call a function that is an argument.
    """
    *others, last = kernels
    chain = _only(last)
    for number, this in reversed(list(enumerate(others))):
        chain = _either(number, this, chain)
    return chain


def _only(this: Callable[..., Any]) -> Callable[..., Any]:
    """Kernel that calls ``this`` for any number."""

    @kernel
    def only(number, *arguments):
        return this(*arguments)

    return only


def _either(number: int, this: Callable[..., Any], others: Callable[..., Any]) -> Callable[..., Any]:
    """Kernel that calls ``this`` for one number, and ``others`` for any other."""

    @kernel
    def either(given, *arguments):
        if given == number:
            return this(*arguments)
        return others(given, *arguments)

    return either
