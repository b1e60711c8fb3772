#!/bin/bash
# A one-node Slurm of its own (Debian's slurm-wlm; root), an ensemble submitted to it, a task killed, the node drained and
# resumed: the merged files must be those of one process. `just slurm` runs it.
set -euo pipefail
haloray=$(realpath "$1")
work=$(mktemp -d)
cd "$work"
host=$(hostname -s)
cores=$(nproc)
export SLURM_CONF=$work/slurm.conf
cat > slurm.conf <<CONF
ClusterName=check
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=17817
SlurmdPort=17818
AuthType=auth/munge
CryptoType=crypto/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
ReturnToService=2
SchedulerParameters=batch_sched_delay=0,sched_interval=1,bf_interval=1
NodeName=$host NodeAddr=127.0.0.1 CPUs=$cores State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
mkdir -p state spool /run/munge
chown munge: /run/munge
[ -s /etc/munge/munge.key ] || { mungekey --create; chown munge: /etc/munge/munge.key; }
started_munge=
if ! munge -n >/dev/null 2>&1; then
    su munge -s /bin/sh -c 'munged --force' 2>/dev/null
    started_munge=yes
fi
stop() {
    for name in slurmd slurmctld; do [ -s $name.pid ] && kill "$(cat $name.pid)" 2>/dev/null || true; done
    [ -z "$started_munge" ] || pkill -x munged || true
    rm -rf "$work"
}
trap stop EXIT
slurmctld -f slurm.conf
slurmd -f slurm.conf
for _ in $(seq 60); do sinfo --noheader --format=%T 2>/dev/null | grep -q idle && break; sleep 1; done
sinfo

settings=(--set haloes.min_point_shear=1e-5 -n 2000)
"$haloray" ensemble "${settings[@]}" --quiet -o alone
"$haloray" ensemble "${settings[@]}" --submit slurm --shards 20 --partition all --time 10 -o many
killed=; drained=
for second in $(seq 900); do
    left=$(squeue --noheader --array --format=%T | wc -l)
    [ "$left" -gt 0 ] || break
    # One task is killed; then the node is drained, and what runs there requeued, as for its repair.
    if [ -z "$killed" ] && pkill -KILL --newest -f -- '--shard [0-9]*/20'; then killed=yes; echo "killed a task"; fi
    if [ -n "$killed" ] && [ -z "$drained" ] && [ "$second" -gt 5 ]; then
        scontrol update nodename="$host" state=drain reason=check
        for job in $(squeue --noheader --array --states=running --format=%A); do scontrol requeue "$job"; done
        sleep 3
        "$haloray" status many.parts
        scontrol update nodename="$host" state=resume
        drained=yes
        echo "drained the node and resumed it"
    fi
    sleep 1
done
"$haloray" status many.parts
[ -n "$killed" ] && [ -n "$drained" ] || { echo "the ensemble ended before a task was killed and the node drained"; exit 1; }
cat many.parts/logs/merge.txt
diff -r -x timings.json -x report.html -x report.json -x manifest.json alone many
echo "the merged files are those of one process"
