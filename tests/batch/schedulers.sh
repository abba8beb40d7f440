#!/usr/bin/env bash
# Makes one batch in this process, through Slurm on this machine alone, through GNU parallel and through
# Snakemake, and expects the same content of all. Installs them (Debian, as root); starts Slurm's daemons
# for the time of the test. By hand: it takes some minutes, and CI has no use for a scheduler.
#   tests/batch/schedulers.sh build/check/carom
set -euo pipefail
cd "$(dirname "$0")/../.."
source .ci/dependencies.sh
carom=$(realpath "${1:?expected the carom command}")
which="${2:-slurm parallel snakemake}"
carom_require munge slurmctld slurmd slurm-client parallel snakemake

work=$(mktemp -d)
cleanup() {
  for daemon in slurmd slurmctld munged; do
    [ -s "$work/$daemon.pid" ] && kill "$(cat "$work/$daemon.pid")" 2>/dev/null || true
  done
  rm -rf "$work"
}
trap cleanup EXIT

plan() {
  "$carom" batch plan scenes/batches/bouncing_balls.json -o "$work/$1" --count 60 >/dev/null 2>&1
}
content() {
  "$carom" batch verify "$work/$1" --json | python3 -c 'import json, sys; print(json.load(sys.stdin)["content_hash"])'
}
compare() {
  local hash
  hash=$(content "$1")
  [ "$hash" = "$expected" ] || { echo "$1: $hash, expected $expected"; exit 1; }
  echo "$1: the same content"
}

plan here
"$carom" batch run "$work/here" -j 1 >/dev/null
expected=$(content here)
echo "content $expected"

if [[ $which == *slurm* ]]; then
  host=$(hostname -s)
  mkdir -p "$work/state" "$work/spool" /run/munge
  chown munge:munge /run/munge
  [ -s /etc/munge/munge.key ] || /usr/sbin/mungekey --create
  chown -R munge:munge /etc/munge
  runuser -u munge -- /usr/sbin/munged --force
  cp /run/munge/munged.pid "$work/munged.pid"
  cat >"$work/slurm.conf" <<CONF
ClusterName=alone
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ReturnToService=2
MpiDefault=none
SelectType=select/cons_tres
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
  export SLURM_CONF=$work/slurm.conf
  /usr/sbin/slurmctld -f "$SLURM_CONF"
  /usr/sbin/slurmd -f "$SLURM_CONF"
  for _ in $(seq 60); do
    [ "$(sinfo -h -o %t 2>/dev/null)" = idle ] && break
    sleep 1
  done
  plan slurm
  "$carom" batch slurm "$work/slurm" --shards 7
  for _ in $(seq 300); do
    [ -z "$(squeue -h 2>/dev/null)" ] && break
    sleep 1
  done
  compare slurm
fi

if [[ $which == *parallel* ]]; then
  plan parallel
  "$carom" batch parallel "$work/parallel" --shards 7
  PARALLEL_HOME=$work sh "$work/parallel/parallel.sh" -j 2 >/dev/null 2>&1
  compare parallel
fi

if [[ $which == *snakemake* ]]; then
  plan snakemake
  "$carom" batch snakemake "$work/snakemake" --shards 7
  (cd "$work/snakemake" && XDG_CACHE_HOME=$work/cache snakemake --cores 2 --quiet >/dev/null 2>&1)
  compare snakemake
fi
