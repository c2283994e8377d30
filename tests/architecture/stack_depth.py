#!/usr/bin/python3
"""Fails if the stack could grow beyond what linker.ld reserves: the deepest calls of the main loop, of each priority that
can interrupt it, and of the fault handler, all at once.

usage: stack_depth.py kmax-BOARD.elf

Read from the machine code: how deep the stack is at each instruction, on any path to it, and what is called there. The
vector table says which handlers there are, board/BOARD/priorities.hpp whom each of them can interrupt. Whatever
this cannot follow has to be stated below, or is a failure: calls through pointers, recursion, and whatever sets the stack
pointer to anything but a constant away from where it was. What is stated and not found is a failure too.
Prints a table for docs/image_size.md.
"""

import re
import struct
import sys
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from machine_code import demangled, disassembled, output_of, plain_name

ROOT = Path(__file__).resolve().parents[2]
BOARD = ROOT / "board"
PRIORITIES = "priorities.hpp"

# The registers that an exception saves, those of the FPU included, and the word that aligns them (PM0214).
EXCEPTION_FRAME = 26 * 4 + 4
UNEXPECTED, RESET, FAULT = "ISR_unexpected", "ISR_reset", "ISR_hard_fault"


@dataclass
class Stated:
    """What machine code alone does not say, by names in short."""
    # Through a pointer: by whom, and the beginning of the name of each function that it may be.
    indirect: dict = field(default_factory=dict)
    # How often a function that calls itself, by whatever way, can be entered again.
    entered_again: dict = field(default_factory=dict)
    # Set the stack pointer, and never return.
    sets_stack_pointer: set = field(default_factory=set)


FLASH = ["firmware::AnyFlashSectors::of"]
OF_THE_IMAGE = Stated(
    indirect={
        # The constructors of objects with static storage.
        "drivers::cortex_m::start": ["_GLOBAL__sub_I_"],
        # The three function pointers of any flash memory.
        "firmware::AnyFlashSectors::read": FLASH,
        "firmware::ParameterStore::write": FLASH,
        "firmware::ParameterKeeper::poll": FLASH,
        # Never to come back: the stack is the boot loader's then.
        "board::start_boot_loader": [],
        # What a link says of itself.
        "firmware::Readings::refresh_device": ["firmware::LinkReadings::LinkReadings"],
        # What std::any_of() and its like are given.
        "__gnu_cxx::__ops::_Iter_pred::operator": ["firmware::is_setting"],
    },
    entered_again={
        # A tagged request holds another one, which cannot be tagged: server.hpp.
        "firmware::modbus::Server::answer": 1,
    },
    sets_stack_pointer={
        # With less than 256 bytes left it begins again at the top, above what no longer matters.
        FAULT,
    })


class NotProven(Exception):
    pass


CONDITIONS = "eq|ne|cs|hs|cc|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le"
DATA = (".word", ".short", ".byte")


@dataclass
class Instruction:
    address: int
    mnemonic: str
    operands: str

    @cached_property
    def parts(self):
        """What it does without its condition, and whether it has one."""
        name = self.mnemonic.split(".")[0]
        # Not of those that end in the same letters, as `teq` and `mls`.
        match = re.fullmatch(rf"(b|bl|bx|blx|add|addw|sub|subw|mov|push|pop|vpush|vpop|ldr|ldrd|str|strd|"
                             rf"v?ldm\w*?|v?stm\w*?)({CONDITIONS})", name)
        return (match[1], True) if match else (name, False)

    @property
    def base(self):
        return self.parts[0]

    @property
    def conditional(self):
        return self.parts[1] or self.base in ("cbz", "cbnz")

    @property
    def target(self):
        """The address that a direct call or jump leads to, if it is one."""
        match = re.search(r"(?:^|, )([0-9a-f]+) <", self.operands)
        return int(match[1], 16) if match and self.base in ("b", "bl", "blx", "cbz", "cbnz") else None

    @property
    def is_switch(self):
        """Jumps within its function by a table that follows."""
        return (self.base in ("tbb", "tbh") or
                self.base == "ldr" and re.match(r"pc, \[r\d+, r\d+, lsl #2\]", self.operands) is not None)

    @property
    def indirect(self):
        """Calls, or ends in, a function whose address is in a register."""
        return (self.base in ("bx", "blx") and self.target is None and self.operands.split("\t")[0] != "lr" or
                self.base == "mov" and self.operands.startswith("pc, ") and not self.operands.startswith("pc, lr") or
                self.base == "ldr" and self.operands.startswith("pc, ") and "[sp]" not in self.operands and
                not self.is_switch)

    @property
    def ends(self):
        """Nothing follows it in its function."""
        if self.conditional:
            return False
        return (self.base in ("b", "bx", "udf") or self.is_switch or
                self.base in ("pop", "ldmia", "ldmdb") and re.search(r"\bpc}", self.operands) is not None or
                self.base in ("ldr", "mov") and self.operands.startswith("pc, "))

    @property
    def pushed(self):
        """Bytes by which the stack grows; None: by a number that no constant gives."""
        base, operands = self.base, self.operands
        size = 8 if re.search(r"\{d\d", operands) else 4
        saved = sum(1 if not last else int(last) - int(first) + 1
                    for first, last in re.findall(r"[rsd](\d+)-[rsd](\d+)|\b(?:[rsd]\d+|sl|fp|ip|sp|lr|pc)\b",
                                                  operands.partition("{")[2])) * size
        if base in ("push", "vpush") or re.match(r"v?stmdb", base) and operands.startswith("sp!"):
            return saved
        if base in ("pop", "vpop") or re.match(r"v?ldmia", base) and operands.startswith("sp!"):
            return -saved
        if match := re.search(r"\[sp\], #(-?\d+)", operands) or re.search(r"\[sp, #(-?\d+)\]!", operands):
            return -int(match[1])
        if match := re.match(r"sp, (?:sp, )?#(\d+)", operands):
            if base in ("sub", "subw"):
                return int(match[1])
            if base in ("add", "addw"):
                return -int(match[1])
        writes = (operands.startswith("sp!") or re.match(r"[mp]sp", operands) or
                  operands.startswith("sp,") and not re.match(r"v?stm|v?ldm|str|cmp|cmn|tst", base))
        return None if writes else 0


def instruction_of(line):
    address, _, text = line.partition(":")
    mnemonic, _, operands = text.strip().partition("\t")
    return Instruction(int(address, 16), mnemonic, operands.split("\t")[0])


@dataclass
class Function:
    name: str
    plain: str
    code: dict  # instructions by address, in their order
    calls: list = field(default_factory=list)  # (address of the function, depth of the stack there)
    indirect: int | None = None  # depth at its deepest call through a pointer
    frame: int = 0  # the deepest that it is by itself

    def follow(self, after, sets_stack_pointer):
        """Finds its depth at each instruction, the larger one where ways of different depth meet. `after`: the address
        behind its last byte, where another function begins."""
        addresses = list(self.code)
        # What fills up to where the next function begins; of zeros objdump makes a move of r0 to itself.
        while (self.code[addresses[-1]].base == "nop" or
               (self.code[addresses[-1]].base, self.code[addresses[-1]].operands) == ("movs", "r0, r0")):
            del self.code[addresses.pop()]
        following = dict(zip(addresses, [*addresses[1:], after]))
        depth, waiting = {}, [(addresses[0], 0)]
        switch = None
        while True:
            while waiting:
                address, here = waiting.pop()
                if address not in self.code:
                    self.calls.append((address, here))
                    continue
                if self.code[address].mnemonic in DATA or depth.get(address, -1) >= here:
                    continue
                depth[address] = here
                instruction = self.code[address]
                pushed = instruction.pushed
                if pushed is None:
                    if self.plain not in sets_stack_pointer:
                        raise NotProven(f"{self.plain}: the stack grows by a number that is not constant: "
                                        f"{instruction.mnemonic} {instruction.operands}")
                    pushed = 0
                then = max(here + pushed, here if instruction.conditional else 0, 0)
                if then > 1 << 16:
                    raise NotProven(f"{self.plain}: the stack grows in a loop: {instruction.mnemonic} "
                                    f"{instruction.operands}")
                self.frame = max(self.frame, then)
                if instruction.is_switch:
                    switch = max(switch or 0, here)
                elif instruction.indirect:
                    self.indirect = max(self.indirect or 0, here)
                elif instruction.target is not None:
                    calls = instruction.base in ("bl", "blx")
                    # The compiler's own library has calls within a function: those are jumps with a way back.
                    if calls and (instruction.target == addresses[0] or instruction.target not in self.code):
                        self.calls.append((instruction.target, here))
                    else:
                        waiting.append((instruction.target, then))
                    # The call of a function that never returns may be its caller's last instruction.
                    if calls and following[address] not in self.code:
                        continue
                if not instruction.ends:
                    waiting.append((following[address], then))
            # What only a switch reaches, or nothing: as deep as the switch, or as this function ever is.
            unreached = [address for address, instruction in self.code.items()
                         if address not in depth and instruction.mnemonic not in DATA]
            if not unreached:
                return
            waiting = [(unreached[0], self.frame if switch is None else switch)]


NOT_ENTERED = (0, [])


class Calls:
    """Who calls whom, and how deep the stack gets."""

    def __init__(self, functions, stated):
        """`functions`: (name, name in short, lines) of each, by ascending addresses."""
        self.stated = stated
        self.functions = {}
        for name, plain, lines in functions:
            # Of zeros that it leaves out objdump prints dots.
            code = {one.address: one for one in (instruction_of(line) for line in lines if line != "\t...")}
            self.functions[next(iter(code))] = Function(name, plain, code)
        self.problems = []
        self.pointed_at = set()  # by what is stated
        self._known = {}
        for function, after in zip(self.functions.values(), [*list(self.functions)[1:], 1 << 32]):
            try:
                function.follow(after, stated.sets_stack_pointer)
            except NotProven as problem:
                self.problems.append(str(problem))
        for place, function in self.functions.items():
            # A jump into the middle of another function, as in the compiler's own library, needs no more than all of it.
            function.calls = [(self.function_at(target), here) for target, here in function.calls]
        self.follow_pointers()
        plains = {function.plain for function in self.functions.values()}
        self.problems += [f"{name}: stated, but not in the image"
                          for name in sorted({*stated.entered_again, *stated.sets_stack_pointer} - plains)]

    def function_at(self, address):
        return max((place for place in self.functions if place <= address), default=None)

    def follow_pointers(self):
        callers = {function.plain: [] for function in self.functions.values() if function.indirect is not None}
        for function in self.functions.values():
            if function.indirect is None:
                continue
            if function.plain not in self.stated.indirect:
                self.problems.append(f"{function.plain}: calls through a pointer, and it is not stated what")
                continue
            callers[function.plain].append(function)
        for plain, beginnings in self.stated.indirect.items():
            if plain not in callers:
                self.problems.append(f"{plain}: stated as calling through a pointer, but it does not")
            for beginning in beginnings:
                targets = {place for place, one in self.functions.items() if one.plain.startswith(beginning)}
                if not targets:
                    self.problems.append(f"{plain}: stated as calling {beginning}, which is not in the image")
                self.pointed_at |= targets
                for function in callers.get(plain, []):
                    function.calls += [(place, function.indirect) for place in sorted(targets)]

    def addresses_among(self, data):
        """The functions whose addresses are stored, be it in `data` or among instructions."""
        words = set(data)
        for function in self.functions.values():
            words |= {int(one.operands.split()[0], 0) for one in function.code.values() if one.mnemonic == ".word"}
        return {place for place in self.functions if place + 1 in words}

    def deepest(self, place, entered=()):
        """(bytes, [(name, depth at its call of the next, or its own)]) from `place` on. `entered`: how often each of the
        functions that may be entered again has been."""
        function = self.functions[place]
        key = (place, entered)
        if key in self._known:
            if self._known[key] is None:
                self.problems.append(f"{function.plain}: calls itself, and it is not stated how often")
                return NOT_ENTERED
            return self._known[key]
        inner = entered
        if function.plain in self.stated.entered_again:
            times = dict(entered).get(place, 0)
            if times > self.stated.entered_again[function.plain]:
                return NOT_ENTERED
            inner = tuple(sorted({**dict(entered), place: times + 1}.items()))
        self._known[key] = None
        best = function.frame, [(function.plain, function.frame)]
        for callee, here in function.calls:
            below, path = self.deepest(callee, inner)
            if path and here + below > best[0]:
                best = here + below, [(function.plain, here), *path]
        self._known[key] = best
        return best


@dataclass
class Level:
    name: str
    bytes: int
    path: list


def levels_of(calls, handlers, priorities):
    """What can be on the stack at once: the main loop, one handler of each priority, a fault; the least urgent first."""
    named = {calls.functions[place].name: place for place in handlers}

    def level(name, places, frame):
        depth, path = max(map(calls.deepest, places))
        return Level(name, depth + frame, path)

    levels = [level("main loop", [named[RESET]], 0)]
    interrupts = {name.removeprefix("ISR_"): place for name, place in named.items()
                  if name not in (UNEXPECTED, RESET, FAULT)}
    calls.problems += [f"ISR_{name}: a handler whose priority {PRIORITIES} does not say"
                       for name in sorted(interrupts.keys() - priorities.keys())]
    for number in sorted({priorities[name] for name in interrupts.keys() & priorities.keys()}, reverse=True):
        places = [place for name, place in interrupts.items() if priorities.get(name) == number]
        levels.append(level(f"priority {number}", places, EXCEPTION_FRAME))
    return [*levels, level("fault", [named[FAULT], named[UNEXPECTED]], EXCEPTION_FRAME)]


def examined(functions, stated, vectors, data, priorities, reserved):
    """(levels, problems) of an image: `functions` as Calls has them, `vectors` the words of the vector table, `data` those
    of what is stored besides code, `priorities` a number for each handler's name, `reserved` bytes."""
    calls = Calls(functions, stated)
    handlers = {word & ~1 for word in vectors[1:] if word}
    levels = levels_of(calls, handlers, priorities)
    taken = calls.addresses_among(data) - handlers - calls.pointed_at
    calls.problems += [f"{calls.functions[place].plain}: its address is taken, and it is not stated where it is called"
                       for place in sorted(taken)]
    if (total := sum(one.bytes for one in levels)) > reserved:
        calls.problems.append(f"the stack can grow to {total} bytes, of which {reserved} are reserved: see linker.ld")
    return levels, list(dict.fromkeys(calls.problems))


def priorities_in(text):
    """By the interrupts' names: {Interrupt::NAME, LEVEL} and SystemException::NAME, LEVEL, where LEVEL = NUMBER."""
    numbers = {name: int(number) for name, number in re.findall(r"uint8_t (\w+) = (\d+);", text)}
    return {name: numbers[level] for name, level in re.findall(r"(?:Interrupt|SystemException)::(\w+), (\w+)[})]", text)}


def words_of(elf):
    """Of each section that is stored on the chip: its name and (address, word)."""
    data = elf.read_bytes()
    line = re.compile(r"^\s*\[ *\d+\] (\S+)\s+(\S+)\s+([0-9a-f]{8}) ([0-9a-f]+) ([0-9a-f]+) \S+\s+\S*A", re.M)
    for name, kind, address, offset, size in line.findall(output_of("arm-none-eabi-readelf", "-SW", str(elf))):
        if kind != "NOBITS":
            first = int(offset, 16)
            whole = data[first:first + int(size, 16) // 4 * 4]
            yield name, [word for word, in struct.iter_unpack("<I", whole)]


def table(levels, reserved):
    lines = ["| what runs | bytes | deepest calls, each with its bytes |", "|---|---:|---|"]
    for one in levels:
        path = [f"`{name}` {own}" for name, own in one.path]
        lines.append(f"| {one.name} | {one.bytes} | {', '.join(path)} |")
    total = sum(one.bytes for one in levels)
    lines += [f"| all at once | {total} | of {reserved} reserved |"]
    return "\n".join(lines)


def main(elf):
    listed = list(disassembled("-d", str(elf)))
    names = demangled([name for name, _ in listed])
    sections = dict(words_of(elf))
    data = {word for name, words in sections.items() if name not in (".vectors", ".text", ".boot", ".tick_code") for word in words}
    symbols = {name: int(address, 16) for address, _, name in
               map(str.split, output_of("arm-none-eabi-nm", "--defined-only", str(elf)).splitlines())}
    reserved = symbols["kmax_stack_top"] - symbols["kmax_stack_bottom"]
    levels, problems = examined([(name, plain_name(names[name]), lines) for name, lines in listed], OF_THE_IMAGE,
                                sections[".vectors"], data, priorities_in((BOARD / elf.stem.removeprefix("kmax-") / PRIORITIES).read_text()), reserved)
    problems += [f"{path.relative_to(ROOT)}: sets a priority that {PRIORITIES} does not say"
                 for path in sorted(BOARD.rglob("*.[ch]pp")) if path.name != PRIORITIES and "set_priority(" in path.read_text()]
    print(table(levels, reserved))
    for problem in problems:
        print(problem, file=sys.stderr)
    return 3 if problems else 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__.split("\n\n")[1])
    sys.exit(main(Path(sys.argv[1])))
