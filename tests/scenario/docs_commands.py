#!/usr/bin/env python3
"""Runs every command of README.md and of the pages in docs/ as a reader would: page by page, block by block, in a scratch copy of the tree.

    docs_commands.py BUILD_DIR SOURCE_ROOT [--here] [PAGE ...]      --here: in the tree itself, not in a scratch copy

Blocks marked ```sh are run. The comment before a block may be
    <!-- not run: REASON -->      it needs a bench, installs or builds: the reason is printed
    <!-- until: WORDS -->         it continues in a terminal of its own after it has printed these words
A block marked ```text after it is its expected output: each line must appear in the output, in order; "..." matches anything.
"""
import collections
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading

BUILD, ROOT = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
PAGES = ["README.md", "docs/**/*.md", "clients/*/README.md"]
BLOCK = re.compile(r"(?:<!-- (not run|until): (.*?) -->\n)?^```(sh|text)\n(.*?)^```$", re.M | re.S)
PATIENCE_S = 120
Block = collections.namedtuple("Block", "order words text expected")


def blocks_of(page):
    found = []
    for order, words, kind, text in BLOCK.findall(page.read_text()):
        if kind == "sh":
            found.append(Block(order, words, text, []))
        elif found and not found[-1].order == "not run":
            found[-1].expected.extend(text.splitlines())
    return found


def scratch(folder):
    """The tree of a user who has built it: all entries are links except `out`."""
    for entry in ROOT.iterdir():
        if entry.name not in ("build", "out", ".git"):
            (folder / entry.name).symlink_to(entry)
    (folder / "build").mkdir()
    (folder / "build/release").symlink_to(BUILD)
    return folder


class Terminal:
    """A shell. It keeps the output; end() ends the shell and all programs that it started."""

    def __init__(self, folder, environment):
        self.said, self.news = "", threading.Condition()
        self.shell = subprocess.Popen(["bash", "-s"], cwd=folder, env=environment, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                      stderr=subprocess.STDOUT, start_new_session=True)
        self.listener = threading.Thread(target=self.listen, daemon=True)
        self.listener.start()

    def listen(self):
        for line in self.shell.stdout:
            with self.news:
                self.said += line
                self.news.notify_all()
        with self.news:
            self.said += "\n(the terminal has ended)"
            self.news.notify_all()

    def run(self, text, words):
        """Types `text` and waits for `words`. Returns the output before them."""
        with self.news:
            before = len(self.said)
        self.shell.stdin.write(text)
        self.shell.stdin.flush()
        with self.news:
            there = self.news.wait_for(lambda: re.search(words, self.said[before:]) or "(the terminal has ended)" in self.said, PATIENCE_S)
            said = self.said[before:]
        assert there and re.search(words, said), f"never said {words!r}:\n{text}\n{said}"
        return said

    def end(self):
        os.killpg(self.shell.pid, signal.SIGTERM)
        self.shell.wait(PATIENCE_S)
        self.listener.join(PATIENCE_S)  # all writers have ended


def command(terminal, block):
    """Runs every line of the block; the first failure ends it."""
    mark = "@ status of the block "
    said = terminal.run(f"{{ set -e\n{block.text}\nset +e; }} < /dev/null\necho '{mark}'$?\n".replace("set +e; }", "set +e\n}"), mark + r"\d+\n")
    assert said.endswith(mark + "0\n"), f"{block.text}\n{said}"
    return said


def compare(block, said, page):
    rest = said
    for line in block.expected:
        if not line.strip():
            continue
        pattern = r"[^\n]*".join(" +".join(map(re.escape, part.split())) for part in line.split("..."))
        found = re.search(pattern, rest)
        assert found, f"{page}: this is no longer printed:\n  {line}\nafter\n{block.text}\nbut:\n{said}"
        rest = rest[found.end():]


def run_page(page, base):
    blocks = blocks_of(page)
    if not blocks:
        return 0
    folder = ROOT if "--here" in sys.argv else scratch(pathlib.Path(tempfile.mkdtemp(dir=base)))
    clean = {k: v for k, v in os.environ.items() if not k.startswith("WEFT_")}
    environment = {**clean, "PATH": f"{BUILD}:{os.environ['PATH']}", "HOME": str(folder), "PIP_NO_INDEX": "1", "PIP_FIND_LINKS": "/usr/share/python-wheels",
                   "PIP_DISABLE_PIP_VERSION_CHECK": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    terminals, ran = [Terminal(folder, environment)], 0
    try:
        for block in blocks:
            if block.order == "not run":
                print(f"  not run, {block.words}: {block.text.strip().splitlines()[0]}")
                continue
            if block.order == "until":
                terminals.append(Terminal(folder, environment))
                said = terminals[-1].run(block.text, re.escape(block.words))
            else:
                said = command(terminals[0], block)
            compare(block, said, page.relative_to(ROOT))
            ran += 1
    finally:
        for terminal in terminals:
            terminal.end()
    return ran


def main():
    total, wanted = 0, [word for word in sys.argv[3:] if word != "--here"] or PAGES
    base = tempfile.mkdtemp(prefix="weft-docs-")
    try:
        for pattern in wanted:
            for page in sorted(ROOT.glob(pattern)):
                ran = run_page(page, base)
                total += ran
                if ran:
                    print(f"{page.relative_to(ROOT)}: {ran} blocks run")
        assert total, "not one command was found"
    finally:
        shutil.rmtree(base)
    print(f"{total} blocks run (simulated)")


main()
