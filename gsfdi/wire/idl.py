"""The part of OMG IDL that ROS 2 writes into ros2idl schemas: modules, structs, typedefs, constants, enums."""

import re

from gsfdi.wire.leaves import UndecodableError

_TOKEN = re.compile(
    r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])*\'|[A-Za-z_][\w]*(?:::[\w]+)*|::|'
    r"[-+]?[\d.][\w.+-]*|[{}<>\[\](),;=@|&~*/%^]"
)
_NOISE = re.compile(r"//[^\n]*|/\*.*?\*/|^#[^\n]*$|^=+\s*$|^IDL:[^\n]*$", re.MULTILINE | re.DOTALL)
_NAMES = {
    "boolean": "bool",
    "octet": "byte",
    "char": "char",
    "float": "float32",
    "double": "float64",
    "short": "int16",
    "long": "int32",
    "unsigned short": "uint16",
    "unsigned long": "uint32",
    "long long": "int64",
    "unsigned long long": "uint64",
    "int8": "int8",
    "uint8": "uint8",
    "int16": "int16",
    "uint16": "uint16",
    "int32": "int32",
    "uint32": "uint32",
    "int64": "int64",
    "uint64": "uint64",
    "string": "string",
    "wstring": "wstring",
}

Entry = tuple[str, str, int | None]
"""Name, type and, for an array, its length (0 where the message gives it)."""


def idl_types(text: str) -> dict[str, tuple[Entry, ...]]:
    """Structs of an IDL text, by ``package/Name``.

    Parameters
    ----------
    text : str
        One file, or several with a line ``IDL: package/msg/Name`` before each.

    Raises
    ------
    UndecodableError
        The text is not of the part of IDL that is read.
    """
    return _Parser(_TOKEN.findall(_NOISE.sub(" ", text))).structs()


class _Parser:
    def __init__(self, tokens: list[str]) -> None:
        self.tokens, self.at = tokens, 0
        self.modules: list[str] = []
        self.aliases: dict[str, tuple[str, int | None]] = {}
        self.constants: dict[str, int] = {}
        self.found: dict[str, tuple[Entry, ...]] = {}

    def structs(self) -> dict[str, tuple[Entry, ...]]:
        while self.at < len(self.tokens):
            self._definition()
        return self.found

    def _definition(self) -> None:
        word = self._next()
        if word == "@":
            self._annotation()
        elif word == "module":
            self.modules.append(self._next())
            self._want("{")
            while self._peek() != "}":
                self._definition()
            self._want("}")
            self._end()
            self.modules.pop()
        elif word == "struct":
            self._struct()
        elif word == "typedef":
            type_name, length = self._type()
            name = self._next()
            self.aliases[name] = (type_name, self._dimension(length))
            self._end()
        elif word == "enum":
            self.aliases[self._next()] = ("uint32", None)
            while self._next() != "}":
                pass
            self._end()
        elif word == "const":
            self._type()
            name = self._next()
            self._want("=")
            value = self._next()
            if re.fullmatch(r"\d+", value):
                self.constants[name] = int(value)
            while self._peek() != ";":
                self._next()
            self._end()
        elif word != ";":
            raise UndecodableError(f"its schema has {word!r} where a definition is expected")

    def _struct(self) -> None:
        name = self._next()
        self._want("{")
        entries: list[Entry] = []
        while self._peek() != "}":
            if self._peek() == "@":
                self._next()
                self._annotation()
                continue
            type_name, length = self._type()
            while True:
                field = self._next()
                entries.append((field, type_name, self._dimension(length)))
                if self._peek() != ",":
                    break
                self._next()
            self._want(";")
        self._want("}")
        self._end()
        if entries == [("structure_needs_at_least_one_member", "uint8", None)]:
            entries = []  # how ROS 2 spells an empty message; CDR gives it its one byte
        self.found[f"{self.modules[0] if self.modules else ''}/{name}"] = tuple(entries)

    def _type(self) -> tuple[str, int | None]:
        """A type, and its length if it is an array."""
        word = self._next()
        if word == "@":
            self._annotation()
            return self._type()
        if word in ("sequence", "string", "wstring"):
            inner: tuple[str, int | None] = (word, None)
            if self._peek() == "<":
                self._next()
                if word == "sequence":
                    inner = self._type()
                while self._next() != ">":
                    pass
            if word != "sequence":
                return word, None
            if inner[1] is not None:
                raise UndecodableError("its schema nests sequences")
            return inner[0], 0
        while f"{word} {self._peek()}" in _NAMES or (word == "unsigned" and self._peek() in ("long", "short")):
            word = f"{word} {self._next()}"
        if word in _NAMES:
            return _NAMES[word], None
        parts = word.split("::")
        if parts[-1] in self.aliases:
            return self.aliases[parts[-1]]
        package = parts[0] if len(parts) > 1 else (self.modules[0] if self.modules else "")
        return f"{package}/{parts[-1]}", None

    def _dimension(self, length: int | None) -> int | None:
        """Length of an array declared after the name."""
        while self._peek() == "[":
            self._next()
            size = self._next()
            self._want("]")
            number = self.constants.get(size.split("::")[-1], int(size) if size.isdigit() else 0)
            if length is not None or number == 0:
                raise UndecodableError(f"its schema has an array of {size} elements, or of arrays")
            length = number
        return length

    def _annotation(self) -> None:
        self._next()
        if self._peek() == "(":
            depth = 0
            while True:
                word = self._next()
                depth += (word == "(") - (word == ")")
                if depth == 0:
                    return

    def _end(self) -> None:
        if self._peek() == ";":
            self._next()

    def _peek(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def _next(self) -> str:
        if self.at >= len(self.tokens):
            raise UndecodableError("its schema ends in the middle")
        self.at += 1
        return self.tokens[self.at - 1]

    def _want(self, word: str) -> None:
        found = self._next()
        if found != word:
            raise UndecodableError(f"its schema has {found!r} where {word!r} is expected")
