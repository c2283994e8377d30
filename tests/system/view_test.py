"""The live page of `kmax view` in a headless Chromium: against the native firmware, and against the image on the virtual
board. scripts/install_node_packages installs what drives the browser."""

import os
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

from kmax_under_test import BOARD, ELF, KMAX, PATIENCE

FOLDER = Path(__file__).resolve().parent / "view_browser"
DRIVER = FOLDER.parents[2] / "build" / "view_browser" / "package-lock.json"
BROWSER = os.environ.get("CHROMIUM") or shutil.which("chromium")


@unittest.skipUnless(DRIVER.exists(), f"left out: {DRIVER} is not installed (scripts/install_node_packages)")
@unittest.skipUnless(BROWSER, "left out: there is no chromium (Debian package chromium)")
@unittest.skipUnless(shutil.which("node"), "left out: node is missing (Debian package nodejs)")
class Page(unittest.TestCase):
    def check(self, extent, *device):
        done = subprocess.run(["node", str(FOLDER / "page_check.mjs"), extent, *device], capture_output=True, text=True,
                              timeout=20 * PATIENCE, check=False, env={**os.environ, "CHROMIUM": BROWSER, "KMAX": KMAX})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn(" 0 FAILED", done.stdout)

    def test_the_native_firmware(self):
        self.check("all", KMAX, "serve", "--can", "BUS")

    def test_the_image_on_the_virtual_board(self):
        self.check("short", BOARD, ELF, "--can", "BUS")


if __name__ == "__main__":
    sys.exit(unittest.main())
