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
def packages():
    """All that is installed: compilers, their libraries and every header that is not of this repository."""
    return subprocess.run(["dpkg-query", "-W"], capture_output=True, check=False).stdout


def remembered(read, check):
    """`check()`, which json can hold, or what it gave before for the same `read`: texts, of all that it depends on besides
    the installed packages. KMAX_TEST_ALL=1 in the environment asks again in any case."""
    seen = hashlib.sha256(packages())
    for text in read:
        seen.update(len(text).to_bytes(8, "big"))
        seen.update(text.encode())
    file = FOLDER / seen.hexdigest()
    if os.environ.get("KMAX_TEST_ALL") != "1" and file.is_file():
        file.touch()
        return json.loads(file.read_text())
    result = check()
    FOLDER.mkdir(parents=True, exist_ok=True)
    unfinished = file.with_suffix(f".{os.getpid()}.{id(result)}")
    unfinished.write_text(json.dumps(result))
    unfinished.replace(file)
    return result


def forget_the_old():
    for file in FOLDER.glob("*"):
        if time.time() - file.stat().st_mtime > MONTH:
            file.unlink(missing_ok=True)
