haloray fit cutout.fits --model lens.toml -o fit
