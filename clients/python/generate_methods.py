#!/usr/bin/env python3
"""Generates src/weft_client/_methods.py from the daemon's OpenRPC document: a class for each noun, a typed method for each verb.

    generate_methods.py DOCUMENT.json > src/weft_client/_methods.py

`tests/scenario/python_client_methods.py WEFTD ROOT --write` requests the document from a daemon of this build and does this.
"""
import json
import keyword
import sys
import textwrap

HEAD = '''"""Every method of the daemon's API, version {version}. Made by generate_methods.py from `rpc.discover`; do not edit.

Each method returns the result of the daemon as a dict; its docstring lists the fields. Other fields come from a later version of the daemon.
"""
from __future__ import annotations

from typing import Any, Callable, Dict, List, Mapping, Optional

JsonObject = Dict[str, Any]
Call = Callable[[str, Mapping[str, object]], JsonObject]
'''
TYPES = {"string": "str", "integer": "int", "number": "float", "boolean": "bool", "object": "JsonObject", "array": "List[Any]"}
WIDTH = 132


def python_name(name):
    """A keyword gets an underscore: from_."""
    return name + "_" if keyword.iskeyword(name) else name


def sentence(text):
    return (text[:1].upper() + text[1:]).rstrip(".") + "."


def argument(param):
    kind = TYPES[param["schema"]["type"]]
    return f"{python_name(param['name'])}: " + (kind if param["required"] else f"Optional[{kind}] = None")


def documentation(method):
    role = f"Least role: {method['x-role']}." + (" Changes something." if method["x-changes"] else "")
    lines = textwrap.wrap(sentence(method["summary"]), WIDTH - 14) + [""]
    for param in method["params"]:
        lines += textwrap.wrap(f"{python_name(param['name'])}: {param['description']}", WIDTH - 14, subsequent_indent="    ")
    lines += textwrap.wrap(f"Result: {method['result']['description'].rstrip('.')}. {role}", WIDTH - 14)
    return "\n".join("        " + line if line else "" for line in lines).replace("\\", "\\\\").replace('"""', "'''").strip()


def bracketed(opening, items, closing):
    """Joins the items on one line if they fit. Else each has a line, aligned after the opening bracket."""
    line = opening + ", ".join(items) + closing
    if len(line) <= WIDTH:
        return line
    lines, indent = [opening], " " * len(opening)
    for i, item in enumerate(items):
        piece = item + (", " if i + 1 < len(items) else closing)
        if len(lines[-1] + piece.rstrip()) > WIDTH:
            lines[-1] = lines[-1].rstrip()
            lines.append(indent)
        lines[-1] += piece
    return "\n".join(lines)


def definition(verb, method):
    params = sorted(method["params"], key=lambda p: not p["required"])
    head = bracketed(f"    def {python_name(verb)}(", ["self"] + (["*", *map(argument, params)] if params else []), ") -> JsonObject:")
    call = bracketed(f'        return self._call("{method["name"]}", {{', [f'"{p["name"]}": {python_name(p["name"])}' for p in params], "})")
    return f'{head}\n        """{documentation(method)}\n        """\n{call}\n'


def source_of(document):
    """The text of the whole module."""
    nouns = {}
    for method in document["methods"]:
        if method["name"].startswith("$/"):  # methods of the protocol, used by connections only
            continue
        noun, _, verb = method["name"].partition(".")
        nouns.setdefault(noun, []).append((verb, method))
    out = [HEAD.format(version=document["info"]["version"])]
    for noun, verbs in nouns.items():
        out.append(f'\nclass {noun.title()}Methods:\n    """Methods {noun}.*"""\n\n    def __init__(self, call: Call) -> None:\n        self._call = call\n')
        out += [definition(verb, method) for verb, method in verbs]
    out.append('\nclass Api:\n    """All methods by noun: api.run.start(recipe="m1", lease="L-1")."""\n\n    def __init__(self, call: Call) -> None:')
    out.append("\n".join(f"        self.{python_name(noun)} = {noun.title()}Methods(call)" for noun in nouns) + "\n")
    return "\n".join(out[:-2]) + "\n" + "\n".join(out[-2:])


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        sys.stdout.write(source_of(json.load(file)))
