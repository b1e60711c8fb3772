"""Reference images of point sources behind elliptical power laws with shear, by lenstronomy's own solver.

Needs: pip install lenstronomy numpy
Run:   python3 make_images.py

Every image that LensEquationSolver finds (precision 1e-12, 200 by 200 start pixels, magnification above 1e-6) is one row,
magnification signed. The solver may miss images, so a row must be among haloray's, not the other way round.
"""

import importlib.metadata

import numpy as np
from lenstronomy.LensModel.lens_model import LensModel
from lenstronomy.LensModel.Solver.lens_equation_solver import LensEquationSolver

from reference_csv import write

CASES, SEED = 40, 20260301
rng = np.random.default_rng(SEED)
names = ["case", "slope", "e1", "e2", "gamma1", "gamma2", "source_x", "source_y", "x", "y", "magnification"]
columns = {name: [] for name in names}
for case in range(CASES):
    slope, (e1, e2), (g1, g2) = rng.uniform(1.6, 2.5), rng.uniform(-0.2, 0.2, 2), rng.uniform(-0.08, 0.08, 2)
    source = rng.uniform(-0.3, 0.3, 2)
    slope, e1, e2, g1, g2, bx, by = (round(float(v), 5) for v in (slope, e1, e2, g1, g2, *source))
    lens = LensModel(["EPL", "SHEAR"])
    kwargs = [{"theta_E": 1.0, "gamma": slope, "e1": e1, "e2": e2, "center_x": 0, "center_y": 0},
              {"gamma1": g1, "gamma2": g2}]
    x, y = LensEquationSolver(lens).image_position_from_source(
        bx, by, kwargs, min_distance=0.03, search_window=6, precision_limit=1e-12, num_iter_max=200,
        magnification_limit=1e-6)
    for image in zip(x, y, lens.magnification(x, y, kwargs)):
        for name, value in zip(names, (case, slope, e1, e2, g1, g2, bx, by, *image)):
            columns[name].append(float(value))

if __name__ == "__main__":
    write("images", "lenstronomy LensEquationSolver", f"lenstronomy {importlib.metadata.version('lenstronomy')}",
          "python3 make_images.py", "angles arcsec; the rest dimensionless", ["lens at the origin, theta_E = 1 arcsec"],
          {name: [f"{v:.14g}" for v in values] for name, values in columns.items()})
