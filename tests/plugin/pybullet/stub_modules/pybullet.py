"""The server stub as the module `pybullet`: as much of it as the examples call."""

import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from stub_client import StubClient

DIRECT, GEOM_SPHERE, GEOM_PLANE = 2, 2, 6
error = StubClient.error


class Client(StubClient):
    """A connection, with PyBullet's names for what the stub has."""

    DIRECT, GEOM_SPHERE, GEOM_PLANE = DIRECT, GEOM_SPHERE, GEOM_PLANE

    def __init__(self, connection_mode=DIRECT):
        super().__init__()
        assert connection_mode == DIRECT
        self._shapes = []

    def getConnectionInfo(self):
        return {"isConnected": 1, "connectionMethod": DIRECT}

    def setGravity(self, x, y, z):
        assert (x, y, z) == (0, 0, -9.81)  # the stub has no other

    def createCollisionShape(self, form, radius=0.5):
        self._shapes.append((form, radius))
        return len(self._shapes) - 1

    def createMultiBody(self, mass, shape, basePosition=(0, 0, 0)):
        form, radius = self._shapes[shape]
        return self.add("floor" if form == GEOM_PLANE else "ball", half_edges=(radius,) * 3,
                        mass=mass, position=basePosition, restitution=0.8)

    def changeDynamics(self, body, link, restitution):
        assert link == -1 and 0 <= restitution <= 1


_client = None


def connect(method):
    global _client
    _client = Client(method)
    return 0


def __getattr__(name):
    return getattr(_client, name)
