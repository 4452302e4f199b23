"""Agreement with the command line, which `NEARMISS_COMMAND` names."""

import json
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np

import nearmiss
from nearmiss import Shape
from scenes import COMMAND, DRAGON, poses


def as_json(value):
    """A field of a record as the command line writes it."""
    value = value.tolist()
    if isinstance(value, list):
        return None if np.isnan(value[0]) else value
    return None if value == -1 or (isinstance(value, float) and np.isnan(value)) else value


@unittest.skipUnless(COMMAND, "needs NEARMISS_COMMAND")
class Agreement(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.file = str(Path(cls.folder.name) / "dragon.nm")
        cls.run_command("preprocess", str(DRAGON), "-o", cls.file, "--quiet")
        cls.scan = nearmiss.Scan.read(DRAGON)
        near = Path(cls.folder.name) / "near.jsonl"
        cls.run_command("poses", cls.file, cls.file, "--near", "--per-distance", "500", "-o", str(near), "--quiet")
        lines = [json.loads(line) for line in near.read_text().splitlines()]
        pairs = np.array([[line["a"], line["b"]] for line in lines]).reshape(-1, 2, 4, 4)
        # Half of them near contact, the other half anywhere.
        other = np.stack([poses(1, 500, 0.1), poses(2, 500, 0.1)], axis=1)
        cls.pairs = np.concatenate([pairs, other])
        cls.poses = Path(cls.folder.name) / "poses.jsonl"
        cls.poses.write_text("".join(json.dumps({"a": a.ravel().tolist(), "b": b.ravel().tolist()}) + "\n" for a, b in cls.pairs))

    @staticmethod
    def run_command(*words):
        done = subprocess.run([COMMAND, *words], check=True, capture_output=True, text=True)
        return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]

    def write(self, lines):
        path = Path(self.folder.name) / "lines.jsonl"
        path.write_text("".join(json.dumps(line) + "\n" for line in lines))
        return str(path)

    def test_the_file_is_the_same(self):
        self.assertEqual(Path(self.file).read_bytes(), self.scan.to_bytes())

    def test_collide(self):
        self.assertGreaterEqual(len(self.pairs), 1000)
        for words, options in (
            ([], {}),
            (["--margin", "0.003", "--evidence", "estimated"], {"margin": 0.003, "evidence": "estimated"}),
            (["--thickened", "0.002"], {"thickened": 0.002}),
            (["--work", "300"], {"work": 300}),
        ):
            told = self.run_command("collide", self.file, self.file, "--poses", str(self.poses), "--json", *words)
            ours = self.scan.collide_each(self.scan, self.pairs[:, 1], self.pairs[:, 0], **options)
            self.assertEqual(len(told), len(ours))
            for i, (line, record) in enumerate(zip(told, ours)):
                verdict = ["separated", "intersecting", "undecided"][record["verdict"]]
                self.assertEqual(line["verdict"], verdict, (words, i))
                self.assertEqual(line["evidence"], ["estimated", "certified", None][record["evidence"]], (words, i))
                self.assertEqual(line["reason"], [None, "budget"][record["reason"]], (words, i))
                for name in (
                    "witness normal_a normal_b residual gap band likelihood source_a source_b "
                    "evaluations node_pairs leaf_pairs"
                ).split():
                    self.assertEqual(line[name], as_json(record[name]), (words, i, name))

    def test_distance(self):
        told = self.run_command("distance", self.file, self.file, "--poses", str(self.poses), "--json")
        ours = self.scan.distance_each(self.scan, self.pairs[:, 1], self.pairs[:, 0])
        for i, (line, record) in enumerate(zip(told, ours, strict=True)):
            self.assertEqual([line["lower"], line["upper"]], [record["lower"], record["upper"]], i)
            self.assertEqual(line["points"], [record["point_a"].tolist(), record["point_b"].tolist()], i)

    def test_shapes_and_rays(self):
        rng = np.random.default_rng(5)
        low, high = self.scan.bounds
        centres = rng.uniform(low - 0.02, high + 0.02, size=(200, 3))
        file = self.write([{"sphere": {"centre": c.tolist(), "radius": 0.01}} for c in centres])
        target = self.scan.target()
        told = self.run_command("touch", self.file, "--shapes", file, "--surface", "--json")
        shapes = [Shape.sphere(c, 0.01) for c in centres]
        touched, away = target.touch_each(shapes), target.distance_each(shapes)
        for i, line in enumerate(told):
            self.assertEqual(line["touches"], bool(touched["verdict"][i]), i)
            self.assertEqual([line["lower"], line["upper"]], [away["lower"][i], away["upper"][i]], i)
            contacts = target.contacts(shapes[i])
            self.assertEqual([c["depth"] for c in line["contacts"]], contacts["depth"].tolist(), i)
        ways = rng.normal(size=(200, 3))
        file = self.write([{"origin": o.tolist(), "direction": w.tolist()} for o, w in zip(centres, ways)])
        told = self.run_command("cast", self.file, "--rays", file, "--json")
        ours = target.cast_each(centres, ways)
        self.assertGreater(ours["hit"].sum(), 20)
        for i, line in enumerate(told):
            self.assertEqual(line["t"], as_json(ours["t"][i]), i)

    def test_sweep(self):
        path = nearmiss.pose(translation=[[-0.3, 0.02, 0], [0.05, 0.02, 0.01], [0.3, 0.02, 0]])
        file = self.write([{"b": pose.ravel().tolist()} for pose in path])
        told = self.run_command("sweep", self.file, self.file, "--path", file, "--json")[0]
        ours = nearmiss.sweep(self.scan, self.scan, path)
        self.assertEqual((told["verdict"], told["t_free"], told["t_hit"]), (ours.verdict, ours.t_free, ours.t_hit))


if __name__ == "__main__":
    unittest.main()
