#!/usr/bin/env python3
"""Fails on a name in docs/explanation/walkthrough.md that the tree does not have.

Checked are code spans that are a path, a `function()`, a `Class::function()` or a bare identifier. Text in double quotes must be part of a message in
the sources. Comments do not count as sources. Links: see links.py.

    walkthrough_names.py ROOT      checks the tree
    walkthrough_names.py --selftest  checks that the checker refuses what it must refuse
"""
import pathlib
import re
import sys
import tempfile

DOCUMENT = "docs/explanation/walkthrough.md"
ROOTS = ("protocols", "drivers", "recipes", "classifier", "sim", "daemon")
CODE = (".cpp", ".hpp", ".cc", ".in", ".json")
# comments, and literals, because a "//" inside one does not begin a comment
TOKEN = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.S)
BLOCK = re.compile(r"^(?: {4}[^\n]*|```.*?^```$)", re.M | re.S)
SPAN = re.compile(r"`([^`]+)`")
QUOTED = re.compile(r'"([^"]+)"', re.S)
PATH = re.compile(r"[\w.-]+(?:/[\w.-]+)+\.\w+")
LINE_NUMBER = re.compile(r"\.\w+:\d+$")
FUNCTION = re.compile(r"(?:([\w:]+)::)?(\w+)\(\)")
IDENTIFIER = re.compile(r"[A-Za-z_]\w*(?:::\w+)*")


class Sources:
    def __init__(self, root):
        files = [p for r in ROOTS for p in sorted((root / r).rglob("*")) if p.suffix in CODE]
        self.texts = [TOKEN.sub(lambda m: m[0] if m[0][0] == '"' else " ", p.read_text()) for p in files]
        self.words = set(re.findall(r"\w+", "\n".join(self.texts)))
        # adjacent literals are one message
        self.messages = re.sub(r'"\s*"', "", "\n".join(self.texts)).replace('\\"', '"')

    def has_function(self, owner, name):
        call = re.compile(rf"\b{name}\s*\(")
        texts = [t for t in self.texts if name in t]
        if not owner:
            return any(call.search(t) for t in texts)
        owner = owner.split("::")[-1]
        written = re.compile(rf"\b{owner}::{name}\s*\(")  # defined outside the class, or called by its full name
        declared = re.compile(rf"\b(?:class|struct|namespace)\s+(?:\w+::)*{owner}\b")
        return any(written.search(t) or declared.search(t) and call.search(t) for t in texts)


def wrong_with_span(span, root, sources):
    if LINE_NUMBER.search(span):
        return "line numbers rot: name the function"
    if PATH.fullmatch(span):
        return None if (root / span).is_file() else "no such file"
    if match := FUNCTION.fullmatch(span):
        return None if sources.has_function(*match.groups()) else "no such function in the sources"
    if IDENTIFIER.fullmatch(span):
        missing = [word for word in span.split("::") if word not in sources.words]
        return f"{missing[0]} is nowhere in the sources" if missing else None
    return None  # a command or a formula


def check(root):
    document, sources = root / DOCUMENT, Sources(root)
    text = BLOCK.sub("", document.read_text())
    problems = []
    for span in dict.fromkeys(SPAN.findall(text)):
        if wrong := wrong_with_span(span, root, sources):
            problems.append(f"{DOCUMENT}: `{span}`: {wrong}")
    for message in dict.fromkeys(QUOTED.findall(SPAN.sub("", text))):
        if " ".join(message.split("\n")) not in sources.messages:
            problems.append(f'{DOCUMENT}: "{message}": no message in the sources says so')
    return problems


def selftest():
    source = (
        "/// says gone() and \"an old message\" and the word bygone\n"
        "class Engine { void turn(int n); };\n"
        "int helper(int wheel_m) { return fail(\"the wheel is \"\n    \"stuck // here\", wheel_m); }\n"
        "int other() { return 0; }\n"
    )
    cases = {
        "`daemon/a.cpp`": False, "`daemon/b.cpp`": True, "`daemon/a.cpp:12`": True,
        "`helper()`": False, "`gone()`": True, "`wheel_m()`": True,
        "`Engine::turn()`": False, "`Engine::gone()`": True, "`Motor::turn()`": True,
        "`wheel_m`": False, "`bygone`": True, "`v = g e / K`": False, "`weft run`": False,
        'It says "the wheel is stuck // here".': False, 'It says "an old message".': True,
        'It says "the wheel\nis stuck".': False, "    `daemon/b.cpp` in a block": False,
        "    a block\n\nand `daemon/b.cpp` after it": True,
    }
    failures = []
    for text, refused in cases.items():
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, content in {"daemon/a.cpp": source, DOCUMENT: text + "\n"}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(content)
            if bool(check(root)) != refused:
                failures.append(f"{text!r} should be {'refused' if refused else 'allowed'}: {check(root)}")
    return failures


problems = selftest() if sys.argv[1] == "--selftest" else check(pathlib.Path(sys.argv[1]))
print("\n".join(problems) or "names in the walkthrough: in order")
sys.exit(1 if problems else 0)
