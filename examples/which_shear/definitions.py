import json

summary = json.load(open("run/summary.json"))
for haloes in ("all_haloes", "tidal_haloes"):
    found = summary[haloes]
    print(haloes)
    for name, place in [
        ("axis", "los"),
        ("ring", "los_ring"),
        ("light", "los_light"),
        ("best_tidal", "los_best_tidal"),
        ("best_flexion", "los_best_flexion"),
    ]:
        print(f"  {name:12} {found['gamma1_' + place]:+.4f} {found['gamma2_' + place]:+.4f}i")
    print(f"  best_tidal leaves {1000 * found['residual_best_tidal_arcsec']:.2f} mas of the rays")
