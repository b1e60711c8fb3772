haloray simulate sight.toml --preset consistent --seed 6 --quiet -o run
