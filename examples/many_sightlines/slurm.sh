haloray ensemble survey.toml --preset consistent -n 10000 \
    --submit slurm --shards 20 --cpus 4 --time 1:00:00 --memory 1G -o many
