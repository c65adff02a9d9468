"""The Slurm profile on a real Slurm: a cohort of eight, a job that is killed, a workflow that is killed, the rows of a plain run.

    apt-get install slurm-wlm munge          # Debian; nothing of it needs to be set up or running
    python3 -m venv venv && venv/bin/pip install snakemake snakemake-executor-plugin-slurm
    cargo build --release
    venv/bin/python tests/peers/slurm.py

Starts munged, slurmctld and slurmd in a temporary folder, with this machine as the only node, and ends them afterwards. No
systemd, no cgroups, no database, no file outside that folder. Slurm's daemons ask for root. BONEPD_PROGRAM names another
binary than that of target/release, `--keep` leaves the folder.
"""

import argparse
import contextlib
import csv
import getpass
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILT = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release/bonepd-ct"
PROGRAM = pathlib.Path(os.environ.get("BONEPD_PROGRAM", BUILT)).resolve()
SNAKEMAKE = pathlib.Path(sys.executable).with_name("snakemake")
RECIPE = ROOT / "pipelines/quick.toml"
SCANS = [f"p{i}" for i in range(1, 9)]
MEASURED = ("wall_s", "peak_mib")
PATIENCE_S = 1200


def missing():
    """Why this cannot be run here, or None."""
    tools = [tool for tool in ("munged", "slurmctld", "slurmd", "sbatch", "srun", "squeue") if not shutil.which(tool, path=paths())]
    if tools:
        return f"no {', '.join(tools)}; apt-get install slurm-wlm munge"
    if not SNAKEMAKE.exists():
        return "no snakemake for this python; pip install snakemake snakemake-executor-plugin-slurm"
    if os.geteuid():
        return "Slurm's daemons ask for root"
    return None


def paths():
    return os.environ["PATH"] + ":/usr/sbin:/sbin"


def wait_for(what, done, seconds=PATIENCE_S, pause=0.2):
    """The first true answer of `done`."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := done():
            return found
        time.sleep(pause)
    raise TimeoutError(f"waited {seconds} s for {what}")


def free_port():
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))
        return held.getsockname()[1]


def settings(folder):
    """slurm.conf: one node, processes followed by /proc, no cgroups."""
    user, host = getpass.getuser(), socket.gethostname().split(".")[0]
    return f"""\
ClusterName=check
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
SlurmctldPort={free_port()}
SlurmdPort={free_port()}
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={os.cpu_count()} RealMemory=2000
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


class Cluster:
    """A Slurm of this machine alone, as long as the `with` block lasts."""

    def __init__(self, folder):
        self.folder = folder
        self.daemons = []
        self.env = {**os.environ, "SLURM_CONF": f"{folder}/slurm.conf", "PATH": f"{folder}/bin:{SNAKEMAKE.parent}:{paths()}"}

    def __enter__(self):
        try:
            self.write()
            self.start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def write(self):
        for name, mode in (("munge", 0o711), ("state", 0o755), ("spool", 0o755), ("bin", 0o755)):
            (self.folder / name).mkdir(mode=mode)
        self.folder.chmod(0o755)
        key = self.folder / "munge/key"
        key.touch(0o600)
        key.write_bytes(os.urandom(128))
        (self.folder / "slurm.conf").write_text(settings(self.folder))
        # Snakemake's plugin clears SLURM_CONF for its jobs: a cluster's own file lies in /etc/slurm, this one does not.
        step = self.folder / "bin/srun"
        step.write_text(f"#!/bin/sh\nSLURM_CONF={self.folder}/slurm.conf exec {shutil.which('srun', path=paths())} \"$@\"\n")
        step.chmod(0o755)

    def start(self):
        munge = self.folder / "munge"
        self.daemon("munged", "--foreground", f"--key-file={munge}/key", f"--socket={munge}/socket", f"--pid-file={munge}/pid",
                    f"--log-file={munge}/log", f"--seed-file={munge}/seed", "--num-threads=1")
        wait_for("munged", (munge / "socket").exists, 60)
        self.daemon("slurmctld", "-D")
        self.daemon("slurmd", "-D")
        wait_for("the node to be idle", lambda: "idle" in self.ask("sinfo", "-h", "-o", "%T"), 120)

    def daemon(self, *words):
        with open(self.folder / f"{words[0]}.out", "w") as out:
            self.daemons.append(subprocess.Popen(words, env=self.env, stdout=out, stderr=subprocess.STDOUT))

    def ask(self, *words):
        return subprocess.run(words, env=self.env, capture_output=True, text=True).stdout

    def __exit__(self, *_):
        self.ask("scancel", "--user", getpass.getuser())
        with contextlib.suppress(TimeoutError):
            wait_for("the jobs to end", lambda: not self.ask("squeue", "-h"), 60)
        for daemon in reversed(self.daemons):
            daemon.terminate()
            daemon.wait(60)


class Workflow:
    """Snakemake with the Slurm profile over the scans of a folder."""

    def __init__(self, cluster, folder):
        self.cluster, self.folder, self.starts = cluster, folder, 0

    def start(self, *more):
        self.starts += 1
        # Without a database sacct knows nothing. Jobs are short, so they are looked at often.
        command = [SNAKEMAKE, "-s", ROOT / "pipelines/Snakefile", "--profile", ROOT / "pipelines/slurm", "--slurm-status-command", "squeue",
                   "--slurm-init-seconds-before-status-checks", "5", *more,
                   "--config", f"program={PROGRAM}", f"recipe={RECIPE}", "inputs=scans", "out=out", "threads=1"]
        with open(self.log(), "w") as out:
            return subprocess.Popen([str(word) for word in command], cwd=self.folder, env=self.cluster.env, stdout=out, stderr=out)

    def log(self):
        return self.folder / f"snakemake-{self.starts}.log"

    def said(self, words):
        return [line for line in self.log().read_text().splitlines() if words in line]

    def finished(self):
        """Scans whose job has ended well, as Snakemake counts them: their rows are there and no job of theirs is left."""
        busy = self.cluster.ask("squeue", "-h", "-o", "%k")
        return {scan for scan in SCANS if (self.folder / f"out/scans/{scan}/results.csv").exists() and f"wildcards_{scan}" not in busy}

    def at_work(self):
        """(job, scan) of a job whose scan has been segmented and not solved."""
        for line in self.cluster.ask("squeue", "-h", "-t", "RUNNING", "-o", "%i %k").splitlines():
            job, _, comment = line.partition(" ")
            for scan in SCANS:
                out = self.folder / f"out/scans/{scan}/{scan}"
                if comment.endswith(f"wildcards_{scan}") and out.exists() and not (out.parent / "results.csv").exists():
                    return job, scan
        return None


def rows(path):
    with open(path) as file:
        return [{k: v for k, v in row.items() if k not in MEASURED} for row in csv.DictReader(file)]


def say(start, words):
    print(f"{time.monotonic() - start:6.0f} s  {words}", flush=True)


def phantoms(folder):
    (folder / "scans").mkdir()
    for i, scan in enumerate(SCANS, 1):
        size = ["--size-mm", "3,3,4", "--spacing-mm", "0.04", "--bvtv", f"{0.15 + 0.02 * i:.2f}", "--seed", str(i)]
        subprocess.run([PROGRAM, "phantom", "-o", folder / f"scans/{scan}.nii.gz", *size, "--quiet"], check=True)


def check(folder, cluster):
    start = time.monotonic()
    say(start, f"{cluster.ask('slurmctld', '-V').strip()}: one node, {os.cpu_count()} CPUs")
    phantoms(folder)
    subprocess.run([PROGRAM, "run", RECIPE, "scans", "-o", "plain", "--threads", "1", "--quiet"], cwd=folder, check=True, capture_output=True)
    plain = rows(folder / "plain/results.csv")
    say(start, f"plain run: {len(plain)} rows")

    flow = Workflow(cluster, folder)
    run = flow.start()
    job, killed = wait_for("a job at work", flow.at_work, pause=0.02)
    cluster.ask("scancel", "--signal=KILL", job)
    cluster.ask("scancel", job)
    say(start, f"job {job} ({killed}) killed at work")
    wait_for("its second attempt", lambda: flow.said("Trying to restart job"))
    say(start, "the profile submits it again")
    wait_for("three scans", lambda: len(flow.finished()) >= 3)
    run.send_signal(signal.SIGKILL)
    run.wait()
    cluster.ask("scancel", "--user", getpass.getuser())
    wait_for("the jobs to end", lambda: not cluster.ask("squeue", "-h"), 120)
    kept = flow.finished()
    assert len(kept) < len(SCANS), "all scans were done before the workflow was killed"
    say(start, f"workflow and its jobs killed; done: {', '.join(sorted(kept))}")

    before = {scan: (folder / f"out/scans/{scan}/results.csv").stat().st_mtime_ns for scan in kept}
    assert flow.start("--unlock").wait() == 0, flow.log().read_text()
    run = flow.start()
    assert run.wait(PATIENCE_S) == 0, flow.log().read_text()
    untouched = {scan for scan in kept if (folder / f"out/scans/{scan}/results.csv").stat().st_mtime_ns == before[scan]}
    say(start, f"resumed and finished; not run again: {', '.join(sorted(untouched))}")
    assert rows(folder / "out/results.csv") == plain, "the cluster's rows are not those of the plain run"
    assert untouched, "scans that were done were run again"
    assert (folder / "out/report/report.html").is_file()
    assert flow.start().wait(PATIENCE_S) == 0 and flow.said("Nothing to be done"), flow.log().read_text()
    say(start, f"ok: {len(plain)} rows of {len(SCANS)} scans equal those of the plain run, and a third start has nothing to do")


def main():
    parser = argparse.ArgumentParser(description="The Slurm profile on a Slurm of this machine alone")
    parser.add_argument("--keep", action="store_true", help="leave the folder with logs and results")
    keep = parser.parse_args().keep
    if why := missing():
        sys.exit(f"skipped: {why}")
    folder = pathlib.Path(tempfile.mkdtemp(prefix="bonepd-slurm-"))
    try:
        with Cluster(folder) as cluster:
            work = folder / "work"
            work.mkdir()
            check(work, cluster)
    finally:
        print(f"kept: {folder}") if keep else shutil.rmtree(folder)


main()
