#!/usr/bin/python3
"""Runs a test unless it has passed before with everything it reads byte for byte the same.

usage: tests/remembered.py MEMORY READS... -- COMMAND...

MEMORY is a folder, READS are the files and folders that the test reads besides the program itself. A pass is remembered
by a hash of the command, of the program, of READS, of the environment variables that tests look at and of all packages
installed here. A failure is not remembered, and a folder without passes, as a fresh clone has, remembers nothing.
KMAX_TEST_ALL=1 runs the test in any case (scripts/test --all).

Properties draw the same cases each time, so that a pass means the same tomorrow, and what failed fails again. KMAX_SOAK=1
lets them draw others at each run, and remembers nothing; so does a test program that is started by itself.
RC_PARAMS in the environment stays as it is.

What the hash cannot see is the machine's load: a test that waits for real time and passed before is not asked again.
"""

import hashlib
import os
import subprocess
import sys
import time
from pathlib import Path

FIXED_SEED = "seed=20000"


def files_below(path):
    if path.is_dir():
        return sorted(file for file in path.rglob("*") if file.is_file() and "__pycache__" not in file.parts)
    return [path]


def key_of(command, reads):
    seen = hashlib.sha256()

    def add(*words):
        for word in words:
            seen.update(len(word).to_bytes(8, "big"))
            seen.update(word)

    add(*(word.encode() for word in command))
    add(*(f"{name}={value}".encode() for name, value in sorted(os.environ.items())
          if name.startswith(("KMAX", "GTEST", "RC_")) and name != "KMAX_TEST_ALL"))
    add(subprocess.run(["dpkg-query", "-W"], capture_output=True, check=False).stdout)
    programs = [Path(word) for word in command if "/" in word and Path(word).is_file()]
    for file in [file for path in [*programs, *map(Path, reads)] for file in files_below(path)]:
        # One that is missing is something that a test may look at too.
        add(str(file).encode(), hashlib.sha256(file.read_bytes()).digest() if file.is_file() else b"")
    return seen.hexdigest()


def main(arguments):
    if "--" not in arguments or arguments.index("--") == 0 or arguments[-1] == "--":
        print(__doc__.split("\n\n")[1], file=sys.stderr)
        return 2
    split = arguments.index("--")
    memory, reads, command = Path(arguments[0]), arguments[1:split], arguments[split + 1:]
    soak = os.environ.get("KMAX_SOAK") == "1"
    if not soak:
        os.environ.setdefault("RC_PARAMS", FIXED_SEED)
    remembered = memory / key_of(command, reads)
    if remembered.exists() and not soak and os.environ.get("KMAX_TEST_ALL") != "1":
        print(f"remembered: passed {remembered.read_text().strip()} with the same bytes")
        return 0
    code = subprocess.run(command, check=False).returncode
    if code == 0 and not soak:
        memory.mkdir(parents=True, exist_ok=True)
        remembered.write_text(time.strftime("%Y-%m-%d %H:%M\n"))
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
