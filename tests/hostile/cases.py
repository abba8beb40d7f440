"""The table of hostile inputs: scenes, worlds, recordings, models, meshes, pictures, heads and command lines."""
import copy
import json
import os
import struct
import zlib
from dataclasses import dataclass, field
from pathlib import Path

DONE, FAILED, BAD, LIMIT = 0, 1, 2, 3


@dataclass
class Case:
    name: str
    arguments: list
    sentence: str
    code: int = BAD
    files: dict = field(default_factory=dict)  # name: bytes or text, or a function that makes it at a path
    leaves: bool = False  # true if it may leave files although it failed
    most_lines: int = 6  # of stderr

    def prepare(self, folder):
        for name, content in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if callable(content):
                content(path)
            elif isinstance(content, bytes):
                path.write_bytes(content)
            else:
                path.write_text(content)


# ---- Scenes

BALL = {
    "duration": 0.05,
    "bodies": [
        {"type": "sphere", "name": "ball", "radius": 0.01, "material": "steel", "position": [0, 1, 0]},
        {"type": "plane", "normal": [0, 1, 0], "offset": 0, "material": "concrete"},
    ],
    "listeners": [{"position": [0, 1, 1]}],
}

JELLO = {
    "duration": 0.05,
    "bodies": [
        {"type": "jello", "points": 3, "size": [1, 1, 1], "mass": 1, "stiffness": 100, "position": [0, 2, 0], "integrator": "rk4",
         "step": 0.001},
    ],
    "listeners": [{"position": [0, 1, 1]}],
}

RENDER = ["render", "scene.json", "-o", "out.wav"]
INFO = ["info", "scene.json"]


def changed(scene, pointer, value):
    scene = copy.deepcopy(scene)
    at = scene
    *way, last = [int(key) if key.isdigit() else key for key in pointer.strip("/").split("/")]
    for key in way:
        at = at[key]
    if isinstance(at, list) and last == len(at):
        at.append(value)
    else:
        at[last] = value
    return scene


def scene_case(name, scene, sentence, code=BAD, arguments=None, **files):
    text = scene if isinstance(scene, (str, bytes)) else json.dumps(scene)
    return Case("scene " + name, arguments or INFO, sentence, code, {"scene.json": text, **files})


def wrong_numbers():
    """Each numeric field of a scene with a value outside of its range, which the message tells with its place."""
    fields = [
        (BALL, "/duration", [0, -1, 1e-300, 1e300, "1", None]),
        (BALL, "/sample_rate", [0, 7999, 1e300, 44100.5]),
        (BALL, "/seed", [-1, 0.5, 1e300]),
        (BALL, "/gravity", [[0, -1e300, 0], [0, 0], "down"]),
        (BALL, "/bodies/0/radius", [0, -1, 1e-300, 1e300]),
        (BALL, "/bodies/0/mass", [-1, 1e-30, 1e30]),
        (BALL, "/bodies/0/position", [[0, 1e300, 0], [0, 1]]),
        (BALL, "/bodies/0/velocity", [[1e300, 0, 0]]),
        (BALL, "/bodies/0/spin", [[1e300, 0, 0]]),
        (BALL, "/bodies/0/friction", [-1, 1e300]),
        (BALL, "/bodies/1/offset", [1e300]),
        (BALL, "/bodies/1/normal", [[0, 0, 0], [1e300, 0, 0]]),
        (BALL, "/listeners/0/position", [[1e300, 0, 0]]),
        (JELLO, "/bodies/0/points", [0, 1, 129, 2.5, 1e300]),
        (JELLO, "/bodies/0/size", [[0, 1, 1], [1e-300, 1, 1], [1e300, 1, 1]]),
        (JELLO, "/bodies/0/mass", [0, 1e-300, 1e300]),
        (JELLO, "/bodies/0/stiffness", [-1, 1e13]),
        (JELLO, "/bodies/0/damping", [-1, 1e13]),
        (JELLO, "/bodies/0/step", [0, 1e-30, 1e-8, 1e300]),
    ]
    for scene, pointer, values in fields:
        for value in values:
            yield scene_case(f"{pointer} = {json.dumps(value)}", changed(scene, pointer, value), f"scene.json: {pointer}")


def spelt_scenes():
    """Texts that are no scene."""
    yield scene_case("empty", "", "the document is empty; expected a JSON object")
    yield scene_case("of zeros", b"\0" * 4096, "not JSON")
    yield scene_case("with something behind a NUL", json.dumps(BALL) + "\0garbage {", "is the character NUL")
    for name in ("a\u009b31mb", "a\u202eb", "a\u2028b"):
        yield scene_case(f"with a name with {name.encode('unicode_escape').decode()}", changed(BALL, "/bodies/0/name", name), "/bodies/0/name")
    yield scene_case("of invalid UTF-8", b'{"name": "\xff\xfe"}', "not JSON")
    yield scene_case("NaN", '{"duration": NaN}', "line 1")
    yield scene_case("infinity", '{"duration": Infinity}', "line 1")
    yield scene_case("too large a number", '{"duration": 1e999}', "1e999")
    yield scene_case("cut off", json.dumps(BALL)[:60], "line 1, column 61: this is not JSON")
    yield scene_case("a key twice", '{"duration": 1, "duration": 2}', "duration")
    yield scene_case("nested a million times", "[" * 1_000_000, "expected")
    yield scene_case("nested objects", '{"a":' * 100_000 + "1" + "}" * 100_000, "expected")
    yield scene_case("of a million numbers", '{"bodies": [' + "0," * 3_000_000 + "0]}", "expected")
    yield scene_case("of 20 MB", '{"name": "' + "x" * 20_000_000 + '"}', "larger than 16 MiB")
    yield scene_case("a number of a million digits", '{"duration": ' + "9" * 1_000_000 + "}", "expected")
    yield scene_case("an array", "[]", "expected")
    yield scene_case("an unknown key", changed(BALL, "/bodiess", []), "bodies")
    yield scene_case("no body", changed(BALL, "/bodies", []), "/bodies")
    yield scene_case("a name of a megabyte", changed(BALL, "/name", "x" * 1_000_000), "/name")
    yield scene_case("one name for two", changed(BALL, "/bodies/1/name", "ball"), "taken")
    yield scene_case("spheres in each other", changed(BALL, "/bodies/2", BALL["bodies"][0] | {"name": "other"}), "/bodies/")
    yield scene_case("a group without room", changed(BALL, "/bodies/2", {"type": "spheres", "count": 100000, "radius": 0.1, "material": "steel",
                                                                       "min": [0, 2, 0], "max": [1, 3, 1]}), "/bodies/2")
    yield scene_case("a group of too many", changed(BALL, "/bodies/2", {"type": "spheres", "count": 1e9, "radius": 0.1, "material": "steel",
                                                                       "min": [0, 2, 0], "max": [1, 3, 1]}), "/bodies/2/count")
    yield scene_case("a material that is like itself", changed(BALL, "/materials", {"a": {"like": "b"}, "b": {"like": "a"}}), "/materials")
    yield scene_case("images without end", changed(changed(BALL, "/room", {"order": 1000}), "/bodies/1", {
        "type": "box", "min": [-2, 0, -2], "max": [2, 3, 2], "material": "wood"}), "/room")
    yield scene_case("257 listeners", changed(BALL, "/listeners", BALL["listeners"] * 257), "/listeners")
    yield scene_case("less than a sample", changed(BALL, "/duration", 1e-6), "less than a sample")
    yield Case("scene that is a directory", ["info", "."], "directory")
    yield Case("scene that is a device", ["info", "/dev/zero"], "not a regular file")
    yield Case("scene that is not there", ["info", "none.json"], "no such file")
    yield Case("scene that is a pipe", ["info", "pipe"], "not a regular file", files={"pipe": os.mkfifo})
    yield Case("scene that is a link to itself", ["info", "loop"], "loop", files={"loop": lambda path: path.symlink_to("loop")})
    yield Case("scene of a name of 5000 letters", ["info", "x" * 5000], "expected")
    yield Case("scene of the name empty", ["info", ""], "expected")


# ---- Worlds of jello

HEAD = "RK4\n0.0005 20\n200 0.02 400 0.25\n0.001953125\n0\n0\n"
NAMES = ["integrator", "dt", "n", "kElastic", "dElastic", "kCollision", "dCollision", "mass", "plane", "resolution"]


def world(head=HEAD, positions=None):
    lines = [head]
    for x in range(8):
        for y in range(8):
            for z in range(8):
                lines.append(f"{1.1 * (x / 7 - 0.5)!r} {y / 7 - 0.5!r} {z / 7 - 0.5!r}\n")
    if positions is not None:
        lines[1:] = positions
    return "".join(lines) + "0 0 0\n" * 512


def world_case(name, text, sentence, code=BAD, options=("--seconds", "0.01", "-o", "out.wav"), leaves=False):
    return Case("world " + name, ["jello", "my.w", *options], sentence, code, {"my.w": text}, leaves)


def worlds():
    words = HEAD.split()
    for index, field_name in enumerate(NAMES):
        for value in ("0", "-1", "1e-300", "1e-30", "1e300", "nan", "inf", "x"):
            fine = {"dElastic", "kElastic", "dCollision", "kCollision"}
            if field_name in fine and value in ("0", "1e-300", "1e-30") or field_name in ("plane", "resolution") and value == "0":
                continue
            changed_words = words[:index] + [value] + words[index + 1:]
            yield world_case(f"{field_name} = {value}", world("\n".join(changed_words) + "\n"), f"my.w: line {index + 1}: ")
    yield world_case("with a step of 1e-12", world(HEAD.replace("0.0005", "1e-12")), "expected a number from 1e-08 to 1")
    yield world_case("empty", "", "line 1")
    yield world_case("cut off", world()[:300], "the file ends")
    yield world_case("with more at the end", world() + "1", "expected the end")
    yield world_case("of one word of a megabyte", "9" * 1_000_000, "line 1")
    yield world_case("with a field of 257^3", world("RK4 0.0005 20 200 0.02 400 0.25 0.002 0 257\n"), "resolution")
    yield world_case("with a field that is not there", world("RK4 0.0005 20 200 0.02 400 0.25 0.002 0 256\n"), "the file ends")
    yield world_case("with points at one place", world(positions=["0 0 0\n"] * 512), "", DONE)
    yield world_case("with points outside", world(positions=["1e7 0 0\n"] * 512), "my.w: line 7: number 1 of the 512 positions is 1e+07")
    yield world_case("with points far apart", world(positions=[f"{1e6 * (-1) ** i} 0 0\n" for i in range(512)]), "blew up", FAILED, leaves=True)
    yield world_case("of binary", bytes(range(256)) * 100, "line 1")
    yield world_case("with sound of no sample", world(), "less than a sample", options=("--seconds", "1e-6", "--dt", "1e-8", "-o", "out.wav"))
    for option, value in (("--dt", "0"), ("--dt", "1e-30"), ("--dt", "nan"), ("--dt", "2"), ("--seconds", "0"), ("--seconds", "1e300"),
                          ("--seconds", "-1"), ("--error", "0"), ("--sample-rate", "1"), ("--sample-rate", "44100.5"),
                          ("--listener", "1e300,0,0"), ("--listener", "0,0"), ("--full-scale", "0"), ("--full-scale", "1e300dB")):
        more = ["--integrator", "rk4"] if option in ("--dt", "--error") else []
        yield world_case(f"by {option} {value}", world(), option, options=(*more, option, value, "-o", "out.wav"))


# ---- Stiffness without end

def stiff():
    spring = {"type": "jello", "points": 8, "size": [1, 1, 1], "mass": 1, "stiffness": 1e12, "position": [0, 2, 0]}
    for integrator in ("rk4", "symplectic_euler"):
        yield scene_case(f"with a jello of 1e12 N/m by {integrator}", changed(JELLO, "/bodies/0", {**spring, "mass": 1e-9, "integrator": integrator}),
                         "expected", FAILED, RENDER)
    feather = {"type": "jello", "points": 2, "size": [1, 1, 1], "mass": 1e-18, "stiffness": 1e12, "damping": 1e9, "position": [0, 2, 0]}
    yield scene_case("of a feather at 1e12 N/m", changed(JELLO, "/bodies/0", feather), "its jello asks for steps of", FAILED, RENDER)
    yield scene_case("with 128^3 points at 1e12 N/m", changed(JELLO, "/bodies/0", {**spring, "points": 128}), "it can have no more memory than", LIMIT, RENDER)
    yield scene_case("with 64^3 points at 1e12 N/m by rk4", changed(JELLO, "/bodies/0", {**spring, "points": 64, "integrator": "rk4"}), "it would take", FAILED, RENDER)


# ---- Runs that a limit ends

def gap(duration=1):
    """A ball of 100 m/s in a gap of 0.2 um, which nothing slows down: 5e8 collisions in a second."""
    steel = {"like": "steel", "restitution": 1}
    return {"duration": duration, "gravity": [0, 0, 0], "listeners": [{"position": [0, 1, 1]}], "bodies": [
        {"type": "sphere", "name": "ball", "radius": 0.01, "material": steel, "position": [0, 0.0100001, 0], "velocity": [0, 100, 0]},
        {"type": "plane", "name": "floor", "normal": [0, 1, 0], "offset": 0, "material": steel},
        {"type": "plane", "name": "lid", "normal": [0, -1, 0], "offset": -0.0200002, "material": steel}]}


def sprung(stiffness):
    scene = changed(BALL, "/mechanics", {"springs": [{"bodies": ["ball"], "anchor": [0, 2, 0], "length": 1, "stiffness": stiffness}]})
    return changed(changed(scene, "/bodies/0/velocity", [0, 1, 0]), "/duration", 1)


def replaced():
    """Outputs that would take the place of what is read."""
    there = "would take the place of"
    ball, mesh = json.dumps(BALL), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    yield Case("stem over the scene", ["render", "out.clicks.wav", "-o", "out.wav", "--stems"], there, BAD, {"out.clicks.wav": ball})
    yield Case("report over its scene", ["report", "r/report.json", "-o", "r"], there, BAD, {"r/report.json": ball})
    yield Case("modes over their material", ["modes", "m.obj", "--material", "m.json", "-o", "m.json"], there, BAD,
               {"m.obj": mesh, "m.json": '{"like": "steel"}'})
    scene = changed(BALL, "/bodies/0", {"type": "solid", "shape": {"type": "mesh", "file": "m.obj"}, "material": "steel", "position": [0, 1, 0]})
    scene["stepper"] = {"type": "bullet"}
    for command in (["record", "scene.json", "-o", "m.obj"], [*RENDER, "--events", "m.obj"]):
        yield Case(f"{command[0]} over the scene's mesh", command, there, BAD, {"scene.json": json.dumps(scene), "m.obj": mesh})


def limits():
    rattle = '"ball" (/bodies/0) rattles without end: 200000 collisions within 0.0004 s, the last with "'
    for seconds in (1, 0.01, 3600):
        yield scene_case(f"of an endless rattle for {seconds} s", gap(seconds), rattle[:60], LIMIT, RENDER)
    yield scene_case("of an endless rattle, recorded", gap(), rattle[:60], LIMIT, ["record", "scene.json", "-o", "run.carom"])
    yield scene_case("of an endless rattle, as JSON", gap(), '"pointer": "/bodies/0"', LIMIT, [*RENDER, "--json"])
    yield scene_case("of an endless rattle, whose beginning is kept", gap(), "what came before is in out.incomplete.wav", LIMIT, [*RENDER, "--keep-partial"])
    yield scene_case("of 1e5 events", gap(), "expected at most 100000 (--max-events)", LIMIT, [*RENDER, "--max-events", "100000"])
    yield scene_case("of 100 MB", gap(), "expected at most 100 MB (--max-memory)", LIMIT, [*RENDER, "--max-events", "1e12", "--max-memory", "100MB"])
    yield scene_case("of 300 MB, recorded", gap(), "expected at most 200 MB (--max-memory)", LIMIT,
                     ["record", "scene.json", "-o", "run.carom", "--max-events", "1e12", "--max-memory", "200MB"])
    yield scene_case("of a second", sprung(1e12), "it has taken 1 s", LIMIT, [*RENDER, "--max-time", "1"])
    yield scene_case("of a second, with its cause", sprung(1e12), "steps of springs (/mechanics/springs)", LIMIT, [*RENDER, "--max-time", "1"])
    jello = {"type": "jello", "name": "cube", "points": 8, "size": [1, 1, 1], "mass": 1e-9, "stiffness": 1e12, "position": [0, 2, 0], "integrator": "auto"}
    yield scene_case("of a second for the choice of a step", changed(JELLO, "/bodies/0", jello), "it has taken 1 s", LIMIT,
                     [*RENDER, "--max-time", "1"])
    slow = changed(JELLO, "/bodies/0", {**jello, "points": 20, "mass": 1, "integrator": "rk4", "step": 1e-7, "stiffness": 1})
    yield scene_case("of a second of jello", slow, '"cube" (/bodies/0)', LIMIT, [*RENDER, "--max-time", "1"])
    yield scene_case("of a second of jello alone", slow, "it has taken 1 s", LIMIT, ["jello", "scene.json", "--max-time", "1"])
    yield scene_case("of a second on Bullet", changed(changed(BALL, "/stepper", {"type": "bullet", "step": 1e-5}), "/duration", 3600), "it has taken 1 s", LIMIT,
                     [*RENDER, "--max-time", "1"])
    yield scene_case("of an endless rattle, compared", gap(), rattle[:60], LIMIT, ["compare", "scene.json"])
    yield scene_case("of an endless rattle, reported", gap(), rattle[:60], LIMIT, ["report", "scene.json", "-o", "report"])
    yield scene_case("of 1e5 events, compared", gap(), "expected at most 100000 (--max-events)", LIMIT, ["compare", "scene.json", "--max-events", "100000"])
    yield scene_case("of 1e5 events, reported", gap(), "expected at most 100000 (--max-events)", LIMIT,
                     ["report", "scene.json", "-o", "report", "--max-events", "100000"])
    yield scene_case("of a second, compared", changed(BALL, "/duration", 3600), "it has taken 1 s", LIMIT,
                     ["compare", "scene.json", "--step", "1e-5", "--max-time", "1"])
    yield scene_case("of a second, reported", changed(changed(BALL, "/stepper", {"type": "bullet", "step": 1e-5}), "/duration", 300), "it has taken 1 s", LIMIT,
                     ["report", "scene.json", "-o", "report", "--max-time", "1"])
    yield scene_case("of a second of jello, as JSON", slow, '"ended_early": {', LIMIT, ["jello", "scene.json", "--max-time", "1", "--json"])
    yield Case("a mesh whose modes take longer than 0.1 s", ["modes", "a.obj", "--material", "rubber", "--dofs", "100000", "--max-time", "0.1"],
               "a.obj: the run ends: it has taken 0.1 s", LIMIT, {"a.obj": TETRA})
    yield Case("cases that take longer than 1 ms", ["stability", "--short", "--only", "native.g", "--max-time", "0.001"], "the run ends: it has taken 0.001 s", LIMIT)
    for option, value in (("--max-memory", "1"), ("--max-memory", "-2GB"), ("--max-memory", "much"), ("--max-memory", "1e300GB"), ("--max-time", "0"),
                          ("--max-time", "nan"), ("--max-events", "0"), ("--max-events", "1.5"), ("--max-events", "1e300"), ("--tail", "-1"), ("--tail", "nan"),
                          ("--tail", "1e300")):
        yield scene_case(f"with {option} {value}", BALL, option, BAD, [*RENDER, option, value])


# ---- Command lines

def command_lines():
    ball = {"scene.json": json.dumps(BALL)}
    for name, arguments, sentence in (
            ("of an unknown command", ["rendr"], "unknown command"),
            ("of a scene that is nowhere", ["render", "scne"], "no such file, and no scene of the library"),
            ("of a scene of a megabyte", ["render", "x" * 100_000], "no such file"),
            ("that lists no collision", ["events", "scene.json", "--loudest", "0"], "--loudest"),
            ("of sound and text on one stream", ["render", "scene.json", "-o", "-", "--events", "-"], "--events"),
            ("of stems on one stream", ["render", "scene.json", "-o", "-", "--stems"], "--stems"),
            ("with an empty output", ["render", "scene.json", "-o", ""], "names no file"),
            ("that writes over its scene", ["render", "scene.json", "-o", "scene.json"], "would take the place of"),
            ("that writes no WAV", ["render", "scene.json", "-o", "a.mp3"], "expected FILE.wav"),
            ("with a step of 0", [*RENDER, "--stepper", "bullet", "--step", "0"], "expected a number from 1e-5 to 0.1"),
            ("with a step of 1e-300", [*RENDER, "--stepper", "bullet", "--step", "1e-300"], "expected a number from 1e-5 to 0.1"),
            ("with a step of NaN", [*RENDER, "--stepper", "bullet", "--step", "nan"], "--step"),
            ("with an unknown pulse", [*RENDER, "--pulse", "square"], "expected"),
            ("with an unknown format", [*RENDER, "--format", "mp3"], "expected"),
            ("with a full scale of 0", [*RENDER, "--full-scale", "0"], "expected a pressure"),
            ("with a full scale of infinity", [*RENDER, "--full-scale", "inf"], "expected a pressure"),
            ("with two that exclude each other", [*RENDER, "--normalize", "--limit"], "exclude"),
            ("with one file for two", [*RENDER, "--events", "out.wav"], "expected another name"),
            ("with an unknown option", [*RENDER, "--frobnicate"], "--frobnicate"),
            ("with an option of a megabyte", [*RENDER, "--step", "1" * 100_000], "--step"),
            ("of a report into a file", ["report", "scene.json", "-o", "scene.json"], "--output"),
            ("of a report of no run", ["report", "scene.json", "-o", "r", "--runs", "0"], "--runs"),
            ("of a report without end", ["report", "scene.json", "-o", "r", "--budget", "1e300"], "--budget"),
            ("of a comparison at no step", ["compare", "scene.json", "--step", "0"], "--step"),
    ):
        yield Case("command line " + name, arguments, sentence, BAD, ball)
    yield Case("command line of no case of stability", ["stability", "--only", "nothing at all"], "no case has", most_lines=100)
    for name, arguments in (("directory", ["render", "scene.json", "-o", "."]), ("folder that is not there", ["render", "scene.json", "-o", "a/b.wav"]),
                            ("file as a folder", ["render", "scene.json", "-o", "scene.json/b.wav"]),
                            ("folder of the system", ["render", "scene.json", "-o", "/proc/b.wav"])):
        yield Case("command line with the output a " + name, arguments, "", FAILED, ball)


# ---- Recordings and models: binary, with a checksum

def checksum(data):
    value = 0xCBF29CE484222325
    for byte in data:
        value = (value ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
    return struct.pack("<Q", value)


def sealed(data):
    return data + checksum(data)


def recordings(source):
    good = (source / "tests/fuzz/corpus/recording/bounces.carom").read_bytes()
    for name, data, sentence in (
            ("empty", b"", "is no recording"),
            ("of its first bytes", good[:8], "expected"),
            ("cut off", good[:-20], "damaged or cut off"),
            ("with one bit wrong", good[:40] + bytes([good[40] ^ 1]) + good[41:], "damaged or cut off"),
            ("of another version", good[:8] + b"\xff\xff\xff\xff" + good[12:], "version"),
            ("of zeros", sealed(good[:12] + b"\0" * 100), "byte "),
            ("of ones", sealed(good[:12] + b"\xff" * 100), "byte "),
            ("that begins at NaN", sealed(good[:12] + struct.pack("<d", float("nan")) + good[20:-8]), "byte "),
            ("that ends at infinity", sealed(good[:20] + struct.pack("<d", float("inf")) + good[28:-8]), "byte "),
            ("that ends at 1e300", sealed(good[:20] + struct.pack("<d", 1e300) + good[28:-8]), "byte "),
            ("with a payload of 2^63 bytes", sealed(good[:12] + struct.pack("<5d", 0, 1, 0, 0, 0) + b"\xff" * 9 + b"\x01"), "byte "),
    ):
        yield Case("recording " + name, ["replay", "run.carom", "-o", "out.wav"], sentence, BAD, {"run.carom": data})
    yield Case("recording that is a directory", ["replay", ".", "-o", "out.wav"], "expected")
    yield Case("recording that is a device", ["replay", "/dev/zero", "-o", "out.wav"], "it is not a regular file")


def models(source):
    good = (source / "tests/fuzz/corpus/modal_model/bar.carom_modes").read_bytes()
    strike = ["strike", "bar.carom_modes", "--at", "0,0,0", "--impulse", "0,0,-1", "-o", "out.wav"]
    yield Case("a strike of an hour that may take 10 ms", [*strike, "--duration", "3600", "--max-time", "0.01"],
               "bar.carom_modes: the run ends: it has taken 0.01 s", LIMIT, {"bar.carom_modes": good})
    for name, data, sentence in (
            ("empty", b"", "is no modal model"),
            ("cut off", good[:100], "damaged or cut off"),
            ("of another version", good[:8] + b"\x09\0\0\0" + good[12:], "version"),
            ("of zeros", sealed(good[:12] + b"\0" * 200), "section"),
            ("with a section of 2^64 bytes", sealed(good[:16] + b"\xff" * 8 + good[24:-8]), "longer than the file"),
            ("with a name of 2^64 letters", sealed(good[:24] + b"\xff" * 8 + good[32:-8]), "longer than what is left"),
    ):
        yield Case("model " + name, strike, sentence, BAD, {"bar.carom_modes": data})
    names = 24  # bytes before the name; then that of the material, and seven numbers, of which the last is the mass
    for _ in range(2):
        names += 8 + struct.unpack("<Q", good[names:names + 8])[0]
    for name, index, value, sentence in (("of no mass", 6, 0.0, "mass must be from 1e-21 to 1e18 (kg)"), ("of a mass of NaN", 6, float("nan"), "mass must be"),
                                         ("of a mass of 1e300 kg", 6, 1e300, "mass must be"), ("of a mass of 1e-300 kg", 6, 1e-300, "mass must be"),
                                         ("with its centre at infinity", 7, float("inf"), "centre of mass must be"),
                                         ("of no density", 0, 0.0, "density"), ("of Poisson's ratio 2", 2, 2.0, "Poisson"),
                                         ("with an inertia of 1e300", 10, 1e300, "inertia must be"),
                                         ("in a medium of no density", 19, 0.0, "density of the medium must be from"),
                                         ("in a medium where sound stands", 20, 1e-300, "speed of sound must be from 1 to 1e4")):
        data = good[:names + 8 * index] + struct.pack("<d", value) + good[names + 8 * index + 8:-8]
        yield Case("model " + name, strike, sentence, BAD, {"bar.carom_modes": sealed(data)})
    for name, options, sentence in (
            ("struck nowhere", ["--at", "nan,0,0", "--impulse", "0,0,1"], "--at"),
            ("struck by nothing", ["--at", "0,0,0", "--impulse", "0,0,0"], "--impulse"),
            ("struck without end", ["--at", "0,0,0", "--impulse", "0,0,1e300"], "--impulse"),
            ("heard from within", ["--at", "0,0,0", "--impulse", "0,0,1", "--listener", "0,0,0"], "--listener"),
            ("heard without end", ["--at", "0,0,0", "--impulse", "0,0,1", "--duration", "1e300"], "--duration"),
            ("struck by a hammer of nothing", ["--at", "0,0,0", "--impulse", "0,0,1", "--hammer-mass", "0"], "--hammer-mass"),
            ("at half a sample rate", ["--at", "0,0,0", "--impulse", "0,0,1", "--sample-rate", "44100.5"], "--sample-rate"),
    ):
        yield Case("model " + name, ["strike", "bar.carom_modes", *options, "-o", "out.wav"], sentence, BAD, {"bar.carom_modes": good})


# ---- Meshes

def modes_case(name, file, content, sentence, code=BAD, options=()):
    return Case("mesh " + name, ["modes", file, "--material", "steel", *options], sentence, code, {file: content})


TETRA = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def gltf(accessor, count=3, component=5126, view=36, buffer=36):
    return json.dumps({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "scene": 0, "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": accessor}}]}],
        "accessors": [{"bufferView": 0, "componentType": component, "count": count, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": view}],
        "buffers": [{"byteLength": buffer, "uri": "data:application/octet-stream;base64," + "A" * 48}],
    })


def meshes():
    ply = "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n" \
          "property list uchar int vertex_indices\nend_header\n"
    for name, file, content, sentence in (
            ("empty", "a.obj", "", "expected"),
            ("without triangles", "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "expected"),
            ("with NaN", "a.obj", TETRA.replace("v 1 0 0", "v nan 0 0"), "expected coordinates from -1e9 to 1e9"),
            ("with infinity", "a.obj", TETRA.replace("v 1 0 0", "v 1e999 0 0"), "expected coordinates from -1e9 to 1e9"),
            ("with an index out of range", "a.obj", TETRA + "f 1 2 99\n", "expected"),
            ("with the index 0", "a.obj", TETRA + "f 0 1 2\n", "expected"),
            ("with an index of 2^63", "a.obj", TETRA + "f 1 2 9223372036854775808\n", "expected"),
            ("with a negative index", "a.obj", TETRA + "f -1 -2 -99\n", "expected"),
            ("flat", "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n", "nothing is inside of it"),
            ("of points at one place", "a.obj", "v 0 0 0\n" * 4 + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n", "expected"),
            ("of 1e30 m", "a.obj", TETRA.replace("1", "1e30", 1), "expected coordinates from -1e9 to 1e9"),
            ("of 1e-300 m", "a.obj", TETRA.replace("v 1 0 0", "v 1e-300 0 0").replace("v 0 1 0", "v 0 1e-300 0").replace("v 0 0 1", "v 0 0 1e-300"), "expected"),
            ("of an unknown format", "a.xyz", TETRA, "expected"),
            ("of zeros", "a.stl", b"\0" * 84, "expected"),
            ("of 2^32 triangles", "a.stl", b"\0" * 80 + b"\xff\xff\xff\xff" + b"\0" * 50, "expected"),
            ("of binary", "a.obj", bytes(range(256)) * 64, "expected"),
            ("of 2^62 vertices", "a.ply", ply.format(1 << 62, 1) + "0 0 0\n", "expected"),
            ("of -1 vertices", "a.ply", ply.format(-1, 1), "expected"),
            ("with a face of 255 and no corners", "a.ply", ply.format(1, 1) + "0 0 0\n255\n", "expected"),
            ("of no element", "a.ply", "ply\nformat ascii 1.0\nend_header\n", "expected"),
            ("of half a header", "a.ply", "ply\nformat binary_little_endian 1.0\nelement vertex 3", "expected"),
            ("by an accessor that is not there", "a.gltf", gltf(99), "expected"),
            ("by an accessor of 2^40", "a.gltf", gltf(0, count=1 << 40), "expected"),
            ("by an accessor of -1", "a.gltf", gltf(0, count=-1), "expected"),
            ("by components of no type", "a.gltf", gltf(0, component=1), "expected"),
            ("by a view beyond its buffer", "a.gltf", gltf(0, view=1 << 30), "expected"),
            ("by a buffer that is not there", "a.gltf", gltf(0, buffer=1 << 40), "expected"),
            ("of garbage", "a.gltf", "{" * 1000, "expected"),
            ("of a cut off GLB", "a.glb", b"glTF\x02\0\0\0\xff\xff\xff\xff", "expected"),
    ):
        yield modes_case(name, file, content, sentence)
    yield modes_case("at a scale of 0", "a.obj", TETRA, "--scale", options=("--scale", "0"))
    yield modes_case("with a shell of nothing", "a.obj", TETRA, "--thickness", options=("--thickness", "0"))
    yield modes_case("with degrees of freedom without end", "a.obj", TETRA, "--dofs", options=("--dofs", "1e9"))
    yield Case("mesh that is a directory", ["modes", ".", "--material", "steel"], "expected")
    yield Case("mesh of an unknown material", ["modes", "a.obj", "--material", "cheese"], "--material", files={"a.obj": TETRA})
    yield Case("mesh of a material that is no file", ["modes", "a.obj", "--material", "none.json"], "there is no such file", files={"a.obj": TETRA})


# ---- Pictures and heads that a scene names

def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width, height, data=b"", depth=8, colour=2):
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)) + \
        chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")


def pictures():
    scene = changed(BALL, "/bodies/1/normal_map", {"file": "map.png", "size": [1, 1]})
    scene["stepper"] = {"type": "bullet"}
    for name, data in (("empty", b""), ("of garbage", b"\x89PNG\r\n\x1a\n" + b"x" * 100), ("of 2^31 pixels wide", png((1 << 31) - 1, 1)),
                       ("of 60000 x 60000", png(60000, 60000)), ("of no pixel", png(0, 0)), ("cut off", png(64, 64, b"\0" * 100)),
                       ("a bomb", png(30000, 30000, b"\0" * 50_000_000)), ("a JPEG", b"\xff\xd8\xff\xe0" + b"\0" * 100)):
        yield scene_case("with a normal map " + name, scene, "map.png", FAILED, RENDER, **{"map.png": data})
    for size in ([0, 1], [-1, 1], [1e300, 1], [1e-300, 1]):
        yield scene_case(f"with a normal map of {size}", changed(scene, "/bodies/1/normal_map/size", size), "/bodies/1/normal_map", BAD, INFO, **{"map.png": png(1, 1)})


def heads():
    scene = changed(BALL, "/listeners/0", {"position": [0, 1, 1], "format": "binaural", "sofa": "head.sofa"})
    for name, data in (("empty", b""), ("of garbage", os.urandom(0) + bytes(range(256)) * 40), ("of the beginning of HDF", b"\x89HDF\r\n\x1a\n" + b"\xff" * 2000),
                       ("of HDF's version 0 and zeros", b"\x89HDF\r\n\x1a\n" + b"\0" * 2000)):
        yield scene_case("with a head " + name, scene, "head.sofa", FAILED, RENDER, **{"head.sofa": data})


# ---- Scenes of strangers

def escapes():
    """Scenes that name files outside of their folder, with --confine; the files are there."""
    solid = {"type": "solid", "name": "thing", "material": "steel", "position": [0, 1, 1], "movable": True}
    for kind, pointer, scene, file in (
            ("mesh", "/bodies/2/shape/file", lambda name: changed(BALL, "/bodies/2", {**solid, "shape": {"type": "mesh", "file": name}}), "a.obj"),
            ("normal map", "/bodies/1/normal_map/file", lambda name: changed(BALL, "/bodies/1/normal_map", {"file": name, "size": [1, 1]}), "map.png"),
            ("head", "/listeners/0/sofa", lambda name: changed(BALL, "/listeners/0", {"position": [0, 1, 1], "format": "binaural", "sofa": name}), "head.sofa"),
            ("model", "/bodies/0/modes", lambda name: changed(BALL, "/bodies/0/modes", name), "bar.carom_modes")):
        content = {"a.obj": TETRA}.get(file, "something")

        def link(target):
            return lambda path: path.symlink_to(target)

        for way, name, files in (
                ("above", f"../{file}", {}),
                ("above, by a way down", f"below/../../{file}", {"in/below/x": ""}),
                ("at an absolute path", f"/etc/{file}", {}),
                ("by a link", "link", {"in/link": link(f"../{file}")}),
                ("by a link to a folder", f"out/{file}", {"in/out": link("..")}),
                ("by a link to a link", "one", {"in/two": link(f"../{file}"), "in/one": link("two")})):
            yield Case(f"stranger's {kind} {way}", ["info", "in/scene.json", "--confine"], f"in/scene.json: {pointer}: \"{name}\" leads out of the folder", BAD,
                       {file: content, "in/scene.json": json.dumps(scene(name)), **files})
        yield Case(f"stranger's {kind} in a folder of its own", ["info", "in/scene.json", "--confine"], "", DONE,
                   {f"in/deep/{file}": content, "in/scene.json": json.dumps(scene(f"deep/{file}"))})
    for command in (["render", "in/scene.json", "-o", "out.wav"], ["record", "in/scene.json", "-o", "run.carom"], ["compare", "in/scene.json"],
                    ["report", "in/scene.json", "-o", "report"], ["jello", "in/scene.json"]):
        yield Case(f"stranger's head by {command[0]}", [*command, "--confine"], "leads out of the folder", BAD, {"head.sofa": "something", "in/scene.json": json.dumps(
            changed(BALL, "/listeners/0", {"position": [0, 1, 1], "format": "binaural", "sofa": "../head.sofa"}))})
    head = {"head.sofa": "something", "in/scene.json": json.dumps(
        changed(BALL, "/listeners/0", {"position": [0, 1, 1], "format": "binaural", "sofa": "../head.sofa"}))}
    report = ["report", "in/scene.json", "-o", "report"]
    yield Case("stranger's head by report, which is confined by itself", report, "leads out of the folder", BAD, head)
    yield Case("stranger's head by report that is not confined", [*report, "--no-confine"], "it is not a SOFA file", FAILED, head)
    outside = gltf(0).replace('"data:application/octet-stream;base64,' + "A" * 48 + '"', '"link.bin"')
    yield Case("stranger's glTF whose buffer is a link out of its folder", ["modes", "in/a.gltf", "--material", "steel"], "the path of a file below the folder of this one", BAD,
               {"secret.bin": b"\0" * 36, "in/a.gltf": outside, "in/link.bin": lambda path: path.symlink_to("../secret.bin")})


# ---- Batches

BATCH = {"scene": "scene.json", "count": 3, "parameters": [{"name": "a", "uniform": [0, 1], "at": "/bodies/0/position/1"}]}


def batch_case(name, batch, sentence, code=BAD):
    text = batch if isinstance(batch, str) else json.dumps(batch)
    return Case("batch " + name, ["batch", "plan", "batch.json", "-o", "out"], sentence, code, {"batch.json": text, "scene.json": json.dumps(BALL)}, False)


def batches():
    yield batch_case("that is empty", "", "batch.json: ")
    yield batch_case("of nothing", {}, "scene")
    yield batch_case("of a scene that is not there", {**BATCH, "scene": "none.json"}, "no such file")
    yield batch_case("of a folder as its scene", {**BATCH, "scene": "."}, "a directory")
    yield batch_case("of a billion billion", {**BATCH, "count": 1e18}, "a number of samples")
    yield batch_case("with a pointer to nowhere", {**BATCH, "parameters": [{"name": "a", "uniform": [0, 1], "at": "/bodies/99/radius"}]}, "there is no place")
    yield batch_case("with a pointer to the end of an array", {**BATCH, "parameters": [{"name": "a", "uniform": [0, 1], "at": "/bodies/-"}]}, "there is no place")
    yield batch_case("with an expression without end", {**BATCH, "parameters": [{"name": "a", "expression": "(" * 900}]}, "expected")
    yield batch_case("with a division by zero", {**BATCH, "parameters": [{"name": "a", "expression": "1/0"}]}, "no finite number")
    yield batch_case("that names a parameter twice", {**BATCH, "parameters": 2 * BATCH["parameters"]}, "is taken")
    yield batch_case("of grids without end", {"scene": "scene.json", "parameters": [{"name": f"p{at}", "grid": list(range(100))} for at in range(12)]}, "expected fewer")
    two = [{"name": f"p{at}", "grid": [0, 1]} for at in range(60)]
    yield batch_case("of more points than 64 bits count", {"scene": "scene.json", "count": 3, "parameters": two}, "", DONE)
    yield batch_case("of values that are no JSON", '{"scene": "scene.json", "count": 1e999}', "batch.json: ")
    yield Case("batch run of no folder", ["batch", "run", "nowhere"], "plan.json", BAD, {}, False)
    yield Case("batch run of a plan of nothing", ["batch", "run", "."], "plan.json", BAD, {"plan.json": "[]"}, False)
    yield Case("batch verify of a plan that was changed", ["batch", "verify", "."], "plan.json", BAD,
               {"plan.json": json.dumps({"carom_batch_plan": 1, "count": 1, "home": ".", "plan_hash": "0", "batch": BATCH, "scenes": {"scene.json": {}}})}, False)


def all_cases(source):
    return [*wrong_numbers(), *spelt_scenes(), *worlds(), *stiff(), *replaced(), *limits(), *command_lines(), *recordings(source), *models(source), *meshes(), *pictures(), *heads(), *escapes(), *batches()]
