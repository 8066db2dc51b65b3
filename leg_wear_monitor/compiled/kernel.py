"""The decorators for compiled code: ``@kernel`` for formulas, ``@entry`` for functions called from Python.

Entries are cached on disk under a digest of all code and constants that they depend on.
"""

import hashlib
import sys
from collections.abc import Callable, Iterable, Iterator
from enum import EnumMeta
from functools import cache
from pathlib import Path
from types import BuiltinFunctionType, CodeType, EllipsisType, FunctionType, ModuleType
from typing import Any, TypeVar

import numba
import numpy as np
from numba.core.compiler_lock import global_compiler_lock
from numba.core.extending import _Intrinsic
from numpy.typing import NDArray

from leg_wear_monitor.compiled.cache import PACKAGE, code_directory, one_process_at_a_time

# numba's compiler, changed to optimise an entry once as a whole; only this module uses private parts of
# numba.
#
# By default, numba compiles every function as a separate program: it writes the wrappers that Python and C
# would call, optimises it with all functions that it calls, and makes machine code of it. A chain of kernels
# pays for this at every level, for code that is inlined into the next level and thrown away. Here a kernel is
# only typed and lowered; the entry links the kernels that it needs, and is optimised once.
#
# If numba's internals are not as expected, `AVAILABLE` is False and plain numba compiles: the same results,
# later.


_LIBRARY = (
    "_finalized", "_linking_libraries", "add_linking_library", "finalize", "get_pointer_to_function",
)  # fmt: skip
_FLAGS = ("no_cfunc_wrapper", "no_compile", "no_cpython_wrapper")
_DISPATCHER = ("add_overload", "get_call_template", "get_overload")


def _unliteral(one: Any) -> Any:
    """The type of a constant; any other type unchanged."""
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


class _Part(_Library):  # type: ignore[misc]
    """Code of a kernel. It is only linked into an entry, so it is neither optimised nor compiled."""

    def finalize(self) -> None:
        """Keep the lowered code; the kernels that it calls are linked separately."""
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
        # the caller links it and all kernels below it: each called kernel passes on its own list
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
    """A kernel: compiled like an entry if Python calls it, a part of the caller in compiled code.

    Parameters
    ----------
    py_func : callable
    targetoptions : dict
        Same options as for `numba.njit`.
    """

    def __init__(self, py_func: Callable[..., object], targetoptions: dict[str, object]) -> None:
        options = {"nopython": True, **targetoptions}
        super().__init__(py_func, targetoptions=options)
        self._part = _PartDispatcher(py_func, targetoptions=options, pipeline_class=_PartCompiler)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile the part for a call; a constant argument needs no other part, because it is inlined."""
        general = {name: _unliteral(one) for name, one in kws.items()}
        return self._part.get_call_template([_unliteral(one) for one in args], general)

    def get_overload(self, sig: Any) -> Any:
        """Overload of the part for a signature."""
        return self._part.get_overload(sig)


# Machine code inside the package: a wheel for x86-64 carries it, for every processor since about 2015.
# It has the directories of the cache, so their names say which Python, numba and sources it is for.
SHIPPED = Path(__file__).with_name("machine_code")
_BASELINE = "x86-64-v3"
_BASELINE_FEATURES = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")


@cache
def shipped_directory(name: str) -> Path | None:
    """Directory of machine code that came with the package, if this processor can run it.

    Parameters
    ----------
    name : str
        Name of the directory, as in the cache.

    Returns
    -------
    pathlib.Path or None
    """
    directory = SHIPPED / name
    if not directory.is_dir():
        return None
    from llvmlite.binding import get_host_cpu_features

    features = get_host_cpu_features()
    return directory if all(features.get(one) for one in _BASELINE_FEATURES) else None


class _Place:
    """Directory where numba stores code: its name is a digest of all sources, wherever they lie.

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
        """Always the same, because different sources have different directories."""
        return ""

    def get_disambiguator(self) -> str:
        """Text that distinguishes functions of the same name."""
        return str(self._line)


def _locators(directory: Path | None) -> Any:
    """A class of locators, in the form that numba asks for."""

    class Locators:
        @staticmethod
        def from_function(function: Callable[..., object], _file: str) -> _Place | None:
            return _Place(function, directory) if directory else None

    return Locators


def store(entry: Any, directory: Path) -> None:
    """Have numba store an entry's code in a directory, and load it from there.

    By default, numba stores an entry's intermediate code next to its machine code, so that other entries can
    link it; it parses this code again at each start and keeps it. Before it loads anything, it registers all
    functions that it can compile. Here no code is linked with an entry (`ByAddress`), and loaded code was
    compiled before. Without both steps, a monitor needs 60 MB less and starts 0.6 s earlier.

    Parameters
    ----------
    entry : dispatcher
    directory : pathlib.Path
        Directory for these sources alone; writable.
    """
    in_package = shipped_directory(directory.name)
    try:
        from numba.core.caching import CompileResultCacheImpl, FunctionCache

        class Stored(CompileResultCacheImpl):  # type: ignore[misc]
            """Machine code, and the names in it."""

            _locator_classes = (_locators(directory),)

            def reduce(self, result: Any) -> Any:
                (name, kind, (code, intermediate)), *rest = super().reduce(result)
                return (name, kind, (code, _names_alone(intermediate))), *rest

            def rebuild(self, context: Any, stored: Any) -> Any:
                result = super().rebuild(context, stored)
                # linking with it must be an error, not an empty function
                result.library._shared_module = None
                return result

        class Cache(FunctionCache):  # type: ignore[misc]
            """Loads without registering compilable functions; without code, the compiler registers them."""

            _impl_class = Stored

            def load_overload(self, signature: Any, context: Any) -> Any:
                with self._guard_against_spurious_io_errors():
                    try:
                        return self._load_overload(signature, context)
                    except AttributeError:  # the index names a type of arguments that this version lacks
                        self.flush()
                        return None

            def _load_overload(self, signature: Any, context: Any) -> Any:
                found = super()._load_overload(signature, context)
                return found if found or shipped is None else shipped.load_overload(signature, context)

        class StoredInPackage(Stored):
            """The same, compiled for the baseline of processors."""

            _locator_classes = (_locators(in_package),)

        class CacheInPackage(FunctionCache):  # type: ignore[misc]
            """Looks for code of the baseline, independent of the name of this processor."""

            _impl_class = StoredInPackage

            def _index_key(self, signature: Any, codegen: Any) -> Any:
                kinds, (triple, *_), *code = super()._index_key(signature, codegen)
                return kinds, (triple, _BASELINE, ""), *code

        shipped = None if in_package is None else CacheInPackage(entry.py_func)
        entry._cache = Cache(entry.py_func)
    except (AttributeError, ImportError):  # then by path and time
        previous, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(directory)
        try:
            entry.enable_caching()
        finally:
            numba.config.CACHE_DIR = previous


def _names_alone(intermediate: bytes) -> bytes:
    """Intermediate code that contains only the names defined in the given code."""
    from llvmlite.binding import parse_assembly, parse_bitcode

    module = parse_bitcode(intermediate)
    functions = (
        f'define void @"{one.name}"() {{ ret void }}' for one in module.functions if not one.is_declaration
    )
    variables = (f'@"{one.name}" = global i8 0' for one in module.global_variables if not one.is_declaration)
    names = parse_assembly("\n".join([*functions, *variables]))
    return bytes(names.as_bitcode())


def address_of(entry: Any, arguments: Iterable[object], returns: Any) -> int:
    """Address of an entry's machine code for arguments; compiles or loads it.

    Parameters
    ----------
    entry : dispatcher
    arguments : iterable
        Any of the types of its later calls.
    returns : numba type
        Expected return type.

    Raises
    ------
    TypeError
        If the entry returns a different type.
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
        Return type of the code at the address.
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


_Function = TypeVar("_Function", bound=Callable[..., object])

_ENTRY: dict[str, object] = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
_KERNEL = {**_ENTRY, "forceinline": True}

_HOME = Path(__file__).parents[1]  # directory of the package
_PLAIN = (int, float, complex, str, bytes, slice, np.generic, EllipsisType, type(None))

at_compilation: list[Callable[[], None]] = []  # called if an entry is compiled instead of loaded


def uncompiled(function: Any) -> Any:
    """The Python function of a kernel or an entry; other values as they are.

    Used for a formula that Python needs once: a kernel that Python calls is compiled again in each process.
    """
    return getattr(function, "py_func", function)


def _description(value: object, digest: Any, known: set[object]) -> None:
    """Add to a digest the compiler's view of a value, including all values that it depends on.

    Raises
    ------
    TypeError
        If the effect of this kind of value on compiled code is unknown.
    """
    function = uncompiled(value)
    if isinstance(function, FunctionType):
        if function not in known:
            known.add(function)
            _add_function(function, digest, known)
        digest.update(f"function {function.__module__}.{function.__qualname__} ".encode())
    elif isinstance(value, tuple | frozenset):
        digest.update(f"{type(value).__qualname__} {len(value)} ".encode())
        for each in value if isinstance(value, tuple) else sorted(value, key=repr):
            _description(each, digest, known)
    elif isinstance(value, np.ndarray):
        digest.update(f"array {value.dtype.descr} {value.shape} ".encode())
        digest.update(value.tobytes())
    elif isinstance(value, CodeType):
        _add_code(value, digest, known)
    elif isinstance(value, EnumMeta):
        digest.update(f"enum {value.__qualname__} {[*map(repr, value)]} ".encode())
    elif isinstance(value, type | BuiltinFunctionType | np.ufunc | ModuleType):
        name = f"{getattr(value, '__module__', '')}.{value.__name__}"
        digest.update(f"name {name} {getattr(value, '_field_defaults', '')} ".encode())
        digest.update(f"{getattr(value, '_fields', '')} ".encode())
    elif isinstance(value, _Intrinsic):  # defined in this package; the digest covers its sources
        cells = [cell.cell_contents for cell in value._defn.__closure__ or ()]
        digest.update(f"intrinsic {value._name} {[str(one) for one in cells if not callable(one)]} ".encode())
    elif isinstance(value, np.dtype):
        digest.update(f"dtype {value.descr} ".encode())
    elif isinstance(value, _PLAIN):
        digest.update(f"{type(value).__name__} {value!r} ".encode())
    else:
        raise TypeError(f"{value!r} in compiled code: a change of it would not be seen by the cache")


def _add_code(code: CodeType, digest: Any, known: set[object]) -> None:
    """Instructions, constants and names of a function's code, not its place in a file."""
    digest.update(f"{code.co_name} {code.co_names} {code.co_varnames} {code.co_flags} ".encode())
    digest.update(f"{code.co_argcount} {code.co_freevars} {code.co_cellvars} ".encode())
    digest.update(code.co_code)
    _description(code.co_consts, digest, known)


def _names_in(code: CodeType) -> Iterator[str]:
    """Names of globals and attributes in a function and in those inside it."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names_in(constant)


def _add_function(function: FunctionType, digest: Any, known: set[object]) -> None:
    """Code of a function, and every global and every variable around it that it uses.

    A name may be the name of an attribute. For a module of this package it is taken as an attribute, and also
    as a global.
    """
    _add_code(function.__code__, digest, known)
    _description(function.__defaults__ or (), digest, known)
    for cell in function.__closure__ or ():
        _description(cell.cell_contents, digest, known)
    spaces = [function.__globals__]
    names = sorted({*_names_in(function.__code__)})
    for space in spaces:
        for name in names:
            if name not in space:
                continue
            value = space[name]
            digest.update(f"{name} = ".encode())
            _description(value, digest, known)
            ours = isinstance(value, ModuleType) and value.__name__.split(".")[0] == PACKAGE
            if ours and not any(vars(value) is one for one in spaces):
                spaces.append(vars(value))


@cache
def _compiler() -> bytes:
    """Versions of Python and numba and all sources of this room: how anything is compiled."""
    room = b"".join(source.read_bytes() for source in sorted(Path(__file__).parent.glob("*.py")))
    return f"{sys.version_info[:2]} {numba.__version__} {AVAILABLE} ".encode() + room


@cache
def cache_directory(function: Callable[..., object] | None = None) -> Path | None:
    """Directory of the compiled code of a function, named by a digest of all that it is compiled from.

    numba checks only the file of the cached function itself: after a change of a kernel in a different file
    it would use the old code. The digest covers the code of the function, of all functions that it calls, and
    the values of the globals that they use; so other changes in their files compile nothing again. A
    directory outside the package also works if the package directory is read-only.

    Parameters
    ----------
    function : callable, optional
        Before compilation; default: whatever is compiled from any file of the package.

    Returns
    -------
    pathlib.Path or None
        Below ``$NUMBA_CACHE_DIR`` if set, else ``$XDG_CACHE_HOME`` or ``~/.cache``, else the temporary
        directory: the first that is private (`leg_wear_monitor.compiled.cache`). None if none is.

    Raises
    ------
    TypeError
        If the function uses a global of a kind with unknown effect on compiled code.
    """
    digest = hashlib.sha256(_compiler())
    if function is None:
        name = "all"
        for source in sorted(_HOME.rglob("*.py")):
            digest.update(f"{source.relative_to(_HOME)} ".encode() + source.read_bytes())
    else:
        name = f"{function.__module__.removeprefix(f'{PACKAGE}.')}.{function.__qualname__}"
        _description(function, digest, set())
    return code_directory(f"{name.replace('<locals>', 'in')}-{digest.hexdigest()[:16]}")


def kernel(function: _Function) -> _Function:
    """Compile a formula of numbers and arrays; division by zero gives inf, as in numpy.

    A kernel cannot allocate arrays: it is compiled without numba's runtime, because its reference counting
    would cost more time than the physics where many small arrays are passed. A kernel is inlined into the
    entry that calls it and is not cached by itself, because cached code cannot be inlined.
    """
    if AVAILABLE and not numba.config.DISABLE_JIT:
        return KernelDispatcher(function, _KERNEL)
    return numba.njit(**_KERNEL)(function)  # type: ignore[no-any-return]


def entry(function: _Function) -> _Function:
    """Compile a function for calls from Python: cached on disk, and without the interpreter's lock.

    While a different process compiles the same entry, this process waits for it and loads the result.
    """
    compiled = numba.njit(nogil=True, **_ENTRY)(function)
    if not numba.config.DISABLE_JIT:
        compiled.compile = _compiled_once(compiled)
    return compiled  # type: ignore[no-any-return]


def _compiled_once(compiled: Any) -> Callable[..., object]:
    """A dispatcher's method ``compile``, in one process at a time."""
    compile_or_load = compiled.compile
    kept_in: list[Path] = []

    def compile_in_turn(signature: object) -> object:
        home = cache_directory(compiled.py_func)  # now that all globals are defined
        if home is None:
            return compile_or_load(signature)
        # numba's own lock first: two threads that each held one of the two would wait for ever
        with global_compiler_lock, one_process_at_a_time(home / "lock"):
            if home not in kept_in:
                kept_in.append(home)
                store(compiled, home)
            if at_compilation and not is_stored(compiled):
                for call in at_compilation:
                    call()
            return compile_or_load(signature)

    return compile_in_turn


def compile_for(compiled: Callable[..., object], *arguments: object) -> None:
    """Compile an entry for the types of arguments, or load it, without running it."""
    if hasattr(compiled, "py_func"):
        compiled.compile(tuple(map(numba.typeof, arguments)))  # type: ignore[attr-defined]


def is_stored(compiled: Callable[..., object]) -> bool:
    """True if code of an entry is in the cache; always without a compiler, never without a cache."""
    function = getattr(compiled, "py_func", None)
    if function is None:
        return True
    home = cache_directory(function)
    if home is None:
        return False
    # the code, not its index, which numba writes first
    places = (home, shipped_directory(home.name) or home)
    return any(any(place.glob(f"**/*.{function.__name__}-*.nbc")) for place in places)


class ByAddress:
    """An entry that other compiled code calls by its address, without being compiled again as a part of it.

    Parameters
    ----------
    target : callable
        The entry.
    returns : numba type
        Return type of the entry.

    Attributes
    ----------
    call : callable
        For compiled code: takes the address and a tuple of the arguments.
    """

    def __init__(self, target: Callable[..., object], returns: object) -> None:
        self._target, self._returns = target, returns
        self._has_address = AVAILABLE and not numba.config.DISABLE_JIT
        call: Callable[..., Any]
        call = caller(returns) if self._has_address else _called_directly(target)
        self.call = call

    def address(self, *arguments: object) -> int:
        """Address for arguments of the types that it will be called with; compiles it if need be."""
        return address_of(self._target, arguments, self._returns) if self._has_address else 0


def _called_directly(target: Callable[..., object]) -> Callable[..., Any]:
    """An entry compiled together with its caller, or not compiled."""

    @kernel
    def call(_address, arguments):  # type: ignore[no-untyped-def]
        return target(*arguments)

    return call


# Records of a structured dtype as state of compiled code, with the same access in compiled and plain Python.
#
# An entry takes an array of records, also for a single record, and begins with ``record = records[0]``: numba
# identifies the type of an array in half a microsecond, the type of a `numpy.record` in ten.


Record = Any
"""One record: ``state.speed`` reads and writes a field, ``state.speed[k]`` a value of an array field.

A `numpy.record` is an object for Python and a pointer for compiled code; no Python type describes its fields.
"""

Records = NDArray[Any]
"""Array (n,) of records: ``records["speed"]`` is a column, and in a kernel ``records[k].speed`` a value."""


def new_records(n: int, dtype: np.dtype[Any]) -> Records:
    """Records (n,) for an entry, all fields 0; a copy is a snapshot, ``records[:] = snapshot`` restores it.

    Raises
    ------
    ValueError
        If a field has the name of an attribute of numpy's records, which would hide it.
    """
    hidden = sorted(name for name in _names(dtype) if hasattr(np.record, name))
    if hidden:
        raise ValueError(f"fields {', '.join(hidden)}: numpy.record has attributes of these names")
    # uncompiled code needs elements with attributes
    return np.zeros(n, np.dtype((np.record, dtype)) if numba.config.DISABLE_JIT else dtype)


def _names(dtype: np.dtype[Any]) -> Iterator[str]:
    """Names of all fields, including the fields of nested records."""
    for name, (inner, *_) in (dtype.fields or {}).items():
        yield name
        yield from _names(inner.base)


def record_of(records: Records) -> Record:
    """The only record of an array, a view, to read and write by field names.

    Each access takes Python some microseconds; use `values_of` to read many fields.
    """
    (record,) = records.view(np.recarray)
    return record


def values_of(records: Records) -> dict[str, Any]:
    """Fields of the only record of an array, as Python's own numbers."""
    (values,) = records.tolist()
    return dict(zip(records.dtype.names or (), values, strict=True))
