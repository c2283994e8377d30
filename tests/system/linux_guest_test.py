"""scripts/linux_guest: what goes into the guest, what comes out of it, and what it must not touch."""

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
    def test_exit_code_and_both_outputs_come_back(self):
        done = guest("--", "bash", "-c", "echo out; echo err >&2; exit 37")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (37, "out\n", "err\n"))

    def test_arguments_and_variables_arrive_unchanged(self):
        value = "x \"$HOME\"' y"
        odd = ["a b", "", "*", "$HOME", "it's", "two\nlines", "\\", "ä"]
        done = guest("--env", f"ODD={value}", "--", "python3", "-c",
                     "import os, sys; print([os.environ['ODD']] + sys.argv[1:])", *odd)
        self.assertEqual(done.stdout, f"{[value, *odd]}\n", done.stderr)

    def test_of_the_hosts_variables_only_those_asked_for(self):
        done = guest("--env", "GIVEN=1", "--", "env", env={**os.environ, "NOT_GIVEN": "1"})
        names = {line.split("=")[0] for line in done.stdout.splitlines()}
        self.assertLessEqual({"GIVEN", "PATH", "HOME", "KMAX_TEST_CAN", "KMAX_TEST_GPIO"}, names)
        self.assertNotIn("NOT_GIVEN", names)

    def test_it_runs_in_the_current_folder(self):
        self.assertEqual(guest("--", "pwd", cwd=ROOT / "docs").stdout, f"{ROOT / 'docs'}\n")

    def test_much_output_comes_whole(self):
        done = guest("--", "seq", "200000")
        self.assertEqual(done.stdout, "".join(f"{number}\n" for number in range(1, 200001)))

    def test_output_comes_while_the_command_runs(self):
        with subprocess.Popen([str(SCRIPT), "--", "bash", "-c", "echo first; sleep 1000"], cwd=ROOT,
                              stdout=subprocess.PIPE, text=True) as process:
            self.addCleanup(process.terminate)
            self.assertEqual(process.stdout.readline(), "first\n")
            process.terminate()

    def test_standard_input_is_empty(self):
        self.assertEqual(guest("--", "cat", input="not handed on").stdout, "")

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

    def test_outside_the_repository_nothing_is_written(self):
        with tempfile.TemporaryDirectory(dir="/var/tmp") as folder:
            done = guest("--", "touch", f"{folder}/file", "/usr/kmax_test_file")
            self.assertNotEqual(done.returncode, 0)
            self.assertEqual(list(Path(folder).iterdir()), [])
            self.assertFalse(Path("/usr/kmax_test_file").exists())
        mark = f"/tmp/kmax_guest_{os.getpid()}_{time.time_ns()}"
        self.assertEqual(guest("--", "touch", mark).returncode, 0)
        self.assertFalse(Path(mark).exists(), "the guest's /tmp is the host's")

    def test_in_the_repository_files_are_written(self):
        with tempfile.TemporaryDirectory(dir=ROOT / "build") as folder:
            done = guest("--", "bash", "-c", f"echo text >'{folder}/file'")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual((Path(folder) / "file").read_text(), "text\n")


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
