"""The Debian packages and the release folder of scripts/package: installed in a root of their own, used, removed."""

import os
import subprocess
import tempfile
import unittest
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]


class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.made = Path(cls.folder.name) / "packages"
        done = subprocess.run([str(HOUSE / "scripts" / "package"), str(cls.made)], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise AssertionError(done.stdout + done.stderr)

    def run_in(self, root, *command, **more):
        environment = {**os.environ, "KMAX_DEVICE": "sim", "PATH": f"{root}/usr/bin:{os.environ['PATH']}",
                       "LD_LIBRARY_PATH": str(root / "usr/lib"),
                       "PYTHONPATH": str(root / "usr/lib/python3/dist-packages")}
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=300, cwd=root,
                              **more).stdout

    def dpkg(self, root, *arguments):
        subprocess.run(["dpkg", f"--root={root}", "--force-not-root", "--force-depends", "--force-script-chrootless",
                        "--log=/dev/null", *arguments], check=True, capture_output=True, text=True, timeout=300)

    def test_installed_used_and_removed(self):
        root = Path(self.folder.name) / "root"
        for state in ("info", "updates", "triggers"):
            (root / "var/lib/dpkg" / state).mkdir(parents=True)
        for file in ("status", "available"):
            (root / "var/lib/dpkg" / file).touch()
        before = {path for path in root.rglob("*")}
        packages = sorted(self.made.glob("*.deb"))
        self.assertEqual([package.name.split("_")[0] for package in packages], ["kmax", "libkmax-dev", "python3-kmax"])
        self.dpkg(root, "-i", *map(str, packages))

        version = self.run_in(root, "kmax", "--version")
        self.assertRegex(version, r"^kmax [0-9.]+, commit [0-9a-f]{7}")
        self.assertIn(f"image {root}/usr/share/kmax/kmax-odrive_v3.elf, CRC-32 ", version)
        self.assertIn("wall.stiffness = 1000 N/m", self.run_in(root, "kmax", "get", "wall.stiffness"))
        self.run_in(root, "kmax-board", str(root / "usr/share/kmax/kmax-odrive_v3.elf"), "--duration", "0.2", "--free-running")
        self.assertIn("0.001", self.run_in(root, "/usr/bin/python3", "-c",
                                           "import kmax\nwith kmax.Device('sim') as d: print(d['wall.magnetic_length'])"))
        for file in ("usr/share/man/man1/kmax-experiment-contact.1", "usr/share/bash-completion/completions/kmax",
                     "usr/share/zsh/vendor-completions/_kmax", "usr/share/fish/vendor_completions.d/kmax.fish",
                     "lib/udev/rules.d/60-kmax.rules", "usr/share/doc/kmax/docs/first_wall.md"):
            self.assertTrue((root / file).exists() or (root / "usr" / file).exists(), file)

        self.dpkg(root, "--purge", "python3-kmax", "libkmax-dev", "kmax")
        left = {path for path in root.rglob("*") if path.is_file() and "var/lib/dpkg" not in str(path)} - before
        self.assertEqual(left, set())

    def test_names_what_it_depends_on(self):
        for name, needed in (("kmax", ("libc6", "libfmt9", "libmodbus5", "libgpiod2")), ("libkmax-dev", ("libc6", "libstdc++6")),
                             ("python3-kmax", ("python3-numpy", "libkmax-dev"))):
            package = next(self.made.glob(f"{name}_*.deb"))
            depends = subprocess.run(["dpkg-deb", "--field", str(package), "Depends"], capture_output=True, text=True,
                                     check=True).stdout
            for other in needed:
                self.assertRegex(depends, rf"(^|, ){other.replace('+', '[+]')}( |,|$)", f"{name} depends on {depends}")

    @property
    def release(self):
        return next(self.made.glob("kmax-*/environment")).parent

    def run_bare(self, shell, script, folder):
        """In a shell that knows nothing of Kmax but what the script reads."""
        environment = {"PATH": "/usr/bin:/bin", "HOME": self.folder.name, "KMAX_DEVICE": "sim"}
        return subprocess.run([shell, "-c", script], cwd=folder, env=environment, capture_output=True, text=True, check=True,
                              timeout=300)

    def test_the_environment_finds_its_own_folder_from_any_other(self):
        found = self.run_bare("bash", f'. "{self.release}/environment" && command -v kmax && kmax get wall.stiffness && '
                                      '/usr/bin/python3 -c "import kmax; print(kmax.__file__)"', self.folder.name)
        self.assertEqual(found.stderr, "")
        program, stiffness, module = found.stdout.splitlines()
        self.assertEqual(program, f"{self.release}/bin/kmax")
        self.assertEqual(stiffness, "wall.stiffness = 1000 N/m")
        self.assertTrue(module.startswith(f"{self.release}/lib/"), module)

    def test_a_shell_that_cannot_tell_where_the_environment_is_says_to_go_there(self):
        self.assertIn("go to the release folder first", self.run_bare("sh", f'. "{self.release}/environment"',
                                                                      self.folder.name).stderr)

    def test_the_release_folder_needs_no_library_but_the_smallest_systems(self):
        release = self.release
        said = self.run_bare("sh", ". ./environment && kmax get wall.stiffness && ldd bin/kmax bin/kmax-board", release).stdout
        self.assertIn("wall.stiffness = 1000 N/m", said)
        smallest = ("libc.so", "libm.so", "libstdc++.so", "libgcc_s.so", "libpthread.so", "libdl.so", "librt.so", "linux-vdso",
                    "/lib64/ld-linux")
        for line in said.splitlines():
            library = line.strip()
            if "=>" not in library or library.startswith(smallest):
                continue
            self.assertIn(str(release / "lib"), library)


if __name__ == "__main__":
    unittest.main()
