#!/usr/bin/env python3
"""PostgreSQL with a database `lab` for a test of the page: prints the folder of its socket, then obeys "stop" and "start" until the input ends.

    lab_server.py            Exit status 77 without Debian's server programs
"""
import pathlib
import signal
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "scenario"))
import lab_support  # noqa: E402


def main():
    if lab_support.programs() is None:
        print(lab_support.NOT_INSTALLED, flush=True)
        sys.exit(77)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # ends the server too
    with lab_support.Server() as server:
        server.make_lab()
        print(server.folder, flush=True)
        for line in sys.stdin:
            {"stop": server.stop, "start": server.start}[line.strip()]()
            print("done", flush=True)


if __name__ == "__main__":
    main()
