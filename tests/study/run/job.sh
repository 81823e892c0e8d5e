#!/bin/bash
#SBATCH --job-name=streator2022
#SBATCH --output=/scratch/out/slurm-%j.log
#SBATCH --open-mode=append
#SBATCH --nodes=2
#SBATCH --ntasks=8
#SBATCH --cpus-per-task=1
#SBATCH --time=01:00:00
#SBATCH --requeue
#SBATCH --signal=TERM@90
#SBATCH --partition=main
#SBATCH --account=friction
#SBATCH --exclusive
module load mpich
export OMP_PLACES=cores

# --wait: should a rank be killed (out of memory, a lost node), the others do not wait for it until the time limit.
srun --mpi=pmi2 --wait=10 /opt/nanoslip/bin/nanoslip run '/home/me/my campaigns/streator2022.toml' --out /scratch/out
code=$?

# 99: the ranks were told to stop before all was done. Above 128: one of them was killed.
# Finished tasks are kept; the next start goes on.
most=0
[ "$code" -gt 128 ] && most=5
[ "$code" -eq 99 ] && most=50
if [ "${SLURM_RESTART_COUNT:-0}" -lt "$most" ]; then
    scontrol requeue "$SLURM_JOB_ID" && sleep 60
fi
exit "$code"
