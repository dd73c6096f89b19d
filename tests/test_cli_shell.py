"""The command line as a shell sees it: exit codes, streams, colours, and what goes wrong."""

import errno
import io
import json
import os
import re
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import click
import pytest

from accelcal.cli import main as entry
from accelcal.cli import options as option
from accelcal.cli.deliver import deliver, remark
from accelcal.cli.main import main
from accelcal.cli.program import COMMANDS, LazyGroup
from accelcal.cli.values import number, quantities, setting, temperature
from accelcal.errors import AccelcalWarning, InputError, TableError
from accelcal.version import __version__

ROOT = Path(__file__).parents[1]

posix_only = pytest.mark.skipif(sys.platform == "win32", reason="a matter of POSIX shells")


@pytest.fixture
def run(monkeypatch):
    """Run a function as the body of the command ``accelcal try``."""

    def run_body(body, *arguments, options=()):
        for decorate in options:
            body = decorate(body)
        trial = click.command("try")(body)
        monkeypatch.setattr(LazyGroup, "get_command", lambda *_: trial)
        return main(["try", *arguments])

    return run_body


def accelcal(*arguments, **options):
    """Run the command line in a process of its own."""
    return process("-m", "accelcal", *arguments, **options)


def accelcal_try(body, **options):
    """Run the source of a function as the body of a command, in a process of its own."""
    return process("-c", TRIAL.format(body=body), **options)


TRIAL = """
import sys, warnings, click
from accelcal.cli.deliver import deliver, remark
from accelcal.cli.main import main
from accelcal.cli.program import LazyGroup
from accelcal.errors import AccelcalWarning, InputError

def body():
    {body}

LazyGroup.get_command = lambda *_: click.command("try")(body)
sys.exit(main(["try"]))
"""


def process(*arguments, **options):
    options = {"capture_output": True, "text": True, "check": False} | options
    return subprocess.run([sys.executable, *arguments], **options)


# -- the group -------------------------------------------------------------------------------------


def test_help_names_every_command_and_what_it_does(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["--help"]) == 0
    lines = capsys.readouterr().out.partition("Commands:\n")[2].splitlines()
    assert [line.split()[0] for line in lines] == list(COMMANDS)
    assert not [line for line in lines if line.endswith("...")]


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"accelcal {__version__}\n"


def test_runs_as_a_module():
    done = accelcal("--version")
    assert (done.returncode, done.stdout, done.stderr) == (0, f"accelcal {__version__}\n", "")


def test_no_command_shows_the_help(capsys):
    assert main([]) == 2
    assert "Usage: accelcal" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ("nosuch", "no such command 'nosuch'; see accelcal --help"),
        ("check", "missing argument 'DATA'; see accelcal check --help"),
        ("check x y", "got unexpected extra argument (y); see accelcal check --help"),
        ("fit x --method", "option '--method' requires an argument; see accelcal"),
        ("fit x --method y", "invalid value for '--method': 'y' is not one of 'least-squares', "),
        (
            "simulate --effect x",
            "invalid value for '--effect': 'x' is not of the form NAME=NUMBER;",
        ),
        ("fit x --t0 warm", "invalid value for '--t0': 'warm' is not a finite number; see"),
        (
            "fit x --t0 293mK",
            "invalid value for '--t0': '293mK' has another unit; it is one of degC, K, degF; see",
        ),
        (
            "fit x --t0 20,5",
            "invalid value for '--t0': '20,5' is not a finite number; write a decimal point; see",
        ),
        ("simulate --seed x", "invalid value for '--seed': 'x' is not a whole number; see"),
    ],
)
def test_unknown_words_are_unusable_options_and_one_line(arguments, line, capsys):
    assert main(arguments.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"error: {line}")
    assert err.endswith(" --help\n")
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ("--nosuch", "; see accelcal --help"),
        ("fit x --magic", r" \(?did you mean '?--g'?\?\)?; see accelcal fit --help"),
        ("check --nosuch x", "; see accelcal check --help"),
    ],
)
def test_an_unknown_option_is_one_line(arguments, line, capsys):
    """In the words of click, which put quotes and brackets to it from 8.4 on."""
    (unknown,) = [word for word in arguments.split() if word.startswith("--")]
    assert main(arguments.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    said = f"error: no such option:? '?{unknown}'?{line}\n"
    assert re.fullmatch(said, err, re.IGNORECASE)


def test_shell_completion_knows_the_commands():
    environment = os.environ | {
        "_ACCELCAL_COMPLETE": "bash_complete",
        "COMP_WORDS": "accelcal ",
        "COMP_CWORD": "1",
    }
    done = accelcal(env=environment)
    assert done.stdout.split() == [f"plain,{name}" for name in COMMANDS]


# -- exit codes and errors -------------------------------------------------------------------------


def test_done_is_0(run):
    assert run(lambda: None) == 0


def test_a_failed_verdict_is_1(run):
    assert run(lambda: click.get_current_context().exit(1)) == 1


def raising(error):
    def body():
        raise error

    return body


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (InputError("t0 is nan; it is a number"), "error: t0 is nan; it is a number\n"),
        (TableError("stroke 0", "from 1", source="a.csv", line=7), "a.csv:7: stroke 0; from 1\n"),
        (InputError("two\nlines"), "error: two\\nlines\n"),
        (OSError(errno.ENOSPC, "No space left", "a"), "error: [Errno 28] No space left: 'a'\n"),
        (click.ClickException("no"), "error: no\n"),
    ],
)
def test_unusable_input_is_2_and_one_line(run, capsys, error, line):
    assert run(raising(error)) == 2
    assert capsys.readouterr() == ("", line)


def test_a_full_memory_is_no_bug(run, capsys):
    assert run(raising(MemoryError())) == 2
    assert re.fullmatch(r"error: memory is full; .+\n", capsys.readouterr().err)


@pytest.mark.parametrize("command", [["fit"], ["stability"], ["apply", "nosuch.json"]])
def test_a_closed_standard_input_is_told(tmp_path, monkeypatch, capsys, command):
    if command[0] == "apply":
        command = ["apply", str(tmp_path / "cal.json")]
        assert main(["fit", str(ROOT / "examples" / "al15.csv"), "-o", command[1]]) == 0
    monkeypatch.setattr(sys, "stdin", None)
    capsys.readouterr()
    assert main([*command, "-"]) == 2
    assert capsys.readouterr().err.startswith("error: standard input is closed; open it, or")


def test_a_bug_keeps_its_traceback(run, capsys):
    assert run(raising(ZeroDivisionError("oh"))) == 70
    err = capsys.readouterr().err
    assert err.startswith("Traceback")
    assert err.endswith(f"ZeroDivisionError: oh\n{entry.BUG_NOTICE}\n")


def test_interrupt_is_130(run, capsys):
    assert run(raising(KeyboardInterrupt())) == 130
    assert capsys.readouterr() == ("", "\n")


def test_our_warnings_are_one_line(run, capsys):
    def body():
        for _ in range(2):
            warnings.warn("few\nreadings", AccelcalWarning, stacklevel=1)

    assert run(body) == 0
    assert capsys.readouterr() == ("", "warning: few readings\n" * 2)


def test_arguments_of_the_library_are_told_by_their_options(run, capsys):
    def body(**_options):
        warnings.warn("take gravity=..., or unit='g'", AccelcalWarning, stacklevel=1)
        remark("note: same_head=False, dask='tcp://a:1'")
        deliver("compare with same_head=True", words=True)
        deliver("same_head=True")
        raise TableError("no head", "give record.with_apparatus(head_uncertainty=...)", source="a")

    options = [
        click.option("--g", "gravity", metavar="M_S2"),
        click.option("--same-head/--other-head"),
        click.option("--dask"),
        click.option("--head-uncertainty", metavar="G"),
    ]
    assert run(body, options=options) == 2
    assert capsys.readouterr() == (
        "compare with --same-head\nsame_head=True\n",
        "warning: take --g M_S2, or unit='g'\n"
        "note: --other-head, --dask tcp://a:1\n"
        "a: no head; give --head-uncertainty G\n",
    )


def test_other_warnings_are_shown_as_ever(run):
    def body():
        warnings.simplefilter("always")
        warnings.warn("other", RuntimeWarning, stacklevel=1)

    with pytest.warns(RuntimeWarning, match="other"):
        assert run(body) == 0


def test_warnings_are_handed_back(run):
    shown = warnings.showwarning
    run(lambda: None)
    assert warnings.showwarning is shown


# -- streams ---------------------------------------------------------------------------------------


@posix_only
def test_a_reader_that_left_is_no_error():
    reader, writer = os.pipe()
    os.close(reader)
    try:
        done = accelcal("--help", capture_output=False, stdout=writer, stderr=subprocess.PIPE)
    finally:
        os.close(writer)
    assert (done.returncode, done.stderr) == (141, "")


def test_a_closed_standard_output_is_told(monkeypatch):
    monkeypatch.setattr(sys, "stdout", None)
    with pytest.raises(InputError, match="standard output is closed; open it, or"):
        deliver("result")


def test_a_full_standard_output_is_told(monkeypatch):
    class Full(io.StringIO):
        def write(self, _):
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(sys, "stdout", Full())
    with pytest.raises(InputError, match="cannot be written: No space left on device; name a file"):
        deliver("result")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the full device is Linux's")
@pytest.mark.parametrize("arguments", [["--help"], ["check", "examples/al15.csv"]], ids=" ".join)
def test_a_full_device_is_one_line(arguments):
    buffered = {key: value for key, value in os.environ.items() if key != "PYTHONUNBUFFERED"}
    with Path("/dev/full").open("wb") as full:
        streams = {"capture_output": False, "stdout": full, "stderr": subprocess.PIPE}
        done = accelcal(*arguments, cwd=ROOT, env=buffered, **streams)
    assert done.returncode == 2
    assert re.fullmatch("error: .*No space left on device.*\n", done.stderr)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the full device is Linux's")
@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["fit", "nofile.csv"], 2),
        (["fit", "--no-such-option"], 2),
        (["fit", "examples/al15.csv", "--method", "printed"], 0),
        (["batch", "examples/al15.csv", "-o", "{}/r.csv"], 0),
        (["fit", "examples/al15.csv", "--spec", "examples/al15.toml", "--format", "csv"], 1),
    ],
    ids=lambda value: " ".join(value[:2]) if isinstance(value, list) else str(value),
)
def test_the_exit_code_is_the_same_where_standard_error_is_full(tmp_path, arguments, code):
    with Path("/dev/full").open("wb") as full:
        streams = {"capture_output": False, "stdout": subprocess.DEVNULL, "stderr": full}
        done = accelcal(*(part.format(tmp_path) for part in arguments), cwd=ROOT, **streams)
    assert done.returncode == code


@posix_only
@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["fit", "nofile.csv"], 2),
        (["fit", "--no-such-option"], 2),
        (["fit", "examples/al15.csv", "--method", "printed", "--format", "json"], 0),
        (["discover", "examples/al15.csv", "--format", "json"], 0),
        (["batch", "examples/al15.csv", "-o", "{}/r.csv"], 0),
        (["batch", "examples", "-o", "{}/r.csv"], 1),
    ],
    ids=lambda value: " ".join(value[:2]) if isinstance(value, list) else str(value),
)
def test_with_a_closed_standard_error_nothing_of_it_is_in_the_result(tmp_path, arguments, code):
    done = accelcal(
        *(part.format(tmp_path) for part in arguments),
        cwd=ROOT,
        capture_output=False,
        stdout=subprocess.PIPE,
        preexec_fn=lambda: os.close(2),
    )
    assert done.returncode == code
    assert not done.stdout or json.loads(done.stdout)["schema"]


@posix_only
def test_ctrl_c_while_reading_standard_input():
    process = subprocess.Popen(
        [sys.executable, "-c", WAITING],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        # a run in the background has SIGINT ignored, and hands that on
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert process.stdout.readline() == b"reading\n"
    process.send_signal(signal.SIGINT)
    process.communicate()
    assert process.returncode == 130


WAITING = TRIAL.format(body="print('reading', flush=True); sys.stdin.read()")


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp437", "utf-8"])
def test_no_encoding_fails(encoding):
    environment = os.environ | {"PYTHONIOENCODING": encoding, "LC_ALL": "C"}
    done = accelcal_try(r"deliver('K1 \u00b1 \u0416 \udcff')", env=environment, text=False)
    assert (done.returncode, done.stderr) == (0, b"")
    escaped = "K1 \u00b1 \u0416 \\xff".encode(encoding, errors="backslashreplace")
    assert done.stdout.rstrip() == escaped


@pytest.mark.parametrize("command", ["fit", "check"])
@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp437", "utf-8"])
def test_a_serial_is_printed_as_far_as_the_encoding_has_it(tmp_path, encoding, command):
    path = tmp_path / "a.csv"
    example = (ROOT / "examples" / "al15.csv").read_text("utf-8")
    path.write_text(example.replace("AL-15", "Mü-Ω-日\x1b", 1), "utf-8")
    environment = os.environ | {"PYTHONIOENCODING": encoding}
    done = accelcal(command, str(path), env=environment, text=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert "Mü-Ω-日\\x1b".encode(encoding, errors="backslashreplace") in done.stdout
    assert b"\x1b" not in done.stdout


@pytest.mark.parametrize(
    "told", [r"raise InputError('\u0416')", r"warnings.warn('\u0416', AccelcalWarning)"]
)
def test_names_on_standard_error_are_escaped_as_well(told):
    environment = os.environ | {"PYTHONIOENCODING": "ascii"}
    done = accelcal_try(rf"remark('note: \u0416 \udcff \x1b'); {told}", env=environment)
    remark, other = done.stderr.splitlines()
    assert remark == r"note: \u0416 \xff \x1b"
    assert other.endswith(r": \u0416")


@posix_only
@pytest.mark.parametrize(("no_color", "coloured"), [("", True), ("1", False)])
def test_colour_is_for_terminals(no_color, coloured):
    pty = pytest.importorskip("pty")
    terminal, end = pty.openpty()
    environment = os.environ | {"NO_COLOR": no_color, "TERM": "xterm"}
    accelcal_try("raise InputError('no')", capture_output=False, stderr=end, env=environment)
    os.close(end)
    told = os.read(terminal, 10_000)
    os.close(terminal)
    label = b"\x1b[31m\x1b[1merror: \x1b[0m" if coloured else b"error: "
    assert told == label + b"no\r\n"


def test_no_colour_in_a_pipe():
    assert accelcal_try("raise InputError('no')").stderr == "error: no\n"


# -- results ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", [None, "-"])
def test_a_result_goes_to_standard_output(path, capsys):
    deliver("result", path)
    assert capsys.readouterr().out == "result\n"


def test_a_result_goes_to_a_file(tmp_path, capsys):
    deliver("K1 \u00b1\n", str(tmp_path / "out.txt"))
    assert (tmp_path / "out.txt").read_bytes() == "K1 \u00b1\n".encode()
    assert capsys.readouterr().out == ""


def test_a_missing_folder_is_an_error_of_the_user(run, capsys, tmp_path):
    path = str(tmp_path / "nowhere" / "out.txt")
    assert run(lambda: deliver("result", path)) == 2
    assert capsys.readouterr().err.startswith(f"error: {path} cannot be written: its folder")


# -- options ---------------------------------------------------------------------------------------


def test_shared_options(run, capsys):
    seen = {}
    options = [option.data(many=True), option.output("the result"), option.format("text", "json")]
    assert run(lambda **given: seen.update(given), "a", "-", "-o", "b", options=options) == 0
    assert seen == {"data": ("a", "-"), "path": "b", "form": "text"}
    assert run(lambda **_: None, "a", "--format", "xml", options=options) == 2
    assert "'xml' is not one of 'text', 'json'" in capsys.readouterr().err


def test_values():
    assert number("-4e1") == -40.0
    assert quantities(temperature)("20,80,-40") == (20.0, 80.0, -40.0)
    assert setting("K4=2e-5") == ("K4", 2e-5)


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1,5", "", "x"])
def test_no_number(value, run, capsys):
    option = click.option("--t0", type=number)
    assert run(lambda **_: None, "--t0", value, options=[option]) == 2
    err = capsys.readouterr().err
    assert f"invalid value for '--t0': {value!r} is not a finite number;" in err


@pytest.mark.parametrize("value", ["K4", "=1", "K4=", "K4=x", "20,,80"])
def test_no_setting(value):
    with pytest.raises(click.BadParameter):
        setting(value) if "," not in value else quantities(temperature)(value)
