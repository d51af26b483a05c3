#!/usr/bin/env python3
"""Runs scenarios in parallel: for those that mostly wait and must not run beside other programs.

    side_by_side.py COMMAND ... [-- COMMAND ...] ...

Exit status: 1 if one failed, else 77 (skipped) if one was skipped.
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
