mkdir parts
haloray ensemble survey.toml --preset consistent -n 40 --shard 1/2 --quiet -o parts/1
haloray ensemble survey.toml --preset consistent -n 40 --shard 2/2 --quiet -o parts/2
haloray status parts
haloray merge parts --quiet -o merged
cmp merged/sightlines.h5 ensemble/sightlines.h5
