"""An environment for agents that hear: a ball falls somewhere around, and which side was it?

    python agent_with_ears.py [EPISODES]

The interface is Gymnasium's, whose spaces are used where it is installed. What the agent gets is
what its two microphones hear in a second of the simulation, from `sound.samples()`.
"""

import glob
import os
import random
import sys

import pybullet
from pybullet_utils.bullet_client import BulletClient

HERE = os.path.dirname(os.path.abspath(__file__))
# carom.py is a folder above in the sources, and in the library folder where it is installed.
sys.path[:0] = [os.path.join(HERE, "..")] + [
    folder
    for place in ("lib", "lib*/*")
    for folder in glob.glob(os.path.join(HERE, "../../../../..", place, "carom"))
]
import carom

try:
    import gymnasium
except ImportError:
    gymnasium = None

STEPS = 240  # of 1/240 s
LEFT, RIGHT = 0, 1


class SideByEar(gymnasium.Env if gymnasium else object):
    """One step is an episode: the agent hears a second of a falling ball, and says LEFT or RIGHT.

    The observation has the shape (48000, 2), in Pa: left and right.
    """

    metadata = {"render_modes": []}

    def __init__(self):
        self.world = BulletClient(pybullet.DIRECT)  # a world of its own for each environment
        self.sound = carom.attach(self.world)
        self.sound.listener([0, 0, 1], format="coincident_pair")  # looks along +y, z is up
        frames = STEPS * self.sound.sample_rate // 240
        if gymnasium:
            self.observation_space = gymnasium.spaces.Box(-float("inf"), float("inf"),
                                                          (frames, self.sound.channels))
            self.action_space = gymnasium.spaces.Discrete(2)
        self.side = LEFT

    def reset(self, *, seed=None, options=None):
        """Lets a ball fall at a random place; returns what is heard of it."""
        if seed is not None:
            random.seed(seed)
        world = self.world
        world.resetSimulation()  # the sound's clock is at 0 again, and all is silent
        world.setGravity(0, 0, -9.81)
        world.createMultiBody(0, world.createCollisionShape(pybullet.GEOM_PLANE))
        self.side = random.choice((LEFT, RIGHT))
        across = random.uniform(0.3, 2.0) * (1 if self.side == RIGHT else -1)
        radius = random.uniform(0.02, 0.05)
        shape = world.createCollisionShape(pybullet.GEOM_SPHERE, radius=radius)
        ball = world.createMultiBody(0.2, shape,
                                     basePosition=[across, random.uniform(0.5, 2.0), 1.0])
        world.changeDynamics(ball, -1, restitution=0.8)
        for _ in range(STEPS):
            world.stepSimulation()
        return self.sound.samples(), {"collisions": len(self.sound.events()) // 2}

    def step(self, action):
        """Takes LEFT or RIGHT. The episode is over; the observation is no new one."""
        reward = 1.0 if action == self.side else 0.0
        return self.sound.samples(), reward, True, False, {}

    def close(self):
        self.sound.close()
        self.world.disconnect()


def louder_side(samples):
    """The side on which there is more energy."""
    energies = [0.0, 0.0]
    for left, right in samples.tolist():
        energies[LEFT] += left * left
        energies[RIGHT] += right * right
    return max((LEFT, RIGHT), key=lambda side: energies[side])


def main():
    episodes = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    environment = SideByEar()
    right = 0.0
    for episode in range(episodes):
        samples, _ = environment.reset(seed=episode)
        _, reward, *_ = environment.step(louder_side(samples))
        right += reward
    environment.close()
    print(f"{right:.0f} of {episodes} by ear")


if __name__ == "__main__":
    main()
