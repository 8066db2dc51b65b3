"""What `import leg_wear_monitor as lw` offers, and how it is called; a script renews what is kept.

python test/doors/test_public_names.py
"""

import inspect
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import attrs

import leg_wear_monitor as lw

PACKAGE = Path(__file__).parents[2] / "package.xml"
KEPT = Path(__file__).parent / "kept" / "names.txt"


def call_of(function: object) -> str:
    """Parameters and defaults, without annotations: those name inner modules."""
    signature, bare = inspect.signature(function), inspect.Signature.empty  # type: ignore[arg-type]
    parameters = []
    for each in signature.parameters.values():
        is_plain = isinstance(each.default, (str, int, float, tuple, type(None))) or each.default is bare
        parameters.append(each.replace(annotation=bare, default=each.default if is_plain else ...))
    return str(signature.replace(parameters=parameters, return_annotation=bare))


def members(kind: type) -> Iterator[str]:
    """Public attributes and methods of a class, those of its bases included, beside what it is made of."""
    ours = [each for each in kind.__mro__ if each.__module__.startswith("leg_wear_monitor")]
    found = {name: value for each in reversed(ours) for name, value in vars(each).items()}
    made_of = {field.alias for field in attrs.fields(kind)} if attrs.has(kind) else set()
    for name, value in sorted(found.items()):
        if name in made_of or (name.startswith("_") and name != "_repr_html_"):
            continue
        is_called = inspect.isfunction(value) or isinstance(value, (classmethod, staticmethod))
        yield f"  {name}{call_of(getattr(kind, name)) if is_called else ''}"


def names() -> Iterator[str]:
    """A line a public name, one each of its parts."""
    for name in lw.__all__:
        value = getattr(lw, name)
        is_error = inspect.isclass(value) and issubclass(value, Exception)
        yield name + ("" if is_error else call_of(value))
        if inspect.isclass(value):
            yield from members(value)


def test_names_and_how_they_are_called_are_those_that_are_kept():
    assert list(names()) == KEPT.read_text().splitlines(), (
        "if it is meant: python test/doors/test_public_names.py"
    )


def test_dir_lists_every_public_name_before_it_is_used():
    assert set(lw.__all__) <= set(dir(lw))
    for name in lw.__all__:
        assert getattr(lw, name) is not None


def test_the_version_is_that_of_the_package():
    assert lw.__version__ == ElementTree.parse(PACKAGE).findtext("version")
    assert "__version__" in dir(lw)


if __name__ == "__main__":
    KEPT.write_text("\n".join([*names(), ""]))
