#!/usr/bin/env python3
"""Runs scenarios at the same time: for those that wait nearly all of the time and may have no other program beside them.

    side_by_side.py COMMAND ... [-- COMMAND ...] ...

Ends as failed (1) where one failed, else as skipped (77) where one was skipped.
"""
import itertools
import subprocess
import sys
import threading

SKIPPED = 77


def main():
    commands = [list(group) for is_command, group in itertools.groupby(sys.argv[1:], lambda word: word != "--") if is_command]
    ended = []

    def run(command):
        ended.append((command, subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")))

    threads = [threading.Thread(target=run, args=(command,)) for command in commands]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for command, result in ended:
        print(f"{' '.join(command)}\n{result.stdout}exit status {result.returncode}\n")
    statuses = {result.returncode for _, result in ended}
    all_told = len(ended) == len(commands) and statuses <= {0, SKIPPED}
    sys.exit(max(statuses) if all_told else 1)


main()
