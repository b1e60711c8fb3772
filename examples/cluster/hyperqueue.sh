#!/bin/sh
# An ensemble in shards with HyperQueue, whose server and workers are running: `sh examples/cluster/hyperqueue.sh 10000 8`
set -eu
number=${1:-10000} shards=${2:-8}
mkdir -p many.parts
hq submit --wait --array "1-$shards" --cpus 1 -- \
    sh -c "haloray ensemble -n $number --shard \$HQ_TASK_ID/$shards -o many.parts/\$HQ_TASK_ID --threads 1 --quiet"
haloray merge many.parts -o many
