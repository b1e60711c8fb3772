import haloray as hr

haloes = hr.Haloes.from_columns(
    {
        "z": [0.3, 0.5, 0.9],
        "theta_x_arcsec": [1.2, -0.9, -1.5],
        "theta_y_arcsec": [0.5, 1.1, -0.8],
        "m200c_msun": [3e9, 1e9, 5e9],
        "c200c": [14.0, 13.0, 11.0],
    },
    z_source=1.5,
)
sight = hr.LineOfSight(haloes)
beta_x, beta_y = sight.ray_shooting([0.0, 1.5, 0.0], [0.0, 0.0, 1.5])
print(beta_x.round(6), beta_y.round(6))

image = hr.image({"image": {"pixel_sampling": "point"}}, preset="consistent", haloes=haloes)
print(image.noisy_e_s.shape)
