"""A tour of nearmiss in Python: python tour.py SCAN [OUT.png]."""

import sys
import time

import numpy as np

import nearmiss
from nearmiss import Shape

if len(sys.argv) < 2:
    sys.exit(__doc__)
# Prepare once, save, open by mapping. A scan is also made from an array: nearmiss.Scan(points).
scan = nearmiss.Scan.read(sys.argv[1], progress=lambda share: print(f"\rpreparing {share:4.0%}", end=""))
scan.save("tour.nm")
scan = nearmiss.Scan.open("tour.nm", check="structure")
print(f"\n{scan} bounds {scan.bounds.tolist()}")

# Does it touch a copy of itself, moved along x? A pose is a 4×4 array.
size = float(np.ptp(scan.bounds, axis=0).max())
apart = nearmiss.pose(translation=[1.2 * size, 0, 0])
near = nearmiss.pose(translation=[0.45 * size, 0.05 * size, 0])
print(scan.collide(scan, apart), scan.collide(scan, near), scan.distance(scan, apart), sep="\n")

# A hundred thousand poses on all cores give a structured array.
rng = np.random.default_rng(0)
poses = nearmiss.pose(translation=rng.normal(size=(100_000, 3)) * size)
start = time.perf_counter()
answers = scan.collide_each(scan, poses)
seconds = time.perf_counter() - start
print(f"{(answers['verdict'] == 1).sum()} of {len(answers)} poses touch, {1e6 * seconds / len(answers):.2f} µs each")
print(f"the least certified gap is {np.nanmin(answers['gap']):.4g}")

# Contact points for a solver, and all contacts.
(answer, manifold), (_, contacts) = scan.manifold(scan, near), scan.contacts(scan, near)
print(answer, "with", len(manifold), "manifold points and", len(contacts), "contacts")

# Shapes and rays against the surface.
target = scan.target()
middle = scan.bounds.mean(axis=0)
ball = Shape.sphere(middle, 0.3 * size)
print(target.touch(ball), target.distance(ball), target.contacts(ball)["depth"])
low, high = scan.bounds
rays = target.cast_each(rng.uniform(low, high, size=(1000, 3)) + [0, 0, size], [0, 0, -1])
print(rays["hit"].mean(), "of the rays from above hit; the highest place is", rays["point"][rays["hit"], 2].max())

# A whole motion: free, or the first impact.
path = nearmiss.pose(translation=[[1.2 * size, 0, 0], [0.2 * size, 0, 0]])
print(nearmiss.sweep(scan, scan, path))

# A world finds the pairs that may touch.
world = nearmiss.World()
for shift in np.linspace(0, 3, 8):
    world.insert(scan, nearmiss.pose(translation=[shift * size, 0, 0]))
pairs, found = world.collide()
print(pairs[found["verdict"] == 1].tolist(), "touch")

if len(sys.argv) > 2:
    from nearmiss import plot

    plot.contact(scan, scan, near).figure.savefig(sys.argv[2], dpi=150)
