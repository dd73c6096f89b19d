"""Memory of the workers of a batch."""

import os
import platform
import subprocess
import sys

import pytest

CODE = """
import resource
import numpy as np
from accelcal.archive.block import keep_freed_memory

def pages():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt

def pages_of_some_arrays():
    before = pages()
    arrays = [np.ones(3 * 2**17) for _ in range(4)]
    return pages() - before

before = pages()
keep_freed_memory()
taken = pages() - before
pages_of_some_arrays()
print(taken, pages_of_some_arrays())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="of the allocator of glibc")
def test_freed_memory_is_taken_again_without_new_pages():
    # Dask sets a threshold of its own, which this process may have from other tests
    env = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    run = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, check=True, env=env
    )
    taken, again = map(int, run.stdout.split())
    assert taken < 100  # 32 MB are 8192 pages
    assert again < 300  # of 3072
