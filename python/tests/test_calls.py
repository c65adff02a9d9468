"""Long calls: threads, the interpreter's lock, Ctrl-C, and what is printed."""

import _thread
import ast
import inspect
import pathlib
import threading
import time
from importlib.metadata import version

import numpy as np
import pytest

import bonepd_ct
from bonepd_ct import _native, _settings
from conftest import bonepd_ct_command, gyroid

#: Some seconds of iterations on one thread.
LONG = {"lower": 300, "method": "voxel-fe", "tolerance": 1e-9, "threads": 1}


def test_threads_do_not_change_a_bit(grey):
    settings = {"lower": 300, "method": "voxel-fe", "fields": "sed"}
    one, two = (bonepd_ct.solve(grey, 0.02, threads=n, **settings) for n in (1, 2))
    assert one["e_app_mpa"] == two["e_app_mpa"] and one["iterations"] == two["iterations"]
    assert np.array_equal(one["fields"]["sed_mpa"], two["fields"]["sed_mpa"])


def test_other_threads_of_python_go_on():
    ended = threading.Event()
    turns = 0

    def count():
        nonlocal turns
        while not ended.wait(0.01):
            turns += 1

    other = threading.Thread(target=count)
    other.start()
    bonepd_ct.solve(gyroid((64, 64, 64)), 0.02, **LONG)
    ended.set()
    other.join()
    # A call that keeps the lock leaves none.
    assert turns > 10


def test_ctrl_c_stops_a_call():
    tasks = pathlib.Path("/proc/self/task")

    def count():
        return [comm.read_text().strip() for comm in tasks.glob("*/comm")].count("bonepd-ct")

    # The threads of the pool have this name too, and stay.
    bonepd_ct.solve(np.ones((4, 4, 4), bool), 0.02, method="voxel-fe")
    time.sleep(0.5)
    before = count()
    timer = threading.Timer(1.0, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        bonepd_ct.solve(gyroid((128, 128, 128)), 0.02, **{**LONG, "tolerance": 1e-14})
    for _ in range(600):
        if count() == before:
            break
        time.sleep(0.1)
    # The thread that computed has ended: it would not reach this tolerance in hours.
    assert count() == before
    assert bonepd_ct.solve(np.ones((4, 4, 4), bool), 0.02, method="voxel-fe")["e_app_mpa"] > 0


def test_ctrl_c_stops_a_run(tmp_path):
    np.save(tmp_path / "a.npy", gyroid((128, 128, 128)))
    timer = threading.Timer(1.5, _thread.interrupt_main)
    timer.start()
    settings = {"lower": 300, "spacing_mm": 0.02, "method": "voxel-fe", "tolerance": 1e-14}
    with pytest.raises(KeyboardInterrupt):
        bonepd_ct.run("quick", tmp_path / "a.npy", tmp_path / "out", **settings)
    assert not (tmp_path / "out/results.csv").exists()


def test_calls_print_nothing(grey, capfd):
    bonepd_ct.solve(grey, 0.02, lower=300, method="voxel-fe")
    bonepd_ct.segment(grey, 0.02, lower=300)
    assert capfd.readouterr() == ("", "")


def test_the_command_is_the_program(tmp_path):
    done = bonepd_ct_command("--version")
    assert done.stdout == f"bonepd-ct {bonepd_ct.__version__}\n" and done.returncode == 0
    done = bonepd_ct_command("info", tmp_path / "gone.nii.gz")
    assert done.returncode == 2 and done.stderr.startswith("error: ")
    done = bonepd_ct_command("solve")
    assert done.returncode == 2 and "Usage: bonepd-ct solve" in done.stderr


def test_versions_agree():
    root = pathlib.Path(__file__).parents[2]
    line = f'version = "{version("bonepd-ct")}"'
    assert bonepd_ct.__version__ == version("bonepd-ct")
    for manifest in ("Cargo.toml", "python/Cargo.toml"):
        assert line in (root / manifest).read_text().splitlines(), manifest


def test_stubs_name_the_settings_of_the_program():
    with pytest.raises(bonepd_ct.SettingError) as raised:
        bonepd_ct.solve(np.ones((4, 4, 4), bool), 0.02, zzz=1)
    known = set(str(raised.value).split("Known here: ")[1].split(", "))
    stubs = set(_settings.RunSettings.__annotations__)
    for base in (_settings.SolveSettings, _settings.SegmentSettings):
        stubs |= set(base.__annotations__)
    assert stubs == known


def test_stubs_name_the_functions_of_the_program():
    stub = pathlib.Path(bonepd_ct.__file__).with_name("_native.pyi").read_text()
    functions = [node for node in ast.parse(stub).body if isinstance(node, ast.FunctionDef)]
    assert {function.name for function in functions} == {"main", "run", "segment", "solve"}
    for function in functions:
        own = list(inspect.signature(getattr(_native, function.name)).parameters)
        assert own == [argument.arg for argument in function.args.args], function.name
