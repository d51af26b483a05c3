"""Runs a notebook's code cells in order, with top-level await, without Jupyter.

    run_notebook.py NOTEBOOK.ipynb      skips cells that need a missing package (named in their metadata), with a message
"""
import ast
import asyncio
import importlib.util
import inspect
import json
import pathlib
import sys


def run(path):
    """Returns the number of cells that ran, and the skipped ones with the reason."""
    notebook = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    names, left_out, ran = {"__name__": "__main__"}, [], 0
    for cell in notebook["cells"]:
        if cell["cell_type"] != "code":
            continue
        assert cell["outputs"] == [] and cell["execution_count"] is None, f"{cell['id']}: cell has outputs (expected none). Clear them before the commit"
        needs = cell["metadata"].get("weft", {}).get("needs")
        if needs and importlib.util.find_spec(needs) is None:
            left_out.append(f"{cell['id']} ({needs} not installed)")
            continue
        code = compile("".join(cell["source"]), cell["id"], "exec", flags=ast.PyCF_ALLOW_TOP_LEVEL_AWAIT)
        ended = eval(code, names)
        if inspect.iscoroutine(ended):
            asyncio.run(ended)
        ran += 1
    return ran, left_out


if __name__ == "__main__":
    cells, skipped = run(sys.argv[1])
    print(f"{cells} cells run, skipped: {', '.join(skipped) or 'none'}")
