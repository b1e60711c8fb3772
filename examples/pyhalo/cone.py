import haloray as hr
import numpy as np
from pyHalo.preset_models import preset_model_from_name

np.random.seed(1)
realization = preset_model_from_name("CDM")(z_lens=0.5, z_source=1.5, cone_opening_angle_arcsec=6.0, log_mlow=7.0)
haloes, sheets = hr.from_pyhalo(realization)
print(haloes)
print(f"{np.isclose(haloes.z, 0.5).sum()} in the lens plane, {len(sheets)} sheets")

haloes.write("haloes.csv")
