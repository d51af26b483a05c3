#!/usr/bin/env python3
"""Fails on retired phrases in comments, documentation and texts for people, and on pages of long sentences: docs/reference/glossary.md has the terms.

    english.py ROOT [PATH ...]    checks COMMENTS, TEXTS and PAGES, or the files and folders below PATH whole
    english.py --report ROOT      counts findings by folder, and the sentence length of each page; exit status 0
    english.py --help-of ROOT PROGRAM ...   checks that the help of each option and command is a phrase of under 80 characters
    english.py --selftest         checks that the checker refuses what it must refuse

Retired are the phrases of PHRASES, two openings of a sentence, and each phrase of several words in the third column of the glossary
that has no bracket. Code, file keys in backquotes and quotations in double quotes do not count. A text for people is a string of C++, Python or
the page, and the text of an HTML file, with three words or more. A docstring counts as a comment.
"""
import ast
import io
import pathlib
import re
import statistics
import subprocess
import sys
import tokenize

# The clean parts, which stay clean. Both lists grow until they hold everything.
COMMENTS = ("CMakeLists.txt", "classifier", "clients", "daemon", "docs/sample_driver", "drivers", "packaging", "protocols", "recipes", "script", "sim", "tests")
PAGES = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "docs", "classifier", "clients", "daemon", "drivers", "packaging", "protocols", "recipes", "sim", "tests")
MOST_WORDS = 20  # mean of a page's sentences
MOST_HELP = 80  # characters
NO_PHRASE = re.compile(r"(?:of|what|whose|which|who|where|when|how|not|in|as|by|too|its)\b", re.I)
TEXTS = ("classifier", "clients/python/src", "daemon", "docs/sample_driver", "drivers", "protocols", "recipes", "script", "sim")  # strings of these folders
CODE = {".hpp": "c", ".cpp": "c", ".cc": "c", ".js": "c", ".mjs": "c", ".py": "python", ".sh": "shell", ".cmake": "shell", ".service": "shell",
        ".m": "matlab", ".css": "css"}
PHRASES = {  # pattern -> what is used instead
    r"befall(?:s|en)?|befell": "happens to, is injected", r"suffer(?:s|ed|ing)?": "has, is exposed to",
    r"hear(?:s|d|ing)?": "receives, is notified", r"foretold|foretells?": "forecast",
    r"(?:tell|tells|told|telling)(?!\s(?:\S+\s){0,3}apart)": "reports, shows, states", r"(?:say|says|said|saying)": "states, reports",
    r"go(?:es|ing)? on with|gone on with|went on with": "resumes, continues", r"stands(?! for)": "is",
    r"somebody|nobody": "a person, no user, no one", r"whose": "with its, of which", r"so many": "the number of",
    r"so long(?! as)": "the duration of", r"likewise": "also, the same", r"by now": "now", r"no more(?! than)": "no longer",
    r"told right": "accurate", r"taken for": "predicted as", r"in line(?! \d| with)": "in the queue", r"is wanted": "is requested",
}
OPENINGS = {r"Of\s": "name the thing", r"(?:What|Whatever|Who|Whoever|Whom)\s[^?]*$": "a noun as the subject"}
# Phrases of the glossary's third column that are plain English in another sense.
PLAIN = {"guard trips on", "by then", "of the whole", "room's driver", "come down", "asked about", "good for"}
COMMENT = re.compile(r'(?P<comment>//[^\n]*|/\*.*?\*/)|(?:u8|[uUL])?R"([^()\\\s]{0,16})\(.*?\)\2"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'|`(?:\\.|[^`\\])*`',
                     re.S)
CSS_COMMENT = re.compile(r'(?P<comment>/\*.*?\*/)|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'', re.S)
# After a name or a bracket a quotation mark transposes.
MATLAB_COMMENT = re.compile(r'"(?:""|[^"\n])*"|(?<![\w)\]}\'.])\'(?:\'\'|[^\'\n])*\'|%(?P<comment>.*)')
SHELL_COMMENT = re.compile(r'\\.|"(?:\\.|[^"\\])*"|\'[^\']*\'|(?<!\S)#(?!!)\s?(?P<comment>.*)')
QUOTED = re.compile(r'`[^`\n]*`|"[^"\n]*"|\u201c[^\u201d]*\u201d|https?://\S+')
SENTENCE_END = re.compile(r"(?<=[.!?])\s+(?=[A-Z\"(\[`*\u201c])")


def glossary_phrases(text):
    """Phrases of several words that are retired in every sense."""
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("|")]
    out = {}
    for term, _, third, _ in (row for row in rows if len(row) == 4):
        for phrase in (part.strip() for part in re.split(r",| / ", re.sub(r"([^,]*?)\([^)]*\)", "", third))):
            if re.fullmatch(r"[a-z][a-z' ]*[a-z]", phrase) and " " in phrase and phrase not in PLAIN:
                out[re.escape(phrase)] = term
    return out


def join_comments(pieces):
    """Comment lines that follow each other as one text: [(line, text)] -> [(line of each word's line, text)]."""
    blocks = []
    for line, text in pieces:
        if blocks and line == blocks[-1][-1][0] + 1:
            blocks[-1].append((line, text))
        else:
            blocks.append([(line, text)])
    return blocks


def kind_of(path, text):
    """The kind of comments: by the name, else by the first line of a script; None if unknown."""
    name = path.with_suffix("") if path.suffix == ".in" else path
    if name.suffix in CODE or name.name == "CMakeLists.txt":
        return CODE.get(name.suffix, "shell")
    first = text.split("\n", 1)[0] if path.suffix == "" else ""
    if not first.startswith("#!"):
        return None
    return "python" if "python" in first else "shell" if "sh" in first else None


def c_comments(text, pattern=COMMENT):
    out = []
    for found in pattern.finditer(text):
        if not found["comment"]:
            continue
        line = text.count("\n", 0, found.start()) + 1
        alone = text[text.rfind("\n", 0, found.start()) + 1:found.start()].strip() == ""
        body = re.sub(r"^\s*(?://[/!]?<?|/\*\*?|\*/|\*)|\*/$", "", found["comment"], flags=re.M)
        out += [(line + at, one.strip() if alone or at else "\0" + one.strip()) for at, one in enumerate(body.split("\n"))]
    return out


STRING = re.compile(r'(?P<skip>//[^\n]*|/\*.*?\*/|\'(?:\\.|[^\'\\\n]){1,2}\')|(?:u8|[uUL])?R"(?P<mark>[^()\\\s]{0,16})\((?P<raw>.*?)\)(?P=mark)"'
                    r'|"(?P<plain>(?:\\.|[^"\\\n])*)"|\'(?P<single>(?:\\.|[^\'\\\n])*)\'|`(?P<template>(?:\\.|[^`\\])*)`', re.S)


def strings_of(path, text):
    """[(line, text)] of the strings for people; neighbours are joined as the compiler does, and `${...}` is one word."""
    if path.suffix == ".html":
        text = re.sub(r"<(script|style)\b.*?</\1>", lambda m: "\n" * m[0].count("\n"), text, flags=re.S)
        found = [(text.count("\n", 0, m.start(1)) + 1, " ".join(m[1].split())) for m in re.finditer(r">([^<>]+)<", text)]
        found += [(text.count("\n", 0, m.start()) + 1, m[1]) for m in re.finditer(r'\b(?:title|placeholder|aria-label)="([^"]*)"', text)]
    elif kind_of(path, text) == "python":
        found = python_strings(text)
    elif kind_of(path, text) == "c":
        found, end = [], None
        for m in STRING.finditer(text):
            value = next((m[name] for name in ("raw", "plain", "single", "template") if m[name] is not None), None)
            if value is None or m["single"] is not None and path.suffix not in (".js", ".mjs"):
                continue
            value = re.sub(r"\$\{(?:[^{}]|\{[^{}]*\})*\}", "x", value) if m["template"] is not None else value
            value = value.replace("\\n", " ").replace('\\"', '"').replace("\\t", " ")
            if end is not None and not text[end:m.start()].strip():
                found[-1] = (found[-1][0], found[-1][1] + value)
            else:
                found.append((text.count("\n", 0, m.start()) + 1, value))
            end = m.end()
    else:
        return []
    return [(line, value) for line, value in found if len(re.findall(r"[A-Za-z]{2,}", value)) >= 3 and " " in value.strip()]


def python_comments(text):
    out = []
    try:
        tokens = list(tokenize.generate_tokens(io.StringIO(text).readline))
    except (tokenize.TokenError, IndentationError, SyntaxError):
        return out
    before = None
    for token in tokens:
        if token.type == tokenize.COMMENT and not token.string.startswith("#!"):
            out.append((token.start[0], token.string.lstrip("# ")))
        elif token.type == tokenize.STRING and before in (None, tokenize.NEWLINE, tokenize.INDENT, tokenize.NL) and token.string.startswith('"""'):
            out += [(token.start[0] + at, one.strip()) for at, one in enumerate(token.string.strip('"').split("\n"))]
        if token.type != tokenize.COMMENT:
            before = token.type
    return out


def python_strings(text):
    """[(line, text)] without docstrings; an expression in an f-string is one word."""
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError):
        return []
    out, parts = [], set()
    parts.update(id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr))
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            parts.update(id(part) for part in node.values)
            parts.update(id(part.format_spec) for part in node.values if isinstance(part, ast.FormattedValue))
            if id(node) not in parts:
                out.append((node.lineno, "".join(part.value if isinstance(part, ast.Constant) else "x" for part in node.values)))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts:
            out.append((node.lineno, node.value))
    return sorted((line, " ".join(value.split())) for line, value in out)


def line_comments(text, pattern):
    """A comment behind code is a text of its own."""
    out = []
    for found in pattern.finditer(text):
        if found["comment"] is not None:
            alone = text[text.rfind("\n", 0, found.start()) + 1:found.start()].strip() == ""
            out.append((text.count("\n", 0, found.start()) + 1, ("" if alone else "\0") + found["comment"].lstrip("#% ").rstrip()))
    return out


def prose_of_page(text):
    """Paragraphs and list items as [(line, text)], without code blocks, tables, headings and comments."""
    out, fenced = [], False
    for at, line in enumerate(re.sub(r"<!--.*?-->", lambda m: "\n" * m[0].count("\n"), text, flags=re.S).split("\n"), 1):
        if re.match(r"\s*(```|~~~)", line):
            fenced = not fenced
        elif not fenced and not re.match(r"\s*(#|\||    |$)", line):
            item = re.match(r"\s*(?:[-*+]|\d+\.)\s+(.*)", line)
            out.append((at, "\0" + item[1] if item else line.strip()))
    return out


COMMENTS_OF = {"c": c_comments, "css": lambda text: c_comments(text, CSS_COMMENT), "python": python_comments,
               "shell": lambda text: line_comments(text, SHELL_COMMENT), "matlab": lambda text: line_comments(text, MATLAB_COMMENT)}


def texts_of(path, text):
    """Blocks of prose of a file: lists of (line, text)."""
    if path.suffix == ".md":
        pieces = prose_of_page(text)
    else:
        kind = kind_of(path, text)
        if kind is None:
            return []
        pieces = COMMENTS_OF[kind](text)
    blocks = []
    for block in join_comments([(line, one) for line, one in pieces if one.strip("\0 ") or path.suffix != ".md"]):
        for line, one in block:
            if one.startswith("\0") or not one or not blocks or blocks[-1] is None or line != blocks[-1][-1][0] + 1:
                blocks.append([])
            if one.strip("\0 "):
                blocks[-1].append((line, one.strip("\0 ")))
            else:
                blocks[-1].append((line, ""))
    return [[piece for piece in block if piece[1]] for block in blocks if any(piece[1] for piece in block)]


def sentences(block):
    """(line, sentence) of a block."""
    text, lines = "", []
    for line, one in block:
        lines += [line] * (len(one) + 1)
        text += one + " "
    at = 0
    for sentence in SENTENCE_END.split(text.rstrip()):
        at = text.index(sentence, at)
        yield lines[at], sentence
        at += len(sentence)


class Checker:
    def __init__(self, glossary):
        phrases = PHRASES | {pattern: f"{term} (glossary)" for pattern, term in glossary_phrases(glossary).items()}
        self.phrases = [(re.compile(rf"(?<![\w-])(?:{pattern})(?![\w-])", re.I), instead) for pattern, instead in phrases.items()]
        self.openings = [(re.compile(rf"(?:@\w+\s+)?{pattern}"), instead) for pattern, instead in OPENINGS.items()]

    def problems(self, path, text, strings=False):
        """[(line, sentence)] with what is wrong in comments and pages, or else in strings."""
        out = []
        for block in [[one] for one in strings_of(path, text)] if strings else texts_of(path, text):
            for line, sentence in sentences(block):
                plain = QUOTED.sub("\u2423", sentence)
                found = [(match[0], instead) for pattern, instead in self.phrases for match in [pattern.search(plain)] if match]
                found += [(plain.split()[0] + " ...", instead) for pattern, instead in self.openings if pattern.match(plain)]
                out += [(line, f'"{phrase}" is retired ({instead}): {sentence}') for phrase, instead in found]
        return out


def words_of_sentences(text):
    return [len(re.findall(r"[\w'\u2019.-]*\w", QUOTED.sub("x", sentence))) for block in texts_of(pathlib.Path("a.md"), text)
            for _, sentence in sentences(block)]


def length_problem(text):
    counts = words_of_sentences(text)
    if len(counts) >= 5 and statistics.mean(counts) > MOST_WORDS:
        return f"mean sentence of {statistics.mean(counts):.1f} words (at most {MOST_WORDS})"
    return None


def files_below(root, places):
    for place in places:
        start = root / place
        for path in [start] if start.is_file() else sorted(start.rglob("*")):
            if path.is_file() and "node_modules" not in path.parts and (kind_of(path, "") or path.suffix in (".md", ".html", "")):
                yield path


def selftest():
    checker = Checker("| term | meaning | retired | where |\n|---|---|---|---|\n| handover | x | what is learnt from it, rub (noun), by then | y |\n")
    cases = {
        ("a.cpp", "// The reader is told of it.\n"): 1, ("a.cpp", 'auto a = "told";  // \u201ctold\u201d is "told", `told`\n'): 0,
        ("a.hpp", "/// Of the trial.\n"): 1, ("a.hpp", "/// What the run is.\n"): 1, ("a.hpp", "/// What is it? A run.\n"): 0,
        ("a.cpp", "// A long sentence that goes on\n// with it.\n"): 1, ("a.cpp", "int a;  // told\nint b;  // heard\n"): 2,
        ("a.md", "# Told\n\nIt tells.\n\n```sh\ntold\n```\n\n| told |\n"): 1, ("a.md", "Learn to tell fabrics apart.\n"): 0,
        ("a.py", '"""It says so."""\na = "told"\n'): 1, ("a.py", "a = 1  # said\n"): 1, ("a.sh", "# said\necho said\n"): 1,
        ("a.md", "That is what is learnt from it.\n"): 1, ("a.md", "A rub by then.\n"): 0, ("a.js", "const a = `// told`;\n"): 0,
        ("a.md", "Wait no more than 5 s, in line 3.\n"): 0, ("a.md", "- Nobody waits.\n- Nobody goes.\n"): 2, ("a.txt", "told"): 0,
        ("a.sh", "a=1  # said\nb=${#a} c=$#  # fine\necho \"x # said\" 'y # said' \\# said#\n"): 1, ("CMakeLists.txt", "# Said.\n"): 1,
        ("a.cpp.in", "// Said.\n"): 1, ("a.service.in", "# Said.\n"): 1, ("a.in", "# Said.\n"): 0, ("a", "#!/bin/sh\n# Said.\n"): 1,
        ("a.m", "% It is\n% told.\n"): 1, ("a.m", "a = b';  % told\nc = ['%d told', 'it''s % told'];\nd = c{1}';  % heard\n"): 2,
        ("a.css", "/* told */\na { b: url(//told); c: \"/* told */\"; } /* It\n is heard. */\n"): 2,
    }
    wrong = [case for case, expected in cases.items() if len(checker.problems(pathlib.Path(case[0]), case[1])) != expected]
    strings = {  # of them at least three words
        ("a.py", '"""It says so here."""\na = "it says so"\n'): 1, ("a.py", 'a = f"it {says} {so:told} here"\n'): 0, ("a.py", 'a = "told"\n'): 0,
        ("a.py", 'f(a, "one two "\n  f"three {b} is said")\n'): 1, ("a.py", "a = {'k': f'{b[\"it is told\"]} is fine here'}\n"): 1, ("a.py", "a = (\n"): 0,
        ("a", '#!/usr/bin/env python3\nprint("it says so")\n'): 1, ("a.cpp", 'a("it says" " so");\n'): 1, ("a.m", "a('it says so')\n"): 0,
        ("a.py", "# it says so\na = b'it says so'\n"): 0,
    }
    wrong += [case for case, expected in strings.items() if len(checker.problems(pathlib.Path(case[0]), case[1], strings=True)) != expected]
    long = "It is a sentence " + "with words " * 20 + ". "
    if not length_problem(long * 5) or length_problem("Short it is. " * 9) or length_problem("| " + long * 9):
        wrong.append("length of sentences")
    if [line for line, _ in checker.problems(pathlib.Path("a.cpp"), "int a;\n// Fine.\n// It was\n// told.\n")] != [3]:
        wrong.append("the line of a finding")
    page = ".SH OPTIONS\n.TP\n\\fB\\-\\-%s\\fR\n%s\n.SS weft a\n\\fBweft a\\fR\n.PP\nadd a run.\n.PP\nExample: weft a of it and what is told, so often that it is long, longer than it may be\n"
    for name, text, expected in (("rig", "rig file", 0), ("rig", "of the rig", 1), ("rig", "use the rig " * 8, 1), ("rig", "print what is told", 1)):
        if len(help_problems(checker, page % (name, text))) != expected:
            wrong.append(("help", text))
    for each in wrong:
        print(f"not as expected: {each}")
    return not wrong


def help_problems(checker, manual):
    """Problems of the help of commands and options in a manual page that Weft made: [(heading, problem)]."""
    out, section = [], ""
    plain = re.sub(r"\\f[A-Z]|\\&", "", manual).replace("\\-", "-").replace("\\e", "\\")
    for block in re.split(r"^\.(?=SS|TP|SH|PP)", plain, flags=re.M):
        kind, _, rest = block.partition("\n")
        if kind.startswith(("SS", "SH")):
            section = kind[3:].strip()
        head, _, text = rest.partition("\n") if kind == "TP" else (section, "", rest.split("\nExample:")[0])
        text = text.strip()
        if kind not in ("TP", "PP") or text.startswith("Example:") or section == "EXIT STATUS":
            continue
        place = f"{section}: {head}"
        if len(text) >= MOST_HELP or not text:
            out.append((place, f"{len(text)} characters (expected 1 to {MOST_HELP - 1}): {text}"))
        if NO_PHRASE.match(text):
            out.append((place, f"not an imperative phrase: {text}"))
        out += [(place, problem) for _, problem in checker.problems(pathlib.Path("a.md"), text)]
    return out


def report(root, checker):
    counts = {}
    for path in files_below(root, ("classifier", "clients", "daemon", "docs", "drivers", "packaging", "protocols", "recipes", "script", "sim", "tests")):
        folder = "/".join(path.relative_to(root).parts[:2 if path.relative_to(root).parts[0] in ("daemon", "tests") else 1])
        counts[folder] = counts.get(folder, 0) + len(checker.problems(path, path.read_text(errors="replace")))
    for folder, count in sorted(counts.items(), key=lambda one: -one[1]):
        print(f"{count:6} {folder}")
    for path in sorted(root.rglob("*.md")):
        words = words_of_sentences(path.read_text())
        if len(words) >= 5 and not {"node_modules", "build"} & set(path.relative_to(root).parts):
            print(f"mean {statistics.mean(words):5.1f}  p90 {sorted(words)[int(0.9 * len(words))]:3}  {path.relative_to(root)}")


def main():
    if sys.argv[1] == "--selftest":
        sys.exit(0 if selftest() else 1)
    root = pathlib.Path(sys.argv[2] if sys.argv[1].startswith("--") else sys.argv[1])
    checker = Checker((root / "docs/reference/glossary.md").read_text())
    if sys.argv[1] == "--report":
        return report(root, checker)
    if sys.argv[1] == "--help-of":
        found = []
        for program in sys.argv[3:]:
            words = [program, "manual"] if program.endswith("weft") else [program, "--manual"]
            found += help_problems(checker, subprocess.run(words, capture_output=True, text=True, check=True).stdout)
        for place, problem in found:
            print(f"{place}: {problem}")
        print(f"{len(found)} findings")
        sys.exit(1 if found else 0)
    count = files = 0
    places = sys.argv[2:]
    paths = list(files_below(root, places)) if places else [path for path in files_below(root, COMMENTS) if path.suffix != ".md"]
    paths += [] if places else [path for path in files_below(root, PAGES) if path.suffix == ".md"]
    texts = {path for path in files_below(root, TEXTS) if path.suffix != ".md"}
    for path in dict.fromkeys([*paths, *sorted(texts)]):
        text = path.read_text(errors="replace")
        found = checker.problems(path, text)
        found += checker.problems(path, text, strings=True) if places or path in texts else []
        if path.suffix == ".md" and (long := length_problem(text)):
            found.append((1, long))
        files += 1
        count += len(found)
        for line, problem in found:
            print(f"{path.relative_to(root)}:{line}: {problem}")
    print(f"{files} files, {count} findings")
    sys.exit(1 if count else 0)


main()
