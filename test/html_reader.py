"""HTML as its elements and texts."""

from html.parser import HTMLParser

VOID = {"meta", "link", "img", "input", "br"}


class Reader(HTMLParser):
    """Elements of a page, and a fault for whatever is not closed where it was opened."""

    def __init__(self):
        super().__init__()
        self.open, self.elements, self.texts, self.places = [], [], [], []

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append((tag, dict(attrs).get("class") or ""))

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop()[0] == tag

    def handle_data(self, data):
        self.texts.append(data)
        self.places.append((tuple(self.open), data))

    def inside(self, is_wanted):
        """Texts inside of elements whose tag and class are wanted."""
        return [data for places, data in self.places if any(is_wanted(*place) for place in places)]

    def of(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]


def words(markup):
    """All texts, with single spaces between their words."""
    return " ".join(" ".join(read(markup).texts).split())


def read(html):
    reader = Reader()
    reader.feed(html)
    reader.close()
    assert reader.open == []
    return reader
