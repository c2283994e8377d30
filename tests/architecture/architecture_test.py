"""The rules of the house that a compiler does not see. Each rule says what it found and tries itself on bad examples.

usage: tests/architecture/architecture_test.py [-v] [TEST...]          as unittest has it

A rule is a function of the tree, path -> text, that yields (what, why): the file or class that breaks it, and how.
EXCEPTIONS names what breaks a rule today and is known. It may only shrink: an exception that is no longer needed
fails the test too.
"""

import re
import sys
import unittest
from collections import defaultdict
from pathlib import Path

from source_text import classes, classes_with_members_defined, includes, without_comments

ROOT = Path(__file__).resolve().parents[2]

# The floors from the bottom, and what each may include besides itself.
FLOORS = {
    "control": [],
    "drivers": [],
    "firmware": ["control", "drivers"],
    "board": ["control", "drivers", "firmware"],
    "host_tools": ["control", "drivers", "firmware", "board"],
    "tests": ["control", "drivers", "firmware", "board", "host_tools"],
}
# The folders of a floor from the bottom: each may include what stands in a row above its own. A folder within one
# of these belongs to it unless it has a place of its own.
FOLDERS = {
    "firmware": [
        ["exchange", "object_dictionary"],
        ["board_interface"],
        ["parameters", "capture"],
        ["canopen", "modbus", "usb"],
        ["drive"],
        ["command"],
        ["links"],
        [""],
    ],
    "host_tools": [
        ["base"],
        ["plot", "report", "lines", "simulation", "usb"],
        ["flash", "wall", "device"],
        ["description", "record", "check", "bench", "simulated_board"],
        ["device/sim", "serve", "calibration", "selftest", "json"],
        ["experiment"],
        ["bring_up", "view"],
        ["virtual_board", "kmax"],
        ["libkmax"],
    ],
}
# What a file defines stands in the namespace of its folder on the floor of the host tools, and of its floor on the others,
# or in one of these.
NAMESPACES = {
    "board/stm32f405/tick_code.cpp": ["kmax::board", "kmax::drivers"],  # the tick's drivers once more, for its memory
    "host_tools/kmax/": ["kmax::cli"],
    "host_tools/libkmax/": ["kmax::library", "kmax"],  # what users write is short
}
# Standard headers whose contents need a heap, an operating system or libm.
NOT_ON_THE_DEVICE = set("""
    any chrono cmath complex condition_variable cstdio cstdlib deque exception filesystem format fstream functional
    future iomanip iostream istream list locale map math.h memory mutex ostream queue random regex set shared_mutex
    sstream stdexcept stdio.h stdlib.h string thread unordered_map unordered_set vector""".split())
NAMES_THAT_SAY_NOTHING = {"common", "helper", "helpers", "manager", "managers", "misc", "util", "utils"}
# One class, one reason to change: what a reader can keep in mind. Overloads, constructors and operators are not counted.
MOST_DATA_MEMBERS, MOST_PUBLIC_FUNCTIONS, MOST_FILES_OF_A_CLASS = 24, 22, 2

EXCEPTIONS = {
    "class_in_one_place": {"kmax::virtual_board::Row"},
    "class_size": {"CoupledHandle", "Processor"},
    "using_namespace": {
        "board/odrive_v3/main.cpp",
        "firmware/object_dictionary/axis_groups.hpp",
        "host_tools/device/drive.cpp",
        "host_tools/virtual_board/cortex_m/core_peripherals.cpp",
        "host_tools/virtual_board/cortex_m/system_control.cpp",
        "host_tools/virtual_board/cortex_m/system_tick.cpp",
        "host_tools/virtual_board/run/main.cpp",
        "host_tools/virtual_board/stm32f4/can_controller.cpp",
        "host_tools/virtual_board/stm32f4/can_filters.cpp",
    },
}


def product(tree):
    return {path: text for path, text in tree.items() if not path.startswith("tests/")}


def headers(tree):
    return {path: text for path, text in tree.items() if path.endswith(".hpp")}


def floors(tree):
    """Includes go down the floors; the device has no heap, no operating system and no libm; only boards know chips."""
    for path, text in tree.items():
        floor = path.split("/")[0]
        native = path.startswith("board/native/")
        on_device = floor in ("control", "drivers", "firmware", "board") and not native
        for include in includes(text):
            place = f"{path}:{include.line}"
            target = include.target.split("/")[0]
            if not include.quoted:
                if on_device and include.target in NOT_ON_THE_DEVICE:
                    yield place, f"<{include.target}> is not for the device"
            elif target not in FLOORS:
                yield place, f'"{include.target}" does not start from the root of the repository'
            elif target != floor and target not in FLOORS[floor]:
                yield place, f'"{include.target}" goes up the floors'
            elif (floor == "firmware" or native) and re.match(r"drivers/(stm32|cortex)", include.target):
                yield place, f'"{include.target}": {"the native board has" if native else "the firmware knows"} no chip'
            elif include.target not in tree and not (ROOT / include.target).is_file():
                yield place, f'"{include.target}" is not there'


def folder_order(tree):
    """The folders of a floor use each other in one direction, so there is no cycle between them."""
    rows = {floor: {folder: row for row, folders in enumerate(order) for folder in folders}
            for floor, order in FOLDERS.items()}

    def folder_of(path, floor):
        parts = path.split("/")[1:-1]
        return next((name for name in ("/".join(parts[:n]) for n in range(len(parts), 0, -1)) if name in rows[floor]),
                    "/".join(parts))

    found = defaultdict(list)
    for path, text in tree.items():
        floor = path.split("/")[0]
        if floor not in rows:
            continue
        folder, row_of = folder_of(path, floor), rows[floor]
        if folder not in row_of:
            found[f"{floor}: {folder}"].append(f"{path} lies in no folder that FOLDERS places")
            continue
        for include in includes(text):
            if not include.quoted or include.target.split("/")[0] != floor:
                continue
            used = folder_of(include.target, floor)
            if used != folder and row_of.get(used, len(row_of)) >= row_of[folder]:
                found[f"{floor}: {folder} -> {used}"].append(f"{path}:{include.line} includes {include.target}")
    for what, places in found.items():
        yield what, "; ".join(places)


def pragma_once(tree):
    """A header is read once."""
    for path, text in headers(tree).items():
        if "#pragma once" not in text.splitlines():
            yield path, "has no #pragma once"


def class_in_one_place(tree):
    """The members of a class are defined in its header and in few source files beside it."""
    places = defaultdict(set)
    for path, text in product(tree).items():
        if path.endswith(".cpp"):
            for name in classes_with_members_defined(text):
                places["::".join(name)].add(path)
    for name, files in places.items():
        if len(files) > MOST_FILES_OF_A_CLASS:
            yield name, f"is defined in {len(files)} files: {', '.join(sorted(files))}"


def class_size(tree):
    """A class has one reason to change."""
    for path, text in product(tree).items():
        for one in classes(text):
            if len(one.data) > MOST_DATA_MEMBERS:
                yield one.name, f"{path}:{one.line} has {len(one.data)} data members; {MOST_DATA_MEMBERS} are the most"
            if len(one.public_functions) > MOST_PUBLIC_FUNCTIONS:
                yield one.name, (f"{path}:{one.line} has {len(one.public_functions)} public functions; "
                                 f"{MOST_PUBLIC_FUNCTIONS} are the most")


def friends(tree):
    """No class opens itself to another. An operator of its own is no other."""
    for path, text in product(tree).items():
        for number, line in enumerate(without_comments(text).splitlines(), 1):
            if re.match(r"\s*friend\b(?!.*\boperator\W)", line):
                yield path, f"{path}:{number}: {' '.join(line.split())}"


def using_namespace(tree):
    """Nobody imports all names of a namespace into a whole file, and with it into every file of a unity build."""
    for path, text in product(tree).items():
        for number, line in enumerate(without_comments(text).splitlines(), 1):
            if re.match(r"using namespace (?!.*literals;)", line):
                yield path, f"{path}:{number}: {line}"


def telling_names(tree):
    """A folder's and a file's name say what is in it."""
    for path in tree:
        for part in Path(path).parts:
            if not NAMES_THAT_SAY_NOTHING.isdisjoint(Path(part).stem.split("_")):
                yield path, f"'{part}' says nothing"


def whole_phrases(tree):
    """A text is not left as the formatter broke it when a word was put in: a few letters alone between two full lines."""
    scrap, literal = re.compile(r'\s*"[^"]{1,19}"$'), re.compile(r'\s*"')
    remark = re.compile(r"(\s*///?)(\s+)(\S.*)$")
    for path, text in tree.items():
        lines = text.splitlines()
        for number, (before, line, after) in enumerate(zip(lines, lines[1:], lines[2:]), 2):
            if scrap.match(line) and literal.match(before) and literal.match(after) and "\\n" not in before + line:
                yield path, f"{path}:{number}: {line.strip()} alone"
            one, short, hanging = remark.match(before), remark.match(line), remark.match(after)
            # Of a list or of a table's row; what follows prose at a deeper place is a formula.
            if (one and short and hanging and re.search(r"^[-*] |\S {2}", one[3]) and len(before) >= 92 and len(short[3]) < 20
                    and len(hanging[2]) > len(short[2]) == len(one[2])):
                yield path, f"{path}:{number}: {line.strip()} alone"


def namespaces(tree):
    """A reader who has a name's namespace has its folder, and the other way round."""
    for path, text in product(tree).items():
        floor, folder = path.split("/")[:2]
        allowed = next((spaces for place, spaces in NAMESPACES.items() if path.startswith(place)),
                       [f"kmax::{folder if floor == 'host_tools' else floor}"])
        for number, line in enumerate(text.splitlines(), 1):
            opened = re.match(r"namespace (kmax[\w:]*) \{", line)
            if opened and not any(opened[1] == space or (opened[1].startswith(space + "::") and space != "kmax")
                                  for space in allowed):
                yield path, f"{path}:{number}: {opened[1]} is not in {' or '.join(allowed)}"


def test_namespaces(tree):
    """What a test file defines stands in a namespace of the file's name: a unity build compiles several as one."""
    for path, text in tree.items():
        if not path.startswith("tests/") or not path.endswith("_test.cpp") or not re.search(r"^TEST|^RC_GTEST", text, re.M):
            continue
        namespaces = re.findall(r"^namespace ([\w:]+) \{", text, re.M)
        if not any(name.split("::")[-1] == Path(path).stem for name in namespaces):
            yield path, f"has no namespace that ends in {Path(path).stem}"


RULES = [floors, folder_order, pragma_once, class_in_one_place, class_size, friends, using_namespace, telling_names,
         whole_phrases, namespaces, test_namespaces]


def repository():
    tree = {}
    for floor in FLOORS:
        for path in sorted((ROOT / floor).rglob("*.[ch]pp")):
            tree[path.relative_to(ROOT).as_posix()] = path.read_text()
    return tree


class Rules(unittest.TestCase):
    """Every rule on every file."""

    maxDiff = None

    def test_the_sources_are_found(self):
        self.assertGreater(len(repository()), 500, ROOT)

    def test_every_rule(self):
        tree = repository()
        for rule in RULES:
            known = EXCEPTIONS.get(rule.__name__, set())
            found = defaultdict(list)
            for what, why in rule(tree):
                found[what].append(why)
            print(f"{rule.__name__}: {len(found)} found, {len(known)} known. {rule.__doc__}", file=sys.stderr)
            for what, reasons in sorted(found.items()):
                for why in reasons:
                    print(f"  {'known: ' if what in known else ''}{what}: {why}", file=sys.stderr)
            with self.subTest(rule.__name__):
                self.assertEqual(sorted(found.keys() - known), [], f"break the rule: {rule.__doc__}")
                self.assertEqual(sorted(known - found.keys()), [], "are exceptions no longer: take them out of EXCEPTIONS")


class EachRuleSees(unittest.TestCase):
    """A rule that sees nothing keeps nothing."""

    def found(self, rule, path, text, **others):
        return [what for what, _ in rule({path: text, **others})]

    def good(self, rule, path, text, **others):
        self.assertEqual(self.found(rule, path, text, **others), [], text)

    def bad(self, rule, path, text, **others):
        self.assertNotEqual(self.found(rule, path, text, **others), [], text)

    def test_floors(self):
        present = {"control/b.hpp": "", "firmware/b.hpp": "", "drivers/b.hpp": "", "board/b.hpp": "",
                   "drivers/stm32f4/usart.hpp": "", "host_tools/b.hpp": "", "tests/b.hpp": ""}
        self.good(floors, "firmware/a.hpp", '#include "control/b.hpp"', **present)
        self.good(floors, "control/a.hpp", '// #include "firmware/b.hpp"', **present)
        self.good(floors, "tests/control/a_test.cpp", "#include <cmath>")
        self.good(floors, "board/odrive_v3/a.hpp", '#include "drivers/stm32f4/usart.hpp"', **present)
        for path, target in [
                ("control/a.hpp", '"firmware/b.hpp"'), ("drivers/a.hpp", '"control/b.hpp"'),
                ("firmware/a.cpp", '"board/b.hpp"'), ("firmware/a.cpp", '"drivers/stm32f4/usart.hpp"'),
                ("board/native/a.hpp", '"host_tools/b.hpp"'), ("board/native/a.hpp", '"drivers/stm32f4/usart.hpp"'),
                ("host_tools/a.hpp", '"tests/b.hpp"'), ("control/a.hpp", '"b.hpp"'),
                ("control/a.hpp", '"../firmware/b.hpp"'), ("firmware/a.hpp", '"control/not_there.hpp"'),
                ("firmware/a.hpp", "<vector>"), ("control/a.hpp", "<cmath>")]:
            for directive in "#include", "  #  include":
                self.bad(floors, path, f"{directive} {target}", **present)

    def test_folder_order(self):
        self.good(folder_order, "host_tools/device/can/a.hpp", '#include "host_tools/base/b.hpp"')
        self.good(folder_order, "host_tools/device/sim/a.hpp", '#include "host_tools/simulated_board/b.hpp"')
        self.bad(folder_order, "host_tools/base/a.hpp", '#include "host_tools/device/b.hpp"')
        self.bad(folder_order, "host_tools/device/a.hpp", '#include "host_tools/device/sim/b.hpp"')
        self.bad(folder_order, "host_tools/plot/a.hpp", '#include "host_tools/report/b.hpp"')
        self.bad(folder_order, "host_tools/new_folder/a.hpp", "")
        self.good(folder_order, "firmware/application.hpp", '#include "firmware/links/b.hpp"')
        self.bad(folder_order, "firmware/drive/a.hpp", '#include "firmware/command/b.hpp"')
        self.bad(folder_order, "firmware/drive/a.hpp", '#include "firmware/application.hpp"')

    def test_pragma_once(self):
        self.good(pragma_once, "control/a.hpp", "#pragma once\n")
        self.bad(pragma_once, "control/a.hpp", "// #pragma once\n")

    def test_class_in_one_place(self):
        define = "namespace kmax {\nint A::f() {\n}\n}  // namespace kmax\n"
        other = "namespace kmax::other {\nA::A(int x) : x_(x) {}\n}\n"
        self.good(class_in_one_place, "firmware/a.cpp", define, **{"firmware/b.cpp": define, "firmware/c.cpp": other})
        self.bad(class_in_one_place, "firmware/a.cpp", define, **{"firmware/b.cpp": define, "firmware/c.cpp": define})

    def test_class_size(self):
        def of(data, functions):
            return "class A {\n public:\n  A();\n" + "".join(f"  int f{n}(int x) const {{ return x; }}\n" for n in range(functions)) + \
                   " private:\n" + "".join(f"  std::array<int, 3> x{n}_{{}};  // it's {{\n" for n in range(data)) + "};\n"
        self.good(class_size, "firmware/a.hpp", of(MOST_DATA_MEMBERS, MOST_PUBLIC_FUNCTIONS))
        self.bad(class_size, "firmware/a.hpp", of(MOST_DATA_MEMBERS + 1, 0))
        self.bad(class_size, "firmware/a.hpp", of(0, MOST_PUBLIC_FUNCTIONS + 1))
        self.good(class_size, "firmware/a.hpp", of(0, MOST_PUBLIC_FUNCTIONS) + of(0, MOST_PUBLIC_FUNCTIONS))

    def test_friends(self):
        self.good(friends, "firmware/a.hpp", "class A {\n  friend constexpr bool operator==(A, A) = default;\n};")
        self.bad(friends, "firmware/a.hpp", "class A {\n  friend class B;\n};")

    def test_using_namespace(self):
        self.good(using_namespace, "firmware/a.cpp", "void f() {\n  using namespace std;\n}\n")
        self.good(using_namespace, "host_tools/a.cpp", "using namespace std::chrono_literals;\n")
        self.bad(using_namespace, "firmware/a.cpp", "namespace kmax {\nusing namespace drivers::stm32f4;\n}\n")

    def test_telling_names(self):
        self.good(telling_names, "host_tools/base/units.hpp", "")
        self.bad(telling_names, "host_tools/utils/units.hpp", "")
        self.bad(telling_names, "firmware/axis_manager.hpp", "")

    def test_whole_phrases(self):
        full = '  "' + 90 * "a" + ' "\n'
        self.good(whole_phrases, "control/a.cpp", full + full + '  "b");\n')
        self.bad(whole_phrases, "control/a.cpp", full + '  "may "\n' + full)
        self.good(whole_phrases, "control/a.cpp", "// - " + 90 * "a" + "\n//   was\n//   b\n")
        self.good(whole_phrases, "control/a.cpp", "// " + 95 * "a" + "\n// was\n//   b = c\n")
        self.bad(whole_phrases, "control/a.cpp", "//   * " + 90 * "a" + "\n//   was\n//     b\n")

    def test_namespaces(self):
        self.good(namespaces, "host_tools/device/can/a.hpp", "namespace kmax::device {\n")
        self.good(namespaces, "firmware/canopen/a.hpp", "namespace kmax::firmware::canopen {\n")
        self.good(namespaces, "host_tools/kmax/a.hpp", "namespace kmax::cli {\n")
        self.bad(namespaces, "host_tools/base/a.hpp", "namespace kmax::device {\n")
        self.bad(namespaces, "host_tools/base/a.hpp", "namespace kmax {\n")
        self.bad(namespaces, "host_tools/libkmax/a.hpp", "namespace kmax::device {\n")
        self.bad(namespaces, "control/a.hpp", "namespace kmax::firmware {\n")

    def test_test_namespaces(self):
        self.good(test_namespaces, "tests/a/b_test.cpp", "namespace kmax::a::b_test {\nTEST(A, B) {}\n}\n")
        self.bad(test_namespaces, "tests/a/b_test.cpp", "namespace kmax::a {\nTEST(A, B) {}\n}\n")


if __name__ == "__main__":
    unittest.main()
