#!/usr/bin/env python3
"""Fails on a C++ identifier or file name with a retired word; docs/reference/glossary.md has the word to use instead.

    retired_words.py ROOT        checks the sources of the programs and of the tests
    retired_words.py --selftest  checks that the checker refuses what it must refuse

A name is split at _ and at camel-case humps: HandOverDesk is hand, over, desk. Retired are the words of PARTS, the sequences of SEQUENCES and the
endings of ENDINGS. Each single word of the glossary's third column is retired too, unless it is in another column or in PROSE. Text of literals does
not count: keys of files and of the API keep their words.
"""
import pathlib
import re
import sys

ROOTS = ("classifier", "daemon", "drivers", "protocols", "recipes", "sim", "tests")
CODE = (".hpp", ".cpp", ".cc")
PARTS = {  # word -> its replacement
    "aids": "postprocessing", "bargain": "choice", "befall": "inject", "befallen": "inject", "befalls": "exposed", "curious": "request",
    "desk": "manager, service", "errand": "background task", "errands": "worker queue", "heard": "received", "hear": "on_message, on_sample",
    "hears": "receives", "judge": "check, evaluate", "judged": "checked", "learnt": "trained, model", "lesson": "training task",
    "obey": "apply, execute", "onlooker": "frame sampler", "said": "predicted, reply, reported", "sealed": "checksummed",
    "somebody": "its name", "nobody": "a condition", "stranger": "unknown label", "strangers": "unknown labels", "struck": "with a fault",
    "suffer": "apply faults", "suffers": "active fault", "surroundings": "dependencies", "tells": "reports", "told": "reported, callback",
    "twin": "duplicate", "twins": "duplicates", "unsealed": "checked", "wish": "request", "wished": "requested", "wishes": "requests",
}
SEQUENCES = {  # words in this order, anywhere in a name
    ("hand", "over"): "handover", ("handed", "over"): "handover", ("played", "again"): "replayed", ("go", "on"): "resume",
    ("gone", "on"): "resumed", ("goes", "on"): "continues", ("went", "on"): "on_progress", ("good", "bye"): "close",
    ("keep", "again"): "retry_persist", ("rig", "standing"): "rig state", ("take", "judge"): "attempt quality check",
    ("take", "rejected"): "attempt rejected", ("way", "on"): "resume hint", ("run", "line"): "run queue", ("event", "line"): "event queue",
}
STARTS = {"look": "check_, poll_, inspect_", "tell": "notify_, print_", "ask": "request_, prompt_", "say": "write_, send_", "may": "can_"}
ENDINGS = {"words": "format_x()", "word": "format_x(), x_keyword", "asked": "requested", "kept": "stored, persisted", "stands": "is_x"}
# Words of the glossary's third column that may have another sense in a name.
PROSE = set("""figures abort achieved answer arrow attention axis bias block branch budget case chance class cloth creep cycle data doubt drag duel
experiment face figure finger finally fingerprint floor force give guess guessing hold holds hook house journal keep level lingers line
lined lock machine manager method mount movement note pace pad pads people piece pilot plate platform print prints probe raw real record
retreat right role room round rows rub seat settle slide smooth speed stands stuck stuff swatch tag take tare texture touch trade wait
watcher who width window wire words workbench world zero""".split())
ALLOWED = {  # name -> reason
    "status_word": "the devices' manuals (ATI) call it so", "status_word_": "the devices' manuals (ATI) call it so",
    "may_alias": "an attribute of the compiler", "learnt_bytes": "script/same-bytes builds older commits by this name too",
    "may_have_been_resumed_externally": "an uncertainty, not a permission",
}
TOKEN = re.compile(r'//[^\n]*|/\*.*?\*/|(?:u8|[uUL])?R"([^()\\\s]{0,16})\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\''
                   r"|^[ \t]*#[ \t]*include[^\n]*|(?:\b\d[\w.']*)|([A-Za-z_]\w*)", re.S | re.M)
HUMPS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")


def words_of_name(name):
    return [hump.lower() for part in name.split("_") for hump in HUMPS.findall(part)]


def glossary_words(text):
    """Retired single words that no term, meaning or place of the glossary uses."""
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("|")]
    rows = [row for row in rows if len(row) == 4 and not re.fullmatch(r"-+|term", row[0])]
    used = {word for row in rows for cell in (row[0], row[1], row[3]) for word in re.findall(r"[a-z]+", cell.lower())}
    retired = {}
    for term, _, third, _ in rows:
        for word in (re.sub(r"\(.*?\)", "", part).strip() for part in third.split(",")):
            if re.fullmatch(r"[a-z]{3,}", word) and "(" not in third.split(word, 1)[1].split(",")[0]:
                retired[word] = term
    return {word: term for word, term in retired.items() if word not in used | PROSE}


def problem(name, parts):
    """The problem of a name, or None."""
    if name in ALLOWED:
        return None
    words = words_of_name(name)
    for word in words:
        if word in parts:
            return f'"{word}" is retired: {parts[word]}'
    for sequence, instead in SEQUENCES.items():
        if any(tuple(words[i:i + len(sequence)]) == sequence for i in range(len(words))):
            return f'"{" ".join(sequence)}" is retired: {instead}'
    if "_" in name.strip("_") and words:
        if words[0] in STARTS:
            return f'"{words[0]}_" is retired: {STARTS[words[0]]}'
        if words[-1] in ENDINGS:
            return f'"_{words[-1]}" is retired: {ENDINGS[words[-1]]}'
    return None


def check(files, parts):
    """`files`: text by path."""
    seen = {}
    for path, text in files.items():
        stem = pathlib.PurePosixPath(path).stem
        for name in [stem, *(m[2] for m in TOKEN.finditer(text) if m[2])]:
            seen.setdefault(name, path)
    return [f"{path}: {name}: {wrong}" for name, path in sorted(seen.items()) if (wrong := problem(name, parts))]


def selftest():
    glossary = "| term | meaning | retired | where |\n|---|---|---|---|\n| prediction | What a model names. | divination, oracle (of people) | x |\n"
    parts = PARTS | glossary_words(glossary)
    cases = {
        "class RunDesk;": True, "int hand_over_state;": True, "struct HandOver;": True, "Handover handover;": False, "bool told_;": True,
        "void look_at_plane();": True, "int look;": False, "std::string cell_words();": True, "auto words = 1;": False, "int may_begin;": True,
        'auto x = "told";': False, "// told\nint a;": False, 'R"(told)"': False, "int divination;": True, "int oracle;": False,
        "Word status_word;": False, "int retold;": False, "auto twinsOf;": True, "void ask_again();": True, "bool mayonnaise_s;": False,
        "char c = '\"'; int told;": True, "int n = 1'000; int heard;": True, '#include "daemon/run_desk.hpp"\nint a;': False,
    }
    wrong = [text for text, expected in cases.items() if bool(check({"a/b.cpp": text}, parts)) != expected]
    if not check({"a/rig_words.hpp": ""}, parts) or check({"a/rig_text.hpp": ""}, parts):
        wrong.append("file names")
    for text in wrong:
        print(f"not as expected: {text}")
    return not wrong


def main():
    if sys.argv[1] == "--selftest":
        sys.exit(0 if selftest() else 1)
    root = pathlib.Path(sys.argv[1])
    parts = PARTS | glossary_words((root / "docs/reference/glossary.md").read_text())
    paths = [path for folder in ROOTS for path in sorted((root / folder).rglob("*")) if path.suffix in CODE]
    problems = check({path.relative_to(root).as_posix(): path.read_text() for path in paths}, parts)
    for each in problems:
        print(each)
    print(f"{len(paths)} files")
    sys.exit(1 if problems or not paths else 0)


main()
