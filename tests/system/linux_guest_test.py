"""scripts/linux_guest: what goes into the guest, what comes out of it, and what it must not touch."""

import json
import os
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts" / "linux_guest"


def guest(*arguments, cwd=ROOT, timeout=600, **options):
    return subprocess.run([str(SCRIPT), *arguments], cwd=cwd, capture_output=True, text=True, timeout=timeout,
                          check=False, **options)


class Command(unittest.TestCase):
    def test_what_goes_in_arrives_unchanged_and_what_comes_out_comes_whole(self):
        value = "x \"$HOME\"' y"
        odd = ["a b", "", "*", "$HOME", "it's", "two\nlines", "\\", "ä"]
        report = """
import json, os, sys
print(json.dumps([sys.argv[1:], dict(os.environ), os.getcwd(), sys.stdin.read()]))
print("err", file=sys.stderr)
for number in range(200000): print(number)
sys.exit(37)"""
        done = guest("--env", f"ODD={value}", "--", "python3", "-c", report, *odd, cwd=ROOT / "docs",
                     input="not handed on", env={**os.environ, "NOT_GIVEN": "1"})
        first, *rest = done.stdout.splitlines()
        arguments, variables, folder, standard_input = json.loads(first)
        self.assertEqual((done.returncode, done.stderr), (37, "err\n"))
        self.assertEqual(arguments, odd)
        self.assertEqual(variables["ODD"], value)
        self.assertLessEqual({"PATH", "HOME", "KMAX_TEST_CAN", "KMAX_TEST_GPIO"}, set(variables))
        self.assertNotIn("NOT_GIVEN", variables)
        self.assertEqual(folder, str(ROOT / "docs"))
        self.assertEqual(standard_input, "")
        self.assertEqual(rest, [str(number) for number in range(200000)])

    def test_output_comes_while_the_command_runs(self):
        with subprocess.Popen([str(SCRIPT), "--", "bash", "-c", "echo first; sleep 1000"], cwd=ROOT,
                              stdout=subprocess.PIPE, text=True) as process:
            self.addCleanup(process.terminate)
            self.assertEqual(process.stdout.readline(), "first\n")
            process.terminate()

    def test_a_program_that_is_not_there(self):
        done = guest("--", "no-such-program")
        self.assertEqual(done.returncode, 127)
        self.assertIn("no-such-program", done.stderr)


class Limits(unittest.TestCase):
    def test_a_command_that_hangs_is_stopped(self):
        done = guest("--timeout", "1", "--", "sleep", "1000")
        self.assertEqual(done.returncode, 124)
        self.assertIn("after 1 s", done.stderr)

    def test_a_command_that_refuses_to_stop_is_killed(self):
        done = guest("--timeout", "1", "--", "bash", "-c", "trap '' TERM; while :; do sleep 0.1; done")
        self.assertEqual(done.returncode, 124)

    def test_what_is_left_behind_goes_with_the_guest(self):
        left = f"sleep {10_000_000 + os.getpid()}"  # nobody else's
        done = guest("--", "bash", "-c", f"setsid {left} & exit 0")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotEqual(subprocess.run(["pgrep", "-f", left], check=False).returncode, 0)

    def test_when_it_is_stopped_itself_nothing_stays(self):
        with tempfile.TemporaryDirectory() as folder:
            process = subprocess.Popen([str(SCRIPT), "--", "bash", "-c", "echo up; sleep 1000"], cwd=ROOT,
                                       stdout=subprocess.PIPE, env={**os.environ, "TMPDIR": folder})
            self.addCleanup(process.kill)
            self.assertEqual(process.stdout.readline(), b"up\n")
            process.terminate()
            self.assertEqual(process.wait(60), 130)
            process.stdout.close()
            self.assertEqual(list(Path(folder).iterdir()), [])

    def test_files_are_written_in_the_repository_and_nowhere_else(self):
        mark = f"/tmp/kmax_guest_{os.getpid()}_{time.time_ns()}"
        with tempfile.TemporaryDirectory(dir="/var/tmp") as outside, \
             tempfile.TemporaryDirectory(dir=ROOT / "build") as inside:
            done = guest("--", "bash", "-c", f"""
touch '{mark}' && echo text >'{inside}/file' || exit 3
touch '{outside}/file' && exit 4
touch /usr/kmax_test_file && exit 5
exit 0""")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual((Path(inside) / "file").read_text(), "text\n")
            self.assertEqual(list(Path(outside).iterdir()), [])
        self.assertFalse(Path("/usr/kmax_test_file").exists())
        self.assertFalse(Path(mark).exists(), "the guest's /tmp is the host's")


class Usage(unittest.TestCase):
    def test_wrong_usage_is_code_2(self):
        for arguments in ([], ["--nonsense"], ["--timeout"], ["--timeout", "soon", "true"],
                          ["--env", "novalue", "true"]):
            with self.subTest(arguments=arguments):
                done = guest(*arguments)
                self.assertEqual(done.returncode, 2)
                self.assertIn("usage", done.stderr)

    def test_which_names_the_kernel_and_the_reason(self):
        done = guest("--which")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, "^(own kernel: |User-mode Linux, .*not the own kernel: )")


if __name__ == "__main__":
    sys.exit(unittest.main())
