"""Count the phrases that make our English hard to read, per 10 000 words.

    python test/docs/english.py [CHECKOUT]

Documents are counted apart from comments and docstrings. A second table has the words of each section.
"""

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

PATTERNS = {
    "that of, those of": r"\b(?:that|those) of\b",
    "what as a noun": r"\bwhat\b(?![^.?!]*\?)",
    "another": r"\banother\b",
    "nor, beside, comma too": r"\bnor\b|\bbeside\b|, too\b",
    "of which, by which": r"\b(?:of|by|with|from|in|to|on) which\b",
    "somebody, nobody, whoever": r"\b(?:somebody|nobody|whoever|a person)\b",
    "a row a joint": r"\b(?:rows?|lines?|messages?|samples?|times|once|pages?|steps?) an? \w+",
    "is no": r"\b(?:is|are) no\b",
    "counted, believed, misfit": r"\b(?:counted|believed|misfit)\b",
}
WORD = re.compile(r"\S*\w\S*")  # the bars and rules of a table are none
RIDDLE = re.compile(r"(?:of|what|by|that|whether|where)\b", re.IGNORECASE)
LONG_SENTENCE = 25  # words
PER = 10_000
LABEL, NUMBER = 38, 10  # widths of columns


def prose(markdown: str) -> str:
    """A page without blocks of code, table rules and link targets."""
    text = re.sub(r"^ *```.*?^ *```", "", markdown, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"`[^`\n]*`", "NAME", text)
    return re.sub(r"\]\([^)]*\)", "]", text)


def comments(source: str) -> Iterator[str]:
    """Docstrings, and comments with the lines that follow them, of a file of Python."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and (
            words := ast.get_docstring(node)
        ):
            yield words
    block: list[str] = []
    last = 0
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and not re.match(r"# (?:noqa|type:|fmt:)", token.string):
            if block and token.start[0] != last + 1:
                yield " ".join(block)
                block = []
            block.append(token.string.lstrip("# "))
            last = token.start[0]
    if block:
        yield " ".join(block)


def sentences(text: str) -> list[str]:
    """Sentences of prose; a row of a table is none."""
    plain = "\n".join(line for line in text.splitlines() if not line.lstrip().startswith("|"))
    return [each for each in re.split(r"(?<=[.:?!])\s+|\n\s*[-*\d]|\n\n", plain) if each.strip()]


def counts(texts: list[str]) -> tuple[int, dict[str, int]]:
    """Words of all texts, and how often each pattern occurs in them."""
    text = "\n\n".join(texts)
    found = {name: len(re.findall(pattern, text, re.IGNORECASE)) for name, pattern in PATTERNS.items()}
    found["sentences over 25 words"] = sum(len(each.split()) > LONG_SENTENCE for each in sentences(text))
    found["comments that open with a riddle"] = sum(bool(RIDDLE.match(each.strip())) for each in texts)
    return len(WORD.findall(text)), found


def main(root: Path) -> None:
    """Print both tables for a checkout."""
    pages = sorted([*root.glob("*.md"), *root.glob("*.rst"), *root.glob("docs/**/*.md")])
    code = sorted(root.glob("leg_wear_monitor/**/*.py"))
    kinds = {
        "documents": [prose(page.read_text(encoding="utf-8")) for page in pages],
        "code": [each for file in code for each in comments(file.read_text(encoding="utf-8"))],
    }
    results = {name: counts(texts) for name, texts in kinds.items()}
    print(f"{'per 10 000 words':{LABEL}}" + "".join(f"{name:>{NUMBER}}" for name in results))
    print(f"{'words':{LABEL}}" + "".join(f"{words:{NUMBER}d}" for words, _ in results.values()))
    for name in next(iter(results.values()))[1]:
        row = "".join(f"{PER * found[name] / words:{NUMBER}.1f}" for words, found in results.values())
        print(f"{name:{LABEL}}{row}")
    print("\nwords of each section")
    sections: dict[str, int] = {}
    for page in pages:
        place = page.parent.relative_to(root).as_posix()
        sections[place] = sections.get(place, 0) + len(WORD.findall(page.read_text(encoding="utf-8")))
    for place, words in [*sorted(sections.items()), ("all", sum(sections.values()))]:
        print(f"{place:{LABEL}}{words:{NUMBER}d}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[2]))
