"""PyBullet itself with the plugin, which no package has: by hand, with one that was built.

    python3 real_pybullet.py CAROM_FOLDER [--models PYBULLET_DATA]

CAROM_FOLDER has carom.py and libcarom_pybullet.so, as build/check/plugin/pybullet; the Python is one
that can import pybullet. Prints: impacts of four shapes on a plane in both kinds of coordinates and
at three steps; two balls; a stack; what slides; frames of 10,000 steps; stock models, if their folder is given; what
recording costs. Nothing of PyBullet is in this repository.
"""

import argparse
import os
import sys
import tempfile
import time

import pybullet as p

STEPS = (1 / 60, 1 / 240, 1 / 1000)
MODELS = ("humanoid.xml thrower.xml capsule_fromtoX.xml capsule_fromtoY.xml capsule_fromtoZ.xml ant.xml "
          "hopper.xml half_cheetah.xml walker2d.xml pusher.xml striker.xml capsule.xml cylinder.xml "
          "sphere.xml hello_mjcf.xml").split()
BODIES = ("duck_vhacd.urdf cube_small.urdf teddy_vhacd.urdf soccerball.urdf block.urdf "
          "domino/domino.urdf jenga/jenga.urdf sphere_small.urdf sphere2.urdf sphere_1cm.urdf "
          "quadruped/minitaur.urdf husky/husky.urdf lego/lego.urdf tray/tray.urdf mug.urdf "
          "objects/mug.urdf a1/a1.urdf laikago/laikago.urdf cube_rotate.urdf kuka_iiwa/model.urdf "
          "racecar/racecar.urdf r2d2.urdf humanoid/humanoid.urdf").split()


def plane(maximal):
    body = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE), useMaximalCoordinates=maximal)
    p.changeDynamics(body, -1, restitution=0.9)


def shapes():
    return {"ball": p.createCollisionShape(p.GEOM_SPHERE, radius=0.05),
            "box": p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.05, 0.04, 0.03]),
            "cylinder": p.createCollisionShape(p.GEOM_CYLINDER, radius=0.04, height=0.1),
            "capsule": p.createCollisionShape(p.GEOM_CAPSULE, radius=0.03, height=0.1)}


def impacts():
    print("first impact of a fall of 0.3 m: approach speed (m/s), impulse (N s), time (s), peak (Pa)")
    for name in ("ball", "box", "cylinder", "capsule"):
        for step in STEPS:
            for maximal in (False, True):
                p.connect(p.DIRECT)
                p.setGravity(0, 0, -9.81)
                p.setTimeStep(step)
                plane(maximal)
                body = p.createMultiBody(0.5, shapes()[name], basePosition=[0, 0, 0.4],
                                         baseOrientation=[0.1, 0.2, 0.05, 0.9],
                                         useMaximalCoordinates=maximal)
                p.changeDynamics(body, -1, restitution=0.8)
                with carom.attach(p) as sound:
                    for _ in range(round(0.4 / step)):
                        p.stepSimulation()
                    first = next(event for event in sound.events() if event["body"] == body)
                kind = "maximal" if maximal else "reduced"
                print(f"  {name:9} 1/{round(1 / step):<5} {kind} {first['approach_speed_m_s']:.6f} "
                      f"{first['jz_Ns']:.6f} {first['time_s']:.7f} {first['peak_pa']:.5f}")
                p.disconnect()


def two_balls():
    print("two balls of 0.5 and 0.3 kg meet at 3 m/s, without gravity: time, impulse, over the closed forms")
    for step in STEPS:
        for maximal in (False, True):
            p.connect(p.DIRECT)
            p.setTimeStep(step)
            balls = []
            for mass, place, speed in ((0.5, 0.0, 2.0), (0.3, 0.5, -1.0)):
                ball = p.createMultiBody(mass, shapes()["ball"], basePosition=[place, 0, 1],
                                         useMaximalCoordinates=maximal)
                p.changeDynamics(ball, -1, restitution=0.9, linearDamping=0, angularDamping=0)
                p.resetBaseVelocity(ball, [speed, 0, 0])
                balls.append(ball)
            with carom.attach(p) as sound:
                for _ in range(round(0.3 / step)):
                    p.stepSimulation()
                events = [event for event in sound.events() if event["body"] == balls[1]]
            touch = (0.5 - 0.1) / 3.0
            impulse = (1 + 0.81) * 3.0 * (0.5 * 0.3 / 0.8)
            first = events[0]
            print(f"  1/{round(1 / step):<5} {'maximal' if maximal else 'reduced'} {len(events)} event, "
                  f"{1e6 * (first['time_s'] - touch):+.3f} us, {first['jx_Ns'] / impulse:.8f}")
            p.disconnect()


def stack():
    print("a stack of 8 boxes let down by 2 mm: events that are heard within 1 s, and in the second after")
    for step in STEPS:
        for maximal in (False, True):
            p.connect(p.DIRECT)
            p.setGravity(0, 0, -9.81)
            p.setTimeStep(step)
            plane(maximal)
            shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=[0.1, 0.1, 0.05])
            for number in range(8):
                p.createMultiBody(1.0, shape, basePosition=[0, 0, 0.052 + 0.102 * number],
                                  useMaximalCoordinates=maximal)
            with carom.attach(p) as sound:
                counts = []
                for _ in range(2):
                    for _ in range(round(1 / step)):
                        p.stepSimulation()
                    events = sound.events()
                    loudest = max((event["peak_pa"] for event in events), default=0.0)
                    counts.append(f"{sum(event['heard'] for event in events)} ({loudest:.3g} Pa)")
            print(f"  1/{round(1 / step):<5} {'maximal' if maximal else 'reduced'} " + ", ".join(counts))
            p.disconnect()


def slides():
    print("a box of 0.5 kg at 1.5 m/s, a ball at 1.5 m/s, a box at rest: rms (Pa) by tenths of a second")
    for name, speed in (("box", 1.5), ("ball", 1.5), ("box", 0.0)):
        for maximal in (False, True):
            p.connect(p.DIRECT)
            p.setGravity(0, 0, -9.81)
            plane(maximal)
            half = 0.03 if name == "box" else 0.05
            body = p.createMultiBody(0.5, shapes()[name], basePosition=[0, 0, half],
                                     useMaximalCoordinates=maximal)
            p.changeDynamics(body, -1, lateralFriction=0.3)
            with carom.attach(p) as sound:
                sound.material(body, "wood")
                for _ in range(60):
                    p.stepSimulation()
                sound.samples()
                p.resetBaseVelocity(body, [speed, 0, 0])
                tenths = []
                for _ in range(10):
                    energy = frames = 0.0
                    for _ in range(24):
                        p.stepSimulation()
                        samples = sound.samples()
                        energy += sum(x * x for frame in samples.tolist() for x in frame)
                        frames += 2 * len(samples)
                    tenths.append((energy / frames) ** 0.5)
            print(f"  {name:4} {speed} {'maximal' if maximal else 'reduced'} "
                  + " ".join(f"{value:.1e}" for value in tenths))
            p.disconnect()


def frames():
    p.connect(p.DIRECT)
    p.setGravity(0, 0, -9.81)
    plane(False)
    p.createMultiBody(0.5, shapes()["ball"], basePosition=[0, 0, 0.4])
    with carom.attach(p) as sound:
        lengths = set()
        for _ in range(10000):
            p.stepSimulation()
            lengths.add(len(sound.samples()))
        print(f"frames of each of 10,000 steps: {sorted(lengths)}, after {sound.time:.9f} s")
    p.disconnect()


def models(folder):
    print("stock models, 300 steps each: impacts, late, rejected")
    for name in MODELS + BODIES:
        file = os.path.join(folder, "mjcf", name) if name in MODELS else os.path.join(folder, name)
        for maximal in ((False,) if name in MODELS else (False, True)):
            if not os.path.exists(file):
                continue
            p.connect(p.DIRECT)
            p.setAdditionalSearchPath(folder)
            p.setGravity(0, 0, -9.81)
            try:
                with carom.attach(p) as sound:
                    if name in MODELS:
                        p.loadMJCF(file)
                    else:
                        plane(maximal)
                        p.loadURDF(file, [0, 0, 1], useMaximalCoordinates=maximal)
                    for _ in range(300):
                        p.stepSimulation()
                    count = sound.statistics()
                    print(f"  {name} {'maximal' if maximal else 'reduced'} {count['impacts']:.0f} "
                          f"{count['late']:.0f} {count['rejected']:.0f}")
            except p.error as error:
                print(f"  {name}: {error}")
            p.disconnect()


def cost():
    print("what recording costs, of a step without it, by turns, medians of 360 steps")
    for maximal in (False, True):
        for count in (10, 100, 1000):
            clients = []
            for _ in range(2):
                client = p.connect(p.DIRECT)
                p.setGravity(0, 0, -9.81, physicsClientId=client)
                floor = p.createCollisionShape(p.GEOM_PLANE, physicsClientId=client)
                p.createMultiBody(0, floor, useMaximalCoordinates=maximal, physicsClientId=client)
                ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.05, physicsClientId=client)
                for number in range(count):
                    p.createMultiBody(0.5, ball, useMaximalCoordinates=maximal,
                                      basePosition=[0.2 * (number % 32), 0.2 * (number // 32),
                                                    0.1 + 0.1 * (number % 7)],
                                      physicsClientId=client)
                clients.append(client)
            with tempfile.TemporaryDirectory() as folder:
                sound = carom.attach(p, samples=False, physics_client_id=clients[1])
                sound.record(os.path.join(folder, "cost.wav"))
                times = ([], [])
                for _ in range(480):
                    for client, taken in zip(clients, times):
                        begin = time.perf_counter()
                        p.stepSimulation(physicsClientId=client)
                        taken.append(time.perf_counter() - begin)
                bare, recording = (sorted(taken[120:])[180] for taken in times)
                print(f"  {count:4} balls {'maximal' if maximal else 'reduced'}: {1e6 * bare:.0f} us, "
                      f"recording {1e6 * recording:.0f} us, +{100 * (recording / bare - 1):.0f} %")
                sound.close()
            for client in clients:
                p.disconnect(client)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("carom_folder")
    parser.add_argument("--models", metavar="PYBULLET_DATA")
    options = parser.parse_args()
    sys.path.insert(0, os.path.abspath(options.carom_folder))
    import carom

    impacts()
    two_balls()
    stack()
    slides()
    frames()
    if options.models:
        models(options.models)
    cost()
