"""Meshes, alone and against scans; clashes and curves of scans."""

import pickle
import tempfile
import unittest
from pathlib import Path

import numpy as np

import nearmiss
from scenes import DRAGON, dragon, plate, poses


def cube(half=0.5):
    """Vertices and triangles of a closed cube about the origin."""
    corners = np.array([[x, y, z] for x in (-half, half) for y in (-half, half) for z in (-half, half)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])


def at(x, y=0.0, z=0.0):
    return nearmiss.pose(translation=[x, y, z])


class Meshes(unittest.TestCase):
    def test_two_cubes_are_compared_exactly(self):
        mesh = nearmiss.Mesh(*cube())
        self.assertEqual((len(mesh), mesh.is_closed), (12, True))
        np.testing.assert_array_equal(mesh.bounds, [[-0.5] * 3, [0.5] * 3])
        for x, touches, distance in [(0.75, True, 0.0), (1.0, True, 0.0), (1.25, False, 0.25), (3.0, False, 2.0)]:
            answer, apart = mesh.collide(mesh, at(x)), mesh.distance(mesh, at(x))
            self.assertEqual(answer.touches, touches, x)
            self.assertEqual(answer.evidence, "certified", x)
            self.assertEqual(answer.gap, None if touches else 0.0, x)
            self.assertNotIn("nan", repr(answer).lower(), x)
            self.assertAlmostEqual(apart.upper, distance, delta=1e-9, msg=str(x))
            self.assertEqual(apart.lower, apart.upper, x)
        out = mesh.penetration(mesh, at(0.75))
        self.assertTrue(0.1 < out.lower <= 0.25 <= out.upper < 0.26, out)
        self.assertGreater(out.direction[0], 0.99)
        self.assertEqual((out.evidence, out.band, out.complete), ("certified", 0.0, True))
        self.assertFalse(mesh.penetration(mesh, at(0.75), work=1).complete)
        answer, contacts = mesh.contacts(mesh, at(0.75, 0.1, 0.2))
        self.assertEqual((answer.touches, answer.evidence, answer.complete), (True, "certified", True))
        self.assertEqual(contacts["ends"].shape[1:], (2, 3))
        self.assertLess(np.abs(contacts["point"] - contacts["ends"].mean(axis=1)).max(), 1e-9)

    def test_batches_agree_with_single_answers(self):
        mesh, where = nearmiss.Mesh.read(DRAGON), poses(3, 200, 0.1)
        answers, distances = mesh.collide_each(mesh, where), mesh.distance_each(mesh, where)
        self.assertGreater((answers["verdict"] == 1).sum(), 10)
        self.assertGreater((answers["verdict"] == 0).sum(), 10)
        for i in range(200):
            self.assertEqual(mesh.collide(mesh, where[i]).touches, bool(answers["verdict"][i]), i)
            self.assertEqual(mesh.distance(mesh, where[i]).upper, distances["upper"][i], i)
        np.testing.assert_array_equal(distances["upper"] == 0.0, answers["verdict"] == 1)
        likely = mesh.collide_each(mesh, where, p_min=0.9, k_min=1)
        missed = (likely["likelihood"] < 0.5) & (answers["verdict"] == 1)
        self.assertFalse(missed.any(), "no contact is missed")

    def test_a_mesh_meets_a_scan_of_the_same_thing(self):
        mesh, scan = nearmiss.Mesh.read(DRAGON), dragon()
        self.assertTrue(mesh.collide(scan, at(0.09, 0.03, 0.01)).touches)
        apart = mesh.distance(scan, at(0.3))
        self.assertTrue(0.0 < apart.lower <= apart.upper, apart)
        other = scan.distance(scan, at(0.3))
        self.assertLess(abs(apart.upper - other.upper), scan.sampling_radius)
        self.assertFalse(mesh.collide(scan, at(0.3), margin=0.9 * apart.lower).touches)
        self.assertTrue(mesh.collide(scan, at(0.3), margin=1.1 * apart.upper).touches)
        verdicts = mesh.collide_each(scan, poses(5, 50, 0.1))["verdict"]
        self.assertEqual(set(verdicts.tolist()), {0, 1})

    def test_a_mesh_and_a_scan_move_out_of_each_other(self):
        mesh, scan, near = nearmiss.Mesh.read(DRAGON), dragon(), np.array([0.09, 0.03, 0.01])
        exact = mesh.penetration(mesh, at(*near)).upper
        whole, contacts = mesh.contacts(mesh, at(*near))
        hasty, some = mesh.contacts(mesh, at(*near), work=whole.node_pairs // 4)
        self.assertEqual((whole.complete, hasty.complete), (True, False))
        self.assertLess(len(some), len(contacts))
        for a, b, solid, wrong in ((scan, mesh, "a", "b"), (mesh, scan, "b", "both")):
            out = a.penetration(b, at(*near), solid=solid)
            self.assertTrue(0.0 <= out.lower <= out.upper, out)
            self.assertLess(abs(out.upper - exact), 2.0 * scan.sampling_radius)
            free = at(*(near + 1.001 * out.upper * np.array(out.direction)))
            self.assertEqual(a.penetration(b, free, solid=solid).upper, 0.0)
            with self.assertRaisesRegex(ValueError, "to name scans"):
                a.penetration(b, solid=wrong)
        with self.assertRaisesRegex(ValueError, "to name scans"):
            mesh.penetration(mesh, solid="a")
        with self.assertRaisesRegex(TypeError, "options among work"):
            mesh.penetration(mesh, margin=0.1)

    def test_meshes_sweep(self):
        mesh = nearmiss.Mesh(*cube())
        path = np.stack([at(3.0), at(0.5)])
        hit = nearmiss.sweep(mesh, mesh, path)
        self.assertEqual((hit.verdict, hit.evidence), ("impact", "certified"))
        self.assertTrue(0.79 < hit.t_free <= hit.t_hit < 0.802, hit)
        kept = nearmiss.sweep(mesh, mesh, path, clearance=0.5)
        self.assertAlmostEqual(kept.t_hit, 0.6, delta=2e-3)
        # Both move: the second one towards the first one, which withdraws.
        withdrawn = nearmiss.sweep(mesh, mesh, path, np.stack([at(0.0), at(-2.0)]))
        self.assertEqual((withdrawn.verdict, withdrawn.t_free), ("free", 1.0))
        self.assertAlmostEqual(withdrawn.upper, 1.5, delta=1e-6)
        self.assertEqual(nearmiss.sweep(mesh, mesh, path, work=1).reason, "budget")
        with self.assertRaisesRegex(TypeError, "options among work, seconds"):
            nearmiss.sweep(mesh, mesh, path, thickened=1.0)
        with self.assertRaisesRegex(TypeError, "expected a Scan, a MovingScan or a Mesh, got int"):
            nearmiss.sweep(mesh, 1, path)

    def test_a_mesh_sweeps_past_a_scan(self):
        scan, small = dragon(), nearmiss.Mesh(*cube(0.02))
        path = np.stack([at(0.4, 0.1), at(0.0, 0.1)])
        hit, swapped = nearmiss.sweep(scan, small, path), nearmiss.sweep(small, scan, np.eye(4), path)
        self.assertTrue(hit.hits and 0 < hit.t_free <= hit.t_hit < 1, hit)
        self.assertEqual((hit.t_free, hit.t_hit, hit.witness), (swapped.t_free, swapped.t_hit, swapped.witness))
        free = nearmiss.sweep(scan, small, np.stack([at(0.4, 0.1), at(0.4, -0.1)]))
        self.assertEqual((free.verdict, free.evidence), ("free", "certified"))
        for y in (0.1, 0.05, 0.0, -0.05, -0.1):
            apart = scan.distance(small, at(0.4, y))
            self.assertTrue(0.0 < free.clearance <= apart.upper and free.upper <= apart.upper * (1 + 1e-9), (y, apart))

    def test_files_and_pickles_hold_the_same_mesh(self):
        mesh = nearmiss.Mesh.read(DRAGON)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "dragon.nm"
            mesh.save(path)
            for again in (nearmiss.Mesh.open(path), pickle.loads(pickle.dumps(mesh))):
                self.assertEqual(again.to_bytes(), mesh.to_bytes())
            with self.assertRaises(ValueError):
                nearmiss.Scan.open(path)

    def test_what_is_wrong_raises_a_value_error(self):
        vertices, triangles = cube()
        mesh = nearmiss.Mesh(vertices, triangles)
        for words, call in {
            r"index below 8|below 8": lambda: nearmiss.Mesh(vertices, triangles + 5),
            r"shape \(N, 3\), got \(12, 2\)": lambda: nearmiss.Mesh(vertices, triangles[:, :2]),
            r"no integers": lambda: nearmiss.Mesh(vertices, triangles * 1.0),
            r"indices from 0": lambda: nearmiss.Mesh(vertices, triangles - 1),
            r"positive area": lambda: nearmiss.Mesh(vertices, triangles[:, [0, 0, 0]]),
            r"p_min from 0 to 1": lambda: mesh.collide(mesh, p_min=2.0),
        }.items():
            with self.subTest(words), self.assertRaisesRegex(ValueError, words):
                call()
        with self.assertRaisesRegex(TypeError, "options among p_min"):
            mesh.collide(mesh, margin=0.1)
        with self.assertRaises(TypeError):
            mesh.collide("mesh")


class Clashes(unittest.TestCase):
    def test_crossing_plates_clash_along_a_line(self):
        scan = nearmiss.Scan(plate())
        upright = np.array([[1, 0, 0, 0.005], [0, 0, -1, 0.505], [0, 1, 0, -0.505], [0, 0, 0, 1.0]])
        (clash,) = scan.clashes(scan, upright)
        self.assertTrue(clash["hard"])
        self.assertEqual(clash["upper"], 0.0)
        self.assertGreater(clash["size"][0], 0.7)
        (curve,) = scan.curves(scan, upright)
        self.assertEqual(curve.shape[1], 3)
        self.assertLess(np.abs(curve[:, 1:] - [0.505, 0.0]).max(), 1e-3)
        self.assertGreater(np.ptp(curve[:, 0]), 0.9)
        self.assertTrue(np.isnan(clash["depth"]) and np.isnan(clash["depth_direction"]).all())

    def test_hard_clashes_tell_their_depth(self):
        scan = nearmiss.Scan(plate())
        upright = np.array([[1, 0, 0, 0.005], [0, 0, -1, 0.505], [0, 1, 0, -0.1], [0, 0, 0, 1.0]])
        (clash,) = scan.clashes(scan, upright, depth=True)
        self.assertTrue(0.08 < clash["depth"] < 0.13, clash)
        self.assertGreater(clash["depth_direction"][2], 0.9)
        self.assertEqual(clash["depth_lower"], 0.0)
        (solid,) = scan.clashes(scan, upright, solid="both")
        self.assertLessEqual(solid["depth_lower"], solid["depth"])
        with self.assertRaisesRegex(ValueError, "solid"):
            scan.clashes(scan, upright, solid="c")

    def test_near_places_are_listed_with_their_distance(self):
        scan = nearmiss.Scan(plate())
        self.assertEqual(len(scan.clashes(scan, at(0, 0, 0.2))), 0)
        (clash,) = scan.clashes(scan, at(0, 0, 0.2), clearance=0.25)
        self.assertFalse(clash["hard"])
        self.assertTrue(clash["lower"] <= 0.2 + 1e-6 and 0.2 - 1e-6 <= clash["upper"] < 0.22, clash)
        self.assertEqual(scan.curves(scan, at(0, 0, 0.2)), [])
        with self.assertRaisesRegex(ValueError, "link"):
            scan.clashes(scan, link=-1.0)


if __name__ == "__main__":
    unittest.main()
