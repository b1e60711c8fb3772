#!/bin/bash
#SBATCH --array=1-20 --cpus-per-task=4 --time=1:00:00 --requeue
mkdir -p parts
haloray ensemble survey.toml --preset consistent -n 10000 --shard "$SLURM_ARRAY_TASK_ID/20" \
    -o "parts/$SLURM_ARRAY_TASK_ID" --threads 4
