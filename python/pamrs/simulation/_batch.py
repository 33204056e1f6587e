"""Many plants advanced together, sample by sample: gain sweeps, payload sweeps, vector
environments.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from pamrs import _core
from pamrs._arrays import Array, ArrayLike, Mask
from pamrs._checks import as_numbers, as_said, check_names, quantities, refused, whole
from pamrs._tables import Columns, Tabular
from pamrs._views import COLOURS, Panels, View, in_laboratory_units, over_time
from pamrs.channels import unit_of
from pamrs.errors import ParameterError
from pamrs.rig import Rig
from pamrs.simulation._driving import by_signal, initial_values, inputs_of, keywords
from pamrs.simulation._plants import plants_of, rowwise, thread_count
from pamrs.simulation._simulation import (
    MOST_NUMBERS,
    MOST_STATE,
    check_run,
    chosen_step,
    core_rig,
    loop_samples,
)

_MOST_DRAWN = 40  # plants of a batch
#: What is made from the rest, and not pickled.
_MADE = ("_core", "_first", "_inputs", "_channels", "_commands")


class Failure(NamedTuple):
    """Reason for which a plant of a batch has ended, with its time.

    Attributes
    ----------
    time : float
        When [s].
    message : str
        What happened: the quantity, its value and what is allowed.
    """

    time: float
    message: str


@dataclass(frozen=True, eq=False)
class BatchRun(View, Tabular, Mapping[str, Array]):
    """Record of :meth:`Batch.control` or :func:`pamrs.simulate_batch`; ``run["joint_angle"]`` has
    the shape (n, rows).

    Attributes
    ----------
    time : ndarray, shape (rows,)
        Time of each row [s].
    channels : dict of str to ndarray, shape (n, rows)
        Channels and commands by name in SI units, pressures gauge; a command is the one held from
        that row. The samples of all plants at one time lie next to each other in memory.
    status : tuple of Failure or None
        Why and when each plant ended, None for those that did not. A plant that ended stays at its
        last good sample.
    reduced : dict of str to ndarray, shape (n,)
        Numbers of whole runs that were asked for (``reduce``), NaN for plants that ended.
    """

    time: Array
    channels: dict[str, Array]
    status: tuple[Failure | None, ...]
    reduced: dict[str, Array] = field(default_factory=dict)

    @property
    def failed(self) -> Mask:
        """True for each plant that ended early, shape (n,)."""
        return np.array([failure is not None for failure in self.status], dtype=np.bool_)

    def _columns(self) -> Columns:
        axes = {"plant": np.arange(len(self.status)), "time": self.time}
        values: dict[str, tuple[tuple[str, ...], Array]] = {}
        values |= {name: (("plant", "time"), of) for name, of in self.channels.items()}
        values |= {name: (("plant",), of) for name, of in self.reduced.items()}
        units = {name: unit_of(name) for name in self.channels}
        return Columns(axes, values, {"time": "s", **units})

    def _panels(self) -> Panels:
        if self.time.size < 2 or not self.channels:
            return {
                name: partial(_draw_spread, name=name, of=v) for name, v in self.reduced.items()
            }
        faint = {"color": COLOURS[0], "alpha": 0.5, "lw": 0.8}
        shown = range(0, len(self.status), max(1, len(self.status) // _MOST_DRAWN))
        return over_time(
            {
                name: [("", self.time, values[k], faint) for k in shown]
                for name, values in self.channels.items()
            }
        )

    def _numbers(self) -> dict[str, str]:
        rows = f"{self.time[-1]:.4g} s in {self.time.size} rows" if self.time.size else "no rows"
        numbers = {"plants": f"{len(self.status)}, {self.failed.sum()} of them ended", "time": rows}
        last = {name: v[~self.failed, -1] for name, v in self.channels.items() if v.shape[1]}
        last |= {name: values[~self.failed] for name, values in self.reduced.items()}
        return numbers | {
            f"{name} at the end" if name in self.channels else name: (
                in_laboratory_units(name, values.min(), values.max())
            )
            for name, values in last.items()
            if values.size
        }

    def __getitem__(self, channel: str) -> Array:
        try:
            return self.channels[channel]
        except KeyError:
            there = f"there are: {', '.join(self.channels)}" if self.channels else "nothing was"
            raise KeyError(
                f"{channel!r} was not recorded ({there}); record=[{channel!r}] keeps it"
            ) from None

    def __iter__(self) -> Any:
        return iter(self.channels)

    def __len__(self) -> int:
        return len(self.channels)

    def __repr__(self) -> str:
        ended = f"{len(self.status)} plants, {self.failed.sum()} of them ended"
        return f"BatchRun({ended}; {self.time.size} rows of {', '.join(self.channels)})"


def _draw_spread(axes: Any, name: str, of: Array) -> None:
    """Draw a histogram of a number over the plants."""
    axes.hist(of[np.isfinite(of)], bins="auto", color=COLOURS[0])
    axes.set_xlabel(name)
    axes.set_ylabel("plants")


class Batch:
    """Plants that take their commands together, each as if it were alone.

    Plants whose rig has no effects and an arm of one link or a hanging mass run side by side in the
    vector lanes of the processor (:attr:`side_by_side`); their channels agree with those of
    :class:`pamrs.Simulator` to about 1e-9 of their size. Every other plant gives bit for bit what
    the simulator gives. Which other plants run, the number of threads, and how a run is cut
    into calls change no bit of it. A plant whose state leaves the range in which the model holds is
    kept: its channels stay at its last good sample, :attr:`status` says why, and the others go on.
    A batch can be pickled and copied; it belongs to one thread at a time.

    Parameters
    ----------
    rig : Rig or sequence of Rig
        The model of all plants, or one for each: rigs with the same inputs and channels, other
        parameters.
    n : int, optional
        Number of plants; needed where neither a sequence of rigs nor an array of initial values
        says it.
    sample_time : float
        Time between two samples [s].
    step : float, optional
        RK4 step [s] as of :class:`pamrs.Simulator`.
    initial : mapping of str to float or array_like, shape (n,), optional
        Initial values as for :func:`pamrs.simulate`, common ones or one for each plant.
    threads : int, optional
        Most threads that work; by default one for each processor that this process may use.

    Raises
    ------
    ParameterError
        If an argument is not finite, outside its range or of another length; the message names it,
        and the row.
    RigError
        If the rigs do not have the same inputs and channels.

    Examples
    --------
    >>> import numpy as np, pamrs
    >>> batch = pamrs.Batch(pamrs.rigs.shoulder(), n=3, sample_time=0.005)
    >>> for _ in range(100):
    ...     sample = batch.step(np.array([5.0, 5.5, 6.0]))
    >>> sample["joint_angle"].shape, bool(sample["joint_angle"][2] > sample["joint_angle"][1])
    ((3,), True)
    """

    @quantities
    def __init__(
        self,
        rig: Rig | Sequence[Rig],
        *,
        n: int | None = None,
        sample_time: float,
        step: float | None = None,
        initial: Mapping[str, ArrayLike] | None = None,
        threads: int | None = None,
    ) -> None:
        many = not isinstance(rig, Rig) and isinstance(rig, Iterable)
        given: list[Any] = list(rig) if many else [rig]  # type: ignore[arg-type]
        if not given:
            raise ParameterError("rig is an empty sequence; one Rig at least is needed")
        for each in {id(each): each for each in given}.values():
            check_run(each, sample_time)
        starts = {f"initial {name}": values for name, values in (initial or {}).items()}
        count = plants_of(n, len(given) if many else None, starts)
        channels = len(core_rig(given[0]).channels)
        if count * channels > MOST_NUMBERS:
            raise refused(
                "n",
                count,
                f"at most {MOST_NUMBERS // channels} plants of {channels} channels (2 GB)",
            )
        self.rigs: tuple[Rig, ...] = tuple(given) if many else (given[0],) * count
        """The rig of each plant."""
        self.sample_time = float(sample_time)
        self._step = chosen_step(self.sample_time, step)
        self._threads = thread_count(threads)
        self._prepare()
        self._begin(self._starting(initial))

    def _begin(self, initial: dict[str, Array]) -> None:
        """Core for initial values, and its first state, to begin again without new threads."""
        self._initial = initial
        self._core = self._started(initial)
        self._first = self._core.states

    def _prepare(self) -> None:
        self._inputs = inputs_of(self.rigs[0])
        core = core_rig(self.rigs[0])
        self._channels = tuple(core.channels)
        self._commands = tuple(core.inputs)

    def _starting(self, initial: Mapping[str, ArrayLike] | None) -> dict[str, Array]:
        names = initial_values(dict.fromkeys(initial or {}, 0.0), self.rigs[0])
        return {
            name: rowwise(f"initial {name}", (initial or {})[name], len(self)) for name in names
        }

    def _started(self, initial: Mapping[str, Array]) -> _core.Batch:
        like = core_rig(self.rigs[0])
        return _core.Batch(
            [core_rig(rig, like) for rig in self.rigs],
            self.sample_time,
            self._step,
            dict(initial),
            self._threads,
        )

    def __len__(self) -> int:
        return len(self.rigs)

    @property
    def time(self) -> float:
        """Simulated time [s] of the plants that have not ended."""
        return self._core.samples * self.sample_time

    @property
    def side_by_side(self) -> Mask:
        """True for each plant that runs in vector lanes, shape (n,); the others run one by one."""
        return np.array(self._core.side_by_side, dtype=np.bool_)

    @property
    def status(self) -> tuple[Failure | None, ...]:
        """Reason and time of each plant's end, None for those that did not end."""
        return tuple(None if ended is None else Failure(*ended) for ended in self._core.status)

    @property
    def state(self) -> dict[str, Any]:
        """State that the further run depends on (copies): ``samples``, ``rows`` and ``status``;
        give it back to :meth:`restore`.
        """
        return {"samples": self._core.samples, "rows": self._core.states, "status": self.status}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from a state, bit for bit.

        Parameters
        ----------
        state : mapping
            :attr:`state` of a batch of the same rigs.

        Raises
        ------
        ParameterError
            If it is not one; the message says what is wrong, and the row. The batch then stays as
            it is.
        """
        needed = {"samples", "rows", "status"}
        if not isinstance(state, Mapping) or set(state) != needed:
            has = ", ".join(map(str, state)) if isinstance(state, Mapping) else as_said(state)
            raise ParameterError(
                f"state has {has}; samples, rows and status are needed, as of Batch.state"
            )
        try:
            samples = int(state["samples"])
            if not len(state["rows"]) == len(state["status"]) == len(self):
                raise ParameterError(
                    f"state is of {len(state['rows'])} rows and {len(state['status'])} status; "
                    f"{len(self)} are needed"
                )
            rows = [
                np.ascontiguousarray(as_numbers("a row of state", row, MOST_STATE).reshape(-1))
                for row in state["rows"]
            ]
            status = [
                None if ended is None else (float(ended[0]), str.__str__(ended[1]))
                for ended in state["status"]
            ]
        except ParameterError:
            raise
        except (TypeError, ValueError, LookupError, OverflowError):
            raise ParameterError(
                "state is not one of a batch: its rows are arrays of numbers, its status None or "
                "(time, message)"
            ) from None
        if not 0 <= samples < 2**53:
            raise refused("state.samples", samples, "a number from 0 on is needed")
        self._core.restore(samples, rows, status)

    @quantities
    def reset(self, initial: Mapping[str, ArrayLike] | None = None) -> dict[str, Array]:
        """Begin again, all plants.

        Parameters
        ----------
        initial : mapping of str to float or array_like, shape (n,), optional
            Other initial values; those of the last start by default.

        Returns
        -------
        dict of str to ndarray, shape (n,)
            The first sample.
        """
        if initial is None:
            self._core.restore(0, self._first, [None] * len(self))
        else:
            self._begin(self._starting(initial))
        return self.observe()

    def observe(self) -> dict[str, Array]:
        """The present sample: channel -> values of all plants in SI units, pressures gauge.

        Returns
        -------
        dict of str to ndarray, shape (n,)
        """
        return self._named(self._core.observe())

    @quantities
    def step(
        self,
        valve_command: ArrayLike | Mapping[str, ArrayLike] | None = None,
        *,
        supply_command: ArrayLike | Mapping[str, ArrayLike] | None = None,
        length: ArrayLike | None = None,
        pressure: ArrayLike | Mapping[str, ArrayLike] | None = None,
        supply_pressure: ArrayLike | Mapping[str, ArrayLike] | None = None,
    ) -> dict[str, Array]:
        """Hold a command of each plant for one sample.

        Parameters
        ----------
        valve_command : float or array_like, shape (n,), or mapping of str to either, optional
            Commands [V]; needed by rigs with a valve, of several one for each name.
        supply_command : float or array_like, shape (n,), or mapping of str to either, optional
            Set pressures of a regulator [Pa, gauge].
        length, pressure, supply_pressure : float or array_like, shape (n,), optional
            As in :meth:`pamrs.Simulator.step`.

        Returns
        -------
        dict of str to ndarray, shape (n,)
            The sample after it.

        Raises
        ------
        ParameterError
            If a command is missing, not finite (the index is the plant's) or of another length; the
            batch stays as it is.
        """
        asked = by_signal(valve_command, supply_command, length, pressure, supply_pressure)
        return self._named(self._core.advance(1, self._inputs.rows(len(self), asked), True))

    @quantities
    def control(
        self,
        update: Callable[
            [dict[str, Any]],
            ArrayLike | Mapping[str, ArrayLike] | Mapping[str, Mapping[str, ArrayLike]],
        ],
        duration: float,
        *,
        period: float | None = None,
        channels: Sequence[str] | None = None,
        record_every: int = 1,
    ) -> BatchRun:
        """Close the loop of every plant with one sampled controller.

        The controller sees the present sample every ``period``; what it answers is held exactly
        until the next.

        Parameters
        ----------
        update : callable
            Takes the sample (channel -> values of all plants, shape (n,), in SI units, read-only,
            and ``time`` [s]); returns the valve commands [V], shape (n,) or one for all, of several
            valves a mapping of names, or a mapping of the keywords of :meth:`step`.
        duration : float
            How long [s].
        period : float, optional
            Time between two updates [s], a multiple of the sample time; the sample time by default.
        channels : sequence of str, optional
            Channels and commands that are recorded; all by default.
        record_every : int
            Samples from one recorded row to the next; the first row is the present sample.

        Returns
        -------
        BatchRun
            Arrays of shape (n, rows). A plant whose state leaves the model's range, or that is
            answered a command that is not finite or not possible, ends there, and the others go on.

        Raises
        ------
        ParameterError
            If the period or the duration is not a multiple of the sample time, a channel is not
            known, more than 2 GB would be recorded, or the controller answers what no plant can
            take.
        """
        every, total = loop_samples(update, self.sample_time, period, duration)
        book = self._book(total, channels, record_every)
        # what is recorded is what was, whatever the controller does with its sample
        began, sample, k = self.time, self._named(self._core.observe(), writeable=False), 0
        signals: dict[str, Array] = {}
        while True:
            if k % every == 0 and k < total:
                answer = update({"time": self.time, **sample})
                signals = self._inputs.rows(len(self), keywords(answer))
            if k % book.every == 0:
                book.write(k // book.every, sample, signals)
            if k == total:
                break
            # up to where there is something to do
            stop = min(k + every - k % every, k + book.every - k % book.every, total)
            sample = self._named(self._core.advance(stop - k, signals, False), writeable=False)
            k = stop
        time = np.asarray(
            began + np.arange(0, total + 1, book.every) * self.sample_time, dtype=np.float64
        )
        return BatchRun(time, {name: rows.T for name, rows in book.rows.items()}, self.status)

    def _book(self, total: int, channels: Sequence[str] | None, every: int) -> _Book:
        every = whole("record_every", every, 1)
        known = (*self._channels, *self._commands)
        names = list(
            dict.fromkeys(
                known if channels is None else [channels] if isinstance(channels, str) else channels
            )
        )
        check_names("channels", names, known, "channel of the rig")
        rows = total // every + 1
        if rows * len(self) * len(names) > MOST_NUMBERS:
            most = MOST_NUMBERS // (len(self) * len(names))
            raise ParameterError(
                f"{rows} rows of {len(names)} channels of {len(self)} plants are not allowed: at "
                f"most {most} rows (2 GB); choose fewer channels or a larger record_every"
            )
        return _Book({name: np.full((rows, len(self)), np.nan) for name in names}, every)

    def _named(self, sample: Array, *, writeable: bool = True) -> dict[str, Array]:
        sample.flags.writeable = writeable
        return dict(zip(self._channels, sample, strict=True))

    def __getstate__(self) -> dict[str, Any]:
        kept = {name: value for name, value in self.__dict__.items() if name not in _MADE}
        return {**kept, "state": self.state}

    def __setstate__(self, kept: dict[str, Any]) -> None:
        state = kept.pop("state")
        self.__dict__.update(kept)
        self._prepare()
        self._begin(self._initial)
        self.restore(state)

    def __repr__(self) -> str:
        names = ", ".join(dict.fromkeys(rig.name for rig in self.rigs))
        return (
            f"Batch({len(self)} x {names}, time={self.time:.6g} s, "
            f"sample_time={self.sample_time:g} s)"
        )


class _Book(NamedTuple):
    """Records of a batch, of shape (rows, n): the values of one time are written together."""

    rows: dict[str, Array]
    every: int

    def write(self, row: int, sample: Mapping[str, Array], signals: Mapping[str, Array]) -> None:
        """Note a sample and the commands that are held from it."""
        for name, rows in self.rows.items():
            values = sample.get(name, signals.get(name))
            if values is not None:
                rows[row] = values
