#!/usr/bin/python3
"""Turn the shapes of a run (&output shape_step) into a VTKHDF file, in which ParaView plays the motion.

The beam is a line of points that move, displacements magnified so that they can be seen; velocities are data of the points.
"""

import argparse
from pathlib import Path

import impactbeam_plots as plots
import h5py
import numpy as np

VTK_LINE = 3


def shapes_of(path, factor):
    """Instants, positions along the beam, displacements to be drawn and their factor, velocities."""
    with plots.open_results(path) as file:
        group = plots.group_of(file, "shapes", "&output shape_step")
        time = plots.values_of(group, "tau")
        along = group["x"][()]
        # counted from where the root is at first
        displacement = plots.values_of(group, "displacement")
        displacement = displacement - displacement[0, 0]
        velocity = group["velocity"][()]
    if factor is None:
        greatest = np.abs(displacement).max()
        factor = 0.25 * along[-1] / greatest if greatest > 0 else 1.0
    return time, along, factor * displacement, factor, velocity


def write(path, time, along, displacement, factor, velocity):
    """An unstructured grid of lines whose points move: VTKHDF 2.0, as ParaView 5.12 and later read it."""
    instants, points = displacement.shape
    cells = points - 1
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = (2, 0)
        root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", len("UnstructuredGrid")))
        file.attrs["magnified"] = factor
        places = np.zeros((instants, points, 3))
        places[:, :, 0] = along
        places[:, :, 1] = displacement
        root["Points"] = places.reshape(-1, 3)
        root["NumberOfPoints"] = np.full(instants, points, dtype=np.int64)
        root["NumberOfCells"] = np.array([cells], dtype=np.int64)
        root["NumberOfConnectivityIds"] = np.array([2 * cells], dtype=np.int64)
        root["Connectivity"] = np.stack([np.arange(cells), np.arange(1, points)], axis=1).ravel().astype(np.int64)
        root["Offsets"] = np.arange(0, 2 * points, 2, dtype=np.int64)
        root["Types"] = np.full(cells, VTK_LINE, dtype=np.uint8)
        data = root.create_group("PointData")
        data["displacement"] = displacement.ravel() / factor
        data["velocity"] = velocity.ravel()
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = instants
        steps["Values"] = time
        steps["PointOffsets"] = np.arange(instants, dtype=np.int64) * points
        none = np.zeros(instants, dtype=np.int64)
        steps["PartOffsets"] = none
        steps["NumberOfParts"] = none + 1
        steps["CellOffsets"] = none[:, None]
        steps["ConnectivityIdOffsets"] = none[:, None]
        offsets = steps.create_group("PointDataOffsets")
        for name in data:
            offsets[name] = steps["PointOffsets"][()]


def main():
    """Read the command line, convert."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.h5", help="results files with shapes")
    parser.add_argument("--factor", type=float, metavar="NUMBER",
                        help="what displacements are drawn larger by (default: the greatest is a quarter of the length)")
    parser.add_argument("--out", type=Path, metavar="FILE.vtkhdf", help="file to write (default: beside the results)")
    arguments = parser.parse_args()
    for path in arguments.files:
        out = arguments.out or path.with_suffix(".vtkhdf")
        write(out, *shapes_of(path, arguments.factor))
        print(out)


if __name__ == "__main__":
    plots.run(main)
