#!/usr/bin/env python3
"""clients/python/src/weft_client/_methods.py must equal the generator's output for the daemon's OpenRPC document.

    python_client_methods.py WEFTD SOURCE_ROOT [--write]      --write: write the file
"""
import pathlib
import sys
import tempfile

from weftd_support import Client, Daemon


def main():
    weftd, root = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    sys.path.insert(0, str(root / "clients/python"))
    from generate_methods import source_of
    target = root / "clients/python/src/weft_client/_methods.py"
    with tempfile.TemporaryDirectory(prefix="weft-client-") as name:
        folder = pathlib.Path(name)
        for sub in "recipes", "data":
            (folder / sub).mkdir()
        daemon = Daemon(weftd, root, folder)
        document = Client(daemon.socket).call("rpc.discover")
        assert daemon.end() == 0
    made = source_of(document)
    if "--write" in sys.argv:
        target.write_text(made)
    elif target.read_text() != made:
        print(f"{target.relative_to(root)} does not agree with the daemon's description. This makes it anew, for the commit that changed the API:\n"
              f"    python3 tests/scenario/python_client_methods.py {weftd} {root} --write")
        return 1
    print(f"{len(document['methods'])} methods")
    return 0


if __name__ == "__main__":
    sys.exit(main())
