"""Programs in C with an exported header: compiled without a warning, and what they print."""

import shutil
import subprocess

import numpy as np
import pytest

COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic"]

needs_compiler = pytest.mark.skipif(not COMPILER, reason="no C compiler (cc, gcc or clang) here")


def compiled(folder, main, *flags):
    """The program of a text, whose headers are in the folder."""
    (folder / "main.c").write_text(main, "utf-8")
    command = [COMPILER, *STRICT, *flags, "main.c", "-o", "program", "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return str(folder / "program")


def printed_by(program, rows):
    """Numbers in the lines that a program prints, which reads rows of numbers."""
    text = "".join(" ".join(map(repr, row)) + "\n" for row in np.asarray(rows).tolist())
    done = subprocess.run([program], input=text, capture_output=True, text=True, check=True)
    return np.array([line.split() for line in done.stdout.splitlines()], dtype=np.float64)
