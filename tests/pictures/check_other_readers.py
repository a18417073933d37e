"""Results read by others: check_other_readers.py xarray|vtk PROGRAM INPUTS SCRIPTS FOLDER

xarray  the files open as they are: coordinates and units are there
vtk     the shapes that impactbeam-plot paraview turns into VTKHDF have displacements, velocities, moments and contact forces as
        the file says; warped by the displacement, they are rendered
"""

import os
import re
import shutil
import subprocess
import sys

import h5py

READER, PROGRAM, INPUTS, SCRIPTS, FOLDER = sys.argv[1:]


def run(*command):
    """Run a command that must do."""
    subprocess.run(command, check=True, cwd=FOLDER, stdin=subprocess.DEVNULL)


def check_xarray():
    """Lines of pages as they stand, and what is in the files."""
    import xarray  # pylint: disable=import-outside-toplevel
    with open(os.path.join(FOLDER, "relay.nml"), "w", encoding="utf-8") as scene:
        subprocess.run([PROGRAM, "--new", "relay"], check=True, stdout=scene)
    run(PROGRAM, "--quiet", os.path.join(INPUTS, "first_scene.nml"), "relay.nml")
    for name in ("README.md", "docs/howto/read_results.md"):
        with open(os.path.join(SCRIPTS, "..", name), encoding="utf-8") as page:
            lines = re.search(r"```python\n(.*?)```", page.read(), re.DOTALL).group(1)
        subprocess.run([sys.executable, "-c", lines], check=True, cwd=FOLDER, env={**os.environ, "MPLBACKEND": "agg"})
    run(PROGRAM, "--quiet", "--out", ".", os.path.join(INPUTS, "relay_reed.nml"), os.path.join(INPUTS, "table1.nml"))
    response = xarray.open_dataset(os.path.join(FOLDER, "relay_reed.h5"), group="response")
    assert dict(response.sizes) == {"time": 6001}, response.sizes
    assert response.displacement_stop.dims == ("time",)
    assert response.displacement_stop.attrs["units"] == "m" and response.time.attrs["units"] == "s"
    quiet = abs(response.displacement_stop.sel(time=slice(2e-3, None))).max().item()
    assert 0 < quiet < 1e-5, quiet
    table = xarray.open_dataset(os.path.join(FOLDER, "table1.h5"), group="frequencies")
    assert table["lambda"].dims == ("mode", "column") and abs(table["lambda"].sel(mode=1)[-1].item() - 3.2604) < 1e-4


def check_vtk():
    """Some instants, all points, and how it looks."""
    with open(os.path.join(INPUTS, "tube_in_supports.nml"), encoding="utf-8") as scene:
        text = scene.read()
    with open(os.path.join(FOLDER, "tube_in_supports.nml"), "w", encoding="utf-8") as scene:
        scene.write(text + "&stress position = 0, 0.5 /\n")
    run(PROGRAM, "--quiet", "--out", ".", "tube_in_supports.nml")
    run(os.path.join(SCRIPTS, "impactbeam-plot"), "paraview", "tube_in_supports.h5")
    with h5py.File(os.path.join(FOLDER, "tube_in_supports.h5")) as file:
        shapes = {name: file["shapes"][name][()] for name in ("time", "x", "displacement", "velocity")}
        contacts = {name: file["surfaces"][name][()] for name in ("time", "side", "position", "height", "force")}
        moment = file["stress/moment"][()]
    from vtkmodules.vtkIOHDF import vtkHDFReader  # pylint: disable=import-outside-toplevel
    reader = vtkHDFReader()
    reader.SetFileName(os.path.join(FOLDER, "tube_in_supports.vtkhdf"))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == len(shapes["time"]), reader.GetNumberOfSteps()
    for instant in (0, len(shapes["time"]) // 2, len(shapes["time"]) - 1):
        reader.SetStep(instant)
        reader.Update()
        grid = reader.GetOutput()
        points, sides = shapes["x"].size, contacts["side"].size
        assert grid.GetNumberOfPoints() == points + sides and grid.GetNumberOfCells() == points - 1 + sides
        data = {name: grid.GetPointData().GetArray(name) for name in ("displacement", "velocity", "contact_force", "moment")}
        for k in range(points):
            assert abs(grid.GetPoint(k)[0] - shapes["x"][k]) < 1e-12 and grid.GetPoint(k)[1:] == (0.0, 0.0), (instant, k)
            moved = shapes["displacement"][instant, k] - shapes["displacement"][0, 0]
            assert abs(data["displacement"].GetTuple(k)[1] - moved) < 1e-12, (instant, k)
            assert abs(data["velocity"].GetTuple(k)[1] - shapes["velocity"][instant, k]) < 1e-12, (instant, k)
            assert data["contact_force"].GetTuple(k) == (0.0, 0.0, 0.0)
        sample = abs(contacts["time"] - shapes["time"][instant]).argmin()
        for k in range(sides):
            place = grid.GetPoint(points + k)
            assert abs(place[0] - contacts["position"][k]) < 1e-12 and abs(place[1] - contacts["height"][k]) < 1e-12, k
            force = contacts["side"][k] * contacts["force"][k, sample]
            assert data["contact_force"].GetTuple(points + k) == (0.0, force, 0.0), (instant, k)
        middle = abs(shapes["x"] - 0.5 * shapes["x"][-1]).argmin()
        assert [data["moment"].GetValue(k) for k in (0, middle)] == [row[sample] for row in moment], instant
        assert data["moment"].GetValue(1) != data["moment"].GetValue(1), "a moment where none was asked for"
    assert contacts["force"].any() and moment.any()
    render(reader)


def render(reader):
    """A picture off the screen that shows something, warped as ParaView's filter does it."""
    from vtkmodules import vtkRenderingOpenGL2  # noqa: F401 pylint: disable=import-outside-toplevel,unused-import
    from vtkmodules.util.numpy_support import vtk_to_numpy  # pylint: disable=import-outside-toplevel
    from vtkmodules.vtkCommonDataModel import vtkDataObject  # pylint: disable=import-outside-toplevel
    from vtkmodules.vtkFiltersGeneral import vtkWarpVector  # pylint: disable=import-outside-toplevel
    from vtkmodules.vtkIOImage import vtkPNGWriter  # pylint: disable=import-outside-toplevel
    from vtkmodules.vtkRenderingCore import (vtkActor, vtkDataSetMapper, vtkRenderer, vtkRenderWindow,  # pylint: disable=C0415
                                             vtkWindowToImageFilter)
    mapper, actor, renderer, window = vtkDataSetMapper(), vtkActor(), vtkRenderer(), vtkRenderWindow()
    warp = vtkWarpVector()
    warp.SetInputConnection(reader.GetOutputPort())
    warp.SetInputArrayToProcess(0, 0, 0, vtkDataObject.FIELD_ASSOCIATION_POINTS, "displacement")
    warp.SetScaleFactor(200.0)
    mapper.SetInputConnection(warp.GetOutputPort())
    actor.SetMapper(mapper)
    actor.GetProperty().SetLineWidth(4)
    renderer.AddActor(actor)
    window.SetOffScreenRendering(1)
    window.SetSize(600, 300)
    window.AddRenderer(renderer)
    window.Render()
    picture = vtkWindowToImageFilter()
    picture.SetInput(window)
    picture.Update()
    pixels = vtk_to_numpy(picture.GetOutput().GetPointData().GetScalars())
    assert 600 < (pixels.max(axis=1) > 100).sum() < 20000, "nothing was drawn"
    writer = vtkPNGWriter()
    writer.SetFileName(os.path.join(FOLDER, "tube_in_supports.png"))
    writer.SetInputConnection(picture.GetOutputPort())
    writer.Write()


if __name__ == "__main__":
    shutil.rmtree(FOLDER, ignore_errors=True)
    os.makedirs(FOLDER)
    {"xarray": check_xarray, "vtk": check_vtk}[READER]()
