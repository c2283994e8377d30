"""What compilers said of sources, remembered by what they read: as a compiler cache does for what they make.

In $XDG_CACHE_HOME/kmax/compiler_checks, by default below ~/.cache: a clone knows what another one has checked. A file
that nobody asked for in 30 days is removed.
"""

import hashlib
import json
import os
import subprocess
import time
from functools import cache
from pathlib import Path

FOLDER = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "kmax" / "compiler_checks"
MONTH = 30 * 24 * 3600  # s


@cache
def unchanging():
    """All that is installed, which is compilers, their libraries and every header that is not of this repository; and how
    it is remembered."""
    return subprocess.run(["dpkg-query", "-W"], capture_output=True, check=True).stdout + Path(__file__).read_bytes()


def key_of(texts):
    seen = hashlib.sha256(unchanging())
    for text in texts:
        seen.update(len(text.encode()).to_bytes(8, "big"))
        seen.update(text.encode())
    return seen.hexdigest()


def remembered(read, check):
    """`check()`, which json can hold, or what it gave before for the same `read()`: the texts of all that it depends on
    besides the installed packages. What changes meanwhile, and what `check` raises, is not remembered. KMAX_TEST_ALL=1 in
    the environment asks again in any case."""
    key = key_of(read())
    file = FOLDER / key
    if os.environ.get("KMAX_TEST_ALL") != "1":
        try:
            known = json.loads(file.read_text())
            os.utime(file)
            return known
        except (OSError, ValueError):
            pass
    result = check()
    if key_of(read()) == key:
        FOLDER.mkdir(parents=True, exist_ok=True)
        unfinished = FOLDER / f"{key}.{os.getpid()}"
        unfinished.write_text(json.dumps(result))
        unfinished.replace(file)
    return result


def forget_the_old():
    for file in FOLDER.glob("*"):
        try:
            if time.time() - file.stat().st_mtime > MONTH:
                file.unlink()
        except FileNotFoundError:
            pass  # another process was first
