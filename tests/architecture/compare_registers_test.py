"""scripts/compare_registers tells registers that are the same from those that are not, on a made-up vendor's file.

usage: tests/architecture/compare_registers_test.py
"""

import subprocess
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "compare_registers"
# Field of the independent watchdog: (register, offset of it, name, bit, width).
WATCHDOG = [("KR", 0x0, "KEY", 0, 16), ("PR", 0x4, "PR", 0, 3), ("RLR", 0x8, "RL", 0, 12), ("SR", 0xC, "RVU", 1, 1),
            ("SR", 0xC, "PVU", 0, 1)]


def svd(rows, base=0x4000_3000):
    registers = {}
    for register, offset, *field in rows:
        registers.setdefault((register, offset), []).append(field)
    text = "".join(
        f"<register><name>{name}</name><addressOffset>{offset:#x}</addressOffset><fields>" + "".join(
            f"<field><name>{field}</name><bitOffset>{bit}</bitOffset><bitWidth>{width}</bitWidth></field>"
            for field, bit, width in fields) + "</fields></register>" for (name, offset), fields in registers.items())
    return (f"<device><peripherals><peripheral><name>IWDG</name><baseAddress>{base:#x}</baseAddress>"
            f"<registers>{text}</registers></peripheral></peripherals></device>")


class CompareRegisters(unittest.TestCase):
    def compare(self, text, *options):
        with tempfile.NamedTemporaryFile("w", suffix=".svd") as file:
            file.write(text)
            file.flush()
            return subprocess.run([SCRIPT, file.name, *options], capture_output=True, text=True, check=False)

    def test_what_is_the_same_is_listed_with_both_names(self):
        done = self.compare(svd(WATCHDOG), "--list")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("| iwdg_rlr::Reload | 0x00000FFF | IWDG.RLR: RL |", done.stdout)
        self.assertIn("| iwdg_base | 0x40003000 |", done.stdout)
        self.assertRegex(done.stderr, r"^9 the same, 0 differ")

    def differs(self, ours, rows, **base):
        done = self.compare(svd(rows, **base))
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertIn(ours, done.stderr)

    def test_a_bit_of_width_or_place_an_offset_and_a_base_that_differ_are_named(self):
        self.differs("iwdg_rlr::Reload", [*WATCHDOG[:2], ("RLR", 0x8, "RL", 0, 13), *WATCHDOG[3:]])
        self.differs("iwdg_pr::", [WATCHDOG[0], ("PR", 0x4, "PR", 1, 3), *WATCHDOG[2:]])
        self.differs("IwdgRegisters::rlr", [*WATCHDOG[:2], ("RLR", 0x18, "RL", 0, 12), *WATCHDOG[3:]])
        self.differs("iwdg_base", WATCHDOG, base=0x4000_3400)

    def test_what_cannot_be_compared_is_no_success(self):
        self.assertEqual(self.compare("<device/>").returncode, 1)
        done = self.compare("no XML")
        self.assertEqual(done.returncode, 2)
        self.assertIn("an SVD file is XML", done.stderr)


if __name__ == "__main__":
    unittest.main()
