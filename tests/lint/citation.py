#!/usr/bin/env python3
"""Fails where CITATION.cff lacks a required key or states another version or licence than CMakeLists.txt and LICENSE.

    citation.py ROOT        checks the tree
    citation.py --selftest  checks that the checker refuses what it must refuse
"""
import pathlib
import re
import sys

REQUIRED = ("cff-version", "message", "title", "version", "license", "authors")


def problems(citation, cmake, licence):
    keys = dict(re.findall(r"^([\w-]+):[ \t]*(.*)$", citation, re.M))
    out = [f"CITATION.cff: no key {key}" for key in REQUIRED if key not in keys]
    version = re.search(r"project\(\w+ VERSION ([\d.]+)", cmake)
    if version is None or keys.get("version") != version[1]:
        out.append(f"CITATION.cff: version {keys.get('version')} (expected {version and version[1]}, as CMakeLists.txt has it)")
    if keys.get("license") != "Apache-2.0" or "Apache License" not in licence:
        out.append(f"CITATION.cff: license {keys.get('license')} (expected Apache-2.0, as LICENSE has it)")
    return out


def selftest():
    good = "".join(f"{key}: x\n" for key in REQUIRED).replace("version: x\nlicense: x", "version: 1.2.0\nlicense: Apache-2.0")
    cmake, licence = "project(weft VERSION 1.2.0 LANGUAGES CXX)", "Apache License"
    cases = {good: 0, good.replace("1.2.0", "1.2.1"): 1, good.replace("authors: x\n", ""): 1, good.replace("Apache-2.0", "MIT"): 1}
    return all(len(problems(text, cmake, licence)) == count for text, count in cases.items())


def main():
    if sys.argv[1] == "--selftest":
        sys.exit(0 if selftest() else 1)
    root = pathlib.Path(sys.argv[1])
    found = problems(*((root / name).read_text() for name in ("CITATION.cff", "CMakeLists.txt", "LICENSE")))
    for each in found:
        print(each)
    sys.exit(1 if found else 0)


main()
