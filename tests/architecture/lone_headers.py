"""Every header compiles by itself: it includes what it uses of this repository.

usage: tests/architecture/lone_headers.py FOLDER [--plain]        FOLDER: for what is precompiled

The standard library's headers are read once, precompiled, which halves the time and hides that one of them is missing.
A header that another one includes before any other of this repository has compiled by itself there, and is not compiled
again. --plain has nothing precompiled, compiles each and finds that too; it is how the preset plain runs this. On x86 the chip's headers
compile as well: they name registers but touch none.
"""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from os import cpu_count
from pathlib import Path

from source_text import includes

ROOT = Path(__file__).resolve().parents[2]
FLOORS = ["control", "drivers", "firmware", "board", "host_tools"]
CLANG = ["clang++", "-std=c++20", f"-I{ROOT}", "-isystem", "/usr/include/eigen3", "-DKMAX_AXIS_COUNT=2",
         '-DKMAX_VERSION=""', "-fconstexpr-steps=100000000", "-Wno-pragma-once-outside-header", "-x", "c++-header"]


def is_standard(include):
    """The standard library's headers have neither a folder nor a suffix."""
    return not include.quoted and "/" not in include.target and "." not in include.target


def precompiled(folder, headers):
    """The standard headers of all that the headers include."""
    folder.mkdir(parents=True, exist_ok=True)
    names = {include.target for header in headers for include in includes(header.read_text()) if is_standard(include)}
    listed, result = folder / "standard.hpp", folder / "standard.pch"
    listed.write_text("".join(f"#include <{name}>\n" for name in sorted(names)))
    subprocess.run([*CLANG, "-fpch-instantiate-templates", str(listed), "-o", str(result)], check=True)
    return result


def without_those_that_come_first(headers):
    """Those before which no other one has anything but what is precompiled."""
    firsts = set()
    for header in headers:
        others = [include for include in includes(header.read_text()) if not is_standard(include)]
        if others and others[0].quoted:
            firsts.add(others[0].target)
    return [header for header in headers if str(header.relative_to(ROOT)) not in firsts]


def message_of(header, first):
    """What the compiler says of `header` alone after the options `first`; empty when nothing is missing."""
    return subprocess.run([*CLANG, *first, "-fsyntax-only", str(header)], capture_output=True, text=True,
                          check=False).stderr


def main(folder, plain):
    headers = [header for floor in FLOORS for header in sorted((ROOT / floor).rglob("*.hpp"))]
    first = [] if plain else ["-include-pch", str(precompiled(folder, headers))]
    broken = folder / "broken.hpp"
    folder.mkdir(parents=True, exist_ok=True)
    broken.write_text('#include "control/wall_law.hpp"\ninline kmax::firmware::Axis* nothing() { return nullptr; }\n')
    if not message_of(broken, first):
        sys.exit("the check itself is broken: it does not see what a header lacks")
    compiled = headers if plain else without_those_that_come_first(headers)
    with ThreadPoolExecutor(cpu_count()) as pool:
        messages = list(pool.map(lambda header: message_of(header, first), compiled))
    print("".join(messages), end="")
    print(f"{len(headers)} headers, {len(compiled)} of them compiled; {sum(map(bool, messages))} lack something")
    return any(messages)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3) or sys.argv[2:] not in ([], ["--plain"]):
        sys.exit(__doc__.split("\n\n")[1])
    sys.exit(main(Path(sys.argv[1]), len(sys.argv) == 3))
