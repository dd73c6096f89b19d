"""Batches on a Dask cluster of processes: the same bytes, also where a worker dies."""

import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pandas as pd
import pytest

import accelcal

pytest.importorskip("distributed")

PLAN = accelcal.TumblePlan(temperatures=(20.0,), strokes=2)


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("archive")
    for seed in range(80):
        accelcal.write_table(
            accelcal.simulate(seed=seed + 1, plan=PLAN), folder / f"t{seed:03d}.csv"
        )
    (folder / "zero.csv").write_text("temperature,position\n")
    return folder


def command(*arguments, **options):
    line = [sys.executable, "-m", "accelcal", "batch", *map(str, arguments)]
    return subprocess.Popen(line, stderr=subprocess.PIPE, text=True, **options)


def children(process):
    """Process ids below one, by /proc."""
    found = {}
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            found[int(entry.name)] = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
    below = {process}
    for _ in range(4):
        below |= {child for child, parent in found.items() if parent in below}
    return below - {process}


def is_worker(process):
    with suppress(OSError):
        return b"spawn_main" in Path(f"/proc/{process}/cmdline").read_bytes()
    return False


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="needs /proc")
def test_a_killed_worker_changes_nothing(archive, tmp_path):
    accelcal.write_batch(archive, tmp_path / "calm.csv")
    process = command(archive, "-o", tmp_path / "r.csv", "--dask", "local", "--jobs", "2")
    journal, began = tmp_path / "r.csv.journal", time.monotonic()
    while not any(journal.glob("*.block")):
        assert process.poll() is None, process.stderr.read()
        if time.monotonic() > began + 300.0:
            process.kill()
            pytest.fail("the cluster has finished no block in five minutes")
        time.sleep(0.01)
    victims = [child for child in children(process.pid) if is_worker(child)]
    assert victims
    os.kill(victims[0], signal.SIGKILL)
    said = process.communicate(timeout=120)[1]
    assert process.returncode == 1, said
    assert "80 calibrations from 81 files; 1 error" in said
    for part in ("", ".laws", ".errors"):
        assert (tmp_path / f"r{part}.csv").read_bytes() == (
            tmp_path / f"calm{part}.csv"
        ).read_bytes()


def test_a_local_cluster_leaves_the_port_of_the_dashboard_to_others(archive):
    with socket.socket() as other:
        with suppress(OSError):  # somebody has it
            other.bind(("", 8787))
            other.listen()
        found = accelcal.batch(archive / "t000.csv", dask="local", jobs=1)
    assert not found.errors.size


def test_a_running_cluster(archive):
    from distributed import LocalCluster

    options = {"n_workers": 1, "threads_per_worker": 1, "processes": True}
    with LocalCluster(dashboard_address=":0", **options) as cluster:
        found = accelcal.batch(archive, dask=cluster.scheduler_address)
    pd.testing.assert_frame_equal(found.tables, accelcal.batch(archive).tables)


def test_no_scheduler_is_one_line(archive, tmp_path):
    process = command(archive, "-o", tmp_path / "r.csv", "--dask", "tcp://127.0.0.1:1")
    said = process.communicate(timeout=60)[1]
    assert process.returncode == 2
    assert said.startswith("error: --dask tcp://127.0.0.1:1: no scheduler there (")
    assert said.count("\n") == 1
    assert not list(tmp_path.iterdir())
