"""numba's compiler, told to optimise an entry once and as a whole: all that is private in numba is here.

By itself numba compiles every function as a program of its own: it writes the wrappers that Python and C
would call it by, optimises it with all that it calls, and makes machine code of it. A chain of kernels pays
that at every level, for code that is inlined into the next level and thrown away. Here a kernel is typed and
lowered and no more; the entry links the kernels that it needs, and is optimised once.

Where numba's internals are not as expected, `AVAILABLE` is False and plain numba compiles: the same results,
later.
"""

from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import Any

import numba

_LIBRARY = (
    "_finalized", "_linking_libraries", "add_linking_library", "finalize", "get_pointer_to_function",
)  # fmt: skip
_FLAGS = ("no_cfunc_wrapper", "no_compile", "no_cpython_wrapper")
_DISPATCHER = ("add_overload", "get_call_template", "get_overload")


def _unliteral(one: Any) -> Any:
    """The type of a constant; another type as it is."""
    from numba.core.types.misc import unliteral

    return unliteral(one)


def _internals() -> tuple[Any, Any, Any] | None:
    """Numba's classes for a library, a compiler and a dispatcher, if all that is used here is there."""
    try:
        from numba.core.codegen import CodeLibrary, JITCodeLibrary
        from numba.core.compiler import Compiler, CompileResult, Flags
        from numba.core.registry import CPUDispatcher

        _unliteral(None)
        attributes = {*dir(JITCodeLibrary), *JITCodeLibrary.__init__.__code__.co_names}
        attributes.update(CodeLibrary.__init__.__code__.co_names)
        used = (
            *((Flags, name) for name in _FLAGS),
            *((CPUDispatcher, name) for name in _DISPATCHER),
            (Compiler, "compile_extra"),
            (CompileResult, "_replace"),
        )
        complete = attributes.issuperset(_LIBRARY) and all(hasattr(owner, name) for owner, name in used)
    except (AttributeError, ImportError):
        return None
    return (JITCodeLibrary, Compiler, CPUDispatcher) if complete else None


_FOUND = _internals()

AVAILABLE = _FOUND is not None

_Library: Any
_Compiler: Any
_Dispatcher: Any
_Library, _Compiler, _Dispatcher = _FOUND or (object, object, object)


def _read_flags_quickly() -> bool:
    """Let numba gather its flags from two dictionaries, not by some thirty properties; False if they changed.

    It does so for each call that it types, a hundred thousand times in a compilation: a fifth of its time.
    """
    try:
        from numba.core.compiler import Flags
        from numba.core.targetconfig import TargetConfig

        defaults = {name: option.default for name, option in Flags.options.items()}
        flags = Flags()
        flags.nrt = True

        def values(self: Any) -> dict[str, Any]:
            return {**defaults, **self._values}

        if Flags.values is not TargetConfig.values or values(flags) != flags.values():
            return False
        Flags.values = values
    except (AttributeError, ImportError):
        return False
    return True


QUICK_FLAGS = _read_flags_quickly()


def _remember_calls() -> bool:
    """Let numba find out once what it calls for numbers of some types; False if it changed.

    It tries all that it has for an operator, arrays first, each time that one occurs: a tenth of its time.
    """
    try:
        from numba.core.types import Boolean, Number
        from numba.core.types.functions import BaseFunction

        owner: Any = BaseFunction
        find = owner.get_call_type
        if find.__code__.co_varnames[:4] != ("self", "context", "args", "kws"):
            return False
        known: dict[Any, Any] = {}

        @wraps(find)
        def get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
            if kws or not all(isinstance(one, Number | Boolean) for one in args):
                return find(self, context, args, kws)
            key = (self, context, self.templates, tuple(args))  # templates: more may be registered later
            if key not in known:
                known[key] = find(self, context, args, kws)
            return known[key]

        owner.get_call_type = get_call_type
    except (AttributeError, ImportError):
        return False
    return True


QUICK_CALLS = _remember_calls()


class _Part(_Library):  # type: ignore[misc]
    """Code of a kernel: only ever linked into an entry, so neither optimised nor made machine code of."""

    def finalize(self) -> None:
        """Leave it as it was lowered; what it calls is linked beside it, not into it."""
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """No address: it has no machine code."""
        return 0


class _PartCompiler(_Compiler):  # type: ignore[misc]
    """The usual pipeline up to lowering."""

    def compile_extra(self, func: Callable[..., object]) -> Any:
        """Type and lower a kernel for the types of this pipeline."""
        state = self.state
        state.library = library = _Part(state.targetctx.codegen(), func.__qualname__)
        state.flags.no_compile = state.flags.no_cpython_wrapper = state.flags.no_cfunc_wrapper = True
        result = super().compile_extra(func)
        # who calls it links it and all below it: a kernel that it calls has handed on its own list
        below = library._linking_libraries = list(dict.fromkeys(library._linking_libraries))
        key = object()  # stands for the function that Python would call
        state.targetctx.insert_user_function(key, result.fndesc, [library, *below])
        return result._replace(entry_point=key)


class _PartDispatcher(_Dispatcher):  # type: ignore[misc]
    """A kernel as other kernels and entries see it."""

    def add_overload(self, cres: Any) -> None:
        """Note a compiled kernel, without an address that Python could call."""
        self.overloads[tuple(cres.signature.args)] = cres


class KernelDispatcher(_Dispatcher):  # type: ignore[misc]
    """A kernel: compiled like an entry if Python calls it, a part of what calls it in compiled code.

    Parameters
    ----------
    py_func : callable
    targetoptions : dict
        As those of `numba.njit`.
    """

    def __init__(self, py_func: Callable[..., object], targetoptions: dict[str, object]) -> None:
        options = {"nopython": True, **targetoptions}
        super().__init__(py_func, targetoptions=options)
        self._part = _PartDispatcher(py_func, targetoptions=options, pipeline_class=_PartCompiler)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile the part for a call; a constant argument makes no other part, as it is inlined anyway."""
        general = {name: _unliteral(one) for name, one in kws.items()}
        return self._part.get_call_template([_unliteral(one) for one in args], general)

    def get_overload(self, sig: Any) -> Any:
        """What stands for the part with a signature."""
        return self._part.get_overload(sig)


class _Place:
    """Where numba stores code: a directory whose name is a digest of all sources, wherever they lie.

    Its own locators know the source by its path and time, so an equal copy would be compiled again.
    """

    def __init__(self, function: Callable[..., object], directory: Path) -> None:
        self._line, self._directory = function.__code__.co_firstlineno, directory

    def ensure_cache_path(self) -> None:
        """Nothing to do: it is there."""

    def get_cache_path(self) -> str:
        """The directory."""
        return str(self._directory)

    def get_source_stamp(self) -> str:
        """Always the same: another source has another directory."""
        return ""

    def get_disambiguator(self) -> str:
        """What tells functions of one name apart."""
        return str(self._line)


def store(entry: Any, directory: Path) -> None:
    """Have numba store an entry's code in a directory, and load it from there.

    Parameters
    ----------
    entry : dispatcher
    directory : pathlib.Path
        For these sources alone, and writable.
    """
    try:
        from numba.core.caching import CompileResultCacheImpl, FunctionCache

        class Locators:
            """As numba asks for them."""

            @staticmethod
            def from_function(function: Callable[..., object], _file: str) -> _Place:
                return _Place(function, directory)

        implementation = type("Stored", (CompileResultCacheImpl,), {"_locator_classes": [Locators]})
        cache = type("Cache", (FunctionCache,), {"_impl_class": implementation})
        entry._cache = cache(entry.py_func)
    except (AttributeError, ImportError):  # then by path and time
        previous, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(directory)
        try:
            entry.enable_caching()
        finally:
            numba.config.CACHE_DIR = previous


def address_of(entry: Any, arguments: Iterable[object], returns: Any) -> int:
    """Address of an entry's machine code for arguments; compiles or loads it.

    Parameters
    ----------
    entry : dispatcher
    arguments : iterable
        Any of the types that it will be called with.
    returns : numba type
        Expected type of what it returns.

    Raises
    ------
    TypeError
        If the entry returns another type.
    """
    types = tuple(map(entry.typeof_pyval, arguments))
    entry.compile(types)
    found = entry.overloads[types]
    if found.signature.return_type != returns:
        raise TypeError(f"{entry.py_func.__name__} returns {found.signature.return_type}, not {returns}")
    return int(found.library.get_pointer_to_function(found.fndesc.llvm_func_name))


def caller(returns: Any) -> Any:
    """Function for compiled code that calls an address with a tuple of arguments.

    Parameters
    ----------
    returns : numba type
        What the code at the address returns.
    """
    from numba.core.cgutils import if_unlikely, unpack_tuple
    from numba.extending import intrinsic

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        address, packed = values
        types = signature.args[1].types
        convention = context.call_conv
        kind = convention.get_function_type(returns, types).as_pointer()
        code, arguments = builder.inttoptr(address, kind), unpack_tuple(builder, packed, len(types))
        status, result = convention.call_function(builder, code, returns, types, arguments)
        with if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return result

    def call(_context: Any, address: Any, arguments: Any) -> Any:
        return returns(address, arguments), generate

    return intrinsic(call)
