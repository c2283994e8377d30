"""Every header compiles by itself: it includes what it uses of this repository.

usage: tests/architecture/lone_headers.py FOLDER [--plain]        FOLDER: for what is precompiled

The headers of the standard library and of other libraries are read once, precompiled, which takes a third of the time and
hides that one of them is missing. So is one of DEAR, for a header that includes it in any case: its place among the includes
is all that this hides. A header that another one includes before any other of this repository
has compiled by itself there, and is not compiled again. --plain has nothing precompiled, compiles each and finds that too;
it is how the preset plain runs this. On x86 the chip's headers compile as well: they name registers but touch none.

That a header compiled is remembered for as long as nothing changed that it includes; see scripts/compiler_checks.py.
"""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from os import cpu_count
from pathlib import Path
from threading import RLock

from source_text import includes

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

from compiler_checks import forget_the_old, remembered  # noqa: E402

# Headers that bring most of what others read. None is precompiled after another of them: Clang crashes on some such chains.
DEAR = ["firmware/object_dictionary/dictionary.hpp", "firmware/parameters/parameter_values.hpp", "firmware/command/axes.hpp",
        "firmware/application.hpp", "host_tools/device/device.hpp", "host_tools/device/drive.hpp", "host_tools/simulation/scene.hpp",
        "host_tools/simulated_board/simulated_power_hardware.hpp", "host_tools/experiment/contact/contact_experiment.hpp",
        "host_tools/virtual_board/odrive_v3/virtual_board.hpp"]
FLOORS = ["control", "drivers", "firmware", "board", "host_tools"]
CLANG = ["clang++", "-std=c++20", "-I.", "-Ihost_tools/libkmax", "-isystem", "/usr/include/eigen3", "-DKMAX_AXIS_COUNT=2",
         '-DKMAX_VERSION=""', "-fconstexpr-steps=100000000", "-Wno-pragma-once-outside-header", "-x", "c++-header"]


def is_library(include):
    """Of the standard library, whose headers have neither a folder nor a suffix, or in another library's folder. In kmax/
    are the headers of libkmax."""
    if include.quoted or include.target.startswith("kmax/"):
        return False
    return "/" in include.target or "." not in include.target


def precompiled(listed, text, *first):
    """The compiler's options that bring what `text` includes."""
    result = listed.with_suffix(".pch")
    listed.write_text(text)
    subprocess.run([*CLANG, *first, "-fpch-instantiate-templates", str(listed), "-o", str(result)], check=True,
                   cwd=ROOT)
    return "-include-pch", str(result)


def libraries_of(headers):
    names = {include.target for header in headers for include in includes(header.read_text()) if is_library(include)}
    return "".join(f"#include <{name}>\n" for name in sorted(names))


def place_of(include):
    return f"host_tools/libkmax/{include.target}" if include.target.startswith("kmax/") else include.target


@cache
def included_by(header):
    """All of this repository that a header includes, whether itself or through others."""
    path = ROOT / header
    own = {place_of(include) for include in includes(path.read_text()) if not is_library(include)} if path.is_file() else set()
    return own.union(*map(included_by, own))


def to_read(files):
    return sum(path.stat().st_size for path in (ROOT / file for file in files) if path.is_file())


@cache
def dear_one_of(header):
    """That of DEAR which the header includes and which leaves least of it to read; empty: none."""
    included = included_by(header)
    return min(["", *(dear for dear in DEAR if dear in included)],
               key=lambda dear: to_read(included - included_by(dear) - {dear} if dear else included))


def without_those_that_come_first(headers):
    """Those before which no other one has anything but what is precompiled."""
    firsts = set()
    for header in headers:
        others = [include for include in includes(header.read_text()) if not is_library(include)]
        if others and others[0].quoted:
            firsts.add(others[0].target)
    return [header for header in headers if str(header.relative_to(ROOT)) not in firsts]


class Lacking(Exception):
    """What the compiler says of a header."""


def compile_alone(header, first):
    """`header` after the options `first`. Raises Lacking, and CalledProcessError when the compiler itself fails."""
    done = subprocess.run([*CLANG, *first, "-fsyntax-only", header], capture_output=True, text=True, check=False, cwd=ROOT)
    if done.returncode < 0 or (done.returncode > 0 and not done.stderr):
        done.check_returncode()
    if done.stderr:
        raise Lacking(done.stderr)


class Check:
    """Of headers of this repository, each by itself but for what is precompiled."""

    def __init__(self, folder, headers, plain):
        self.folder, self.plain = folder, plain
        self.libraries = "" if plain else libraries_of(headers)
        self.made, self.lock = {}, RLock()

    def options(self, dear):
        """Those that bring what is precompiled, which is made when it is first needed. Empty `dear`: the libraries alone."""
        if self.plain:
            return ()
        with self.lock:
            if dear not in self.made:
                self.made[dear] = (precompiled(self.folder / Path(dear).name, f'#include "{dear}"\n', *self.options("")) if dear
                                   else precompiled(self.folder / "libraries.hpp", self.libraries))
            return self.made[dear]

    def message(self, header):
        """What it lacks; empty: nothing."""
        name = str(header.relative_to(ROOT))
        read = [name, *sorted(file for file in included_by(name) if (ROOT / file).is_file())]
        dear = dear_one_of(name)
        try:
            remembered(lambda: [Path(__file__).read_text(), self.libraries, dear, *read, *((ROOT / file).read_text() for file in read)],
                       lambda: compile_alone(name, self.options(dear)))
        except Lacking as lacking:
            return str(lacking)
        return ""


def main(folder, plain):
    folder = folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    headers = [header for floor in FLOORS for header in sorted((ROOT / floor).rglob("*.hpp"))]
    broken = folder / "broken.hpp"
    broken.write_text('#include "control/wall_law.hpp"\ninline kmax::firmware::Axis* nothing() { return nullptr; }\n')
    check = Check(folder, headers, plain)
    try:
        compile_alone(str(broken), check.options(""))
        sys.exit("the check itself is broken: it does not see what a header lacks")
    except Lacking as lacking:
        if "Axis" not in str(lacking):
            sys.exit(f"the check itself is broken: {lacking}")
    compiled = headers if plain else without_those_that_come_first(headers)
    with ThreadPoolExecutor(cpu_count()) as pool:
        messages = list(pool.map(check.message, compiled))
    forget_the_old()
    print("".join(messages), end="")
    print(f"{len(headers)} headers, {len(compiled)} of them looked at; {sum(map(bool, messages))} lack something")
    return any(messages)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3) or sys.argv[2:] not in ([], ["--plain"]):
        sys.exit(__doc__.split("\n\n")[1])
    sys.exit(main(Path(sys.argv[1]), len(sys.argv) == 3))
