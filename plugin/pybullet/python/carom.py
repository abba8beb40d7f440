"""Contact sound for PyBullet, as samples, collisions, a file, or over loudspeakers.

    import pybullet as p
    import carom

    p.connect(p.DIRECT)
    sound = carom.attach(p)
    sound.listener([0, -1, 1])
    for _ in range(240):
        p.stepSimulation()
        samples = sound.samples()    # float32, (frames, channels), Pa: 200 frames for 1/240 s
        collisions = sound.events()  # who hit whom, when, where, how hard, how loud

This file needs nothing but the plugin, libcarom_pybullet.so, which lies beside it; the environment
variable CAROM_PYBULLET_PLUGIN names another. With NumPy, samples and events are arrays; without it,
memoryviews and lists of named tuples.

Units are SI, the world's frame is that of PyBullet, quaternions are [x, y, z, w]. Everything is
called by the thread that steps the simulation. Errors are CaromError, or ValueError for arguments
that no server has seen.
"""

from __future__ import annotations

import collections
import contextlib
import ctypes
import math
import os
import pathlib
import threading
import warnings

try:
    import numpy
except ImportError:
    numpy = None

__all__ = ["attach", "Sound", "Event", "CaromError", "EVENT_COLUMNS"]

PLUGIN_FILE = "libcarom_pybullet.so"
_POSTFIX = "_carom"
_LONGEST_COMMAND = 1023  # bytes: servers cut longer ones short
_FLOAT_SIZE = ctypes.sizeof(ctypes.c_float)

#: Columns of an event, with their types; `peaks_pa` has one peak for each listener.
EVENT_COLUMNS = (
    ("time_s", float), ("body", int), ("link", int), ("other", int), ("other_link", int),
    ("jx_Ns", float), ("jy_Ns", float), ("jz_Ns", float),
    ("px_m", float), ("py_m", float), ("pz_m", float),
    ("nx", float), ("ny", float), ("nz", float),
    ("approach_speed_m_s", float), ("effective_mass_kg", float), ("duration_s", float),
    ("collision", int), ("peak_pa", float), ("heard", bool))

#: One body's share of a collision. There are two for each, with opposite impulses.
Event = collections.namedtuple("Event", [name for name, _ in EVENT_COLUMNS] + ["peaks_pa"])


class CaromError(RuntimeError):
    """The plugin is not there, or has refused something; the message says why."""


class _Gone(CaromError):
    """The sound, or its server, is not there any more."""


#: Beginnings of what the plugin says of a sound that is not there any more.
_GONE = ("the sound is closed", "this sound was closed")


def attach(client, plugin: "str | os.PathLike | None" = None, *, samples: bool = True,
           latency: "float | None" = None, physics_client_id: "int | None" = None) -> "Sound":
    """Gives the sound of a PyBullet client.

    client: the module `pybullet`, or a `BulletClient`, which is connected.
    plugin: the file libcarom_pybullet.so, where it is not found by itself.
    samples: keeps samples and events from now on, for `samples()` and `events()`. They cost memory
        until they are taken, and some time; without them the sound can be recorded and played.
    latency: s by which samples are behind the simulation, at least four of its substeps; contacts
        become known that late. By default the larger of 0.05 s and four substeps, as they are at
        the first step.
    physics_client_id: which of the module's clients, where it has several.

    The sound ends with `close()`, with the block of a `with` statement, with the connection, or
    when another one is attached to the same client.
    """
    return Sound(client, plugin, samples=samples, latency=latency,
                 physics_client_id=physics_client_id)


class Sound:
    """The sound of one PyBullet client. See `attach`."""

    def __init__(self, client, plugin=None, *, samples=True, latency=None,
                 physics_client_id=None):
        if not callable(getattr(client, "loadPlugin", None)):
            raise CaromError(f"attach: {type(client).__name__} is no PyBullet client; expected the "
                             "module pybullet, or a BulletClient; the number that connect returns "
                             "goes into physics_client_id")
        self._id = {} if physics_client_id is None else {"physicsClientId": physics_client_id}
        self._client = client
        self._plugin = None
        self._library = None
        self._has_warned = False
        self._file = _find_plugin(plugin)
        number = client.loadPlugin(self._file, _POSTFIX, **self._id)
        if number < 0:
            raise CaromError(f"{self._file}: the physics server does not take this plugin; why is "
                             "on the standard error output")
        self._plugin = number
        # A plugin that is loaded already gives its number again: its sound is another one now.
        self._take(self._ask("open"))
        self._captures = samples
        # Elsewhere another thread or process steps, and answers before it is through.
        method = getattr(client, "getConnectionInfo", dict)(**self._id).get("connectionMethod")
        self._is_direct = method == getattr(client, "DIRECT", None)
        try:
            if latency is not None:
                self._do(f"latency {_number(latency)}")
            if samples:
                self._do("capture")
            self._describe()
        except BaseException:
            with contextlib.suppress(CaromError):
                self.close()
            raise

    def __enter__(self) -> "Sound":
        return self

    def __exit__(self, kind, *_) -> None:
        # What goes wrong in the block says more than what cannot be finished because of it.
        with contextlib.suppress(*(() if kind is None else (CaromError,))):
            self.close()

    def close(self) -> None:
        """Finishes a recording, and ends the sound; says where the recording cannot be finished. The
        second time it does nothing, nor where the client has disconnected, or another sound has taken
        this one's place.

        The plugin stays loaded, silent: PyBullet ends the program where a plugin is loaded after
        one was unloaded.
        """
        if self._plugin is None:
            return
        try:
            self._do("close")
        except _Gone:
            pass
        except CaromError:
            raise
        except getattr(self._client, "error", _Gone):
            pass  # the client has disconnected
        finally:
            self._plugin = None
            self._library = None

    # What is heard

    def samples(self):
        """Gives the samples since the last call: float32 of shape (frames, channels), in Pa.

        There are 48,000 frames for each second of the simulation, to the frame; frame k since
        `attach`, or since the clock was set (see `reset`), is what was to be heard at the time
        k / 48000 - `latency`. With NumPy an array; without it a memoryview of that shape, which of
        no frames has the shape (0,).
        """
        self._await_step()
        if self._library is not None:
            data = self._taken(self._library.takeSamples_carom, ctypes.c_float)
        else:
            data = self._taken_by_text("samples")
        return _shaped(data, self.channels)

    def events(self):
        """Gives the collisions since the last call, as the events CSV of the `carom` command.

        Two events for each collision, one of either body, with opposite impulses. Besides the
        columns of EVENT_COLUMNS each has `peaks_pa`, an upper bound of its sound at each listener.
        With NumPy a structured array; without it a list of `Event`.
        """
        self._await_step()
        if self._library is not None:
            data = self._taken(self._library.takeEvents_carom, ctypes.c_double)
        else:
            data = self._taken_by_text("events")
        return _table(data, self._listeners)

    @property
    def channels(self) -> int:
        """Channels of all listeners together, in their order."""
        return self._channels

    @property
    def sample_rate(self) -> int:
        """Frames in a second of the simulation."""
        return self._rate

    @property
    def latency(self) -> float:
        """Time in s by which samples are behind the simulation."""
        self._describe()
        return self._latency

    @property
    def time(self) -> float:
        """Time of the simulation in s: the sum of its substeps since the clock was set."""
        self._describe()
        return self._time

    # Who hears, and what

    def listener(self, position, orientation=None, *, looks_at=None, index: int = 0,
                 format: "str | None" = None, spacing: "float | None" = None,
                 half_angle: "float | None" = None, pattern: "float | None" = None,
                 head: "str | os.PathLike | None" = None) -> None:
        """Moves a listener, or adds one: the index after the last does.

        position: [x, y, z], m.
        orientation: [x, y, z, w], of a listener that looks along its -z, with y up. Without it,
            and without looks_at, it looks along the world's +y, with z up.
        looks_at: a point [x, y, z] that it looks at, with z up, instead.
        format: "mono", "spaced_pair" (what the first is), "coincident_pair" or "binaural".
        spacing, half_angle: of a pair, m and rad. pattern: 0 omnidirectional, 0.5 cardioid, 1
        figure of eight. head: a SOFA file; it makes the listener binaural.

        Moving is for every step. Adding, and making a listener another receiver, makes the sound
        anew: what sounds is cut, and what was not taken is gone.
        """
        words = ["listener", _vector("position", position, 3)]
        if looks_at is not None:
            if orientation is not None:
                raise ValueError("listener: orientation and looks_at are one too many")
            orientation = _looking(position, looks_at)
        if orientation is not None:
            words.append(_vector("orientation", orientation, 4))
        words.append(f"index={int(index)}")
        for name, value in (("spacing", spacing), ("angle", half_angle), ("pattern", pattern)):
            if value is not None:
                words.append(f"{name}={_number(value)}")
        if format is not None:
            words.append(f"format={_word('format', format)}")
        if head is not None:
            words.append(f"head={os.path.abspath(os.fspath(head))}")
        self._do(" ".join(words))
        self._describe()

    def material(self, body: int, name: str, link: "int | None" = None) -> None:
        """Sets of what a body, or one link of it, is; -1 is the base. See docs/materials.md."""
        middle = "" if link is None else f"{int(link)} "
        self._do(f"material {int(body)} {middle}{_word('material', name)}")

    def modes(self, body: int, file: "str | os.PathLike | None", link: "int | None" = None) -> None:
        """Has a body ring as a model file (`carom modes`) says; None: it does not ring."""
        self._do(f"modes {_target(body, link)} {_file(file)}")

    def texture(self, body: int, file: "str | os.PathLike | None", size=(1.0, 1.0),
                link: "int | None" = None) -> None:
        """Gives a body the bumps of a normal map, a PNG file, that is `size` (m) wide and high;
        None: those of its material."""
        if file is None:
            self._do(f"texture {_target(body, link)} none")
        else:
            self._do(f"texture {_target(body, link)} {_vector('size', size, 2)} {_file(file)}")

    def room(self, least=None, most=None, *, surface: "str | float" = "plaster", order: int = 1,
             reverb: bool = True) -> None:
        """Puts walls around everything: a box between two corners (m); without them, open air.

        surface: of all walls, a name (docs/room.md) or the share, 0 to 1, that they absorb. order:
        how often sound is followed from wall to wall, 0 to 32. reverb: what comes later, too.
        """
        if least is None and most is None:
            self._do("room none")
            return
        if isinstance(surface, str):
            walls = _word("surface", surface)
        else:
            walls = _number(surface)
        self._do(f"room {_vector('least', least, 3)} {_vector('most', most, 3)} surface={walls} "
                 f"order={int(order)} reverb={'on' if reverb else 'off'}")

    def level(self, full_scale: "float | None") -> None:
        """Sets the pressure (Pa) of a sample of 1.0 in what is recorded and played; None: automatic.

        `samples()` are in Pa, whatever it is.
        """
        self._do("level " + ("automatic" if full_scale is None else _number(full_scale)))

    # Outputs

    def record(self, file: "str | os.PathLike") -> None:
        """Records to a WAV file from now on; it is complete after `stop()`."""
        self._do(f"record {os.path.abspath(os.fspath(file))}")

    def record_run(self, file: "str | os.PathLike") -> None:
        """Writes what happens from now on, for `carom replay`; complete after `stop()`."""
        self._do(f"record-run {os.path.abspath(os.fspath(file))}")

    def keep_run(self, seconds: float) -> None:
        """Keeps the last seconds of what happens in memory, for `save_run`; 0 ends it.

        It begins anew where the listeners, the room, level or latency are set.
        """
        self._do(f"keep-run {_number(seconds)}")

    def save_run(self, file: "str | os.PathLike") -> None:
        """Writes what is kept, for `carom replay`."""
        self._do(f"save-run {os.path.abspath(os.fspath(file))}")

    def play(self) -> None:
        """Plays on the default audio device, for simulations that step in real time."""
        self._do("play")

    def stop(self) -> None:
        """Ends playing, and finishes the recordings."""
        self._do("stop")

    def gain(self, factor: float) -> None:
        """Sets a factor, 0 to 1000, on what is played."""
        self._do(f"gain {_number(factor)}")

    def mute(self, on: bool = True) -> None:
        """Mutes what is played, or unmutes it."""
        self._do("mute " + ("on" if on else "off"))

    def pause(self) -> None:
        """Takes note that the simulation rests until its next step: for what is played."""
        self._do("pause")

    # The clock

    def reset(self, time: float = 0.0) -> None:
        """Sets the clock of the sound (s). What sounds is silent, what was not taken is gone.

        `resetSimulation` does this by itself.
        """
        self._do(f"reset {_number(time)}")

    def save_state(self) -> "tuple[int, float]":
        """Saves the simulation's state in memory, as p.saveState does, with the time."""
        return self._client.saveState(**self._id), self.time

    def restore_state(self, state: "tuple[int, float]") -> None:
        """Restores what `save_state` has saved, and the clock with it; all is silent.

        p.restoreState does without the clock: no server tells of it.
        """
        number, time = state
        self._client.restoreState(stateId=number, **self._id)
        self.reset(time)

    def statistics(self) -> "dict[str, float]":
        """Gives the counters of what became of the collisions (docs/pybullet.md)."""
        words = (word.split("=", 1) for word in self._do("stats").split())
        return {name: float(value) for name, value in words}

    def report(self) -> str:
        """Says in some sentences, a line each, what sounds and how loud, and why it may be silent."""
        return self._do("report")

    # The plugin

    def _do(self, command: str) -> str:
        """Runs a command in this sound, and in no other that has taken its place."""
        self._require_open()
        return self._ask(f"as {self._instance} {command}")

    def _ask(self, command: str) -> str:
        if "\0" in command or "\n" in command:
            raise ValueError(f"a line break or a zero in {command!r}")
        if len(command.encode()) > _LONGEST_COMMAND:
            raise ValueError(f"the command is longer than {_LONGEST_COMMAND} bytes: {command[:60]}...")
        answer = self._client.executePluginCommand(self._plugin, command, **self._id)
        if isinstance(answer, int):
            raise _Gone("the physics server does not answer; is it connected still?")
        result, _, data = answer
        text = bytes(number & 0xFF for number in data).decode("ascii", "replace")
        if result != 0:
            raise (_Gone if text.startswith(_GONE) else CaromError)(text)
        return text

    def _describe(self) -> None:
        self._take(self._do("describe"))

    def _take(self, description: str) -> None:
        told = dict(word.split("=", 1) for word in description.split())
        self._instance = int(told["instance"])
        self._rate = int(float(told["rate"]))
        self._channels = int(told["channels"])
        self._listeners = int(told["listeners"])
        self._latency = float(told["latency"])
        self._time = float(told["time"])
        if self._library is None and int(told["process"]) == os.getpid():
            self._library = _library(self._file)

    def _require_open(self) -> None:
        if self._plugin is None:
            raise CaromError("the sound is closed; attach another")

    def _await_step(self) -> None:
        """Has the server finish the latest step, of which it may have told too early."""
        self._require_open()
        if not self._captures:
            raise CaromError("samples and events are not kept; attach(..., samples=True) keeps them")
        if not self._is_direct:
            self._do("describe")

    def _taken(self, take, number_type) -> memoryview:
        waiting = take(self._instance, None, 0)
        if waiting < 0:
            raise CaromError("the sound is not there any more; is the server connected still?")
        if waiting == 0:
            return memoryview(b"")
        data = bytearray(waiting * ctypes.sizeof(number_type))
        if take(self._instance, (number_type * waiting).from_buffer(data), waiting) != waiting:
            raise CaromError("samples and events were taken by somebody else meanwhile")
        return memoryview(data)

    def _taken_by_text(self, name: str) -> memoryview:
        if not self._has_warned:
            self._has_warned = True
            warnings.warn("the physics server runs in another process: samples and events come as "
                          "text, which takes long; connect with p.DIRECT or p.GUI", stacklevel=3)
        data = bytearray()
        while True:
            some = bytes.fromhex(self._do(name).split("=", 1)[1])
            if not some:
                return memoryview(data)
            data += some


# Loading

_libraries: "dict[str, ctypes.CDLL]" = {}
_libraries_lock = threading.Lock()


def _find_plugin(plugin) -> str:
    if plugin is None:
        plugin = os.environ.get("CAROM_PYBULLET_PLUGIN")
    if plugin is None:
        plugin = pathlib.Path(__file__).resolve().parent / PLUGIN_FILE
    file = pathlib.Path(plugin)
    if not file.is_file():
        raise CaromError(f"{file}: there is no such file; expected the plugin, {PLUGIN_FILE}")
    return str(file.resolve())


def _library(file: str) -> ctypes.CDLL:
    """The plugin as the server of this process has loaded it."""
    with _libraries_lock:
        if file not in _libraries:
            library = ctypes.CDLL(file)
            for take, number in ((library.takeSamples_carom, ctypes.c_float),
                                 (library.takeEvents_carom, ctypes.c_double)):
                take.argtypes = [ctypes.c_int, ctypes.POINTER(number), ctypes.c_longlong]
                take.restype = ctypes.c_longlong
            _libraries[file] = library
        return _libraries[file]


# Numbers to words, and back

def _number(value) -> str:
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{value!r} is not a finite number")
    return repr(number)


def _vector(name: str, values, length: int) -> str:
    numbers = [_number(value) for value in values] if values is not None else []
    if len(numbers) != length:
        raise ValueError(f"{name}: {len(numbers)} numbers; expected {length}")
    return " ".join(numbers)


def _word(name: str, value: str) -> str:
    if not value or any(letter.isspace() for letter in value):
        raise ValueError(f"{name}: {value!r} is not one word")
    return value


def _target(body: int, link: "int | None") -> str:
    return str(int(body)) if link is None else f"{int(body)} link={int(link)}"


def _file(file: "str | os.PathLike | None") -> str:
    return "none" if file is None else os.path.abspath(os.fspath(file))


def _looking(position, at) -> "list[float]":
    """The quaternion of a listener that looks from one point at another, with z up."""
    back = [float(p) - float(a) for p, a in zip(position, at)]
    length = math.sqrt(sum(x * x for x in back))
    if not length > 0.0:
        raise ValueError("looks_at: that is where the listener is")
    back = [x / length for x in back]
    right = [-back[1], back[0], 0.0]  # z cross back
    wide = math.hypot(right[0], right[1])
    right = [x / wide for x in right] if wide > 1e-9 else [1.0, 0.0, 0.0]
    up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2],
          back[0] * right[1] - back[1] * right[0]]
    return _quaternion(right, up, back)


def _quaternion(x, y, z) -> "list[float]":
    """The quaternion whose rotation has these columns (Shepperd's method)."""
    diagonal = [x[0], y[1], z[2]]
    trace = sum(diagonal)
    most = max(range(3), key=lambda axis: diagonal[axis])
    if trace >= diagonal[most]:
        values = [y[2] - z[1], z[0] - x[2], x[1] - y[0], 1.0 + trace]
    elif most == 0:
        values = [1.0 + 2.0 * x[0] - trace, x[1] + y[0], z[0] + x[2], y[2] - z[1]]
    elif most == 1:
        values = [x[1] + y[0], 1.0 + 2.0 * y[1] - trace, y[2] + z[1], z[0] - x[2]]
    else:
        values = [z[0] + x[2], y[2] + z[1], 1.0 + 2.0 * z[2] - trace, x[1] - y[0]]
    length = math.sqrt(sum(value * value for value in values))
    return [value / length for value in values]


def _shaped(data: memoryview, channels: int):
    if numpy is not None:
        return numpy.frombuffer(data, dtype=numpy.float32).reshape(-1, channels)
    frames = len(data) // (channels * _FLOAT_SIZE)
    if frames == 0:
        return memoryview(b"").cast("f")
    return data.cast("f", shape=[frames, channels])


def _table(data: memoryview, listeners: int):
    columns = len(EVENT_COLUMNS) + listeners
    if numpy is not None:
        rows = numpy.frombuffer(data, dtype=numpy.float64).reshape(-1, columns)
        kinds = {float: numpy.float64, int: numpy.int64, bool: numpy.bool_}
        table = numpy.empty(len(rows), dtype=[(name, kinds[kind]) for name, kind in EVENT_COLUMNS]
                            + [("peaks_pa", numpy.float64, (listeners,))])
        for column, (name, _) in enumerate(EVENT_COLUMNS):
            table[name] = rows[:, column]
        table["peaks_pa"] = rows[:, len(EVENT_COLUMNS):]
        return table
    numbers = data.cast("d").tolist() if len(data) else []
    events = []
    for first in range(0, len(numbers), columns):
        row = numbers[first:first + columns]
        values = [kind(value) for (_, kind), value in zip(EVENT_COLUMNS, row)]
        events.append(Event(*values, tuple(row[len(EVENT_COLUMNS):])))
    return events
