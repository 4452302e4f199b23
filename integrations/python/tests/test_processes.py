"""Memory, threads, forks and spawned processes; pictures."""

import gc
import multiprocessing
import os
import pickle
import signal
import threading
import time
import tracemalloc
import unittest

import numpy as np

import nearmiss
from scenes import dragon, plate, poses

#: Builds and queries; `NEARMISS_LEAKS=100000` runs as many as the guide claims.
ROUNDS = int(os.environ.get("NEARMISS_LEAKS", "2000"))


def resident():
    """The memory of this process in bytes."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def verdicts(seed):
    """The verdicts of a batch, and of single questions."""
    scan, at = dragon(), poses(seed, 40, 0.1)
    single = [scan.collide(scan, pose).touches for pose in at]
    return single == [bool(v) for v in scan.collide_each(scan, at)["verdict"]]


class Memory(unittest.TestCase):
    @unittest.skipUnless(os.path.exists("/proc/self/statm"), "needs /proc")
    def test_nothing_leaks(self):
        points, scan, pose = plate(count=8), dragon(), poses(1, 1, 0.1)[0]
        shape = nearmiss.Shape.sphere([0, 0.1, 0], 0.01)
        target, hint, bad = scan.target(), nearmiss.Hint(), np.ones((4, 4))

        def ask(count):
            for _ in range(count):
                scan.collide(scan, pose, hint=hint, margin=0.001)
                target.touch(shape)
                target.cast([0, 0, 1], [0, 0, -1])
                scan.manifold(scan, pose)
                try:
                    scan.collide(scan, bad)
                except ValueError:
                    pass

        def build(count):
            for _ in range(count):
                small = nearmiss.Scan(points)
                nearmiss.Scan.from_bytes(small.to_bytes())
                small.collide_each(small, pose[None])
                moving = nearmiss.MovingScan(points)
                kept = moving.still()
                moving.move_to(points + 0.1)
                kept.collide(moving)

        for work, count in ((ask, 5 * ROUNDS), (build, ROUNDS)):
            work(count // 5 + 100)
            gc.collect()
            tracemalloc.start()
            before, traced = resident(), tracemalloc.get_traced_memory()[0]
            work(count)
            gc.collect()
            grown = resident() - before
            kept = tracemalloc.get_traced_memory()[0] - traced
            tracemalloc.stop()
            self.assertLess(kept, 20_000, f"{work.__name__}: bytes of Python after {count}")
            self.assertLess(grown, 8 << 20, f"{work.__name__}: resident bytes after {count}")


class Concurrency(unittest.TestCase):
    def test_threads_share_a_scan(self):
        wrong = []

        def work(seed):
            if not verdicts(seed):
                wrong.append(seed)

        threads = [threading.Thread(target=work, args=(seed,)) for seed in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])

    def interrupted(self, work):
        """Interrupt `work` soon after its start and return the time that it took."""
        timer = threading.Timer(0.1, signal.raise_signal, [signal.SIGINT])
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        start = time.monotonic()
        try:
            timer.start()
            with self.assertRaises(KeyboardInterrupt):
                work()
        finally:
            timer.join()
            signal.signal(signal.SIGINT, before)
        return time.monotonic() - start

    def test_an_interrupt_ends_a_batch(self):
        scan = dragon()
        # Half a minute of work or more.
        many = np.repeat(poses(3, 1000, 0.1), 500, axis=0)
        self.assertLess(self.interrupted(lambda: scan.distance_each(scan, many)), 5.0)
        self.assertEqual(len(scan.distance_each(scan, many[:10])), 10)

    def test_an_interrupt_ends_the_wait_for_a_preparation(self):
        side = np.linspace(0.0, 1.0, 700)
        points = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
        points = np.column_stack([points, 0.05 * np.sin(9.0 * points[:, 0])])
        first = (np.arange(699)[:, None] * 700 + np.arange(699)).reshape(-1, 1)
        triangles = np.concatenate([first + [0, 1, 700], first + [1, 701, 700]])
        moving = nearmiss.MovingScan(plate())
        for name, work in [
            ("mesh", lambda: nearmiss.Mesh(points, triangles)),
            ("slices", lambda: nearmiss.SliceMap(points, pixel=2e-4, slice_height=1e-2)),
            ("frame", lambda: moving.replace(points)),
        ]:
            with self.subTest(name):
                start = time.monotonic()
                work()
                whole = time.monotonic() - start
                self.assertGreater(whole, 0.4, "long enough to be interrupted")
                self.assertLess(self.interrupted(work), 0.7 * whole)
        self.assertEqual(len(moving), len(points), "waits for the frame")

    @unittest.skipUnless(hasattr(os, "fork"), "needs fork")
    def test_forked_processes_answer_and_prepare(self):
        self.assertTrue(verdicts(1), "starts the threads of this process")
        with multiprocessing.get_context("fork").Pool(2) as pool:
            self.assertEqual(pool.map_async(verdicts, range(4)).get(60), [True] * 4)
            again = pool.apply_async(nearmiss.Scan, (plate(),)).get(60)
        self.assertEqual(again.to_bytes(), nearmiss.Scan(plate()).to_bytes())

    def test_spawned_processes_get_pickled_scans_and_return_answers(self):
        scan = dragon()
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            count = pool.apply_async(len, (scan,)).get(120)
            answer = pool.apply_async(scan.collide, (scan,)).get(120)
        self.assertEqual(count, len(scan))
        self.assertEqual(repr(answer), repr(scan.collide(scan)))

    def test_answers_are_pickled_whole(self):
        scan, ball = dragon(), nearmiss.Shape.sphere([0.0, 0.1, 0.0], 0.02)
        target = scan.target()
        away = nearmiss.pose(translation=[0.3, 0.0, 0.0])
        for answer in [
            scan.collide(scan, away),
            scan.distance(scan, away),
            target.touch(ball),
            target.distance(ball),
            target.cast([0.0, 0.1, 1.0], [0.0, 0.0, -1.0]),
            target.penetration(ball),
            nearmiss.sweep(scan, scan, [away, nearmiss.pose(translation=[0.4, 0.0, 0.0])]),
        ]:
            with self.subTest(type(answer).__name__):
                again = pickle.loads(pickle.dumps(answer))
                names = [name for name in dir(answer) if not name.startswith("_")]
                self.assertGreater(len(names), 4)
                for name in names:
                    self.assertEqual(repr(getattr(again, name)), repr(getattr(answer, name)), name)
        with self.assertRaises(ValueError):
            nearmiss.Answer._from_bytes(b"short")


class Pictures(unittest.TestCase):
    def test_plots(self):
        try:
            import matplotlib
        except ImportError:
            self.skipTest("needs matplotlib")
        matplotlib.use("agg")
        from nearmiss import plot

        scan, apart = dragon(), nearmiss.pose(translation=[0.24, 0, 0])
        self.assertIn("apart", plot.contact(scan, scan, apart).get_title())
        self.assertEqual(plot.contact(scan, scan, nearmiss.pose(translation=[0.05, 0, 0])).get_title(), "touching")
        plot.clearance(scan.distance_each(scan, poses(1, 20, 0.2)))

    def test_scipy_rotations(self):
        try:
            from scipy.spatial.transform import Rotation
        except ImportError:
            self.skipTest("needs scipy")
        turn, scan = Rotation.from_euler("xyz", [0.1, 0.2, 0.3]), dragon()
        by_scipy = scan.distance(scan, (turn, [0.3, 0, 0]))
        self.assertEqual(by_scipy.lower, scan.distance(scan, nearmiss.pose(turn.as_matrix(), [0.3, 0, 0])).lower)
        many = Rotation.from_rotvec(np.random.default_rng(0).normal(size=(5, 3)))
        self.assertEqual(scan.collide_each(scan, (many, [0.3, 0, 0])).shape, (5,))


if __name__ == "__main__":
    unittest.main()
