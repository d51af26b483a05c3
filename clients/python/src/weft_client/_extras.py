"""Imports packages that only some modules need."""
from __future__ import annotations

import importlib
from types import ModuleType


def extra(module: str, name: str) -> ModuleType:
    """The package `module` of the extra `name`. Errors: ImportError with the command that installs it; any other failure of the import as it is."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as problem:
        package = module.partition(".")[0]
        if problem.name is None or problem.name.partition(".")[0] != package:
            raise
        raise ImportError(f"package not found: {package}. Run `pip install 'weft-client[{name}]'` (in Weft's tree: `pip install 'clients/python[{name}]'`)",
                          name=package) from problem
