"""Draws docs/images/gravity.png from the results of scenes/gravity-hooke.toml and scenes/gravity-svk.toml.

    tensormass run scenes/gravity-hooke.toml --out out/gravity-hooke
    tensormass run scenes/gravity-svk.toml --out out/gravity-svk
    python3 docs/images/gravity.py out/gravity-hooke out/gravity-svk docs/images/gravity.png

Needs pyvista (reads VTU) and matplotlib (draws).
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pyvista
from matplotlib.collections import PolyCollection

hooke, svk, target = sys.argv[1:4]


def surface(folder):
    """The deformed boundary of the last frame: points, triangles, J of each triangle's element."""
    reader = pyvista.get_reader(f"{folder}/frames.pvd")
    reader.set_active_time_value(reader.time_values[-1])
    grid = reader.read()[0]
    grid["J"] = grid.cell_data["J"]
    grid.points = grid.points + grid.point_data["displacement"]
    skin = grid.extract_surface(algorithm="dataset_surface")
    return np.array(skin.points), skin.faces.reshape(-1, 4)[:, 1:], np.array(skin.cell_data["J"])


# Isometric-like view: x to the right, z up, y into the picture.
view = np.array([[1.0, 0.32, 0.0], [0.0, 0.22, 1.0]])
toward = np.array([0.25, -1.0, 0.35])
toward /= np.linalg.norm(toward)

figure, axes = plt.subplots(2, 1, figsize=(8, 6.4), dpi=120)
for axis, folder, name in ((axes[0], hooke, "Hooke"), (axes[1], svk, "Saint Venant-Kirchhoff")):
    points, triangles, ratio = surface(folder)
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    facing = normals @ toward
    order = np.argsort(corners.mean(axis=1) @ toward)
    order = order[facing[order] > 0]
    colour = plt.get_cmap("coolwarm")(plt.Normalize(0.8, 1.2)(ratio))[order]
    colour[:, :3] *= (0.55 + 0.45 * facing[order])[:, None]
    flat = corners[order] @ view.T
    axis.add_collection(PolyCollection(flat, facecolors=colour, edgecolors=(0, 0, 0, 0.25), linewidths=0.3))
    axis.set_aspect("equal")
    axis.set_xlim(-0.3, 5.9)
    axis.set_ylim(-2.2, 1.5)
    axis.axis("off")
    axis.set_title(name, loc="left", fontsize=11)
scale = plt.cm.ScalarMappable(plt.Normalize(0.8, 1.2), "coolwarm")
figure.colorbar(scale, ax=axes, label="current over initial volume", shrink=0.6)
figure.savefig(target, bbox_inches="tight")
print(f"wrote {target}")
