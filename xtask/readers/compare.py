"""Compares the points that nearmiss reads with those that independent readers do.

usage: compare.py NEARMISS FILE...

Prints a line a file: how many points there are and whether all values are equal. Exit status 1 if some are
not. Install what is imported here with `cargo xtask readers`.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import laspy
import numpy
import plyfile
import pye57
import trimesh


def ours(program, path):
    """What nearmiss reads, by way of a PLY file: a table with named columns."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out.ply"
        subprocess.run([program, "convert", path, out, "--quiet"], check=True, capture_output=True)
        return plyfile.PlyData.read(out)["vertex"].data


def columns(**values):
    return {name: numpy.asarray(column) for name, column in values.items() if column is not None}


def las(path):
    read = laspy.read(path)
    names = set(read.point_format.dimension_names)
    values = columns(x=read.x, y=read.y, z=read.z, intensity=read.intensity, classification=read.classification)
    if "red" in names:
        colours = {name: numpy.asarray(read[name]) for name in ("red", "green", "blue")}
        wide = max(colour.max() for colour in colours.values()) > 255
        values |= {name: colour // 256 if wide else colour for name, colour in colours.items()}
    return values


def e57(path):
    file = pye57.E57(str(path))
    scans = [
        file.read_scan(i, ignore_missing_fields=True, intensity=True, colors=True) for i in range(file.scan_count)
    ]
    return {k: numpy.concatenate([scan["cartesian" + k.upper()] for scan in scans]) for k in "xyz"}


def ply(path):
    vertex = plyfile.PlyData.read(path)["vertex"].data
    wanted = ("x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "intensity")
    return {name: vertex[name] for name in wanted if name in vertex.dtype.names}


def npy(path):
    return dict(zip("xyz", numpy.load(path).T))


def text(path):
    lines = Path(path).read_text().replace(",", " ").replace(";", " ").splitlines()
    rows = [line.split() for line in lines if line.strip() and not line.startswith("#")]
    names = [] if rows[0][0][0] in "-.0123456789" else [name.lower() for name in rows.pop(0)]
    places = [names.index(k) if names else i for i, k in enumerate("xyz")]
    rows = [[float(row[place]) for place in places] for row in rows if len(row) >= 3]
    return dict(zip("xyz", numpy.array(rows).T))


def mesh(path):
    read = trimesh.load(path, process=False, force="mesh")
    return dict(zip("xyz", numpy.asarray(read.vertices).T))


READERS = {
    "las": las, "laz": las, "e57": e57, "ply": ply, "npy": npy, "xyz": text, "csv": text, "stl": mesh, "off": mesh,
    "glb": mesh, "gltf": mesh,
}


def compare(program, path):
    """What differs, and how many points there are."""
    ending = path.suffix[1:].lower()
    theirs = READERS[ending](path)
    mine = ours(program, path)
    keep = numpy.isfinite(theirs["x"]) & numpy.isfinite(theirs["y"]) & numpy.isfinite(theirs["z"])
    theirs = {name: column[keep] for name, column in theirs.items()}
    if ending in ("stl", "glb", "gltf"):
        # Corners at one place are one vertex for one reader and several for the other.
        rows = [numpy.stack([table[k] for k in "xyz"], 1).astype("f4") for table in (theirs, mine)]
        theirs, mine = (dict(zip("xyz", numpy.unique(row + 0.0, axis=0).T)) for row in rows)
    names = mine if isinstance(mine, dict) else mine.dtype.names
    count = len(mine["x"])
    if len(theirs["x"]) != count:
        return [f"{count} points instead of {len(theirs['x'])}"], count
    # What a reader rounds to single precision, as plyfile does with text, we may have in double precision.
    mine = {name: mine[name].astype(column.dtype) for name, column in theirs.items() if name in names}
    wrong = [name for name, column in theirs.items() if not numpy.array_equal(mine.get(name), column)]
    return wrong, count


def main():
    program, *paths = sys.argv[1:]
    differs = False
    for path in map(Path, paths):
        try:
            wrong, count = compare(program, path)
        except (plyfile.PlyParseError, laspy.LaspyException) as cause:
            print(f"{path.name}: not read by the other reader: {cause}")
            continue
        differs |= bool(wrong)
        print(f"{path.name}: {count} points, " + (f"other {', '.join(wrong)}" if wrong else "all equal"))
    sys.exit(differs)


main()
