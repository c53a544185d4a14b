"""The ES modules that a page needs, found by following their imports."""

import re
from collections.abc import Callable, Mapping
from pathlib import PurePosixPath

# `import ... from "x"`, `export ... from "x"`, `import "x"`, at the start of a statement, and `import("x")`.
_IMPORT = re.compile(
    r"""((?:^|[;\n}])\s*(?:import|export)\b[\w\s{},*$]*?\bfrom\s*|(?:^|[;\n])\s*import\s*|\bimport\s*\(\s*)"""
    r"""(["'])([./@\w-]+)\2"""
)
_COMMENT = re.compile(r"/\*.*?\*/|^\s*//[^\n]*", re.DOTALL | re.MULTILINE)

ImportMap = Mapping[str, str]  # specifiers, or prefixes of them that end in a slash, to paths


def modules_from(entry: str, import_map: ImportMap, read: Callable[[str], str]) -> dict[str, str]:
    """Text of the module `entry` and of all that it imports, by path.

    Args:
        import_map: as in the page's import map, but to paths as `read` takes them.
        read: the text of a path.
    """
    found: dict[str, str] = {}
    waiting = [entry]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found[path] = read(path)
            code = _COMMENT.sub("", found[path])
            waiting += [resolved(match[3], path, import_map) for match in _IMPORT.finditer(code)]
    return dict(sorted(found.items()))


def with_paths_as_names(path: str, text: str, import_map: ImportMap) -> str:
    """The module's text with every import naming a path in full, which an import map can then lead anywhere."""

    def named(match: re.Match[str]) -> str:
        try:
            return f"{match[1]}{match[2]}{resolved(match[3], path, import_map)}{match[2]}"
        except KeyError:  # in a comment
            return match[0]

    return _IMPORT.sub(named, text)


def resolved(specifier: str, importer: str, import_map: ImportMap) -> str:
    """The path that an import of `specifier` in the module `importer` means.

    Raises:
        KeyError: neither relative nor in the import map.
    """
    if specifier.startswith("."):
        return _normal(PurePosixPath(importer).parent / specifier)
    if specifier in import_map:
        return import_map[specifier]
    prefixes = [key for key in import_map if key.endswith("/") and specifier.startswith(key)]
    if not prefixes:
        raise KeyError(specifier)
    prefix = max(prefixes, key=len)
    return import_map[prefix] + specifier.removeprefix(prefix)


def _normal(path: PurePosixPath) -> str:
    parts: list[str] = []
    for part in path.parts:
        if part == "..":
            parts.pop()
        elif part != ".":
            parts.append(part)
    return "/".join(parts)
