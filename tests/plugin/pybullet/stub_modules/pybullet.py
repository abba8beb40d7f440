"""The server stub as the module `pybullet`: as much of it as the examples call."""

import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from stub_client import StubClient

DIRECT, GEOM_SPHERE, GEOM_PLANE = 2, 2, 6
error = StubClient.error

_client = None
_shapes = []


def connect(method):
    global _client
    assert method == DIRECT
    _client = StubClient()
    return 0


def disconnect(_=0):
    _client.disconnect()


def getConnectionInfo():
    return {"isConnected": 1, "connectionMethod": DIRECT}


def setGravity(x, y, z):
    assert (x, y, z) == (0, 0, -9.81)  # the stub has no other


def createCollisionShape(form, radius=0.5):
    _shapes.append((form, radius))
    return len(_shapes) - 1


def createMultiBody(mass, shape, basePosition=(0, 0, 0)):
    form, radius = _shapes[shape]
    return _client.add("floor" if form == GEOM_PLANE else "ball", half_edges=(radius,) * 3,
                       mass=mass, position=basePosition, restitution=0.8)


def changeDynamics(body, link, restitution):
    assert link == -1 and 0 <= restitution <= 1


def __getattr__(name):
    return getattr(_client, name)
