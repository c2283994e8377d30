"""The image's machine code as the tests of it read it: functions with their instructions, and names in short."""

import re
import subprocess


def output_of(*command, given=None):
    return subprocess.run(command, check=True, capture_output=True, text=True, input=given).stdout


def functions_in(disassembly):
    """(name, lines as objdump prints them, each with its address) of each function."""
    for part in disassembly.split("\n\n"):
        heading, *lines = part.strip("\n").split("\n")
        if name := re.fullmatch(r"[0-9a-f]+ <(.+)>:", heading):
            yield name[1], lines


def disassembled(*arguments):
    return functions_in(output_of("arm-none-eabi-objdump", "--no-show-raw-insn", *arguments))


def demangled(names):
    """As c++filt shows each of them."""
    return dict(zip(names, output_of("arm-none-eabi-c++filt", given="\n".join(names)).splitlines()))


def plain_name(name):
    """Without arguments, template arguments and return type; each of these may hold brackets of its own."""
    name = name.replace("(anonymous namespace)::", "")
    while (shorter := re.sub(r"<[^<>]*>", "", name)) != name:
        name = shorter
    return name.split("(")[0].split(" ")[-1].removeprefix("kmax::")
