#!/bin/bash
# Slurm on one machine, to try the scripts here: apt-get install slurm-wlm munge; as root, no systemd, no cgroups.
# usage: one_machine.sh start|stop FOLDER; everything is in FOLDER. Then: export SLURM_CONF=FOLDER/slurm.conf
set -euo pipefail
action=$1
mkdir -p "$2"
folder=$(realpath "$2")
host=$(hostname -s)
if [ "$action" = stop ]; then
  for pid in slurmd slurmctld munged; do
    [ -f "$folder/$pid.pid" ] && kill "$(cat "$folder/$pid.pid")" || true
  done
  exit
fi
mkdir -p "$folder"/{state,spool,log}
chmod 755 "$folder"
cat > "$folder/slurm.conf" <<CONF
ClusterName=one
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/log/slurmctld
SlurmdLogFile=$folder/log/slurmd
SlurmctldPort=16817
SlurmdPort=16818
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
MpiDefault=none
SwitchType=switch/none
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=4000 State=UNKNOWN
PartitionName=p Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$folder/slurm.conf
[ -f "$folder/munge.key" ] || dd if=/dev/urandom of="$folder/munge.key" bs=1024 count=1 2> /dev/null
chmod 400 "$folder/munge.key"
munged --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" --pid-file="$folder/munged.pid" \
  --log-file="$folder/log/munged" --seed-file="$folder/munge.seed"
slurmctld -f "$SLURM_CONF"
sleep 1
slurmd -f "$SLURM_CONF" -N "$host"
sleep 3
sinfo
