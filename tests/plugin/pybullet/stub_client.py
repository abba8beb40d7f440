"""The server stub of the tests as a PyBullet client: what carom.py and its examples call of one."""

import ctypes
import os

FORMS = ("ball", "box", "floor", "cylinder", "capsule", "hull", "ballPair")


def _stub():
    library = ctypes.CDLL(os.environ["CAROM_PYBULLET_STUB"])
    pointer = ctypes.c_void_p
    vector = ctypes.POINTER(ctypes.c_double)
    for name, arguments, result in (
            ("makeServerStub", [], pointer), ("destroyServerStub", [pointer], None),
            ("stubAdd", [pointer, ctypes.c_int, vector, ctypes.c_int], ctypes.c_int),
            ("stubRemove", [pointer, ctypes.c_int], None), ("stubReset", [pointer], None),
            ("stubSaveState", [pointer], ctypes.c_int),
            ("stubRestoreState", [pointer, ctypes.c_int], None),
            ("stubPlace", [pointer, ctypes.c_int, vector], None),
            ("stubThrow", [pointer, ctypes.c_int, vector], None),
            ("stubPosition", [pointer, ctypes.c_int, vector], None),
            ("stubSetTimeStep", [pointer, ctypes.c_double, ctypes.c_int], None),
            ("stubTellNothing", [pointer], None),
            ("stubStatesAsked", [pointer], ctypes.c_int), ("stubStep", [pointer], None),
            ("stubLoad", [pointer, ctypes.c_char_p, ctypes.c_char_p], ctypes.c_int),
            ("stubUnload", [pointer], None),
            ("stubExecute", [pointer, ctypes.c_char_p], ctypes.c_int),
            ("stubReplyLength", [], ctypes.c_int), ("stubReplyText", [ctypes.c_char_p], None)):
        function = getattr(library, name)
        function.argtypes = arguments
        function.restype = result
    return library


STUB = _stub()


def _numbers(*values):
    return (ctypes.c_double * len(values))(*values)


class StubClient:
    """One connection to a server of its own, as `BulletClient` is."""

    error = RuntimeError

    def __init__(self):
        self._server = STUB.makeServerStub()
        self._isLoaded = False

    def disconnect(self):
        if self._server:
            STUB.destroyServerStub(self._server)
        self._server = None

    def _connected(self):
        if not self._server:
            raise self.error("Not connected to physics server.")
        return self._server

    def add(self, form="ball", half_edges=(0.05, 0.05, 0.05), mass=1.0, position=(0, 0, 0),
            velocity=(0, 0, 0), restitution=0.9, maximal=False):
        numbers = _numbers(*half_edges, mass, *position, *velocity, restitution)
        return STUB.stubAdd(self._connected(), FORMS.index(form), numbers, int(maximal))

    def removeBody(self, body):
        STUB.stubRemove(self._connected(), body)

    def resetSimulation(self):
        STUB.stubReset(self._connected())

    def saveState(self):
        return STUB.stubSaveState(self._connected())

    def restoreState(self, stateId):
        STUB.stubRestoreState(self._connected(), stateId)

    def place(self, body, position):
        STUB.stubPlace(self._connected(), body, _numbers(*position))

    def resetBaseVelocity(self, body, velocity):
        STUB.stubThrow(self._connected(), body, _numbers(*velocity))

    def position(self, body):
        at = _numbers(0.0, 0.0, 0.0)
        STUB.stubPosition(self._connected(), body, at)
        return list(at)

    def setTimeStep(self, seconds, substeps=0):
        STUB.stubSetTimeStep(self._connected(), seconds, substeps)

    def tell_nothing(self):
        STUB.stubTellNothing(self._connected())

    def states_asked(self):
        return STUB.stubStatesAsked(self._connected())

    def stepSimulation(self):
        STUB.stubStep(self._connected())

    def loadPlugin(self, path, postFix=""):
        result = STUB.stubLoad(self._connected(), path.encode(), postFix.encode())
        self._isLoaded = result >= 0
        return result

    def unloadPlugin(self, _):
        STUB.stubUnload(self._connected())
        self._isLoaded = False

    def executePluginCommand(self, _, text):
        if not self._isLoaded:
            return -1
        result = STUB.stubExecute(self._connected(), text.encode())
        data = ctypes.create_string_buffer(STUB.stubReplyLength())
        STUB.stubReplyText(data)
        signed = tuple(byte - 256 if byte > 127 else byte for byte in data.raw)
        return result, 1, signed
