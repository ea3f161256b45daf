"""Ctrl-C, a killed worker, a full or read-only disk, odd streams: one line, and nothing half-written."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

PATIENCE = 600.0  # s; limit on a busy machine for what takes a second on an idle one
VALIDATE = ["validate", "--models", "alpha,beta", "--out", "v", "-q", "--jobs", "1"]
RUN = ["run", "--model", "beta", "--out", "x.csv", "-q"]
pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals and devices of POSIX")


def wait_until(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def start_hanging(sixbar, *arguments, **options):
    log = sixbar.folder / sixbar.write("log", "")
    process = sixbar.start(*arguments, env={"PRESSES_LOG": str(log)}, **options)
    wait_until(lambda: "hang" in log.read_text() or process.poll() is not None)
    return process, log


def interrupt(sixbar, *arguments, by=signal.SIGINT):
    """Start a command, interrupt it as a terminal does once a run hangs, and return its output."""

    def ended():
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:
            return True
        return False

    # A job in the background hands down that SIGINT is ignored.
    options = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL), "start_new_session": True}
    process, log = start_hanging(sixbar, *arguments, **options)
    os.killpg(process.pid, by)
    out, err = process.communicate(timeout=PATIENCE)
    wait_until(ended)
    log.unlink()
    assert (process.returncode, err[:19], err.count("\n")) == (130, "sixbar: interrupted", 1)
    return out


@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_leaves_the_report_of_the_scenes_that_are_finished(sixbar, by):
    sixbar.write("v/tables/hang-beta.csv", "of an earlier call")
    good, hang = sixbar.press("good"), sixbar.press("hang", beta='does = "hang"')
    assert "1 of 2 scenes. Not compared: hang." in interrupt(sixbar, *VALIDATE, good, hang, by=by)
    summary = sixbar.json("v/summary.json")
    assert (summary["exit_code"], summary["not_compared"]) == (130, ["hang"])
    assert [scene["verdict"] for scene in summary["scenes"]] == ["agree"]
    assert [tag for tag, _ in sixbar.junit("v/junit.xml").values()].count("error") == 1
    assert "incomplete" in sixbar.text("v/report.html")
    assert not (sixbar.folder / "v/tables/hang-beta.csv").exists()
    assert not [name for name in sixbar.files() if ".part-" in str(name)]


def test_ctrl_c_before_anything_is_finished_writes_nothing(sixbar):
    path = sixbar.press("hang", beta='does = "hang"')
    files = sixbar.files()
    assert interrupt(sixbar, *RUN, path) == ""
    assert sixbar.files() == files


def test_a_worker_that_is_killed_costs_its_run_alone(sixbar):
    """The other runs of the scene and the other scene go on, as where memory runs out."""
    scenes = sixbar.press("hang", beta='does = "hang"'), sixbar.press("good", beta="tolerance = 5e-9")
    (process, log), pids = start_hanging(sixbar, *VALIDATE, "--quick", *scenes), set()

    def kill_those_that_hang():
        for line in log.read_text().splitlines():
            _, does, pid, *_ = line.split()
            if does == "hang" and pid not in pids:
                pids.add(pid)
                os.kill(int(pid), signal.SIGKILL)
        return process.poll() is not None

    wait_until(kill_those_that_hang)
    out, err = process.communicate()
    assert (process.returncode, bool(pids)) == (70, True), (out, err)
    bad, good = sixbar.json("v/summary.json")["scenes"]
    assert (bad["verdict"], good["verdict"]) == ("cannot compare", "agree")
    assert "its process" in bad["reason"]


def test_workers_end_with_a_command_that_is_killed(sixbar):
    process, _ = start_hanging(sixbar, *VALIDATE, sixbar.press("hang", beta='does = "hang"'))
    process.kill()
    process.communicate(timeout=PATIENCE)  # ends where no worker holds the streams any more


def test_the_script_is_the_module(sixbar):
    script = [str(Path(sys.executable).with_name("sixbar")), "plan", "idael"]
    process = subprocess.run(script, capture_output=True, text=True, cwd=sixbar.folder, check=False)
    module = sixbar.process("plan", "idael", code=2)
    assert (process.returncode, process.stdout, process.stderr) == (2, module.out, module.err)
    assert module.err == sixbar.refusal("plan idael")


def test_a_reader_that_leaves_early_is_no_verdict_and_a_full_disk_one_line(sixbar):
    process = sixbar.start("scenes")
    process.stdout.close()
    assert process.stderr.read() == ""
    process.stderr.close()
    assert process.wait(timeout=PATIENCE) == 141  # and not 1, "differ"
    if Path("/dev/full").exists():
        with open("/dev/full", "w") as full:  # noqa: PTH123
            failure = sixbar.process("scenes", stdout=full, code=2)
        assert "No space left on device" in failure.err
        assert failure.err.count("\n") == 1


@pytest.mark.parametrize(("command", "stream", "code"), [("scenes", 1, 0), ("plan nowhere", 2, 2)])
def test_a_stream_that_is_closed_changes_no_exit_code(command, stream, code, sixbar):
    process = sixbar.process(*command.split(), code=code, preexec_fn=lambda: os.close(stream))
    assert (process.out, process.err) == ("", "")


def test_on_a_disk_that_is_full_old_files_stay_as_they_were(sixbar):
    def small_files():
        import resource  # of POSIX

        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # the write fails, the process does not end
        resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, 30_000))

    sixbar.table("a.csv", time=[0, 1, 2, 3], x=[0, 1, 0, 2])
    command = ["compare", "a.csv", "a.csv", "--out", "c", "--json", "--tolerance"]
    sixbar(*command, "1")
    files = sixbar.files()
    process = sixbar.process(*command, "2", code=2, preexec_fn=small_files)
    assert process.err.splitlines()[-1].startswith("sixbar: ")
    assert "internal error" not in process.err
    assert sixbar.files() == files


def test_without_a_cache_that_can_be_written_a_command_works_and_says_so(sixbar):
    cache = {"SIXBAR_CACHE_DIR": str(sixbar.folder / sixbar.write("file", ""))}
    process = sixbar.process(*RUN, sixbar.press("one"), env=cache)
    assert process.err.count("sixbar: warning: ") == process.err.count("\n") == 1
    assert "file" in process.err


def test_a_pipe_is_not_waited_for(sixbar):
    os.mkfifo(sixbar.folder / "pipe.csv")  # nobody writes to it
    assert "pipe.csv" in sixbar.process("compare", "pipe.csv", "pipe.csv", code=2).err


def test_a_folder_that_is_gone_is_one_line(sixbar):
    folder = sixbar.folder / "gone"
    folder.mkdir()
    process = sixbar.process("scenes", code=2, cwd=folder, preexec_fn=folder.rmdir)
    assert (process.out, process.err.count("\n")) == ("", 1)
    assert process.err.startswith("sixbar: the working directory ")
