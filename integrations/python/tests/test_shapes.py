"""Shapes, rays, sweeps, worlds, slice maps, messages of ROS."""

import tempfile
import unittest
from types import SimpleNamespace

import numpy as np

import nearmiss
from nearmiss import Shape
from scenes import dragon, plate, poses, room


class Shapes(unittest.TestCase):
    def setUp(self):
        self.floor = nearmiss.Scan(plate())

    def test_each_shape_stands_on_the_floor(self):
        target = self.floor.target(margin=0.005)
        at = nearmiss.pose(translation=[0.5, 0.5, 0.2])
        upright = nearmiss.pose([[1, 0, 0], [0, 0, -1], [0, 1, 0]], [0.5, 0.5, 0.2])
        corners = [[x, y, z] for x in (0.4, 0.6) for y in (0.4, 0.6) for z in (0.1, 0.3)]
        for shape in (
            Shape.sphere([0.5, 0.5, 0.2], 0.1),
            Shape.capsule([0.5, 0.5, 0.2], [0.6, 0.5, 0.2], 0.1),
            Shape.box([0.1, 0.1, 0.1], at),
            Shape.box([0.1, 0.1, 0.05], at, rounding=0.05),
            Shape.cylinder(0.1, 0.05, upright),
            Shape.cone(0.1, 0.05, upright),
            Shape.triangle([[0.5, 0.5, 0.1], [0.6, 0.5, 0.3], [0.5, 0.6, 0.3]]),
            Shape.hull(corners),
        ):
            distance = target.distance(shape)
            self.assertLessEqual(distance.lower, 0.1, shape)
            self.assertAlmostEqual(distance.upper, 0.1, 6, shape)
            self.assertFalse(target.touch(shape).touches, shape)
            self.assertTrue(self.floor.target(margin=0.11).touch(shape).touches, shape)
            self.assertIsInstance(repr(shape), str)

    def test_contacts_push_out(self):
        target, hint = self.floor.target(margin=0.005), nearmiss.ShapeHint()
        height, ids = 0.12, set()
        for _ in range(100):
            height -= 0.002
            contacts = target.contacts(Shape.sphere([0.5, 0.5, height], 0.1), hint=hint)
            if len(contacts):
                height += max(contacts["depth"][0], 0) * contacts["normal"][0, 2]
                ids.add(int(contacts["id"][0]))
        self.assertAlmostEqual(height, 0.1, 3)
        self.assertEqual(len(ids), 1)
        hint.clear()

    def test_penetration_is_the_way_out(self):
        target = self.floor.target()
        ball = Shape.sphere([0.5, 0.5, 0.06], 0.1)
        out = target.penetration(ball)
        self.assertLessEqual(out.lower, 0.04 + 1e-9)
        self.assertGreater(out.lower, 0.035)
        self.assertAlmostEqual(out.upper, 0.04, 2)
        self.assertGreater(out.direction[2], 0.98)
        self.assertTrue(out.complete)
        self.assertGreater(out.band, 0.0)
        self.assertRegex(repr(out), r"^<Penetration between 0\.0\d+ and 0\.0\d+, (certified|estimated)>$")
        free = target.penetration(Shape.sphere([0.5, 0.5, 0.3], 0.1))
        self.assertEqual((free.lower, free.upper, free.direction), (0.0, 0.0, [0.0] * 3))
        for limit in ({"work": 3}, {"seconds": 0.0}):
            hasty = target.penetration(ball, **limit)
            self.assertFalse(hasty.complete, limit)
            self.assertTrue(hasty.lower <= 0.04 + 1e-9 and hasty.upper >= 0.04 - 1e-3, (limit, hasty))
        self.assertTrue(target.penetration(ball, work=10**6).complete)
        with self.assertRaisesRegex(TypeError, "options among work, seconds, got `margin`"):
            target.penetration(ball, margin=0.1)
        with self.assertRaisesRegex(TypeError, "answer.lower"):
            bool(out)

    def test_lower_bounds_hold_beyond_the_reach(self):
        ball, low = Shape.sphere([0.5, 0.5, 0.3], 0.1), Shape.sphere([0.5, 0.5, 0.103], 0.1)
        for options in ({}, {"thickened": 0.01}, {"evidence": "estimated"}):
            target = self.floor.target(**options)
            whole = target.distance(ball)
            for within in (0.0, 0.05, 0.15, 0.999 * whole.upper):
                found = target.distance(ball, within)
                self.assertEqual((found.upper, found.point, found.evidence), (np.inf, None, None), (options, within))
                self.assertLessEqual(found.lower, within, options)
                self.assertEqual(target.distance_each([ball], within)["lower"][0], found.lower, options)
            expected = 0.0 if "evidence" in options else 0.05
            self.assertEqual(target.distance(ball, 0.05).lower, expected, options)
            self.assertAlmostEqual(target.distance(ball, 1.0).lower, whole.lower, 6, options)
        # Just above the floor, the obstacle may be nearer than its discs.
        near = self.floor.target().distance(low, 0.002)
        self.assertTrue(0.0 <= near.lower <= 0.002 and near.upper == np.inf, near)

    def test_scans_move_apart(self):
        near = nearmiss.pose(translation=[0.09, 0.03, 0.01])
        out = dragon().penetration(dragon(), near, solid="both")
        self.assertTrue(0 < out.lower <= out.upper < 0.1, out)
        self.assertTrue(out.complete)
        way = np.multiply(out.direction, out.upper * (1 + 1e-6))
        moved = nearmiss.pose(translation=np.add([0.09, 0.03, 0.01], way))
        self.assertFalse(dragon().collide(dragon(), moved).touches)
        self.assertEqual(dragon().penetration(dragon(), near).lower, 0.0)
        self.assertFalse(dragon().penetration(dragon(), near, work=10).complete)
        with self.assertRaisesRegex(ValueError, 'expected `solid` to be "a", "b" or "both", got "c"'):
            dragon().penetration(dragon(), near, solid="c")

    def test_batches_equal_single_questions(self):
        target = dragon().target(poses(1, 1, 0.01)[0])
        rng = np.random.default_rng(3)
        shapes = [Shape.sphere(c, 0.01) for c in rng.uniform(*dragon().bounds, size=(100, 3))]
        touched, away = target.touch_each(shapes), target.distance_each(shapes, within=0.05)
        self.assertGreater(touched["verdict"].sum(), 3)
        for i, shape in enumerate(shapes):
            self.assertEqual(target.touch(shape).touches, bool(touched["verdict"][i]))
            self.assertEqual(target.distance(shape, 0.05).upper, away["upper"][i])
        origins, ways = rng.uniform(-0.3, 0.3, size=(100, 3)), rng.normal(size=(100, 3))
        hits = target.cast_each(origins, ways, max=1.0)
        for i in range(100):
            single = target.cast(origins[i], ways[i], max=1.0)
            self.assertEqual(single.hit, hits["hit"][i])
            if single.hit:
                self.assertEqual(single.t, hits["t"][i])
                along = origins[i] + ways[i] / np.linalg.norm(ways[i]) * single.t
                np.testing.assert_allclose(single.point, along, atol=1e-6)
        self.assertEqual(target.touch_each([]).shape, (0,))

    def test_rays(self):
        target = self.floor.target()
        hit = target.cast([0.3, 0.3, 2], [0, 0, -5])
        self.assertAlmostEqual(hit.t, 2.0, 6)
        self.assertGreater(abs(hit.normal[2]), 0.99)
        self.assertFalse(target.cast([0.3, 0.3, 2], [0, 0, -1], max=1.0).hit)
        self.assertAlmostEqual(target.cast([0.3, 0.3, 2], [0, 0, -1], radius=0.1).t, 1.9, 6)
        self.assertEqual(len(target.cast_all([0.3, 0.3, 2], [0, 0, -1])), 1)
        for length in (0.001, 1.0, 1000.0):
            self.assertAlmostEqual(target.cast([0.3, 0.3, 2], [0, 0, -length]).t, 2.0, 6)
        self.assertGreater(hit.normal[2], 0.99, "to the side of the ray")
        self.assertLess(target.cast([0.3, 0.3, -2], [0, 0, 1]).normal[2], -0.99, "to the side of the ray")
        oriented = nearmiss.Scan(plate(), scanner=[0.5, 0.5, 5.0])
        self.assertTrue(oriented.is_oriented)
        for origin, way in (([0.3, 0.3, 2], [0, 0, -1]), ([0.3, 0.3, -2], [0, 0, 1])):
            self.assertGreater(oriented.target().cast(origin, way).normal[2], 0.99, "outwards")
        down = target.cast_each([[0.1, 0.1, 1], [5, 5, 1]], [0, 0, -1])
        self.assertEqual(down["hit"].tolist(), [True, False])
        self.assertTrue(np.isnan(down["t"][1]))

    def test_bad_shapes_and_rays_are_refused(self):
        target = self.floor.target()
        for words, call in {
            "finite points of a shape": lambda: Shape.sphere([np.nan, 0, 0], 1),
            "lengths of a shape of at least 0, got -1": lambda: Shape.sphere([0, 0, 0], -1),
            "three numbers for the centre": lambda: Shape.sphere([0, 0], 1),
            r"triangle, of shape \(3, 3\), got \(4, 3\)": lambda: Shape.triangle(np.zeros((4, 3))),
            "at least one point of a hull": lambda: Shape.hull(np.zeros((0, 3))),
            "rotation with uniform scale": lambda: Shape.box([1, 1, 1], np.diag([1.0, 2, 1, 1])),
            "direction other than 0": lambda: target.cast([0, 0, 0], [0, 0, 0]),
            "finite origin": lambda: target.cast([0, 0, np.inf], [0, 0, 1]),
            "greatest length of rays": lambda: target.cast([0, 0, 0], [0, 0, 1], max=-1),
            "finite radius of rays": lambda: target.cast([0, 0, 0], [0, 0, 1], radius=np.nan),
            r"directions of shape \(3, 3\)": lambda: target.cast_each(np.zeros((3, 3)), np.ones((2, 3))),
            "sequence of Shape": lambda: target.touch_each([1, 2]),
            "reach of at least 0, got NaN": lambda: target.distance(Shape.sphere([0, 0, 0], 1), np.nan),
        }.items():
            with self.subTest(words), self.assertRaisesRegex(ValueError, words):
                call()


class Motions(unittest.TestCase):
    def test_sweeps(self):
        scan = dragon()
        over = nearmiss.pose(translation=[[-0.3, 0.25, 0], [0.0, 0.25, 0], [0.3, 0.25, 0]])
        free = nearmiss.sweep(scan, scan, over)
        self.assertEqual((free.verdict, free.hits, free.t_free), ("free", False, 2.0))
        self.assertGreater(free.clearance, 0)
        into = nearmiss.sweep(scan, scan, nearmiss.pose(translation=[[-0.3, 0.02, 0], [0.05, 0.02, 0]]))
        self.assertTrue(into.hits)
        self.assertTrue(0 < into.t_free <= into.t_hit < 1)
        self.assertEqual(nearmiss.sweep(scan, scan, over, work=5).reason, "budget")
        with self.assertRaisesRegex(ValueError, "one scale along a path"):
            changing = over.copy()
            changing[1, :3, :3] *= 2
            nearmiss.sweep(scan, scan, changing)
        with self.assertRaisesRegex(ValueError, "margin"):
            nearmiss.sweep(scan, scan, over, clearance=-1)

    def test_shapes_sweep(self):
        x, y = np.meshgrid(np.arange(50) * 0.02, np.arange(50) * 0.02)
        floor = nearmiss.Scan(np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3))
        target, ball = floor.target(), Shape.sphere([0, 0, 0], 0.1)
        down = nearmiss.pose(translation=[[0.5, 0.5, 1], [0.5, 0.5, -1]])
        hit = target.sweep(ball, down)
        self.assertEqual((hit.verdict, hit.hits, hit.evidence), ("impact", True, None))
        self.assertAlmostEqual(hit.t_hit, 0.45, delta=0.005)
        self.assertTrue(0.43 < hit.t_free <= hit.t_hit)
        self.assertAlmostEqual(hit.witness[2], 0.0, 3)
        self.assertAlmostEqual(hit.band, floor.sampling_radius, 6)
        self.assertEqual(target.sweep(ball, down, work=1).reason, "budget")
        beside = nearmiss.pose(translation=[[0.5, 0.5, 1], [0.5, 0.5, 0.4]])
        free = target.sweep(ball, beside)
        self.assertEqual((free.verdict, free.evidence, free.t_free), ("free", "certified", 1.0))
        self.assertTrue(0.28 < free.clearance <= 0.3 <= free.upper + 1e-9)
        self.assertTrue(floor.target(margin=0.35).sweep(ball, beside).hits)
        # The path of a hull, and of a target that was moved.
        wedge = Shape.hull([[0, 0, -0.1], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
        self.assertAlmostEqual(target.sweep(wedge, down).t_hit, 0.45, delta=0.005)
        lifted = floor.target(nearmiss.pose(translation=[0, 0, 0.5]))
        self.assertAlmostEqual(lifted.sweep(ball, down).t_hit, 0.2, delta=0.005)
        with self.assertRaisesRegex(ValueError, "pose 1: "):
            down[1, 0, 0] = 3
            target.sweep(ball, down)

    def test_worlds_find_what_pairs_find(self):
        scan, at = dragon(), poses(7, 12, 0.2)
        world = nearmiss.World()
        ids = [world.insert(scan, pose) for pose in at]
        pairs, answers = world.collide()
        found = {tuple(pair): answer["verdict"] for pair, answer in zip(pairs.tolist(), answers)}
        for i in range(12):
            for j in range(i + 1, 12):
                touches = scan.collide(scan, at[j], at[i]).touches
                self.assertEqual(touches, found.get((ids[i], ids[j]), 0) == 1, (i, j))
        world.move_to(ids[0], nearmiss.pose(translation=[9, 9, 9]))
        self.assertEqual(world.near_pairs(of=[ids[0]]).shape, (0, 2))
        world.remove(ids[1])
        self.assertEqual((len(world), world.ids), (11, [ids[0], *ids[2:]]))
        for unknown in (ids[1], 99):
            for ask in (
                lambda: world.near_pairs(of=[ids[0], unknown]),
                lambda: world.collide(of=[unknown]),
                lambda: world.nearest(of=[unknown]),
            ):
                with self.assertRaisesRegex(KeyError, f"id of a body of this world, got {unknown}; `ids`"):
                    ask()
        with self.assertRaisesRegex(KeyError, "got 99; `ids`"):
            world.nearest(ignore=[(ids[0], 99)])
        self.assertIsNotNone(world.nearest(ignore=[(ids[0], ids[1])]), "a body that was removed")
        for call in (lambda: world.remove(ids[1]), lambda: world.move_to(99, np.eye(4))):
            with self.assertRaises(KeyError):
                call()
        self.assertEqual(nearmiss.World().collide()[0].shape, (0, 2))

    def test_worlds_hold_meshes_and_shapes(self):
        x, y = np.meshgrid(np.arange(50) * 0.02, np.arange(50) * 0.02)
        floor = nearmiss.Scan(np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3))
        corners = [[0.0, 0.0, 0.0], [0.2, 0.0, 0.5], [-0.2, 0.0, 0.5]]
        tip, ball = nearmiss.Mesh(corners, [[0, 1, 2]]), nearmiss.Shape.sphere([0, 0, 0], 0.1)
        wedge = nearmiss.Shape.hull([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
        at = lambda *place: nearmiss.pose(translation=place)
        world = nearmiss.World()
        ground = world.insert(floor)
        mesh = world.insert(tip, at(0.5, 0.5, -0.1))
        low, high = world.insert(ball, at(0.2, 0.2, 0.09)), world.insert(ball, at(0.2, 0.2, 0.28))
        hull = world.insert(wedge, at(0.5, 0.45, 0.35))
        pairs, answers = world.collide()
        found = {tuple(pair): answer for pair, answer in zip(pairs.tolist(), answers)}
        touching = {pair for pair, answer in found.items() if answer["verdict"] == 1}
        self.assertEqual(touching, {(ground, mesh), (ground, low), (low, high), (mesh, hull)})
        on_floor = found[(ground, low)]
        self.assertTrue(on_floor["source_a"] >= 0 and on_floor["source_b"] == -1)
        self.assertAlmostEqual(on_floor["witness"][2], 0.0, 6)
        self.assertAlmostEqual(found[(ground, mesh)]["witness"][2], 0.0, 6)
        self.assertEqual((found[(low, high)]["evidence"], found[(low, high)]["band"]), (1, 0.0))

        gap = world.distance(ground, high)
        self.assertTrue(0.17 < gap.lower <= gap.upper and abs(gap.upper - 0.18) < 1e-6)
        self.assertEqual((gap.evidence, gap.source_b, gap.complete), ("estimated", None, True), "a tangent disc")
        self.assertTrue(gap.source_a >= 0 and gap.band > 0)
        turned = world.distance(high, ground)
        self.assertEqual((turned.source_a, turned.source_b, turned.upper), (None, gap.source_a, gap.upper))
        exact = world.distance(mesh, high)
        self.assertEqual((exact.evidence, exact.band, exact.source_a), ("certified", 0.0, None))
        np.testing.assert_allclose([gap.point_a[2], gap.point_b[2]], [0.0, 0.18], atol=1e-6)
        ids, nearest = world.nearest()
        self.assertEqual(nearest.upper, 0.0)
        ignore = [(low, ground), (ground, mesh), (low, high), (mesh, hull)]
        ids, nearest = world.nearest(ignore=ignore)
        self.assertEqual(list(ids), [ground, high])
        self.assertAlmostEqual(nearest.upper, 0.18, 6)
        self.assertEqual((nearest.evidence, nearest.band, nearest.source_a), (None, None, None))
        self.assertEqual(nearest.lower, gap.lower)
        self.assertIsNone(world.nearest(0.0, ignore=ignore, of=[high]))
        self.assertEqual(world.collide(margin=0.2)[1]["verdict"].tolist().count(1), 5)
        hasty = world.distance(ground, mesh, work=1)
        self.assertEqual((hasty.complete, hasty.upper >= hasty.lower), (tip.distance(floor, work=1).complete, True))
        with self.assertRaisesRegex(TypeError, "`seconds`"):
            world.nearest(seconds=1)
        for a, b, depth, up in ((ground, mesh, 0.1, 1), (mesh, ground, 0.1, -1), (low, high, 0.01, 1)):
            out = world.penetration(a, b)
            self.assertTrue(out.lower <= depth + 1e-6 and abs(out.upper - depth) < 2e-3, (a, b, out))
            self.assertGreater(up * out.direction[2], 0.99)
        self.assertEqual(world.penetration(ground, high).upper, 0.0)
        out = world.penetration(ground, low)
        self.assertTrue(out.lower <= 0.01 + 1e-6 and abs(out.upper - 0.01) < 2e-3 and out.direction[2] > 0.99)
        self.assertGreater(world.penetration(ground, low, solid="a").upper, 0.0)
        self.assertTrue(out.complete and not world.penetration(ground, low, work=2).complete)
        with self.assertRaisesRegex(ValueError, "no `margin` for bodies"):
            world.penetration(low, high, margin=0.1)
        with self.assertRaisesRegex(ValueError, "to name scans, got 'b'|to name scans, got \"b\""):
            world.penetration(ground, low, solid="b")
        for a, b in ((ground, 99), (99, ground)):
            with self.assertRaises(KeyError):
                world.distance(a, b)
            with self.assertRaises(KeyError):
                world.penetration(a, b)
        with self.assertRaisesRegex(TypeError, "a Scan, a Mesh or a Shape"):
            world.insert(np.eye(3))
        world.move_to(low, at(0.2, 0.2, 0.5))
        self.assertEqual(len(world.collide(of=[low])[0]), 0)
        world.remove(mesh)
        with self.assertRaises(KeyError):
            world.remove(mesh)

        # A world without scans.
        robot = nearmiss.World()
        arm = robot.insert(nearmiss.Shape.capsule([0, 0, 0], [1, 0, 0], 0.1))
        hand = robot.insert(ball, at(1.15, 0, 0))
        self.assertEqual(robot.collide()[1]["verdict"].tolist(), [1])
        robot.move_to(hand, at(1.5, 0, 0))
        self.assertAlmostEqual(robot.distance(arm, hand).upper, 0.3, 6)
        _, nearest = robot.nearest()
        self.assertEqual((nearest.evidence, nearest.band), ("certified", 0.0))

    def test_slice_maps(self):
        slices = nearmiss.SliceMap(room(), pixel=0.05)
        boxes = [[[2, 1, 0.5], [4, 3, 1.5]], [[0, 1, 0.5], [0.3, 3, 1.5]]]
        found = slices.query(boxes)
        self.assertEqual(found["collides"].tolist(), [False, True])
        self.assertAlmostEqual(found["floor"][0], 0.2, 1)
        points, end, length = slices.route([1, 1, 0], [5, 3, 0.2])
        self.assertTrue(4.4 < length < 6)
        np.testing.assert_allclose(end[:2], [5, 3], atol=0.1)
        places = slices.walk([1, 1, 0.01], points)
        np.testing.assert_allclose(places[-1], end, atol=0.05)
        self.assertIsNotNone(slices.standing([1, 1, 0]))
        with self.assertRaisesRegex(ValueError, "nearest place to stand"):
            slices.route([50, 1, 0], [5, 3, 0.2])
        with tempfile.TemporaryDirectory() as folder:
            slices.save(folder)
            again = nearmiss.SliceMap.open(folder)
            self.assertEqual(again.query(boxes).tolist(), found.tolist())
            self.assertEqual((len(again), again.pixel), (len(slices), 0.05))
        for words, call in {
            "expected x, y, z.*got `w`": lambda: nearmiss.SliceMap(room(), up="w"),
            r"boxes of shape \(N, 2, 3\)": lambda: slices.query([[1, 2, 3]]),
            "min ≤ max": lambda: slices.query([[[1, 1, 1], [0, 0, 0]]]),
            "got -1": lambda: nearmiss.SliceMap(room(), pixel=-1.0),
        }.items():
            with self.subTest(words), self.assertRaisesRegex(ValueError, words):
                call()


class Messages(unittest.TestCase):
    def test_point_cloud2(self):
        points = np.zeros((3, 4), dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("pad", "u1", 4)])
        points["x"] = np.arange(12).reshape(3, 4)
        points["z"][1, 2] = np.nan
        fields = [SimpleNamespace(name=n, offset=4 * i, datatype=7, count=1) for i, n in enumerate("xyz")]
        message = SimpleNamespace(
            height=3, width=4, fields=fields, is_bigendian=False, point_step=16, row_step=64,
            data=points.tobytes(), is_dense=False,
        )
        self.assertEqual(nearmiss.point_cloud2(message).shape, (11, 3))
        organised = nearmiss.point_cloud2(message, drop_invalid=False)
        self.assertEqual(organised.shape, (3, 4, 3))
        np.testing.assert_array_equal(organised[..., 0], points["x"])
        for data in (bytearray(points.tobytes()), np.frombuffer(points.tobytes(), "u1"), memoryview(points.tobytes())):
            message.data = data
            self.assertEqual(nearmiss.point_cloud2(message).shape, (11, 3))
        message.width = 5
        with self.assertRaisesRegex(ValueError, "row_step of at least 80"):
            nearmiss.point_cloud2(message)


if __name__ == "__main__":
    unittest.main()
