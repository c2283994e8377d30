#!/usr/bin/python3
"""Fails if a function that the tick calls is not the same machine code in every object that emits it.

usage: link_order.py kmax-BOARD.elf        beside it the linker's map, kmax-BOARD.map

Of an inline function that several files emit, the linker takes the first one it meets. Compiled with other options, or
among other callers, another file's copy may be slower: then the tick's speed would depend on the order of the sources.
"""

import re
import sys
from pathlib import Path

from machine_code import demangled, disassembled


def place_free(lines):
    """Without addresses and the names that objdump gives to where a branch leads before it is linked; the relocation says
    where."""
    return [re.sub(r"<[^>]*>", "", line.split(":", 1)[-1].strip()) for line in lines]


def called_from(calls, root):
    reached, waiting = set(), [root]
    while waiting:
        name = waiting.pop()
        if name not in reached:
            reached.add(name)
            waiting += calls.get(name, ())
    return reached


def main(elf):
    calls = {name: {target[1] for line in lines if (target := re.search(r"\bb\S*\s+[0-9a-f]+ <([^>+]+)>", line))}
             for name, lines in disassembled("-d", str(elf))}
    plain = demangled(calls)
    tick = f"board::{elf.stem.removeprefix('kmax-')}::ISR_tick"
    roots = [name for name, known_as in plain.items() if tick in known_as]
    assert len(roots) == 1, f"{tick}: {roots}"
    reached = called_from(calls, roots[0])
    copies = {}
    linked = re.findall(r"^LOAD (\S+)$", elf.with_suffix(".map").read_text(), re.M)
    for path in {elf.parent / name for name in linked if not name.startswith("/")}:
        for name, lines in disassembled("-dr", str(path)):
            # Not the start-up code's own section, nor what a file keeps to itself: a symbol that is mangled, and whole.
            if name in reached and name.startswith("_Z") and "." not in name:
                copies.setdefault(name, []).append(place_free(lines))
    several = {name: of_files for name, of_files in copies.items() if len(of_files) > 1}
    different = [name for name, of_files in several.items() if any(one != of_files[0] for one in of_files)]
    print(f"{len(reached)} functions in the tick, {len(several)} of them emitted by several files")
    for name in different:
        print(f"  not the same everywhere: {plain[name]}")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
