"""The image's machine code as the tests of it read it: functions with their instructions, and names in short."""

import re
import subprocess


def output_of(*command, given=None):
    return subprocess.run(command, check=True, capture_output=True, text=True, input=given).stdout


def as_jump(name, lines):
    """A step that the linker puts between where a jump is too far for the instruction, as the jump that it stands for."""
    far = re.fullmatch(r"__(.+)_veneer", name) and re.fullmatch(r"( *[0-9a-f]+:\t)ldr\.w\tpc, \[pc\].*", lines[0])
    word = far and re.search(r"\t\.word\t(0x[0-9a-f]+)", lines[1])
    return [f"{far[1]}b.w\t{int(word[1], 0) & ~1:x} <{name[2:-len('_veneer')]}>"] if word else lines


def functions_in(disassembly):
    """(name, lines as objdump prints them, each with its address) of each function."""
    for part in disassembly.split("\n\n"):
        heading, *lines = part.strip("\n").split("\n")
        if name := re.fullmatch(r"[0-9a-f]+ <(.+)>:", heading):
            yield name[1], as_jump(name[1], lines)


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
