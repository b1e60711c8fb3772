haloray ensemble survey.toml --preset consistent -n 40 -o ensemble
