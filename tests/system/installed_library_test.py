"""libkmax and the Python module as they are installed: both components in a prefix of their own, without the build tree. The
examples are compiled and run, and every block of code in docs/library.md."""

import json
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from kmax_under_test import KMAX, PATIENCE, Serve, wait_for

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("KMAX_BUILD", ROOT / "build/native"))
CMAKE = os.environ.get("CMAKE", "cmake")
CXX = os.environ.get("CXX", "c++")
EXAMPLES = ROOT / "host_tools/libkmax/examples"
PYTHON_EXAMPLES = ROOT / "host_tools/libkmax/python/examples"
DOCUMENT = ROOT / "docs/library.md"


def run(*command, **options):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=10 * PATIENCE, **options)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


def blocks(language):
    found = re.findall(rf"^```{language}\n(.*?)^```", DOCUMENT.read_text(), re.M | re.S)
    assert found, f"{DOCUMENT} has no block of {language}"
    return found


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.prefix = cls.folder / "prefix"
        for component in "library", "python":
            run(CMAKE, "--install", BUILD, "--component", component, "--prefix", cls.prefix)
        cls.libraries = next(cls.prefix.glob("**/libkmax.so")).parent
        cls.python = next(cls.prefix.glob("**/dist-packages"))
        # What a user has.
        cls.environment = {**os.environ, "PYTHONPATH": str(cls.python),
                           "PATH": f"{Path(KMAX).resolve().parent}:{os.environ['PATH']}",
                           "PKG_CONFIG_PATH": str(cls.libraries / "pkgconfig"), "CMAKE_PREFIX_PATH": str(cls.prefix),
                           "LD_LIBRARY_PATH": str(cls.libraries)}

    def run_here(self, *command):
        """In a folder of its own, with a fresh device, whose address stands for ADDRESS too."""
        folder = tempfile.mkdtemp(dir=self.folder)
        with Serve("--can", "BUS") as served:
            bus = served.link.parent / "bus"
            wait_for(bus)
            return run(*(str(part).replace("ADDRESS", f"can:{bus}") for part in command), cwd=folder,
                       env={**self.environment, "KMAX_DEVICE": f"can:{bus}"})

    def compile(self, source, program):
        flags = run("pkg-config", "--cflags", "--libs", "kmax", env=self.environment).split()
        run(CXX, "-std=c++20", "-Wall", "-Wextra", "-Werror", source, "-o", program, *flags)
        return program

    def source(self, text):
        path = Path(tempfile.mkstemp(suffix=".cpp", dir=self.folder)[1])
        path.write_text(text)
        return path

    def test_nothing_of_the_inside_is_installed(self):
        headers = sorted(path.name for path in self.prefix.glob("include/**/*.hpp"))
        self.assertIn("version.hpp", headers)
        for path in self.prefix.glob("include/**/*.hpp"):
            included = re.findall(r'#include ["<]([^">]+)', path.read_text())
            for one in included:
                self.assertTrue(one.startswith("kmax/") or "/" not in one, f"{path} includes {one}")
                self.assertTrue("/" not in one or (self.prefix / "include" / one).is_file(), f"{path} includes {one}")
        shown = run("nm", "-DC", "--defined-only", self.libraries / "libkmax.so")
        for inside in "kmax::device::", "kmax::firmware::", "kmax::base::", "kmax::cli::", "CLI::", "nlohmann":
            self.assertNotIn(inside, shown)

    def test_one_version(self):
        version = json.loads(run(KMAX, "info", "--device", "sim", "--json"))["program_version"]
        self.assertEqual(run("pkg-config", "--modversion", "kmax", env=self.environment).strip(), version)
        self.assertEqual(self.run_here(sys.executable, "-c", "import kmax; print(kmax.__version__)").strip(), version)
        major, minor, _ = version.split(".")
        self.assertTrue((self.libraries / f"libkmax.so.{major}.{minor}").exists())
        self.assertIn(f"with version {version}", self.run_here(self.compile(self.source(blocks("cpp")[0]), self.folder / "versioned")))

    def test_examples_by_cmake(self):
        build = self.folder / "examples"
        run(CMAKE, "-S", EXAMPLES, "-B", build, f"-DCMAKE_CXX_COMPILER={CXX}", env=self.environment)
        run(CMAKE, "--build", build)
        self.assertRegex(self.run_here(build / "spring", "ADDRESS"), r"\d+ cycles at 1000 Hz")
        self.assertRegex(self.run_here(build / "wall"), r"\d+ samples")

    def test_examples_by_pkg_config(self):
        for source in sorted(EXAMPLES.glob("*.cpp")):
            with self.subTest(source.name):
                program = self.compile(source, self.folder / source.stem)
                self.assertNotEqual(self.run_here(program, "ADDRESS"), "")

    def test_the_wrong_version_is_not_found(self):
        (self.folder / "newer").mkdir()
        (self.folder / "newer/CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.16)\nproject(newer LANGUAGES NONE)\nfind_package(kmax 99 REQUIRED)\n")
        with self.assertRaisesRegex(AssertionError, "compatible"):
            run(CMAKE, "-S", self.folder / "newer", "-B", self.folder / "newer/build", env=self.environment)

    def test_python_examples(self):
        arguments = {"force_loop_timing": ["ADDRESS", "--seconds", "1"]}
        for source in sorted(PYTHON_EXAMPLES.glob("*.py")):
            with self.subTest(source.name):
                self.assertNotEqual(self.run_here(sys.executable, source, *arguments.get(source.stem, [])), "")

    def test_the_module_is_typed(self):
        package = self.python / "kmax"
        self.assertTrue((package / "py.typed").is_file())
        self.run_here(sys.executable, "-c", "import typing, kmax\n"
                      "for one in kmax.Device.record, kmax.Device.force_loop, kmax.run_scene, kmax.check:\n"
                      "    assert 'return' in typing.get_type_hints(one), one")

    def test_the_stub_names_what_there_is(self):
        stub = (ROOT / "host_tools/libkmax/python/kmax/_kmax.pyi").read_text()
        names = set(re.findall(r"^(?:def|class) (\w+)", stub, re.M))
        there = self.run_here(sys.executable, "-c", "from kmax import _kmax; print(*(n for n in dir(_kmax) if n[0] != '_'))")
        self.assertEqual(names | {"version"}, set(there.split()))

    def test_every_block_of_the_document(self):
        for text in blocks("python"):
            with self.subTest(text):
                self.run_here(sys.executable, "-c", text)
        for number, text in enumerate(blocks("cpp")):
            with self.subTest(text):
                self.run_here(self.compile(self.source(text), self.folder / f"block_{number}"))
        known = {"python", "cpp", "sh", "cmake"}
        self.assertLessEqual(set(re.findall(r"^```(\w+)$", DOCUMENT.read_text(), re.M)), known)

    def test_every_command_of_the_document(self):
        """Those that install, with this prefix, and that measure, for a second."""
        for text in blocks("sh"):
            text = text.replace("/usr/local", str(self.prefix)).replace("build/native", str(BUILD))
            text = text.replace("--seconds 60", "--seconds 1").replace("kmax serve", f"timeout 60 {KMAX} serve")
            with self.subTest(text):
                run("bash", "-euc", f"{text}\nkill $(jobs -p) 2>/dev/null || true", cwd=ROOT,
                    env={**self.environment, "TMPDIR": str(self.folder)})
        for text in blocks("cmake"):
            build = Path(tempfile.mkdtemp(dir=self.folder))
            (build / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.16)\nproject(mine LANGUAGES CXX)\n" + text)
            (build / "mine.cpp").write_text(blocks("cpp")[0])
            run(CMAKE, "-S", build, "-B", build / "build", f"-DCMAKE_CXX_COMPILER={CXX}", env=self.environment)
            run(CMAKE, "--build", build / "build")


if __name__ == "__main__":
    unittest.main()
