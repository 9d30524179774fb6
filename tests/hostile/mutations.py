"""Strategies that turn a valid file into a hostile one."""

from __future__ import annotations

import copy
import json
from typing import Any

from hypothesis import strategies as st

NASTY_TEXTS = (
    "",
    "../../../../etc/passwd",
    "/etc/passwd",
    "..",
    "\0",
    "\x1b[2J",
    "\u202egpj.exe",
    "{{ 7 * 7 }}",
    "{% include '/etc/passwd' %}",
    "<script>alert(1)</script>",
    "__import__('os').system('true')",
    "!!python/object/apply:os.system [true]",
    "nan",
    "1e999",
    "9" * 5000,
    "x" * 200_000,
)
NASTY_NUMBERS = (
    -1,
    0,
    2**31 - 1,
    2**31,
    2**32 - 1,
    2**40,
    2**63 - 1,
    2**63,
    2**64,
    10**30,
    -0.0,
    1e308,
    5e-324,
)
_NUMBERS_AS_BYTES = tuple(
    (number % 2 ** (8 * size)).to_bytes(size, order)
    for number in (-1, 0, 1, 2**31 - 1, 2**31, 2**40, 2**62, 2**63)
    for size in (1, 2, 4, 8)
    for order in ("little", "big")
)


def values() -> st.SearchStrategy[Any]:
    """What JSON can hold and nobody expects."""
    leaves = (
        st.none()
        | st.booleans()
        | st.sampled_from(NASTY_NUMBERS)
        | st.sampled_from(NASTY_TEXTS)
        | st.floats()
        | st.integers()
        | st.text(max_size=8)
    )
    return st.recursive(
        leaves,
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
        max_leaves=6,
    )


@st.composite
def documents(draw: st.DrawFn, valid: Any) -> Any:
    """A document with some of its nodes replaced, removed or doubled."""
    content = copy.deepcopy(valid)
    for _ in range(draw(st.integers(1, 3))):
        places = list(_places(content))
        if not places:
            break
        parent, key = places[draw(st.integers(0, len(places) - 1))]
        what = draw(st.sampled_from(("replace", "replace", "remove", "deepen")))
        if what == "replace":
            parent[key] = draw(values())
        elif what == "remove":
            del parent[key]
        else:
            parent[key] = [parent[key]] * draw(st.integers(0, 3))
    return content


def _places(content: Any) -> list[tuple[Any, Any]]:
    """Every container of a document with a key in it."""
    keys: list[Any]
    if isinstance(content, dict):
        keys = list(content)
    elif isinstance(content, list):
        keys = list(range(len(content)))
    else:
        return []
    return [place for key in keys for place in [(content, key), *_places(content[key])]]


@st.composite
def bytes_like(draw: st.DrawFn, valid: bytes) -> bytes:
    """A file cut, overwritten with numbers at their limits, spliced or repeated."""
    content = bytearray(valid)
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(content)))
        what = draw(st.sampled_from(("number", "number", "noise", "cut", "insert", "repeat", "flip")))
        if what == "number":
            number = draw(st.sampled_from(_NUMBERS_AS_BYTES))
            content[at : at + len(number)] = number
        elif what == "noise":
            noise = draw(st.binary(min_size=1, max_size=8))
            content[at : at + len(noise)] = noise
        elif what == "cut":
            del content[at : at + draw(st.integers(1, max(1, len(content))))]
        elif what == "insert":
            content[at:at] = draw(st.binary(min_size=1, max_size=8))
        elif what == "repeat":
            content[at:at] = content[at : at + 16] * draw(st.integers(1, 64))
        elif at < len(content):
            content[at] ^= 1 << draw(st.integers(0, 7))
    return bytes(content)


@st.composite
def texts_like(draw: st.DrawFn, valid: bytes) -> bytes:
    """A text with some of its words replaced."""
    content = valid.decode("utf-8")
    for _ in range(draw(st.integers(1, 3))):
        begin = draw(st.integers(0, len(content)))
        end = min(len(content), begin + draw(st.integers(0, 12)))
        word = draw(st.sampled_from((*NASTY_TEXTS, *map(str, NASTY_NUMBERS))) | st.text(max_size=6))
        content = content[:begin] + word + content[end:]
    return content.encode("utf-8", "surrogatepass")


def hostile(name: str, valid: bytes) -> st.SearchStrategy[bytes]:
    """What may stand in place of a valid file of that name."""
    strategies = [bytes_like(valid), st.binary(max_size=64)]
    if name.endswith(".json"):
        strategies.append(documents(json.loads(valid)).map(lambda content: json.dumps(content).encode()))
    elif _is_text(valid):
        strategies.append(texts_like(valid))
    return st.one_of(*reversed(strategies))


def _is_text(content: bytes) -> bool:
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return b"\0" not in content
