#!/usr/bin/env python3
"""Opens a run's frames with VTK's own reader and compares them with its summary.json.

Usage: read_vtu.py DIR      (needs: pip install pyvista)

Prints points, cells and arrays of each frame that DIR/frames.pvd lists. Exit status 1 and one line for each fault if a
frame is missing, does not read, has cells that VTK finds invalid or whose volume at rest is not positive, or if its points
and cells are not the summary's "nodes" and "elements"; 2 if DIR is not given.
"""

import json
import pathlib
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np
import pyvista
from vtkmodules.vtkFiltersGeneral import vtkCellValidator


def frames(folder):
    """The (time, path) pairs of frames.pvd, as the XML says; faults if pyvista's own reader finds other times."""
    index = folder / "frames.pvd"
    listed = [
        (float(item.get("timestep")), folder / item.get("file"))
        for item in ElementTree.parse(index).getroot().iter("DataSet")
    ]
    faults = []
    if not listed:
        faults.append(f"{index}: no frames")
    elif sorted(pyvista.PVDReader(str(index)).time_values) != sorted({time for time, _ in listed}):
        faults.append(f"{index}: VTK reads other times than those listed")
    return listed, faults


def check(path, nodes, elements):
    """The faults of one frame, after printing what it holds."""
    if not path.is_file():
        return [f"{path}: missing"]
    mesh = pyvista.read(str(path))
    arrays = [f"point {name} {data.dtype} {data.shape}" for name, data in mesh.point_data.items()]
    arrays += [f"cell {name} {data.dtype} {data.shape}" for name, data in mesh.cell_data.items()]
    print(f"{path.name}: {mesh.n_points} points, {mesh.n_cells} cells; {'; '.join(arrays) or 'no arrays'}")

    faults = []
    if mesh.n_points != nodes:
        faults.append(f"{path}: {mesh.n_points} points, the summary has {nodes} nodes")
    if mesh.n_cells != elements:
        faults.append(f"{path}: {mesh.n_cells} cells, the summary has {elements} elements")
    # Points are rest positions, so that faces that point inwards or a negative volume mean a wrong connectivity.
    validator = vtkCellValidator()
    validator.SetInputData(mesh)
    validator.Update()
    states = pyvista.wrap(validator.GetOutput()).cell_data["ValidityState"]
    if np.any(states != 0):
        faults.append(f"{path}: cells that VTK finds invalid, in states {sorted(set(states.tolist()))}")
    if mesh.n_cells and not np.all(mesh.compute_cell_sizes()["Volume"] > 0):
        faults.append(f"{path}: cells without a positive volume")
    if not np.all(np.isfinite(mesh.points)):
        faults.append(f"{path}: points that are not finite")
    return faults


def main(arguments):
    if len(arguments) != 1:
        print(__doc__, file=sys.stderr)
        return 2
    folder = pathlib.Path(arguments[0])
    try:
        summary = json.loads((folder / "summary.json").read_text())
        listed, faults = frames(folder)
        for _, path in listed:
            faults += check(path, summary["nodes"], summary["elements"])
    except (OSError, ValueError, KeyError, TypeError, ElementTree.ParseError) as error:
        faults = [f"{folder}: {type(error).__name__}: {error}"]
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
