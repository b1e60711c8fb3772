haloray trace --haloes haloes.csv --points points.csv --z-source 1.5 -o rays.csv
haloray map --haloes haloes.csv --grid-points 61 -o maps
haloray image --haloes haloes.csv --preset consistent --set image.pixel_sampling=point -o image
