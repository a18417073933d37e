#!/usr/bin/python3
"""Turn the shapes of a run (&output shape_step) into a VTKHDF file, in which ParaView plays the motion.

The beam is a line of points at rest with the vectors `displacement` and `velocity` at true scale: Warp By Vector moves it,
with the factor chosen there. `moment` and `stress` are those at the positions of &stress, NaN elsewhere. Each side of a stop is a
point with the vector `contact_force` on the beam, and so is each side of a body, which moves with the body.
"""

import argparse
import io
from pathlib import Path

import impactbeam_plots as plots
import h5py
import numpy as np
import plot_scene

VTK_VERTEX, VTK_LINE = 1, 3


class Motion:
    """What ParaView shows of one file, in the units of the file."""

    def __init__(self, path):
        with plots.open_results(path) as file:
            group = plots.group_of(file, "shapes", "&output shape_step")
            self.time = plots.values_of(group, "tau")
            if len(self.time) < 2:
                raise plots.missing(file, "has the shape at the start only: see &output shape_step")
            node = group["x"][()]
            places = file["stress/position"][()] if "stress" in file else np.array([])
            self.along = np.unique(np.concatenate([node, places]))
            displacement = plots.values_of(group, "displacement") + plots.height_of_release(file)
            self.displacement = plot_scene.cubics(node, self.along, displacement, group["slope"][()])
            self.velocity = plot_scene.cubics(node, self.along, group["velocity"][()], group["slope_velocity"][()])
            self.of_places = {}
            for name in ("moment", "stress"):
                if "stress" in file and plots.has(file["stress"], name):
                    values = np.full(self.displacement.shape, np.nan)
                    rows = file["stress"][name][()][:, self.nearest(file["stress"])]
                    values[:, np.searchsorted(self.along, places)] = rows.T
                    self.of_places[name] = values
            self.read_contacts(file, node[-1])

    def nearest(self, group):
        """The samples of a history nearest to the instants of the shapes."""
        time = plots.values_of(group, "tau")
        return np.abs(time[:, None] - self.time).argmin(axis=0)

    def read_contacts(self, file, length):
        """Place of each side of a stop or body, how it moves, and its force on the beam, upwards positive, at the instants of the
        shapes."""
        self.places, self.forces = np.zeros((0, 2)), np.zeros((len(self.time), 0))
        response = file["response"] if "response" in file else {}
        bodies = []
        if "surfaces" in file and "force" in file["surfaces"]:
            group = file["surfaces"]
            names = plots.text_of(group["surface"].attrs["flag_meanings"]).split()
            # floors and ceilings do not meet the beam
            own = [row for row, name in enumerate(names) if not name.endswith(("floor", "ceiling"))]
            self.places = np.stack([group["position"][()], plots.values_of(group, "height")], axis=1)[own]
            self.forces = (group["side"][()][:, None] * group["force"][()])[own][:, self.nearest(group)].T
            bodies = list(enumerate(group["body"][own])) if "body" in group else []
        elif "contact_force" in response and "scene/stop" in file:
            self.places = np.array([[float(file["scene/stop"].attrs["position"]) * length, plots.height_of_release(file)]])
            self.forces = response["contact_force"][()][self.nearest(response)][:, None]
        self.moved = {"displacement": np.zeros_like(self.forces), "velocity": np.zeros_like(self.forces)}
        for column, body in bodies:
            for name, values in self.moved.items():
                if body > 0 and name in file["bodies"]:
                    values[:, column] = file["bodies"][name][body - 1][self.nearest(file["bodies"])]


def upright(values):
    """Vectors along y."""
    return np.stack([np.zeros_like(values), values, np.zeros_like(values)], axis=-1)


def write(path, motion):
    """An unstructured grid of lines and vertices at rest with data that change: VTKHDF 2.0, as ParaView 5.12 and later read it."""
    instants, (on_beam, contacts) = len(motion.time), (len(motion.along), len(motion.places))
    points, lines = on_beam + contacts, on_beam - 1
    beside, before = np.full((instants, contacts), np.nan), np.zeros((instants, on_beam))
    data = {"displacement": upright(np.hstack([motion.displacement, motion.moved["displacement"]])),
            "velocity": upright(np.hstack([motion.velocity, motion.moved["velocity"]])),
            "contact_force": upright(np.hstack([before, motion.forces]))}
    data.update({name: np.hstack([values, beside]) for name, values in motion.of_places.items()})
    # in memory first, because h5py crashes on a full disk
    image = io.BytesIO()
    with h5py.File(image, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = (2, 0)
        root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", len("UnstructuredGrid")))
        places = np.zeros((points, 3))
        places[:on_beam, 0] = motion.along
        places[on_beam:, :2] = motion.places
        root["Points"] = places
        # each list once; of all instants the same part of it counts
        root["NumberOfPoints"] = np.full(instants, points, dtype=np.int64)
        root["NumberOfCells"] = np.full(instants, lines + contacts, dtype=np.int64)
        root["NumberOfConnectivityIds"] = np.full(instants, 2 * lines + contacts, dtype=np.int64)
        pairs = np.stack([np.arange(lines), np.arange(1, on_beam)], axis=1).ravel()
        root["Connectivity"] = np.concatenate([pairs, np.arange(on_beam, points)]).astype(np.int64)
        root["Offsets"] = np.concatenate([np.arange(0, 2 * lines + 1, 2), 2 * lines + np.arange(1, contacts + 1)]).astype(np.int64)
        root["Types"] = np.concatenate([np.full(lines, VTK_LINE), np.full(contacts, VTK_VERTEX)]).astype(np.uint8)
        group = root.create_group("PointData")
        for name, values in data.items():
            group[name] = values.reshape((instants * points, *values.shape[2:]))
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = instants
        steps["Values"] = motion.time
        zero = np.zeros(instants, dtype=np.int64)
        steps["PointOffsets"] = zero
        steps["PartOffsets"] = zero
        steps["NumberOfParts"] = zero + 1
        steps["CellOffsets"] = zero[:, None]
        steps["ConnectivityIdOffsets"] = zero[:, None]
        offsets = steps.create_group("PointDataOffsets")
        for name in data:
            offsets[name] = np.arange(instants, dtype=np.int64) * points
    path.write_bytes(image.getvalue())


def main():
    """Read the command line, convert."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.h5", help="results files with shapes")
    parser.add_argument("--out", type=Path, metavar="FILE.vtkhdf", help="file to write (default: beside the results)")
    arguments = parser.parse_args()
    if arguments.out and len(arguments.files) > 1:
        parser.error("--out names one file: give one file of results")
    for path in arguments.files:
        out = arguments.out or path.with_suffix(".vtkhdf")
        if out.suffix != ".vtkhdf":
            raise plots.Unplottable(f"--out {out}: a file for ParaView ends in .vtkhdf")
        motion = Motion(path)
        with plots.complete_file(out) as partial:
            write(partial, motion)


if __name__ == "__main__":
    plots.run(main)
