"""Tests of carom.py over the server stub. Where there is NumPy the tests of arrays run, too."""

import builtins
import importlib.util
import json
import math
import os
import resource
import struct
import subprocess
import sys
import tempfile
import unittest
import warnings

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.environ["CAROM_PYTHON"])
sys.path.insert(0, os.environ["CAROM_PAGES"])

import carom
import pages
from stub_client import StubClient

GRAVITY = 9.81
RADIUS = 0.05
RATE = 48000


def without_numpy():
    """carom.py as it is where there is no NumPy."""
    real = builtins.__import__

    def importing(name, *others, **more):
        if name.split(".")[0] == "numpy":
            raise ImportError(name)
        return real(name, *others, **more)

    builtins.__import__ = importing
    try:
        specification = importlib.util.spec_from_file_location("carom_plain", carom.__file__)
        module = importlib.util.module_from_spec(specification)
        specification.loader.exec_module(module)
        return module
    finally:
        builtins.__import__ = real


plain = without_numpy()


def floats(samples):
    """Samples as a flat list, of an array or a memoryview."""
    return [value for frame in samples.tolist() for value in frame] if len(samples) else []


def read_wav(file):
    """The samples of a WAV file of floats, and its channels."""
    with open(file, "rb") as opened:
        data = opened.read()
    assert data[:4] == b"RIFF" and data[8:12] == b"WAVE"
    at, channels = 12, 0
    while at + 8 <= len(data):
        name, length = data[at:at + 4], struct.unpack("<I", data[at + 4:at + 8])[0]
        if name == b"fmt ":
            form, channels = struct.unpack("<HH", data[at + 8:at + 12])
            assert form in (3, 0xFFFE)
        if name == b"data":
            return list(struct.unpack(f"<{length // 4}f", data[at + 8:at + 8 + length])), channels
        at += 8 + length + length % 2
    raise AssertionError("no samples")


class WithABall(unittest.TestCase):
    """A ball that falls from 0.3 m on a floor."""

    carom = plain

    def setUp(self):
        self.client = self.world()
        self.folder = tempfile.TemporaryDirectory()

    def tearDown(self):
        self.client.disconnect()
        self.folder.cleanup()

    def world(self):
        client = StubClient()
        client.add("floor", mass=0.0, restitution=0.8)
        self.ball = client.add("ball", position=(0, 0, RADIUS + 0.3))
        return client

    def file(self, name):
        return os.path.join(self.folder.name, name)


class Runs(WithABall):
    def test_sound_as_their_recordings(self):
        with self.carom.attach(self.client) as sound:
            sound.level(1.0)
            sound.keep_run(1.0)
            sound.record(self.file("ball.wav"))
            sound.record_run(self.file("ball.carom"))
            for _ in range(480):
                self.client.stepSimulation()
            sound.save_run(self.file("kept.carom"))
            sound.stop()
        for name in ("ball", "kept"):
            subprocess.run([os.environ["CAROM"], "replay", self.file(f"{name}.carom"), "-o",
                            self.file(f"{name}_again.wav"), "--full-scale", "1"], check=True,
                           stdout=subprocess.DEVNULL)
        recorded, channels = read_wav(self.file("ball.wav"))
        again, replayed = read_wav(self.file("ball_again.wav"))
        self.assertEqual(channels, replayed)
        peak = max(map(abs, recorded))
        self.assertGreater(peak, 0.01)
        self.assertLess(max(abs(a - b) for a, b in zip(recorded, again)), 1e-6 * peak)
        kept, _ = read_wav(self.file("kept_again.wav"))
        self.assertGreater(max(map(abs, kept)), 0.0)

    def test_refuse_what_cannot_be(self):
        with self.carom.attach(self.client) as sound:
            for wrong in (lambda: sound.save_run(self.file("kept.carom")),
                          lambda: sound.keep_run(-1),
                          lambda: sound.record_run("/no/such/folder/a.carom")):
                self.assertRaises(self.carom.CaromError, wrong)


class Samples(WithABall):
    def test_are_as_many_as_time_says_and_those_of_a_recording(self):
        # 10,000 steps of 1/240 s, of which a ball bounces for the first seconds.
        with self.carom.attach(self.client) as sound:
            sound.level(1.0)
            sound.record(self.file("ball.wav"))
            taken = []
            for _ in range(10000):
                self.client.stepSimulation()
                samples = sound.samples()
                self.assertEqual(len(samples), 200)
                if sum(map(len, taken)) < 10 * RATE:
                    taken.append(samples)
            self.assertEqual(sound.channels, 2)
            self.assertAlmostEqual(sound.time, 10000 / 240, places=5)  # the server's step is a float
            late = round(sound.latency * RATE)
            sound.stop()
        recorded, channels = read_wav(self.file("ball.wav"))
        self.assertEqual(channels, 2)
        self.assertGreaterEqual(len(recorded), 2 * (10000 * 200))
        captured = [value for samples in taken for value in floats(samples)]
        self.assertEqual(captured[:2 * late], [0.0] * (2 * late))
        self.assertEqual(captured[2 * late:], recorded[:len(captured) - 2 * late])
        self.assertGreater(max(captured), 0.01)

    def test_come_at_any_step(self):
        for seconds, substeps in ((1 / 60, 0), (1 / 1000, 0), (1 / 60, 4), (0.0123, 0), (1 / 30, 0)):
            client = self.world()
            with self.carom.attach(client) as sound:
                client.setTimeStep(seconds, substeps)
                frames = 0
                for step in range(1, 200):
                    client.stepSimulation()
                    frames += len(sound.samples())
                    # The server's step is a float here.
                    exact = step * struct.unpack("f", struct.pack("f", seconds))[0] * RATE
                    self.assertLess(abs(frames - exact), 1.01)
                self.assertEqual(sound.statistics()["late"], 0)
                self.assertGreaterEqual(sound.latency, 4 * seconds / max(substeps, 1) - 1e-9)
            client.disconnect()

    def test_shape_and_type(self):
        with self.carom.attach(self.client) as sound:
            self.assertEqual(len(sound.samples()), 0)
            self.client.stepSimulation()
            samples = sound.samples()
            self.assertEqual(tuple(samples.shape), (200, 2))
            self.assertEqual(samples.itemsize, 4)
            self.assertEqual(len(sound.samples()), 0)

    def test_are_not_kept_unless_wanted(self):
        with self.carom.attach(self.client, samples=False) as sound:
            self.client.stepSimulation()
            with self.assertRaisesRegex(self.carom.CaromError, "not kept"):
                sound.samples()
            with self.assertRaisesRegex(self.carom.CaromError, "not kept"):
                sound.events()

    def test_of_another_process_come_as_text(self):
        # A server whose process is another one, as the plugin's number says.
        heard = []
        for process in (os.getpid(), os.getpid() + 1):
            client = self.world()
            real, os.getpid = os.getpid, lambda: process
            try:
                sound = self.carom.attach(client)
            finally:
                os.getpid = real
            for _ in range(120):
                client.stepSimulation()
            with warnings.catch_warnings(record=True) as told:
                warnings.simplefilter("always")
                heard.append((floats(sound.samples()), sound.events()))
            self.assertEqual(len(told), 0 if process == os.getpid() else 1)
            client.disconnect()
        self.assertEqual(heard[0][0], heard[1][0])
        self.assertEqual([tuple(row) for row in heard[0][1]], [tuple(row) for row in heard[1][1]])
        self.assertEqual(len(heard[0][0]), 2 * 24000)


class Events(WithABall):
    def test_are_both_shares_of_the_bounce(self):
        with self.carom.attach(self.client) as sound:
            sound.listener([0, 0, 2], format="mono")
            for _ in range(96):  # 0.4 s: one bounce
                self.client.stepSimulation()
            events = sound.events()
            samples = floats(sound.samples())
            self.assertEqual(len(sound.events()), 0)
        self.assertEqual(len(events), 2)
        of_ball = events[0] if events[0][1] == self.ball else events[1]
        of_floor = events[1] if events[0][1] == self.ball else events[0]

        def value(event, name):
            return event[[column for column, _ in self.carom.EVENT_COLUMNS].index(name)]

        first = 0.5 * GRAVITY / 240  # the parabola through the nodes of symplectic Euler
        speed = math.sqrt(first * first + 2 * GRAVITY * 0.3)
        self.assertAlmostEqual(value(of_ball, "time_s"), (speed - first) / GRAVITY, delta=2e-5)
        self.assertAlmostEqual(value(of_ball, "approach_speed_m_s"), speed, delta=1e-4)
        self.assertAlmostEqual(value(of_ball, "jz_Ns"), (1 + 0.9 * 0.8) * speed, delta=2e-4)
        self.assertAlmostEqual(value(of_ball, "effective_mass_kg"), 1.0, delta=1e-6)
        self.assertEqual(value(of_floor, "jz_Ns"), -value(of_ball, "jz_Ns"))
        self.assertEqual((value(of_ball, "other"), value(of_ball, "link")), (0, -1))
        self.assertEqual(value(of_floor, "other"), self.ball)
        self.assertEqual(value(of_ball, "collision"), value(of_floor, "collision"))
        self.assertEqual((value(of_ball, "heard"), value(of_floor, "heard")), (True, False))
        peak = max(map(abs, samples))
        peaks = of_ball[len(self.carom.EVENT_COLUMNS)]
        self.assertEqual(len(peaks), 1)
        self.assertEqual(peaks[0], value(of_ball, "peak_pa"))
        self.assertGreaterEqual(peaks[0], peak)  # a bound, and one that is near
        self.assertLess(peaks[0], 2.0 * peak)

    def test_have_a_peak_for_each_listener(self):
        with self.carom.attach(self.client) as sound:
            sound.listener([0, 0, 1], format="mono")
            sound.listener([0, 0, 4], index=1, format="mono")
            self.assertEqual(sound.channels, 2)
            for _ in range(96):
                self.client.stepSimulation()
            peaks = [event[-1] for event in sound.events() if event[1] == self.ball][0]
            self.assertEqual(len(peaks), 2)
            # Above the ball's centre: 1/r, and the near field of a dipole, which falls faster.
            self.assertGreater(peaks[0] / peaks[1], 3.9 / 0.95)


class Clock(WithABall):
    def test_resetting_the_simulation_turns_it_back(self):
        with self.carom.attach(self.client) as sound:
            heard = []
            for _ in range(2):
                for _ in range(96):
                    self.client.stepSimulation()
                heard.append(floats(sound.samples()))
                self.assertAlmostEqual(sound.time, 0.4)
                self.assertEqual(len(sound.events()), 2)
                self.client.stepSimulation()  # its samples are never taken
                self.client.resetSimulation()
                self.assertEqual(sound.time, 0.0)
                self.assertEqual(len(sound.samples()), 0)
                self.client.add("floor", mass=0.0, restitution=0.8)
                self.client.add("ball", position=(0, 0, RADIUS + 0.3))
            self.assertEqual(heard[0], heard[1])
            self.assertGreater(max(heard[0]), 0.0)

    def test_restoring_a_state_turns_it_back(self):
        with self.carom.attach(self.client) as sound:
            for _ in range(30):
                self.client.stepSimulation()
            state = sound.save_state()
            self.assertAlmostEqual(sound.time, 0.125)
            heard = []
            for _ in range(3):
                sound.restore_state(state)
                self.assertAlmostEqual(sound.time, 0.125)
                for _ in range(66):
                    self.client.stepSimulation()
                heard.append((floats(sound.samples()), [tuple(row) for row in sound.events()]))
            self.assertEqual(len(heard[0][1]), 2)
            self.assertEqual(heard[0], heard[1])
            self.assertEqual(heard[0], heard[2])

    def test_has_what_happens_right_after_a_restored_state(self):
        with self.carom.attach(self.client) as sound:
            for _ in range(56):
                self.client.stepSimulation()
            heard = []
            for _ in range(8):  # it hits the floor in one of these steps
                state = sound.save_state()
                events = []
                for _ in range(3):
                    sound.restore_state(state)
                    self.client.stepSimulation()
                    events.append([round(float(row[0]), 6) for row in sound.events()])
                self.assertEqual(events[1:], events[:-1])
                heard += events[0]
            self.assertEqual(len(heard), 2)

    def test_can_be_set(self):
        with self.carom.attach(self.client) as sound:
            self.client.stepSimulation()
            sound.reset(5.0)
            self.client.stepSimulation()
            self.assertAlmostEqual(sound.time, 5.0 + 1 / 240)
            self.assertEqual(len(sound.samples()), 200)


class Settings(WithABall):
    def heard(self, prepare, steps=96):
        client = self.world()
        with self.carom.attach(client) as sound:
            prepare(sound)
            for _ in range(steps):
                client.stepSimulation()
            samples = floats(sound.samples())
            self.assertGreaterEqual(sound.statistics()["impacts"], 1)
            report = sound.report()
            self.assertRegex(report, r"\A\d+ bod(y|ies) can move, \d+ cannot")
            self.assertRegex(report, r"\nHeard: \d+ click")
        client.disconnect()
        return samples

    def test_change_what_is_heard(self):
        usual = self.heard(lambda sound: None)
        for prepare in (lambda sound: sound.material(self.ball, "wood"),
                        lambda sound: sound.material(self.ball, "wood", link=-1),
                        lambda sound: sound.room([-2, -2, 0], [2, 2, 3], surface=0.1, order=2),
                        lambda sound: sound.listener([0, -2, 1]),
                        lambda sound: sound.listener([0, -1, 1], format="coincident_pair"),
                        lambda sound: sound.listener([0, -1, 1], looks_at=[1, 0, 0],
                                                     format="coincident_pair")):
            samples = self.heard(prepare)
            self.assertEqual(len(samples), len(usual))
            self.assertNotEqual(samples, usual)
        # Those of what is played and recorded do not.
        self.assertEqual(self.heard(lambda sound: sound.level(3.0)), usual)
        self.assertEqual(self.heard(lambda sound: (sound.gain(0.5), sound.mute())), usual)
        self.assertEqual(self.heard(lambda sound: sound.modes(self.ball, None)), usual)
        self.assertEqual(self.heard(lambda sound: sound.room()), usual)

    def model_of_a_bar(self):
        corners = [(x, y, z) for x in (-0.1, 0.1) for y in (-0.01, 0.01) for z in (-0.01, 0.01)]
        sides = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))
        with open(self.file("bar.obj"), "w", encoding="ascii") as mesh:
            mesh.writelines(f"v {x} {y} {z}\n" for x, y, z in corners)
            mesh.writelines("f {} {} {} {}\n".format(*side) for side in sides)
        model = self.file("bar.carom_modes")
        subprocess.run([os.environ["CAROM"], "modes", self.file("bar.obj"), "--material", "steel",
                        "--dofs", "1000", "-o", model], check=True, stdout=subprocess.DEVNULL)
        return model

    def test_a_body_rings_by_its_model(self):
        model = self.model_of_a_bar()
        usual = self.heard(lambda sound: None, 200)
        rings = self.heard(lambda sound: (sound.modes(self.ball, model)), 200)
        tail = slice(2 * int(0.45 * RATE), 2 * int(0.6 * RATE))
        self.assertGreater(sum(x * x for x in rings[tail]), 100 * sum(x * x for x in usual[tail]))

    def test_right_is_right(self):
        # The listener at (0, -1, 1) looks along +y: the ball at x = 1 is at its right.
        for side in (1.0, -1.0):
            client = StubClient()
            client.add("floor", mass=0.0)
            client.add("ball", position=(side, 0, RADIUS + 0.3))
            with self.carom.attach(client) as sound:
                for prepare in (lambda: sound.listener([0, -1, 1], format="coincident_pair"),
                                lambda: sound.listener([0, -1, 1], looks_at=[0, 0, 1])):
                    prepare()
                for _ in range(96):
                    client.stepSimulation()
                samples = floats(sound.samples())
            left, right = (sum(x * x for x in samples[channel::2]) for channel in (0, 1))
            self.assertGreater((right - left) * side, 0.1 * (left + right))
            client.disconnect()


class Motion(unittest.TestCase):
    """The states of bodies follow from what the server tells, or are asked for."""

    STEP = 1 / 240

    def setUp(self):
        self.clients = []

    def tearDown(self):
        for client in self.clients:
            client.disconnect()

    def world(self, maximal=False, height=1.0, told=True):
        client = StubClient()
        self.clients.append(client)
        client.add("floor", mass=0.0, restitution=0.8, maximal=maximal)
        ball = client.add("ball", position=(0, 0, RADIUS + height), maximal=maximal)
        if not told:
            client.tell_nothing()
        return client, ball

    def speeds(self, sound, ball):
        return [event.approach_speed_m_s for event in sound.events() if event.body == ball]

    def kinds(self):
        return [(maximal, told) for maximal in (False, True) for told in (True, False)]

    def test_a_ball_that_is_thrown_hits_as_fast_as_it_was_thrown(self):
        for maximal, told in self.kinds():
            for height in (0.8, 0.012):  # some steps later, and within the first step
                client, ball = self.world(maximal, told=told)
                with plain.attach(client) as sound:
                    for _ in range(10):
                        client.stepSimulation()
                    client.place(ball, (0, 0, RADIUS + height))
                    client.stepSimulation()
                    fallen = RADIUS + height - client.position(ball)[2]
                    client.resetBaseVelocity(ball, (0, 0, -5))
                    for _ in range(60):
                        client.stepSimulation()
                    speeds = self.speeds(sound, ball)
                first = 5 + 0.5 * GRAVITY * self.STEP
                exact = math.sqrt(first ** 2 + 2 * GRAVITY * (height - fallen))
                self.assertAlmostEqual(speeds[0], exact, delta=0.025, msg=(maximal, told, height))

    def test_a_ball_that_is_put_elsewhere_has_not_moved_there(self):
        for maximal, told in self.kinds():
            client, ball = self.world(maximal, height=3.0, told=told)
            with plain.attach(client) as sound:
                for _ in range(100):
                    client.stepSimulation()
                client.place(ball, (0.5, 0, RADIUS + 0.001))
                for _ in range(12):
                    client.stepSimulation()
                self.assertLess(max(self.speeds(sound, ball) + [0.0]), 0.2)
                client.place(ball, (0.5, 0, RADIUS + 0.5))
                for _ in range(96):
                    client.stepSimulation()
                speeds = self.speeds(sound, ball)
            self.assertAlmostEqual(speeds[0], math.sqrt(2 * GRAVITY * 0.5), delta=0.03,
                                   msg=(maximal, told))

    def test_a_ball_that_is_led_hits_as_fast_as_it_is_led(self):
        for maximal, told in self.kinds():
            client, ball = self.world(maximal, height=0.2, told=told)
            with plain.attach(client) as sound:
                for _ in range(60):
                    client.resetBaseVelocity(ball, (0, 0, -1))
                    client.stepSimulation()
                speeds = self.speeds(sound, ball)
            self.assertAlmostEqual(speeds[0], 1.0, delta=0.06, msg=(maximal, told))

    def test_a_server_that_tells_nothing_is_asked(self):
        heard = []
        for told in (True, False):
            client, ball = self.world(height=0.3, told=told)
            with plain.attach(client) as sound:
                for _ in range(240):
                    client.stepSimulation()
                self.assertEqual(sound.statistics()["late"], 0)
                heard.append([(event.time_s, event.jz_Ns) for event in sound.events()
                              if event.body == ball])
        self.assertGreaterEqual(len(heard[1]), 3)
        for (time, impulse), (asked_time, asked_impulse) in zip(*heard):
            self.assertAlmostEqual(time, asked_time, delta=1e-6)
            self.assertAlmostEqual(impulse, asked_impulse, delta=1e-4)

    def test_free_and_sleeping_bodies_are_not_asked_for(self):
        for maximal in (False, True):
            client, _ = self.world(maximal)
            for ball in range(50):
                client.add("ball", position=(0.3 * ball + 1, 0, RADIUS + 0.01 * ball + 0.1),
                           restitution=0.5, maximal=maximal)
            with plain.attach(client, samples=False) as sound:
                client.stepSimulation()
                client.stepSimulation()
                begun = client.states_asked()
                for _ in range(600):
                    client.stepSimulation()
                self.assertGreaterEqual(sound.statistics()["impacts"], 100)
            # Each is asked for twice when it is described at its first touch; 600 steps of 51
            # bodies would be 30,600.
            self.assertLess(client.states_asked() - begun, 51 * 4)


class Sliding(unittest.TestCase):
    """What lasts is heard: a body that slides or rolls, and not one that rests."""

    def loudness(self, form, velocity, prepare=lambda sound, body: None, maximal=False):
        """Root mean squares of the samples in tenths of a second, after the body lies there."""
        client = StubClient()
        client.add("box", half_edges=(5, 5, 0.5), mass=0.0, position=(0, 0, -0.5), maximal=maximal)
        half = (0.05, 0.05, 0.05) if form == "ball" else (0.05, 0.05, 0.03)
        body = client.add(form, half_edges=half, mass=0.5, position=(0, 0, half[2]),
                          maximal=maximal)
        with plain.attach(client) as sound:
            sound.listener([0, -0.5, 0.5], format="mono")
            sound.material(0, "wood")
            sound.material(body, "wood")
            prepare(sound, body)
            for _ in range(48):
                client.stepSimulation()
            sound.samples()
            client.resetBaseVelocity(body, velocity)
            tenths = []
            for _ in range(10):
                samples = []
                for _ in range(24):
                    client.stepSimulation()
                    samples += floats(sound.samples())
                tenths.append(math.sqrt(sum(x * x for x in samples) / len(samples)))
            self.assertEqual(len([event for event in sound.events() if event.body == body]), 0)
        client.disconnect()
        return tenths

    def test_is_heard_until_the_body_rests(self):
        for maximal in (False, True):
            slides = self.loudness("box", (1.5, 0, 0), maximal=maximal)
            self.assertGreater(slides[1], 1e-3)
            # Friction stops it after v / (mu g), the stub's mu being 0.25: 0.6 s.
            self.assertLess(slides[9], 1e-2 * slides[1])
            self.assertGreater(slides[1], slides[5])
            rests = self.loudness("box", (0, 0, 0), maximal=maximal)
            self.assertLess(max(rests), 1e-6)
            rolls = self.loudness("ball", (1.5, 0, 0), maximal=maximal)
            self.assertGreater(min(rolls[1:]), 1e-4)

    def test_is_by_the_bumps_of_the_texture(self):
        bumps = os.environ["CAROM_TEXTURE"]
        usual = self.loudness("box", (1.5, 0, 0))
        bumpy = self.loudness("box", (1.5, 0, 0),
                              lambda sound, body: sound.texture(body, bumps, (0.1, 0.1)))
        self.assertGreater(bumpy[1], 0)
        self.assertNotEqual(bumpy[1], usual[1])
        self.assertEqual(self.loudness("box", (1.5, 0, 0),
                                       lambda sound, body: sound.texture(body, None)), usual)


class Clients(WithABall):
    def test_share_nothing(self):
        other = self.world()
        with self.carom.attach(self.client) as one, self.carom.attach(other) as two:
            two.listener([0, 0, 1], index=1, format="mono")
            for _ in range(96):
                self.client.stepSimulation()
            self.assertEqual(len(one.samples()), 19200)
            self.assertEqual(len(two.samples()), 0)
            self.assertEqual((one.channels, two.channels), (2, 3))
            self.assertEqual((len(one.events()), len(two.events())), (2, 0))
        other.disconnect()

    def test_have_one_sound_after_another(self):
        for _ in range(3):
            with self.carom.attach(self.client) as sound:
                self.client.stepSimulation()
                self.assertEqual(len(sound.samples()), 200)
        with self.assertRaisesRegex(self.carom.CaromError, "0 to 10"):
            self.carom.attach(self.client, latency=20)
        first = self.carom.attach(self.client)
        first.listener([0, 0, 1], index=1)
        self.client.stepSimulation()
        second = self.carom.attach(self.client)  # takes its place, as it is at first
        self.client.stepSimulation()
        self.assertEqual(second.channels, 2)
        for call in (first.samples, first.events, first.statistics, lambda: first.gain(1)):
            with self.assertRaisesRegex(self.carom.CaromError, "in its place|not there any more"):
                call()
        first.close()  # and nothing else
        self.assertEqual(len(second.samples()), 200)
        second.close()

    def test_say_where_a_recording_cannot_be_finished(self):
        folder = self.file("gone")
        os.mkdir(folder)
        with self.assertRaisesRegex(self.carom.CaromError, "gone"):
            with self.carom.attach(self.client) as sound:
                sound.record(os.path.join(folder, "ball.wav"))
                self.client.stepSimulation()
                for name in os.listdir(folder):
                    os.remove(os.path.join(folder, name))
                os.rmdir(folder)
        with self.carom.attach(self.client) as sound:
            self.client.stepSimulation()
            self.assertEqual(len(sound.samples()), 200)

    def test_that_have_disconnected_are_not_mistaken_for_others(self):
        stale = self.carom.attach(self.client)
        self.client.disconnect()
        self.client = self.world()
        stale._client = self.client  # a module connects again under the same number
        sound = self.carom.attach(self.client)
        stale.close()
        self.client.stepSimulation()
        self.assertEqual(len(sound.samples()), 200)
        sound.close()

    def test_come_and_go_without_a_leak(self):
        def round():
            client = self.world()
            sound = self.carom.attach(client)
            for _ in range(10):
                client.stepSimulation()
            state = sound.save_state()
            sound.record(self.file("round.wav"))
            for _ in range(60):
                client.stepSimulation()
            sound.samples(), sound.events()
            sound.restore_state(state)
            client.removeBody(self.ball)
            client.stepSimulation()
            client.resetSimulation()
            client.stepSimulation()
            sound.close()
            client.stepSimulation()
            client.disconnect()

        rounds = int(os.environ.get("CAROM_ROUNDS", "60"))
        for count in range(rounds):
            if count == 20:
                before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            round()
        if rounds > 20 and "CAROM_SANITIZED" not in os.environ:
            grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
            self.assertLess(grown, 4000 + 40 * (rounds - 20))  # kB; a scene has some hundreds


class Examples(unittest.TestCase):
    """The examples run as they stand, over the stub in place of PyBullet."""

    def run_example(self, name, *arguments):
        here = os.path.dirname(os.path.abspath(__file__))
        example = os.path.join(os.environ["CAROM_EXAMPLES"], name)
        environment = dict(os.environ, PYTHONPATH=os.path.join(here, "stub_modules"),
                           CAROM_PYBULLET_PLUGIN=os.path.join(os.environ["CAROM_PYTHON"],
                                                              "libcarom_pybullet.so"))
        return subprocess.run([sys.executable, example, *arguments], env=environment, check=True,
                              capture_output=True, text=True).stdout

    def test_the_agent_hears_on_which_side_the_ball_fell(self):
        self.assertEqual(self.run_example("agent_with_ears.py", "12"), "12 of 12 by ear\n")

    def test_the_data_set_is_the_same_each_time(self):
        with tempfile.TemporaryDirectory() as folder:
            sets = []
            for name in ("one", "two"):
                self.run_example("data_set.py", os.path.join(folder, name), "4")
                files = sorted(os.listdir(os.path.join(folder, name)))
                self.assertEqual(len(files), 5)
                contents = []
                for file in files:
                    with open(os.path.join(folder, name, file), "rb") as opened:
                        contents.append(opened.read())
                sets.append(contents)
            self.assertEqual(sets[0], sets[1])
            rows = [json.loads(line) for line in sets[0][-1].splitlines()]
            self.assertEqual(len(rows), 4)
            for row in rows:
                self.assertGreaterEqual(len(row["collisions"]), 1)
                self.assertGreater(row["collisions"][0]["peak_pa"], 0)


@unittest.skipIf(carom.numpy is None, "the pages' examples have arrays")
class Pages(unittest.TestCase):
    """The examples in Python of all pages run as they stand, over the stub in place of PyBullet."""

    def run_code(self, code, folder):
        """Runs it, and returns what it prints."""
        here = os.path.dirname(os.path.abspath(__file__))
        environment = dict(os.environ, PYTHONPATH=os.pathsep.join(
            (os.path.join(here, "stub_modules"), os.environ["CAROM_PYTHON"])))
        done = subprocess.run([sys.executable, "-c", code], env=environment, cwd=folder,
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, f"{code}\n{done.stderr}")
        return done.stdout

    def test_their_examples_run(self):
        of_page = {}
        for page in pages.pages():
            examples = [block.text for block in pages.split(page)[0] if block.language == "python"]
            if examples:
                of_page[page.name] = examples
        self.assertEqual({name: len(examples) for name, examples in of_page.items()},
                         {"README.md": 1, "bullet_collision_sounds.md": 1, "pybullet.md": 4})
        whole, recorded, loaded, asked = of_page["pybullet.md"]
        plugin = os.path.join(os.environ["CAROM_PYTHON"], "libcarom_pybullet.so")
        world = whole.split("sound = carom.attach(p)")[0]
        fall = "for _ in range(96):\n    p.stepSimulation()\n"
        with tempfile.TemporaryDirectory() as folder:
            first = self.run_code(whole, folder)
            self.assertRegex(first, r"^0\.3\d+ 0 3\.0\d+ 0\.0\n0\.3\d+ 1 3\.0\d+ \d+")
            self.assertEqual(os.listdir(folder), [])
            self.run_code(world + recorded, folder)
            samples, channels = read_wav(os.path.join(folder, "out.wav"))
            self.assertEqual((channels, len(samples) // channels >= 2 * RATE), (2, True))
            self.assertAlmostEqual(20 * math.log10(max(map(abs, samples))), -3, delta=0.01)
            os.remove(os.path.join(folder, "out.wav"))
            loaded = loaded.replace("/path/to/libcarom_pybullet.so", plugin)
            text = self.run_code(world + loaded + asked, folder)
            self.assertRegex(text, "^time=2 bodies=2 ")
            self.assertEqual(os.listdir(folder), ["out.wav"])
            attached, taken = of_page["README.md"][0].strip().split("\n")
            lines = (attached, "p.stepSimulation()", taken, "print(samples.shape)")
            shape = self.run_code(world + "\n".join(lines), folder)
            self.assertEqual(shape, "(200, 2)\n")
            # The page's step stands for the application's loop.
            events = of_page["bullet_collision_sounds.md"][0]
            told = self.run_code(world + events.replace("p.stepSimulation()\n", fall), folder)
            self.assertRegex(told, r"^0\.3\d+ 0 1 3\.0\d+ 0\.0\n0\.3\d+ 1 0 3\.0\d+ \d+")


class Nonsense(WithABall):
    def test_what_is_no_client_is_refused(self):
        for wrong in (0, None, "pybullet", object()):
            with self.assertRaisesRegex(self.carom.CaromError, "is no PyBullet client; expected"):
                self.carom.attach(wrong)

    def test_is_refused_with_a_reason(self):
        error = self.carom.CaromError
        with self.carom.attach(self.client) as sound:
            for call, kind, words in (
                    (lambda: sound.material(self.ball, "cheese"), error, "no 'cheese'"),
                    (lambda: sound.material(77, "steel"), error, "no body 77"),
                    (lambda: sound.material(self.ball, "steel", link=3), error, "no link 3"),
                    (lambda: sound.material(self.ball, "two words"), ValueError, "one word"),
                    (lambda: sound.listener([1, 2]), ValueError, "2 numbers; expected 3"),
                    (lambda: sound.listener([1, 2, math.nan]), ValueError, "finite"),
                    (lambda: sound.listener([0, 0, 0], [0, 0, 0, 2]), error, "length 2"),
                    (lambda: sound.listener([0, 0, 0], looks_at=[0, 0, 0]), ValueError, "is where"),
                    (lambda: sound.listener([0, 0, 0], index=5), error, "no listener 5"),
                    (lambda: sound.listener([0, 0, 0], format="quad"), error, "mono, spaced_pair"),
                    (lambda: sound.listener([0, 0, 0], head="/none.sofa"), error, "none.sofa"),
                    (lambda: sound.modes(self.ball, "/none.carom_modes"), error, "none.carom"),
                    (lambda: sound.texture(self.ball, "/none.png"), error, "none.png"),
                    (lambda: sound.room([0, 0, 0], [1, 1, -1]), error, "below"),
                    (lambda: sound.room([0, 0, 0]), ValueError, "most"),
                    (lambda: sound.room([0, 0, 0], [1, 1, 1], order=40), error, "0 to 32"),
                    (lambda: sound.level(0.0), error, "above 0"),
                    (lambda: sound.record("/no/such/folder/a.wav"), error, "no/such/folder"),
                    (lambda: sound.record("a.mp3"), error, "wav"),
                    (lambda: sound.record("a" * 2000 + ".wav"), ValueError, "longer"),
                    (lambda: sound.record("a\nb.wav"), ValueError, "line break"),
                    (lambda: sound.gain(-1), error, "0 to 1000"),
                    (lambda: sound.reset(-1), error, "0 to 1e9")):
                with self.assertRaisesRegex(kind, words):
                    call()
            self.client.stepSimulation()
            self.assertEqual(len(sound.samples()), 200)  # nothing is lost
        with self.assertRaisesRegex(error, "closed"):
            sound.samples()
        sound.close()
        with self.assertRaisesRegex(error, "no such file"):
            self.carom.attach(self.client, "/none.so")
        with open(self.file("empty.so"), "w", encoding="ascii"):
            pass
        with self.assertRaisesRegex(error, "does not take"):
            self.carom.attach(self.client, self.file("empty.so"))
        with self.assertRaisesRegex(error, "does not take"):
            self.carom.attach(self.world(), self.file("empty.so"))
        with self.assertRaisesRegex(error, "0 to 10"):
            self.carom.attach(self.client, latency=20)

    def test_a_recording_keeps_its_settings(self):
        with self.carom.attach(self.client) as sound:
            sound.record(self.file("a.wav"))
            with self.assertRaisesRegex(self.carom.CaromError, "recording is under way"):
                sound.room([0, 0, 0], [1, 1, 1])
            sound.listener([0, 0, 1])  # moving is no setting

    def test_a_client_that_has_disconnected_is_an_error(self):
        sound = self.carom.attach(self.client)
        self.client.disconnect()
        with self.assertRaises((self.carom.CaromError, RuntimeError)):
            sound.samples()
        sound.close()


if carom.numpy is not None:
    class SamplesInArrays(Samples):
        carom = carom

        def test_are_float32(self):
            with self.carom.attach(self.client) as sound:
                self.client.stepSimulation()
                self.assertEqual(sound.samples().dtype, carom.numpy.float32)

    class EventsInArrays(Events):
        carom = carom

        def test_have_named_columns(self):
            with self.carom.attach(self.client) as sound:
                for _ in range(96):
                    self.client.stepSimulation()
                events = sound.events()
            of_ball = events[events["body"] == self.ball]
            self.assertEqual(of_ball["heard"].tolist(), [True])
            self.assertEqual(of_ball["peaks_pa"].shape, (1, 1))

    class ClockInArrays(Clock):
        carom = carom


if __name__ == "__main__":
    unittest.main()
