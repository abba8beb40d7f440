"""A data set of falling things: a WAV file and a line of JSON for each, written by a loop.

    python data_set.py FOLDER [COUNT]

Each line of FOLDER/data_set.jsonl has the file, what fell and how, and every collision: when, how
hard, how loud. Pressures in the files are in units of 20 Pa. The same number gives the same files.
"""

import glob
import json
import os
import random
import sys

import pybullet

HERE = os.path.dirname(os.path.abspath(__file__))
# carom.py is a folder above in the sources, and in the library folder where it is installed.
sys.path[:0] = [os.path.join(HERE, "..")] + [
    folder
    for place in ("lib", "lib*/*")
    for folder in glob.glob(os.path.join(HERE, "../../../../..", place, "carom"))
]
import carom

MATERIALS = {"steel": 7850.0, "wood": 700.0, "glass": 2500.0, "plastic": 1100.0}  # kg/m^3
SECONDS = 1.5
FULL_SCALE = 20.0  # Pa
COLUMNS = [name for name, _ in carom.EVENT_COLUMNS]


def throw_one(sound, number, file):
    """Simulates and records one sample; returns its line."""
    chance = random.Random(number)
    material = chance.choice(sorted(MATERIALS))
    radius = chance.uniform(0.01, 0.04)
    height = chance.uniform(0.2, 1.0)
    pybullet.resetSimulation()
    pybullet.setGravity(0, 0, -9.81)
    pybullet.createMultiBody(0, pybullet.createCollisionShape(pybullet.GEOM_PLANE))
    shape = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=radius)
    mass = MATERIALS[material] * 4.19 * radius ** 3
    ball = pybullet.createMultiBody(mass, shape, basePosition=[0, 0, radius + height])
    pybullet.changeDynamics(ball, -1, restitution=chance.uniform(0.4, 0.9))
    sound.material(ball, material)
    sound.record(file)
    for _ in range(int(SECONDS * 240)):
        pybullet.stepSimulation()
    sound.stop()
    collisions = []
    for event in sound.events():
        values = dict(zip(COLUMNS, event.tolist() if hasattr(event, "tolist") else event))
        if values["body"] == ball:
            collisions.append({name: values[name] for name in ("time_s", "jz_Ns", "peak_pa")})
    return {"file": os.path.basename(file), "material": material, "radius_m": radius,
            "height_m": height, "full_scale_pa": FULL_SCALE, "collisions": collisions}


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    folder = sys.argv[1]
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    os.makedirs(folder, exist_ok=True)
    pybullet.connect(pybullet.DIRECT)
    with carom.attach(pybullet) as sound:
        sound.listener([0, -1, 0.5], looks_at=[0, 0, 0])
        sound.level(FULL_SCALE)
        with open(os.path.join(folder, "data_set.jsonl"), "w", encoding="utf-8") as lines:
            for number in range(count):
                file = os.path.join(folder, f"{number:06}.wav")
                lines.write(json.dumps(throw_one(sound, number, file)) + "\n")
    pybullet.disconnect()
    print(f"{count} sounds in {folder}")


if __name__ == "__main__":
    main()
