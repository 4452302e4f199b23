"""Scans: preparing, saving, pickling, questions about two of them, and bad input."""

import pickle
import tempfile
import unittest
from pathlib import Path

import numpy as np

import nearmiss
from scenes import DRAGON, dragon, plate, poses


class Preparing(unittest.TestCase):
    def test_arrays_of_any_layout_give_the_same_scan(self):
        points = plate()
        whole = nearmiss.Scan(points)
        self.assertEqual(len(whole), 2500)
        padded = np.zeros((2500, 5))
        padded[:, :3] = points
        for name, other in {
            "float32": points.astype(np.float32),
            "Fortran order": np.asfortranarray(points),
            "columns of a wider array": padded[:, :3],
            "every other of doubled rows": np.repeat(points, 2, axis=0)[::2],
            "read only": np.frombuffer(points.tobytes()).reshape(-1, 3),
            "lists": points.tolist(),
        }.items():
            self.assertEqual(nearmiss.Scan(other).bounds.shape, (2, 3), name)
            if name != "float32":
                self.assertEqual(nearmiss.Scan(other).to_bytes(), whole.to_bytes(), name)

    def test_a_scan_knows_its_points(self):
        points = plate()
        scan = nearmiss.Scan(points, graph=True, scanner=[0.5, 0.5, 3.0])
        np.testing.assert_allclose(scan.points, points[scan.sources], atol=scan.sampling_radius / 1e4)
        self.assertTrue((scan.normals[:, 2] > 0.9).all(), "normals face the scanner")
        self.assertTrue(scan.is_oriented)
        self.assertGreater(scan.reach, scan.sampling_radius)
        self.assertIn("2500 points", repr(scan))
        self.assertEqual(scan.dropped, (0, 0))
        self.assertGreater(scan.usable, 0.9)

    def test_progress_is_told_and_may_stop_the_work(self):
        told = []
        nearmiss.Scan(plate(count=200), progress=told.append)
        self.assertEqual(told[-1], 1.0)
        self.assertEqual(told, sorted(told))

        def stop(share):
            raise KeyboardInterrupt

        with self.assertRaises(KeyboardInterrupt):
            nearmiss.Scan(plate(count=300), progress=stop)

    def test_files_and_pickles_hold_the_same_scan(self):
        scan = nearmiss.Scan(plate(), graph=True)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "plate.nm"
            self.assertEqual(scan.save(path), path.stat().st_size)
            for again in (
                nearmiss.read(path),
                nearmiss.Scan.open(str(path), check="structure"),
                nearmiss.Scan.from_bytes(path.read_bytes()),
                pickle.loads(pickle.dumps(scan)),
            ):
                self.assertEqual(again.to_bytes(), scan.to_bytes())
                self.assertTrue(again.is_oriented)

    def test_what_is_wrong_raises_a_value_error(self):
        bad = plate()
        bad[7, 1] = np.nan
        huge = plate()
        huge[9, 0] = 1e200
        for words, call in {
            r"point 7\); drop such points with drop_invalid=True": lambda: nearmiss.Scan(bad),
            r"within ±1e150, got a larger one \(point 9\)": lambda: nearmiss.Scan(huge),
            r"shape \(N, 3\), got \(3, 2\)": lambda: nearmiss.Scan(np.zeros((3, 2))),
            r"shape \(N, 3\), got \(9,\)": lambda: nearmiss.Scan(np.zeros(9)),
            r"at least 8 distinct finite points, got 0": lambda: nearmiss.Scan(np.zeros((0, 3))),
            r"without numbers": lambda: nearmiss.Scan(np.array([["a"] * 3] * 9)),
            r"got `None`": lambda: nearmiss.Scan.read(DRAGON, format="None"),
            r"3 to 32 neighbours for local radii, got 99": lambda: nearmiss.Scan(plate(), radius_neighbours=99),
            r"finite reach above 0": lambda: nearmiss.Scan(plate(), reach=-1.0),
            r"three numbers for the scanner": lambda: nearmiss.Scan(plate(), scanner=[1, 2]),
            r"attribute for each of 2500 points, got 3": lambda: nearmiss.Scan(plate(), normals=np.ones((3, 3))),
            r"check `full` or `structure`": lambda: nearmiss.Scan.open("x.nm", check="none"),
            r"container in memory": lambda: nearmiss.Scan.from_bytes(b"rubbish"),
        }.items():
            with self.subTest(words), self.assertRaisesRegex(ValueError, words):
                call()
        self.assertEqual(nearmiss.Scan(bad, drop_invalid=True).dropped, (1, 0))
        with self.assertRaisesRegex(TypeError, "options among .*got `reech`"):
            nearmiss.Scan(plate(), reech=1.0)
        complex_points = plate().astype(complex)
        with self.assertRaisesRegex(ValueError, "without numbers"):
            nearmiss.Scan(complex_points)

    def test_files_that_cannot_be_read_raise_an_os_error(self):
        for call in (
            lambda: nearmiss.read("missing.ply"),
            lambda: nearmiss.read("missing.nm"),
            lambda: nearmiss.read_points("missing.ply"),
            lambda: nearmiss.SliceMap.open("missing"),
        ):
            with self.assertRaises(FileNotFoundError):
                call()
        with self.assertRaises(OSError):
            dragon().save("/nonexistent/folder/a.nm")


class Rotation:
    """A rotation as scipy hands it out."""

    def __init__(self, matrix):
        self.matrix = matrix

    def as_matrix(self):
        return self.matrix


class Questions(unittest.TestCase):
    def test_single_answers_and_batches_agree(self):
        scan, at = dragon(), poses(1, 200, 0.15)
        answers = scan.collide_each(scan, at)
        distances = scan.distance_each(scan, at)
        self.assertEqual(answers.shape, (200,))
        self.assertGreater((answers["verdict"] == 1).sum(), 10)
        self.assertGreater((answers["verdict"] == 0).sum(), 10)
        self.assertTrue((distances["lower"] <= distances["upper"]).all())
        for i in range(200):
            answer, record = scan.collide(scan, at[i]), answers[i]
            self.assertEqual(answer.touches, bool(record["verdict"]), i)
            self.assertEqual(answer.evidence, ["estimated", "certified"][record["evidence"]], i)
            self.assertEqual(answer.band, record["band"], i)
            if answer.touches:
                self.assertEqual(answer.verdict, "intersecting")
                np.testing.assert_array_equal(answer.witness, record["witness"])
                self.assertEqual([answer.source_a, answer.source_b], [record["source_a"], record["source_b"]])
            else:
                self.assertIsNone(answer.witness)
                self.assertEqual(answer.gap is None, bool(np.isnan(record["gap"])))
            distance = scan.distance(scan, at[i])
            self.assertEqual((distance.lower, distance.upper), (distances["lower"][i], distances["upper"][i]))

    def test_answers_are_no_conditions(self):
        scan = dragon()
        for answer in (scan.collide(scan), scan.distance(scan), scan.target().cast([0, 0, 1], [0, 0, -1])):
            with self.assertRaisesRegex(TypeError, "expected a condition, such as `answer"):
                bool(answer)

    def test_balls_and_surfaces_exclude_each_other(self):
        scan = dragon()
        with self.assertRaisesRegex(ValueError, "expected `thickened` or `surface_only`, got both"):
            scan.collide(scan, thickened=0.01, surface_only=True)
        balls = scan.collide(scan, thickened=0.01, surface_only=False)
        self.assertEqual(balls.evidence, scan.collide(scan, thickened=0.01).evidence)

    def test_classes_and_properties_are_described(self):
        for name in ("Scan", "MovingScan", "Mesh", "SliceMap"):
            self.assertIn("of shape (N, 3)", getattr(nearmiss, name).__doc__, name)
        for name in ("Answer", "Distance", "ShapeAnswer", "ShapeDistance", "RayAnswer", "SweepAnswer"):
            for field, value in vars(getattr(nearmiss, name)).items():
                if not field.startswith("_"):
                    self.assertTrue(value.__doc__, f"{name}.{field}")

    def test_poses_have_many_forms(self):
        scan = dragon()
        turn, shift = poses(2, 1, 0.0)[0, :3, :3], np.array([0.1, 0.02, 0.01])
        expected = scan.distance(scan, nearmiss.pose(turn, shift)).lower
        for form in (
            (turn, shift),
            (Rotation(turn), shift.tolist()),
            nearmiss.pose(turn, shift).tolist(),
            np.asfortranarray(nearmiss.pose(turn, shift)),
            Rotation(nearmiss.pose(turn, shift)),
        ):
            self.assertEqual(scan.distance(scan, form).lower, expected)
        turned = scan.distance(scan, nearmiss.pose(turn)).lower
        self.assertEqual(scan.distance(scan, turn).lower, turned)
        self.assertEqual(scan.distance(scan, Rotation(turn)).lower, turned)
        both = scan.collide_each(scan, poses(3, 5, 0.1), poses(4, 5, 0.1))
        for i in range(5):
            single = scan.collide(scan, poses(3, 5, 0.1)[i], poses(4, 5, 0.1)[i])
            self.assertEqual(single.touches, bool(both["verdict"][i]))
        self.assertEqual(scan.collide_each(scan, np.eye(4), poses(4, 5, 0.1)).shape, (5,))
        self.assertEqual(scan.collide_each(scan, np.zeros((0, 4, 4))).shape, (0,))

    def test_what_is_no_pose_is_refused(self):
        scan = dragon()
        mirror, skewed, nan = np.diag([1.0, 1, -1, 1]), np.eye(4), np.eye(4)
        skewed[0, 1] = 0.3
        nan[1, 1] = np.nan
        for words, pose in {
            "positive determinant, got -1": mirror,
            "rotation with uniform scale": skewed,
            "finite number, got NaN": nan,
            r"last row of 0 0 0 1": nearmiss.pose(translation=[1, 2, 3]).T,
            r"\(4, 4\).*got \(5, 5\)": np.eye(5),
            r"got str": "pose",
            r"one pose of shape \(4, 4\) here": np.zeros((2, 4, 4)),
            "got bool": True,
        }.items():
            with self.subTest(words), self.assertRaisesRegex(ValueError, words):
                scan.collide(scan, pose)
        many = np.broadcast_to(np.eye(4), (10, 4, 4)).copy()
        many[6] = skewed
        for call in (scan.collide_each, scan.distance_each):
            with self.assertRaisesRegex(ValueError, "pose 6: expected a rotation"):
                call(scan, many)
        with self.assertRaisesRegex(ValueError, "as many poses of both.*got 3 and 10"):
            scan.collide_each(scan, many, many[:3])
        with self.assertRaisesRegex(ValueError, "as many rotations as translations, got 2 and 3"):
            nearmiss.pose(np.zeros((2, 3, 3)), np.zeros((3, 3)))

    def test_options_mean_what_they_do_in_rust(self):
        scan = nearmiss.Scan(plate())
        above = nearmiss.pose(translation=[0, 0, 0.3])
        self.assertFalse(scan.collide(scan, above).touches)
        self.assertTrue(scan.collide(scan, above, margin=0.31).touches)
        self.assertTrue(scan.collide(scan, above, thickened=0.16).touches)
        self.assertIsNone(scan.collide(scan, above, evidence="estimated").gap)
        estimated = scan.distance(scan, above, thickened=0.1)
        self.assertAlmostEqual(estimated.lower, 0.1, 6)
        self.assertEqual(estimated.lower, estimated.upper)
        crossing = dragon().collide(dragon(), poses(5, 1, 0.02)[0], work=1)
        self.assertEqual((crossing.verdict, crossing.touches, crossing.reason), ("undecided", None, "budget"))
        self.assertTrue(0 <= crossing.likelihood <= 1)
        self.assertIn("undecided: budget", repr(crossing))
        soon = dragon().collide(dragon(), poses(5, 1, 0.02)[0], seconds=10.0)
        self.assertIsNotNone(soon.touches)
        for error, words, options in (
            (ValueError, "finite margin of at least 0, got -1", {"margin": -1.0}),
            (ValueError, "margin", {"margin": float("nan")}),
            (ValueError, "evidence `certified` or `estimated`", {"evidence": "sure"}),
            (ValueError, "time of at least 0 seconds, got -1", {"seconds": -1.0}),
            (TypeError, "got `marginn`", {"marginn": 1.0}),
            (TypeError, "", {"margin": "wide"}),
        ):
            with self.assertRaisesRegex(error, words):
                scan.collide(scan, above, **options)

    def test_hints_do_not_change_verdicts(self):
        scan, hint = dragon(), nearmiss.Hint()
        self.assertIn("fresh", repr(hint))
        for step in range(150):
            pose = nearmiss.pose(translation=[0.25 - 0.001 * step, 0.01, 0])
            hinted = scan.collide(scan, pose, hint=hint)
            self.assertEqual(hinted.touches, scan.collide(scan, pose).touches, step)
        self.assertNotIn("fresh", repr(hint))

    def test_contacts_and_manifolds_are_arrays(self):
        scan = dragon()
        pose = nearmiss.pose(translation=[0.09, 0.03, 0.01])
        answer, contacts = scan.contacts(scan, pose)
        other, manifold = scan.manifold(scan, pose, hint=nearmiss.Hint())
        for told in (answer, other, scan.collide(scan, pose)):
            self.assertEqual((told.touches, told.complete), (True, True), told)
        self.assertGreater(len(contacts), 3)
        self.assertTrue(1 <= len(manifold) <= 8)
        self.assertEqual(manifold["gap"][0], manifold["gap"].min(), "the deepest comes first")
        np.testing.assert_allclose(np.linalg.norm(manifold["normal"], axis=1), 1, atol=1e-6)
        low, high = scan.bounds
        self.assertTrue(((contacts["point"] > low - 0.01) & (contacts["point"] < high + 0.01)).all())
        apart, none = scan.contacts(scan, nearmiss.pose(translation=[9, 0, 0]))
        self.assertEqual((apart.touches, apart.complete, none.shape), (False, True, (0,)))

    def test_budgets_tell_whether_lists_are_complete(self):
        scan, pose = dragon(), nearmiss.pose(translation=[0.09, 0.03, 0.01])
        whole, all_contacts = scan.contacts(scan, pose)
        hasty, some = scan.contacts(scan, pose, work=(whole.node_pairs + whole.evaluations) // 4)
        self.assertFalse(hasty.complete)
        self.assertLess(len(some), len(all_contacts))
        none, empty = scan.contacts(scan, pose, work=1)
        self.assertEqual((none.verdict, none.reason, none.complete, len(empty)), ("undecided", "budget", False, 0))
        self.assertTrue(scan.contacts(scan, pose, work=10**9, seconds=600)[0].complete)
        whole, _ = scan.manifold(scan, pose, work=10**9)
        cost = whole.node_pairs + whole.evaluations
        self.assertTrue(whole.complete)
        for work in (1, cost // 2, cost - 1):
            hasty, some = scan.manifold(scan, pose, work=work)
            self.assertFalse(hasty.complete, work)
            self.assertLessEqual(len(some), 8)
            self.assertEqual(len(some) > 0, hasty.touches is True, work)
        self.assertFalse(scan.manifold(scan, pose, seconds=0.0)[0].complete)
        self.assertFalse(scan.collide(scan, pose, work=1).complete)
        self.assertEqual(scan.collide_each(scan, [pose], work=1)["complete"].tolist(), [False])
        self.assertEqual(scan.collide_each(scan, [pose])["complete"].tolist(), [True])

    def test_misaligned_arrays_are_copied(self):
        points = plate(count=20)
        packed = np.zeros(len(points), dtype=[("flag", "u1"), ("place", "<f8", (3,)), ("at", "<f4", (3,))])
        packed["place"], packed["at"] = points, points
        data = bytes(1) + points.tobytes()
        shifted = np.frombuffer(data, dtype="<f8", offset=1).reshape(-1, 3)
        single = np.frombuffer(bytes(1) + points.astype("<f4").tobytes(), dtype="<f4", offset=1).reshape(-1, 3)
        self.assertTrue(shifted.flags.c_contiguous and not shifted.flags.aligned)
        expected = nearmiss.Scan(points)
        for given in (packed["place"], packed["at"], shifted, single):
            scan = nearmiss.Scan(given)
            self.assertEqual(len(scan), len(points))
            np.testing.assert_allclose(scan.bounds, expected.bounds, atol=1e-6)
        moving = nearmiss.MovingScan(points)
        moving.move_to(shifted)
        moving.move_to(single)
        pose = nearmiss.pose(translation=[0, 0, 0.3])
        poses = np.frombuffer(bytes(1) + np.stack([pose] * 2).tobytes(), dtype="<f8", offset=1).reshape(-1, 4, 4)
        self.assertFalse(poses.flags.aligned)
        self.assertEqual(expected.collide(expected, poses[0]).touches, False)
        self.assertEqual(expected.collide_each(expected, poses)["verdict"].tolist(), [0, 0])
        # One row of a packed structure is contiguous, but not aligned.
        self.assertIsInstance(nearmiss.Shape.hull(packed["place"][:1]), nearmiss.Shape)
        above = np.frombuffer(bytes(1) + (points + [0, 0, 1]).tobytes(), dtype="<f8", offset=1).reshape(-1, 3)
        self.assertTrue(expected.target().cast_each(above, [0, 0, -1])["hit"].any())


if __name__ == "__main__":
    unittest.main()
