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
LEFT_OUT = ("node is missing (Debian package nodejs)" if not shutil.which("node") else
            "there is no chromium (Debian package chromium)" if not BROWSER else
            f"{DRIVER} is not installed (scripts/install_node_packages)" if not DRIVER.exists() else None)


@unittest.skipIf(LEFT_OUT, LEFT_OUT)
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
    if LEFT_OUT:  # CTest reports a test that begins so as skipped
        sys.exit(print(f"left out: {LEFT_OUT}"))
    sys.exit(unittest.main())
