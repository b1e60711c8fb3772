haloray simulate small.toml --quiet -o small
haloray simulate small.toml --quiet --seed 4 -o small4
haloray simulate small.toml --quiet --set lens.einstein_radius_arcsec=1.2 -o small_lens
