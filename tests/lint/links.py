#!/usr/bin/env python3
"""Fails if a relative link or picture in a tracked *.md has no target, or names a heading that does not exist.

    links.py ROOT      checks the tree
    links.py --selftest  checks that the checker refuses what it must refuse
"""
import pathlib
import re
import subprocess
import sys
import tempfile

CODE = re.compile(r"^```.*?^```$|`[^`\n]*`", re.M | re.S)
# [text](target), ![picture](target "title"), [text]: target
LINK = re.compile(r"\]\(\s*<?([^()\s<>]+)>?(?:\s+\"[^\"]*\")?\s*\)|^\[[^\]]+\]:\s*(\S+)", re.M)
OUTSIDE = re.compile(r"[a-z][a-z0-9+.-]*:", re.I)
HEADING = re.compile(r"^#+\s+(.*?)\s*#*$", re.M)


def anchors(path):
    """Headings as GitHub turns them into anchors."""
    text = re.sub(r"^```.*?^```$", "", path.read_text(), flags=re.M | re.S)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in HEADING.findall(text)}


def wrong_with(target, page, root):
    name, _, anchor = target.partition("#")
    place = (page.parent / name).resolve() if name else page
    if not place.is_relative_to(root):
        return "outside the tree"
    if not place.exists():
        return "no such file"
    if anchor and place.suffix == ".md" and anchor not in anchors(place):
        return "no such heading"
    return None


def check(root, pages):
    root, problems = root.resolve(), []
    for name in pages:
        page = root / name
        text = CODE.sub("", page.read_text())
        for target in dict.fromkeys(a or b for a, b in LINK.findall(text)):
            if not OUTSIDE.match(target) and (wrong := wrong_with(target, page, root)):
                problems.append(f"{name}: {target}: {wrong}")
    return problems


def tracked(root):
    """Tracked pages and untracked ones that are not ignored; without git, all pages outside of build folders."""
    listed = subprocess.run(["git", "-C", root, "ls-files", "-co", "--exclude-standard", "*.md"], capture_output=True, text=True)
    if listed.returncode == 0:
        return [name for name in listed.stdout.split("\n") if name and (root / name).exists()]
    return [p.relative_to(root).as_posix() for p in sorted(root.rglob("*.md")) if "build" not in p.parts]


def selftest():
    cases = {
        "[a](other.md)": False, "[a](lost.md)": True, "![p](img/p.png)": False, "![p](img/lost.png)": True,
        "[a](img/)": False, "[a](https://example.org/lost.md)": False, "[a](../../../outside.md)": True,
        "[a](other.md#a-heading-of-it)": False, "[a](other.md#lost)": True, "[a](#here)": False, "[a](#lost)": True,
        "`[a](lost.md)`": False, "```\n[a](lost.md)\n```": False, '![p](img/lost.png "title")': True,
        "[a]: lost.md": True, "[a]: other.md": False, "[a](mailto:x@example.org)": False,
    }
    failures = []
    for text, refused in cases.items():
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "docs/img").mkdir(parents=True)
            (root / "docs/img/p.png").write_text("")
            (root / "docs/other.md").write_text("# A heading (of it)\n")
            (root / "docs/page.md").write_text(f"# Here\n\n{text}\n")
            if bool(check(root, ["docs/page.md"])) != refused:
                failures.append(f"{text!r} should be {'refused' if refused else 'allowed'}")
    return failures


def main():
    root = pathlib.Path(sys.argv[1])
    problems = selftest() if sys.argv[1] == "--selftest" else check(root, tracked(root))
    print("\n".join(problems) or "links: in order")
    sys.exit(1 if problems else 0)


main()
