"""Who does the work: this process, processes beside it, or a Dask cluster."""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, as_completed
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from itertools import islice
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, TypeVar

from accelcal.archive.failures import reason
from accelcal.errors import InputError, not_installed

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing.process import BaseProcess

Task = TypeVar("Task")
Result = TypeVar("Result")

Ended = SimpleQueue[Future[Result] | None]
"""Futures as they end."""

_AHEAD = 2  # tasks that wait for each worker, so that none is idle and memory stays bounded
_FOUND = 100  # tasks that are looked for beyond these

_SECONDS = 2.0  # until a pool from which nothing comes is asked whether it is broken

_UNCOLLECTED = 20_000  # objects that a worker makes between collections: few are in a cycle

_PATIENCE = 0.05  # seconds until a worker that goes on is told again
_TIMES = 200  # and so often, until it is ended at once

_UNSEEN = "127.0.0.1:0"  # without a dashboard Dask would take its port, 8787, on all interfaces

_KILLED = (
    "a worker was killed, most often for want of memory; what is finished is kept, go on with"
    " resume=True and fewer jobs"
)

_UNGUARDED = (
    "the processes of jobs cannot start; put what a script does under"
    " if __name__ == '__main__':, which each of them reads too, or give jobs=1"
)


def processors() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def completed(
    executor: Executor | None,
    function: Callable[[Task], Result],
    tasks: Iterable[Task],
    workers: int,
) -> Iterator[tuple[Task, Result]]:
    """Do tasks, a few more at a time than there are workers; without an executor here.

    They are looked for while the workers are busy, and each comes with its result, in the order in
    which they end. Raises InputError if a worker was killed and nobody takes over.
    """
    if executor is None:
        yield from ((task, function(task)) for task in tasks)
        return
    todo = _Ahead(tasks)
    running: dict[Future[Result], Task] = {}
    ended: Ended[Result] = SimpleQueue()
    come: list[Future[Result]] = []
    try:
        with _kills_told(), _interrupts_through(ended):
            while True:
                done = [(running.pop(future), future) for future in come]
                for task in islice(todo, _AHEAD * workers - len(running)):
                    future = executor.submit(function, task)
                    running[future] = task
                    future.add_done_callback(ended.put)
                yield from ((task, future.result()) for task, future in done)
                if not running:
                    return
                todo.look_ahead(lambda: not ended.empty())
                come = _taken(executor, ended)
    finally:
        for future in running:
            future.cancel()


class _Ahead(Iterator[Task]):
    """Tasks, which can be looked for before they are wanted."""

    def __init__(self, tasks: Iterable[Task]) -> None:
        self._tasks = iter(tasks)
        self._found: deque[Task] = deque()

    def __next__(self) -> Task:
        return self._found.popleft() if self._found else next(self._tasks)

    def look_ahead(self, enough: Callable[[], bool]) -> None:
        """Look for tasks until it is enough."""
        for task in islice(self._tasks, _FOUND - len(self._found)):
            self._found.append(task)
            if enough():
                return


@contextmanager
def _interrupts_through(ended: Ended[Any]) -> Iterator[None]:
    """Let Ctrl-C come as None; in the midst of a method of a future it may leave a lock taken."""
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler or _is_beside():
        yield
        return

    def hear(*_: object) -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # a second one comes at once
        ended.put(None)

    signal.signal(signal.SIGINT, hear)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _is_beside() -> bool:
    """Whether this is a thread beside the main one, which alone hears signals."""
    return threading.current_thread() is not threading.main_thread()


def _taken(executor: Executor, ended: Ended[Result]) -> list[Future[Result]]:
    """Wait for futures; that of a task which a pool took while it broke would never end."""
    found: list[Future[Result] | None] = []
    while not found:
        try:
            found.append(ended.get(timeout=_SECONDS))
        except Empty:
            executor.submit(abs, 0).cancel()  # a broken pool refuses it
    while not ended.empty():
        found.append(ended.get())
    if None in found:
        raise KeyboardInterrupt
    return [future for future in found if future is not None]


@contextmanager
def _kills_told() -> Iterator[None]:
    from concurrent.futures.process import BrokenProcessPool

    try:
        yield
    except BrokenProcessPool:
        raise InputError(_KILLED) from None
    except Exception as error:
        if type(error).__name__ == "KilledWorker":  # of Dask, which has tried it several times
            raise InputError(_KILLED) from None
        raise


def workers(jobs: int, dask: str | None) -> AbstractContextManager[tuple[Executor | None, int]]:
    """Give an executor and the number of its workers; one job is done here, without an executor.

    Raises InputError if Dask is not installed or its scheduler is not found.
    """
    if dask is not None:
        return _cluster(dask, jobs)
    return nullcontext((None, 1)) if jobs == 1 else _processes(jobs)


# -- processes -------------------------------------------------------------------------------------


@contextmanager
def _processes(jobs: int) -> Iterator[tuple[Executor, int]]:
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import current_process, get_context

    if current_process().daemon:
        raise InputError(f"jobs is {jobs} in a worker of a pool, which has none; give jobs=1 there")
    # a fork is ready at once, but a copy of a process with threads may hang
    alone = sys.platform == "linux" and threading.active_count() == 1
    context = get_context("fork" if alone else "spawn")
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_start_worker)
    try:
        if not alone:
            _require_start(pool, jobs)
        yield _Interruptible(pool) if _hears_interrupts() else pool, jobs
    except BaseException:
        own = _own(pool)
        pool.shutdown(wait=False, cancel_futures=True)
        _dismiss(own)
        raise
    own = _own(pool)
    pool.shutdown(wait=False)
    for idle in own:
        idle.terminate()  # or it might wait for a lock of one that was killed


def _own(pool: ProcessPoolExecutor) -> list[BaseProcess]:
    """Workers of a pool; other threads may have children of this process as well."""
    return list((pool._processes or {}).values())


def _require_start(pool: Executor, jobs: int) -> None:
    """Wait for the first of processes that read the script again, and end where it starts them."""
    from concurrent.futures.process import BrokenProcessPool

    try:
        next(as_completed([pool.submit(abs, 0) for _ in range(jobs)])).result()
    except BrokenProcessPool:
        raise InputError(_UNGUARDED) from None


def _hears_interrupts() -> bool:
    """Tell whether Ctrl-C ends this process: a shell lets what runs in the background ignore it."""
    return signal.getsignal(signal.SIGINT) is not signal.SIG_IGN


def _start_worker() -> None:
    """Leave Ctrl-C to the parent but during a task, and end with it however it ends."""
    from multiprocessing import parent_process

    gc.set_threshold(_UNCOLLECTED)
    gc.freeze()  # or each collection would copy the pages that are shared with the parent
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()

    def follow() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


class _Interruptible(Executor):
    """Lets SIGINT end the tasks of a pool, but not the processes that do them.

    A process that ends while its result is on the way leaves this one waiting for the rest of it.
    """

    def __init__(self, pool: Executor) -> None:
        self._pool = pool

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:  # type: ignore[override]
        return self._pool.submit(_interruptibly, function, *arguments)


def _interruptibly(function: Callable[..., Result], *arguments: Any) -> Result:
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        return function(*arguments)
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _dismiss(workers: Iterable[BaseProcess]) -> None:
    """End the workers of a pool that is shut; what they have begun is begun anew some day."""
    for worker in workers:
        for _ in range(_TIMES):
            if not worker.is_alive():
                break
            if sys.platform != "win32" and worker.pid is not None:
                with suppress(ProcessLookupError):  # it has just ended
                    os.kill(worker.pid, signal.SIGINT)
            worker.join(_PATIENCE)
        worker.kill()


# -- Dask ------------------------------------------------------------------------------------------


@contextmanager
def _cluster(address: str, jobs: int) -> Iterator[tuple[Executor, int]]:
    try:
        from dask.distributed import Client, LocalCluster
    except ImportError:
        raise not_installed("dask=...", "Dask", "dask") from None
    own: Any = nullcontext()
    if address == "local":
        own = LocalCluster(  # type: ignore[no-untyped-call]
            n_workers=jobs,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            scheduler_kwargs={"dashboard_address": _UNSEEN},
        )
    with own as cluster, _client(Client, cluster or address) as client:
        count = max(sum(client.nthreads().values()), 1)
        yield client.get_executor(pure=False), count


def _client(connect: Callable[..., Any], where: Any) -> Any:
    try:
        return connect(where, timeout="5s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"dask={where!r}: no scheduler there ({reason(error)}); start one by 'dask"
            " scheduler', or give dask='local'"
        ) from None
