"""The code of the guide and of the README runs as it is written."""

import contextlib
import importlib.util
import io
import os
import re
import tempfile
import unittest
from pathlib import Path

import numpy as np
from scenes import DRAGON, room

ROOT = Path(__file__).resolve().parents[3]


def run(page, names):
    """Runs the blocks of a page one after the other, and returns what they print."""
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), re.DOTALL)
    printed = io.StringIO()
    for number, block in enumerate(blocks, 1):
        if "import plot" in block and not importlib.util.find_spec("matplotlib"):
            continue
        code = block.replace("testdata/data/dragon-5k.ply", DRAGON.as_posix())
        with contextlib.redirect_stdout(printed):
            exec(compile(code, f"{page}, block {number}", "exec"), names)
    return len(blocks), printed.getvalue()


class Pages(unittest.TestCase):
    def setUp(self):
        # Blocks save files.
        folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)

    def test_the_guide(self):
        np.savetxt("room.xyz", room())
        blocks, printed = run("docs/guide/python.md", {})
        self.assertGreaterEqual(blocks, 8)
        self.assertEqual(printed.count("<MovingScan of 5205 points"), 3, printed)
        self.assertIn("<SweepAnswer free", printed)

    def test_the_readme(self):
        blocks, printed = run("integrations/python/README.md", {})
        self.assertEqual(blocks, 2)
        lines = printed.splitlines()
        self.assertRegex(lines[0], r"^<Answer apart by at least 0\.2\d+, certified>$")
        self.assertEqual(lines[1:3], ["0.3", "[0 1]"])
        for line in lines[3:]:
            self.assertRegex(line, r"^<Answer apart by at least 0\.2\d+, certified> refitted$")
        self.assertEqual(len(lines), 6)


if __name__ == "__main__":
    unittest.main()
