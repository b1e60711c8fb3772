import haloray as hr

run = hr.simulate("small.toml")
for name in ("all_haloes", "tidal_haloes"):
    found = run.summary[name]
    print(f"{name:12}  gamma_LOS = {found['gamma1_los']:+.4f} {found['gamma2_los']:+.4f}i   Delta_tot = {found['delta_tot']:.2f}")
