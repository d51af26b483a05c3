#!/usr/bin/env python3
"""Fails if two files define a type of the same name in the same namespace: the linker uses one destructor for both.

    one_definition.py ROOT        checks the sources that are linked into the programs
    one_definition.py --selftest  checks that the checker refuses what it must refuse

Tests are left out: each test program has the types of one layer only.
"""
import collections
import pathlib
import re
import sys

MODULES = ("classifier", "daemon", "drivers", "protocols", "recipes", "sim")
NO_CODE = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"', re.S)
# A defined type that is not a member of another (`struct Rig::Parts {`); namespaces; braces.
TOKEN = re.compile(r"\bnamespace\s*([\w:]*)\s*\{"
                   r"|\b(?:struct|class|enum class|enum)\s+(?:\[\[\w+\]\]\s*)?(\w+)(?:\s+final)?\s*(?::(?!:)[^;{=()]*)?\{|\{|\}")


def types(text):
    """Namespace::Type for each type that the linker may find elsewhere too."""
    inside = []  # namespaces by name, None for any other brace
    for token in TOKEN.finditer(NO_CODE.sub("", text)):
        namespace, name = token.groups()
        if token[0] == "}":
            if inside:
                inside.pop()
            continue
        if name and None not in inside and "" not in inside:
            yield "::".join([*inside, name])
        inside.append(namespace)


def check(sources):
    """`sources`: text by file name."""
    places = collections.defaultdict(set)
    for file, text in sources.items():
        for name in types(text):
            places[name].add(file)
    return [f"{name} is defined in {' and in '.join(sorted(files))}" for name, files in sorted(places.items()) if len(files) > 1]


def selftest():
    a = "namespace w::d {\nstruct Material { int a; };\n}"
    cases = {
        a.replace("int a", "double a"): True, a.replace("w::d", "w::e"): False, a.replace("Material", "Other"): False,
        "namespace w::d {\nclass Material final : public Base {\n};\n}": True,
        "namespace w::d {\nnamespace {\nstruct Material { int b; };\n}\n}": False, "namespace w::d {\nstruct Material;\n}": False,
        "namespace w::d {\nstruct Other { struct Material { int b; }; };\n}": False, "namespace w::d {\nstruct Material::Parts { int b; };\n}": False,
        "namespace w {\nnamespace d {\nenum class Material { one };\n}\n}": True, "// namespace w::d { struct Material { int b; }; }": False,
    }
    wrong = [text for text, expected in cases.items() if bool(check({"a": a, "b": text})) != expected]
    for text in wrong:
        print(f"not as expected: {text}")
    return not wrong


def main():
    if sys.argv[1] == "--selftest":
        sys.exit(0 if selftest() else 1)
    root = pathlib.Path(sys.argv[1])
    files = [path for module in MODULES for ending in ("*.hpp", "*.cpp") for path in sorted((root / module).rglob(ending))]
    problems = check({path.relative_to(root).as_posix(): path.read_text() for path in files})
    for problem in problems:
        print(f"{problem}: give one of them another name")
    print(f"{len(files)} files")
    sys.exit(1 if problems or not files else 0)


main()
