"""haloray: what every dark-matter halo along a line of sight does to a strong-lensing image.

Angles are in arcsec, distances in comoving Mpc where the name says so, masses in solar masses; fluxes in e⁻/s. Where a quantity is
expected, a float64 array in the unit of its name, or an astropy Quantity, will do.

>>> import haloray as hr
>>> haloes = hr.populate("paper", seed=1)
>>> sight = hr.LineOfSight(haloes)
>>> effective = sight.effective(z_lens=0.5)
>>> beta_x, beta_y = sight.ray_shooting([1.0, 0.0], [0.0, 1.0])
"""

from typing import TYPE_CHECKING

from ._config import config
from ._coolest import CoolestModel, from_coolest, to_coolest
from ._decoupled import DecoupledMultiPlane
from ._effective import Effective, Flexion, Tidal
from ._ensemble import Ensemble, ensemble
from ._errors import Error, FileError, InputError, MissingFileError
from ._fit import Fit, Parameter, fit, model_text, models
from ._haloes import Haloes, populate
from ._haloray import Config, __version__
from ._lens_arguments import LENS_MODELS
from ._lens_model import LensModel
from ._lens_results import CriticalCurve, PointImages
from ._log_posterior import LogPosterior, Mode
from ._mock import Mock, MockImage, mock
from ._observation import Observation
from ._pyhalo import from_lens_models, from_pyhalo, to_lens_models
from ._read import Posterior, Run, open_ensemble, open_posterior, open_run, read
from ._run import Image, Simulation, image, simulate
from ._sight import Interpol, LineOfSight, Rays
from ._slsim import from_slsim, to_slsim
from ._threads import number_of_threads, set_threads
from ._versions import show_versions

if TYPE_CHECKING:
    from . import figures
else:

    def __getattr__(name):
        # Imported when it is asked for: a program that draws nothing starts sooner.
        if name == "figures":
            from importlib import import_module

            return import_module("haloray.figures")
        raise AttributeError(f"module 'haloray' has no attribute {name!r}")


__all__ = [
    "LENS_MODELS",
    "Config",
    "CoolestModel",
    "CriticalCurve",
    "DecoupledMultiPlane",
    "Effective",
    "Ensemble",
    "Error",
    "FileError",
    "Fit",
    "Flexion",
    "Haloes",
    "Image",
    "InputError",
    "Interpol",
    "LensModel",
    "LineOfSight",
    "LogPosterior",
    "MissingFileError",
    "Mock",
    "MockImage",
    "Mode",
    "Observation",
    "Parameter",
    "PointImages",
    "Posterior",
    "Rays",
    "Run",
    "Simulation",
    "Tidal",
    "__version__",
    "config",
    "ensemble",
    "figures",
    "fit",
    "from_coolest",
    "from_lens_models",
    "from_pyhalo",
    "from_slsim",
    "image",
    "mock",
    "model_text",
    "models",
    "number_of_threads",
    "open_ensemble",
    "open_posterior",
    "open_run",
    "populate",
    "read",
    "set_threads",
    "show_versions",
    "simulate",
    "to_coolest",
    "to_lens_models",
    "to_slsim",
]
