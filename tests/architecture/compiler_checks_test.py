"""What compilers said is asked again as soon as anything differs, and nothing doubtful is kept."""

import os
import sys
import tempfile
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))

import compiler_checks  # noqa: E402


class CompilerChecks(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(setattr, compiler_checks, "FOLDER", compiler_checks.FOLDER)
        compiler_checks.FOLDER = Path(folder.name) / "made" / "when_needed"
        self.addCleanup(os.environ.update, {name: os.environ[name] for name in ["KMAX_TEST_ALL"] if name in os.environ})
        os.environ.pop("KMAX_TEST_ALL", None)
        self.asked = 0

    def ask(self, *texts, answer=("found", 1)):
        def check():
            self.asked += 1
            if isinstance(answer, Exception):
                raise answer
            return list(answer)
        return compiler_checks.remembered(lambda: texts, check)

    def test_the_same_is_asked_once(self):
        self.assertEqual(self.ask("a", "b"), ["found", 1])
        self.assertEqual(self.ask("a", "b", answer=("other",)), ["found", 1])
        self.assertEqual(self.asked, 1)

    def test_what_differs_is_asked(self):
        for texts in (["a", "b"], ["ab"], ["ab", ""], ["", "ab"], ["a", "b", ""], ["a", "b "], ["b", "a"], ["a\u00e9"], []):
            self.ask(*texts)
        self.assertEqual(self.asked, 9)

    def test_another_way_of_remembering_or_another_package_is_asked(self):
        self.ask("a")
        unchanging = compiler_checks.unchanging
        self.addCleanup(setattr, compiler_checks, "unchanging", unchanging)
        compiler_checks.unchanging = lambda: unchanging() + b"clang 99"
        self.ask("a")
        self.assertEqual(self.asked, 2)

    def test_what_fails_or_changes_meanwhile_is_not_kept(self):
        for _ in range(2):
            with self.assertRaises(ValueError):
                self.ask("a", answer=ValueError("killed"))
        self.assertEqual(self.asked, 2)
        texts = ["before"]

        def check():
            texts[0] = "meanwhile"
            return []
        compiler_checks.remembered(lambda: texts, check)
        self.ask("before")
        self.ask("meanwhile")
        self.assertEqual(self.asked, 4)

    def test_a_damaged_file_is_asked_again_and_mended(self):
        self.ask("a")
        for file in compiler_checks.FOLDER.iterdir():
            file.write_text("")
        self.ask("a")
        self.ask("a")
        self.assertEqual(self.asked, 2)

    def test_all_are_asked_when_all_are_wanted(self):
        self.ask("a")
        os.environ["KMAX_TEST_ALL"] = "1"
        self.addCleanup(os.environ.pop, "KMAX_TEST_ALL")
        self.ask("a")
        self.assertEqual(self.asked, 2)

    def test_what_nobody_asked_for_in_a_month_is_forgotten(self):
        self.ask("old")
        long_ago = time.time() - compiler_checks.MONTH - 60
        os.utime(next(compiler_checks.FOLDER.iterdir()), (long_ago, long_ago))
        compiler_checks.forget_the_old()
        self.assertEqual(list(compiler_checks.FOLDER.iterdir()), [])
        self.ask("used")
        os.utime(next(compiler_checks.FOLDER.iterdir()), (long_ago, long_ago))
        self.ask("used")
        compiler_checks.forget_the_old()
        self.ask("used")
        self.assertEqual(self.asked, 2)


if __name__ == "__main__":
    unittest.main()
