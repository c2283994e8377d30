"""scripts/mutate tells killed from survived, on a made-up header and its test.

usage: tests/architecture/mutate_test.py
"""

import json
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "mutate"
HEADER = """#pragma once
static_assert(1 + 1 == 2);  // 3 < 4
inline bool below(int of) { return of < 10; }
inline int unasked(int of) { return of - 1; }
inline unsigned long counted(unsigned long to) {
  unsigned long all = 0;
  while (all != to) ++all;
  return all;
}
inline constexpr int room[2] = {3, 4};
inline int lesser(int a, int b) { return a < b ? a : b; }
"""
TEST = """#include "control/made_up.hpp"
#include <gtest/gtest.h>
TEST(MadeUp, IsRight) {
  EXPECT_TRUE(below(9));
  EXPECT_FALSE(below(10));
  EXPECT_EQ(counted(3), 3UL);
  EXPECT_EQ(room[0], 3);
}
"""
# Line, change: verdict. What hangs is killed by its time-out.
EXPECTED = {("3", "< -> <="): "killed", ("3", "10 -> 11"): "killed", ("4", "- -> +"): "survived", ("4", "1 -> 2"): "survived",
            ("6", "0 -> 1"): "survived", ("7", "!= -> =="): "killed", ("7", "++ -> --"): "killed",
            ("11", "< -> <="): "equivalent", ("10", "2 -> 3"): "survived", ("10", "3 -> 4"): "killed", ("10", "4 -> 5"): "survived"}


class Mutate(unittest.TestCase):
    def test_verdicts(self):
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            for name, text in {"control/made_up.hpp": HEADER, "tests/control/made_up_test.cpp": TEST}.items():
                (root / name).parent.mkdir(parents=True)
                (root / name).write_text(text)
            test = str(root / "tests/control/made_up_test.cpp")
            entries = [{"file": test, "command": f"/usr/bin/c++ -I{root} -std=c++20 -Wall -Werror -o CMakeFiles/{target}.dir/a.o -c {test}"}
                       for target in ("control_tests",)]
            (root / "build/native").mkdir(parents=True)
            (root / "build/native/compile_commands.json").write_text(json.dumps(entries))
            (root / "scripts").mkdir()
            shutil.copy(SCRIPT, root / "scripts")
            command = [str(root / "scripts" / "mutate"), "--count", "100"]
            done = subprocess.run([*command, "control"], capture_output=True, text=True, check=False)
            found = {(line.split(":")[1], line.split(": ")[1].split("   ")[0]): line[:16].strip()
                     for line in done.stdout.splitlines() if "made_up.hpp:" in line}
            self.assertEqual(found, EXPECTED, done.stdout + done.stderr)
            self.assertEqual(done.returncode, 1)
            done = subprocess.run([*command, "control/made_up.hpp:3"], capture_output=True, text=True, check=False)
            self.assertIn("2 of 2 killed, 100.0 %, 2 of them by their own tests", done.stdout)
            self.assertEqual(done.returncode, 0)
            self.assertEqual((root / "control/made_up.hpp").read_text(), HEADER)
            (root / "tests/control/made_up_test.cpp").write_text(TEST.replace("counted(3), 3UL", "counted(3), 4UL"))
            done = subprocess.run([*command, "control"], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 2)
            self.assertIn("does not pass without any mutant", done.stderr)


if __name__ == "__main__":
    unittest.main()
