#!/usr/bin/env bash
#SBATCH --job-name=fathom
#SBATCH --output=fathom-%A_%a.log
#SBATCH --open-mode=append
#SBATCH --requeue
#SBATCH --signal=B:USR1@120
# A shot as a Slurm array job: each task does a few frames, and a task that is stopped begins where it was.
#
#   sbatch --array=0-LAST slurm.sh FRAMES FRAMES_PER_TASK COMMAND DEPTH -o OUT [OPTION...]
#
#   FRAMES           FIRST-LAST, or FIRST-LASTxSTEP as in 1-240x2
#   FRAMES_PER_TASK  task 0 does so many from the first frame on, task 1 the next ones, and so on
#   COMMAND ...      what follows `fathom`. Names are relative to the folder in which sbatch is called
#
# 240 frames in 24 tasks of ten, 8 cores and up to half an hour each:
#
#   sbatch --array=0-23 --cpus-per-task=8 --mem=16G --time=30 slurm.sh 1-240 10 \
#       ssao shot.####.exr --camera cam.####.json -o ao.####.exr --radius 0.5
#
# Without sbatch it prints the whole sbatch line, with the tasks that the frames need. Options of sbatch go before the
# script. FATHOM names another program than `fathom`.
#
# fathom-JOB_TASK.log is what a task prints, and fathom-JOB_TASK.jsonl has a line for each of its frames (--log).
#
# Frames that are there and up to date are kept (--resume), so any task can be requeued or submitted again:
#   scontrol requeue JOB_TASK; sbatch --array=7,12 slurm.sh 1-240 10 ...
# 120 seconds before the time limit the task finishes its frame and requeues itself. `scancel` ends it after
# that frame, too, if Slurm's KillWait is long enough. The exit code is fathom's: 1 if a frame failed, 143 if stopped.

fail() {
    echo "slurm.sh: $*" >&2
    exit 2
}

usage() { sed -n '/^# A shot/,/^$/s/^# \{0,1\}//p' "$0"; }
if [[ $1 == --help || $1 == -h ]]; then
    usage
    exit
fi
if (($# < 4)); then
    usage >&2
    exit 2
fi
[[ $1 =~ ^(-?)0*([0-9]+)-(-?)0*([0-9]+)(x0*([0-9]+))?$ ]] || fail "FRAMES are FIRST-LAST or FIRST-LASTxSTEP, not \"$1\""
first=${BASH_REMATCH[1]}${BASH_REMATCH[2]} last=${BASH_REMATCH[3]}${BASH_REMATCH[4]} step=${BASH_REMATCH[6]:-1}
((first <= last && step > 0)) || fail "FRAMES have to rise, and \"$1\" does not"
[[ $2 =~ ^0*([1-9][0-9]*)$ ]] || fail "FRAMES_PER_TASK is a number from 1 on, not \"$2\""
per_task=${BASH_REMATCH[1]}
tasks=$((((last - first) / step + per_task) / per_task))

if [ -z "$SLURM_ARRAY_TASK_ID" ]; then
    [ -z "$SLURM_JOB_ID" ] || fail "this is no array job: submit it by sbatch --array=0-$((tasks - 1))"
    printf -v line ' %q' "$0" "$@"
    echo "sbatch --array=0-$((tasks - 1))$line"
    exit
fi
((SLURM_ARRAY_TASK_ID < tasks)) || fail "$1 by $per_task has the tasks 0 to $((tasks - 1)), and no $SLURM_ARRAY_TASK_ID"

begin=$((first + SLURM_ARRAY_TASK_ID * per_task * step))
end=$((begin + (per_task - 1) * step))
((end <= last)) || end=$last
shift 2
# Slurm says what the task may use; the program would take what the node has. Tasks on several nodes cannot share a log.
given=" $* " own=()
unless_given() { [[ $given == *" $1"[\ =]* ]] || own+=("$1" "$2"); }
unless_given --threads "$SLURM_CPUS_ON_NODE"
memory=${SLURM_MEM_PER_NODE:-$((${SLURM_MEM_PER_CPU:-0} * SLURM_CPUS_ON_NODE))} # --mem=0 is all of the node's
((memory < 2)) || unless_given --memory "$((memory / 2))M"
unless_given --log "fathom-${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID.jsonl"
set -- "${FATHOM:-fathom}" "$@" --frames "$begin-${end}x$step" --resume --progress off "${own[@]}"
echo "slurm.sh: task $SLURM_ARRAY_TASK_ID on $SLURMD_NODENAME, restart ${SLURM_RESTART_COUNT:-0}: ${*@Q}"

# `scancel` sends SIGTERM to every process of the task, the program among them. The shell only waits then: another
# signal would end the program at once.
signals=0 out_of_time=
trap 'signals=$((signals + 1))' TERM
trap 'signals=$((signals + 1)) out_of_time=yes; kill -TERM "$program"' USR1
"$@" &
program=$!
# A signal ends `wait` before the program has ended.
until
    seen=$signals
    wait "$program"
    status=$?
    ((signals == seen))
do :; done

echo "slurm.sh: task $SLURM_ARRAY_TASK_ID ended with $status"
if [[ $out_of_time && $status == 143 ]]; then
    echo "slurm.sh: out of time, the task goes back into the queue"
    scontrol requeue "$SLURM_JOB_ID"
fi
exit "$status"
