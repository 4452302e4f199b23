"""Moving scans: their frames, the questions about them, threads that move and ask."""

import os
import pickle
import subprocess
import sys
import threading
import unittest
from pathlib import Path

import numpy as np

import nearmiss
from nearmiss import MovingScan, Shape
from scenes import depth_frame, dragon, plate, poses


def cloth(time, count=40):
    """A square of 1 by 1 with waves of height 0.1 that run along x."""
    points = plate(count=count)
    points[:, 2] = 0.1 * np.sin(6.0 * points[:, 0] + time)
    return points


def at(x, y=0.0, z=0.0):
    return nearmiss.pose(translation=[x, y, z])


#: Poses of a cloth from where it crosses another one to where they are apart.
NEAR = poses(11, 120, 0.15) @ at(-0.5, -0.5)


def same(one, other):
    """True if two arrays of records hold the same numbers, apart from counts of work."""
    names = [name for name in one.dtype.names if name not in ("evaluations", "node_pairs", "leaf_pairs")]
    return all(np.array_equal(one[name], other[name], equal_nan=True) for name in names)


class Frames(unittest.TestCase):
    def test_each_frame_answers_as_a_scan_of_its_points(self):
        floor = nearmiss.Scan(plate())
        moving = MovingScan(cloth(0.0))
        first = nearmiss.Scan(cloth(0.0))
        self.assertTrue(same(moving.collide_each(floor, NEAR), first.collide_each(floor, NEAR)), "the first frame")
        for step in range(1, 6):
            frame = cloth(0.3 * step)
            if step == 5:
                moving.replace(frame)
            else:
                self.assertIn(moving.move_to(frame), ("refitted", "renewed", "rebuilt"))
            scan = nearmiss.Scan(frame)
            ours, theirs = moving.collide_each(floor, NEAR), scan.collide_each(floor, NEAR)
            bounds, expected = moving.distance_each(floor, NEAR), scan.distance_each(floor, NEAR)
            self.assertEqual(ours.shape, (120,))
            for verdict in (0, 1):
                self.assertGreater((theirs["verdict"] == verdict).sum(), 10, f"verdict {verdict} in step {step}")
            band = np.maximum(ours["band"], theirs["band"])
            outside = expected["lower"] > band
            self.assertGreater(outside.sum(), 10, f"poses outside the band in step {step}")
            np.testing.assert_array_equal(ours["verdict"][outside], 0, f"step {step}")
            differs = ours["verdict"] != theirs["verdict"]
            self.assertTrue((np.maximum(bounds["lower"], expected["lower"])[differs] <= band[differs]).all(), step)
            self.assertTrue((bounds["lower"] <= expected["upper"] + band).all(), step)
            self.assertTrue((expected["lower"] <= bounds["upper"] + band).all(), step)
            np.testing.assert_allclose(moving.points, frame[moving.sources], atol=1e-6)
            np.testing.assert_allclose(moving.bounds, scan.bounds, atol=1e-6)

    def test_a_frame_tells_how_it_was_followed(self):
        moving = MovingScan(cloth(0.0), radius_neighbours=8, reach=0.2)
        self.assertEqual((len(moving), moving.renewal, moving.looseness), (1600, None, 1.0))
        self.assertAlmostEqual(moving.reach, 0.2, 6)
        self.assertIn("1600 points", repr(moving))
        self.assertIn("first frame", repr(moving))
        self.assertEqual(moving.move_to(cloth(0.05).astype(np.float32)), "refitted")
        self.assertEqual(moving.renewal, "refitted")
        self.assertIn("refitted>", repr(moving))
        self.assertTrue(0.5 < moving.looseness < 2.0, moving.looseness)
        self.assertEqual(moving.misplaced, 0.0)
        # All lengths change, and the order stays good.
        self.assertEqual(moving.move_to(0.5 * cloth(0.05)), "renewed")
        self.assertEqual(moving.move_to(cloth(0.05)), "renewed")
        # All neighbours part.
        shuffled = np.random.default_rng(0).permutation(cloth(0.05))
        self.assertEqual(moving.move_to(shuffled), "rebuilt")
        self.assertEqual(moving.move_to(cloth(0.05)), "rebuilt")
        # A fifth of the points scatters: they are sparse, among those of the sheet.
        scattered = cloth(0.05)
        some = scattered[:, 0] >= 0.8
        scattered[some] = np.random.default_rng(1).uniform(2, 20, (some.sum(), 3))
        self.assertEqual(moving.move_to(scattered), "rebuilt")
        self.assertEqual((moving.looseness, moving.misplaced), (1.0, 0.0))
        moving.replace(cloth(0.05, count=30)[:, ::-1])
        self.assertEqual((len(moving), moving.renewal, moving.normals.shape), (900, "replaced", (900, 3)))

    def test_a_still_scan_is_taken_and_given(self):
        scan = nearmiss.Scan(cloth(0.0))
        moving = MovingScan.of(scan)
        self.assertIsInstance(moving, nearmiss.AnyScan)
        self.assertIsInstance(scan, nearmiss.AnyScan)
        moving.move_to(cloth(0.1))
        kept = moving.still()
        moving.move_to(cloth(0.2))
        self.assertEqual(len(scan.to_bytes()), len(nearmiss.Scan(cloth(0.0)).to_bytes()))
        self.assertEqual(scan.to_bytes(), nearmiss.Scan(cloth(0.0)).to_bytes(), "the frames do not change the scan")
        np.testing.assert_allclose(kept.points, cloth(0.1)[kept.sources], atol=1e-6)
        again = pickle.loads(pickle.dumps(kept))
        self.assertTrue(same(again.collide_each(scan, NEAR), kept.collide_each(scan, NEAR)))
        with self.assertRaisesRegex(TypeError, "pickle"):
            pickle.dumps(moving)

    def test_depth_frames_replace_each_other(self):
        seen = MovingScan(depth_frame(0).reshape(-1, 3), drop_invalid=True)
        for time in range(1, 4):
            frame = depth_frame(time)
            seen.replace_organised(frame.astype(np.float32) if time == 1 else frame)
            self.assertEqual(len(seen), 48 * 64 - 2, "holes are dropped")
            self.assertEqual((seen.dropped[0], seen.renewal), (2, "replaced"))
            ball = Shape.sphere([0, 0, 1.0], 0.25)
            distance = seen.target().distance(ball)
            depth = 0.75 - 0.1 * time
            self.assertLessEqual(distance.lower, depth + 1e-6, time)
            self.assertAlmostEqual(distance.upper, depth, 2, str(time))
            rows = frame.reshape(-1, 3)[seen.sources]
            np.testing.assert_allclose(seen.points, rows, atol=1e-6)
        # Without the pixels, zeros are points.
        frame[7, 9] = np.nan
        again = MovingScan(plate())
        again.replace(frame.reshape(-1, 3))
        self.assertEqual((len(again), again.dropped[0]), (48 * 64 - 2, 2))
        self.assertAlmostEqual(again.target().distance(ball).upper, seen.target().distance(ball).upper, 4)

    def test_what_is_wrong_raises_a_value_error_and_changes_nothing(self):
        moving, frame = MovingScan(cloth(0.0)), cloth(0.1)
        bad = frame.copy()
        bad[7, 1] = np.nan
        far = frame.copy()
        far[9, 0] = 1e200
        double = np.concatenate([frame, frame[:1]])
        twice = MovingScan(double)
        parted = double.copy()
        parted[-1] += 0.5
        for words, call in {
            r"expected 1600 points, as in the first frame, got 1599": lambda: moving.move_to(frame[1:]),
            r"finite coordinates, got .*point 7\)": lambda: moving.move_to(bad),
            r"coordinates below .*, got 1e200": lambda: moving.move_to(far),
            r"points of shape \(N, 3\), got \(1600, 2\)": lambda: moving.move_to(frame[:, :2]),
            r"without numbers": lambda: moving.move_to("points"),
            r"at least 8 distinct finite points, got 2": lambda: moving.replace(frame[:2]),
            r"frame of shape \(H, W, 3\), got \(1600, 3\)": lambda: moving.replace_organised(frame),
            r"frame of shape \(H, W, 3\), got \(4, 0, 3\)": lambda: moving.replace_organised(np.zeros((4, 0, 3))),
            r"frame of shape \(H, W, 3\), got \(4, 4, 2\)": lambda: moving.replace_organised(np.zeros((4, 4, 2))),
            r"at least 8 distinct finite points, got 0": lambda: moving.replace_organised(np.full((4, 4, 3), np.nan)),
            r"finite coordinates, got NaN .*point 7.*drop_invalid=True": lambda: MovingScan(bad),
            r"3 to 32 neighbours": lambda: MovingScan(frame, radius_neighbours=99),
            r"finite reach above 0": lambda: MovingScan(frame, reach=-1.0),
            r"point 1600 to stay with point 0": lambda: twice.move_to(parted),
            r"without a graph, got one": lambda: MovingScan.of(nearmiss.Scan(frame, graph=True)),
            r"distinct points, got 1 repeated": lambda: MovingScan.of(nearmiss.Scan(double)),
            r"two scans with a hint, got a mesh": lambda: moving.collide(
                nearmiss.Mesh(plate()[:3] + np.eye(3), [[0, 1, 2]]), hint=nearmiss.Hint()
            ),
        }.items():
            with self.subTest(words), self.assertRaisesRegex(ValueError, words):
                call()
        self.assertEqual(twice.move_to(double + 0.1), "refitted")
        self.assertEqual((len(moving), moving.renewal), (1600, None))
        np.testing.assert_allclose(moving.points, cloth(0.0)[moving.sources], atol=1e-6)
        for words, call in {
            r"options among radius_neighbours, reach, got `graph`": lambda: MovingScan(frame, graph=True),
            r"Scan, a MovingScan or a Mesh, got str": lambda: moving.collide("scan"),
            r"AnyScan": nearmiss.AnyScan,
        }.items():
            with self.subTest(words), self.assertRaisesRegex(TypeError, words):
                call()


class Questions(unittest.TestCase):
    """Every question about a moving scan is answered as about a still scan of the frame."""

    @classmethod
    def setUpClass(cls):
        cls.moving = MovingScan(cloth(0.0))
        cls.moving.move_to(cloth(0.4))
        cls.still = cls.moving.still()
        cls.other = MovingScan(cloth(1.0))
        cls.other.replace(cloth(1.5))
        cls.mesh = nearmiss.Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])

    def pairs(self):
        """Each pair with a moving scan, and the same with still ones."""
        moving, still, other = self.moving, self.still, self.other
        floor = nearmiss.Scan(plate())
        return {
            "a scan": (moving, floor, still, floor),
            "by a scan": (floor, moving, floor, still),
            "another moving scan": (moving, other, still, other.still()),
            "itself": (moving, moving, still, still),
            "a mesh": (moving, self.mesh, still, self.mesh),
            "by a mesh": (self.mesh, moving, self.mesh, still),
        }

    def test_contacts_and_distances(self):
        for name, (a, b, still_a, still_b) in self.pairs().items():
            with self.subTest(name):
                for options in ({}, {"margin": 0.02}, {"thickened": 0.01}, {"evidence": "estimated"}):
                    ours, theirs = a.collide_each(b, NEAR, **options), still_a.collide_each(still_b, NEAR, **options)
                    self.assertTrue(same(ours, theirs), options)
                self.assertEqual({0, 1}, set(a.collide_each(b, NEAR)["verdict"].tolist()))
                self.assertTrue(same(a.distance_each(b, NEAR), still_a.distance_each(still_b, NEAR)))
                self.assertEqual(a.collide_each(b, NEAR).shape, (120,))
                self.assertEqual(repr(a.collide(b, NEAR[3])), repr(still_a.collide(still_b, NEAR[3])))
                self.assertEqual(a.distance(b, NEAR[3]).upper, still_a.distance(still_b, NEAR[3]).upper)

    def test_a_mesh_is_asked_from_both_sides(self):
        for scan in (self.still, self.moving):
            ours, theirs = scan.collide_each(self.mesh, NEAR), self.mesh.collide_each(scan, np.eye(4), NEAR)
            np.testing.assert_array_equal(ours["verdict"], theirs["verdict"])
            np.testing.assert_array_equal(ours["source_a"], theirs["source_b"])
            ours, theirs = scan.distance_each(self.mesh, NEAR), self.mesh.distance_each(scan, np.eye(4), NEAR)
            np.testing.assert_array_equal(ours["upper"], theirs["upper"])
            np.testing.assert_array_equal(ours["point_a"], theirs["point_b"])
            answer, contacts = scan.contacts(self.mesh)
            self.assertTrue(answer.touches and answer.complete)
            self.assertGreater(len(contacts), 10)
            self.assertLess(np.abs(contacts["point"][:, 2]).max(), 0.01, "contacts are on the mesh")
            self.assertEqual(set(contacts["source_b"].tolist()), {0, 1}, "both triangles")

    def test_manifolds_clashes_curves_sweeps(self):
        upright = at(0.005, 0.505, -0.505) @ nearmiss.pose([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
        for a, b in ((self.moving, nearmiss.Scan(plate())), (self.moving, self.other)):
            still_a, still_b = self.still, b.still() if isinstance(b, MovingScan) else b
            self.assertTrue(same(a.contacts(b)[1], still_a.contacts(still_b)[1]))
            self.assertGreater(len(a.contacts(b)[1]), 3)
            self.assertTrue(same(a.manifold(b)[1], still_a.manifold(still_b)[1]))
            self.assertTrue(same(a.clashes(b, upright), still_a.clashes(still_b, upright)))
            self.assertTrue(a.clashes(b, upright)["hard"][0])
            (curve,), (expected,) = a.curves(b, upright), still_a.curves(still_b, upright)
            np.testing.assert_array_equal(curve, expected)
            path = nearmiss.pose(translation=[[0, 0, 2], [0, 0, 0]])
            ours, theirs = nearmiss.sweep(a, b, path), nearmiss.sweep(still_a, still_b, path)
            self.assertTrue(ours.hits)
            self.assertEqual((ours.t_free, ours.t_hit), (theirs.t_free, theirs.t_hit))

    def test_hints_of_other_frames_are_ignored(self):
        moving, floor, hint = MovingScan(cloth(0.0)), nearmiss.Scan(plate()), nearmiss.Hint()
        for step in range(20):
            moving.move_to(cloth(0.1 * step))
            height = at(0, 0, -0.2 + 0.02 * step)
            hinted = moving.collide(floor, height, hint=hint)
            self.assertEqual(hinted.touches, moving.still().collide(floor, height).touches, step)

    def test_a_target_follows_the_frames(self):
        moving = MovingScan(plate())
        target, hint = moving.target(margin=0.01), nearmiss.ShapeHint()
        ball = Shape.sphere([0.5, 0.5, 0.3], 0.1)
        for height in (0.0, 0.1, 0.195, 0.25):
            moving.move_to(plate() + [0, 0, height])
            gap = 0.2 - height
            touches = gap <= 0.01
            self.assertEqual(target.touch(ball).touches, touches, height)
            self.assertEqual(target.touch_each([ball, ball])["verdict"].tolist(), [int(touches)] * 2)
            self.assertAlmostEqual(target.distance(ball).upper, max(gap, 0.0), 6)
            self.assertAlmostEqual(target.distance_each([ball])["upper"][0], max(gap, 0.0), 6)
            self.assertEqual(len(target.contacts(ball, hint=hint)) > 0, touches)
            self.assertAlmostEqual(target.cast([0.3, 0.3, 2], [0, 0, -1]).t, 2 - height, 6)
            self.assertAlmostEqual(target.cast_each([[0.3, 0.3, 2]], [0, 0, -1])["t"][0], 2 - height, 6)
            self.assertAlmostEqual(target.cast_all([0.3, 0.3, 2], [0, 0, -1])["t"][0], 2 - height, 6)
        self.assertIn("2500 points", repr(target))
        with self.assertRaisesRegex(ValueError, "margin"):
            moving.target(margin=-1.0)


class Threads(unittest.TestCase):
    def test_every_answer_is_about_one_whole_frame(self):
        """Checks that no answer mixes two frames, and that no thread waits forever."""
        first, second = MovingScan(plate(count=30)), MovingScan(plate(count=30))
        probe, wrong, done = nearmiss.Scan(plate(count=30)), [], threading.Event()
        heights = 0.1 * np.arange(8)
        target = first.target()
        far = at(0, 0, 5)

        def move(moving):
            for step in range(120):
                points = plate(count=30) + [0, 0, heights[step % 8]]
                (moving.replace if step % 16 == 7 else moving.move_to)(points)

        def ask(seed):
            while not done.is_set():
                one = probe.distance(first, far, relative=0.0).upper
                single = target.cast([0.33, 0.33, 5], [0, 0, -1]).t
                batch = probe.distance_each(first, np.stack([far] * 4))["upper"]
                for height in (one - 5, 5 - single, batch[0] - 5):
                    if np.abs(height - heights).min() > 1e-3 or np.ptp(batch) > 0:
                        wrong.append((seed, one, single, batch.tolist()))
                # Both orders, and a scan with itself.
                (first, second)[seed % 2].collide((second, first)[seed % 2])
                first.collide(first, far)
                len(first), repr(second), first.looseness

        movers = [threading.Thread(target=move, args=(moving,)) for moving in (first, second)]
        askers = [threading.Thread(target=ask, args=(seed,)) for seed in range(3)]
        for thread in movers + askers:
            thread.start()
        for thread in movers:
            thread.join(60)
        done.set()
        for thread in askers:
            thread.join(60)
        self.assertFalse([thread for thread in movers + askers if thread.is_alive()], "threads that wait forever")
        self.assertEqual(wrong, [])

    def test_threads_that_change_one_scan_wait_for_each_other_only(self):
        """Threads of the pool that steal another change must not wait for the lock of the first one."""
        code = """
import threading
import numpy as np
import nearmiss
from scenes import plate

points = plate(count=100)
moving, failed = nearmiss.MovingScan(points), []

def change(seed):
    try:
        for step in range(24):
            frame = points + [0.0, 0.0, 0.5 + 0.01 * ((seed + step) % 7)]
            if (seed + step) % 3 == 0:
                moving.replace(frame)
            elif (seed + step) % 3 == 1:
                moving.replace_organised(frame.reshape(100, 100, 3))
            else:
                moving.move_to(points * (1.0 + 0.5 * (step % 2)))
    except BaseException as cause:
        failed.append(cause)

threads = [threading.Thread(target=change, args=(seed,)) for seed in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
assert not failed, failed
print(len(moving))
"""
        # The time limit ends the test if threads wait for ever.
        told = subprocess.run(
            [sys.executable, "-B", "-c", code],
            cwd=Path(__file__).parent,
            env={**os.environ, "RAYON_NUM_THREADS": "4"},
            capture_output=True,
            text=True,
            timeout=180,
            check=False,
        )
        self.assertEqual((told.returncode, told.stdout.strip()), (0, "10000"), told.stderr)

    def test_the_world_takes_still_frames(self):
        world, moving = nearmiss.World(), MovingScan(plate())
        world.insert(moving.still())
        world.insert(dragon(), at(0.5, 0.5, 0.0))
        self.assertEqual(world.collide()[1]["verdict"].tolist(), [1])


if __name__ == "__main__":
    unittest.main()
