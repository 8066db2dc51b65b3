"""Plain documents with something wrong in them, as JSON has it."""

import json
import math

DEEP = json.loads("[" * 60 + "]" * 60)
OTHERS = [None, [], {}, "", "x", -1, 1e308, 2**70, True, math.nan, DEEP, "../etc"]


def spoilt(document, draw):
    """A copy with one part removed, or of another type or value, at any depth."""
    document = json.loads(json.dumps(document))
    places = [(document, key) for key in document]
    for parent, key in places:
        below = parent[key]
        if isinstance(below, dict | list):
            inner = list(below) if isinstance(below, dict) else range(len(below))[:3]
            places += [(below, each) for each in inner]
    parent, key = draw.choice(places)
    if draw.random() < 0.3:
        del parent[key]
    else:
        parent[key] = draw.choice(OTHERS)
    return document
