"""Chromium without a window, through the pipe of its DevTools protocol: pages, scripts, keys, pictures."""
import base64
import json
import os
import select
import subprocess
import tempfile
import time


class Browser:
    """One Chromium with one page. Collects requests to a network, and everything that is written on the console."""

    def __init__(self, chromium, size=(1280, 800), dark=True, touch=False, seconds=60, scale=1):
        self.seconds, self.number, self.rest, self.events = seconds, 0, b"", []
        self.requests, self.messages = [], []
        self.profile = tempfile.TemporaryDirectory(prefix="carom_page_", ignore_cleanup_errors=True)
        self.process = self._start(chromium, size)
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=scale, mobile=touch)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])
        if touch:
            self.call("Emulation.setTouchEmulationEnabled", enabled=True)

    session = None

    def _start(self, chromium, size):
        to_browser, from_us = os.pipe()
        to_us, from_browser = os.pipe()
        # The browser reads descriptor 3 and writes descriptor 4.
        command = [chromium, "--headless=new", "--no-sandbox", "--remote-debugging-pipe", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                   "--ignore-gpu-blocklist", "--no-first-run", "--disable-dev-shm-usage", f"--user-data-dir={self.profile.name}",
                   "--host-resolver-rules=MAP * ~NOTFOUND", "--hide-scrollbars", f"--window-size={size[0]},{size[1]}", "--mute-audio", "about:blank"]
        shell = ["sh", "-c", f'exec "$@" 3<&{to_browser} 4>&{from_browser}', "sh", *command]
        process = subprocess.Popen(shell, pass_fds=(to_browser, from_browser), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                   env={**os.environ, "HOME": self.profile.name})
        os.close(to_browser)
        os.close(from_browser)
        self.out, self.back = from_us, to_us
        return process

    def close(self):
        try:
            self.session = None
            self.call("Browser.close")
            self.process.wait(20)
        except (OSError, RuntimeError, TimeoutError, subprocess.TimeoutExpired):
            self.process.kill()
            self.process.wait()
        for descriptor in (self.out, self.back):
            os.close(descriptor)
        self.profile.cleanup()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _receive(self, deadline):
        while b"\0" not in self.rest:
            if not select.select([self.back], [], [], max(0.0, deadline - time.monotonic()))[0]:
                raise TimeoutError("Chromium does not answer")
            data = os.read(self.back, 1 << 20)
            if not data:
                raise RuntimeError("Chromium has ended")
            self.rest += data
        line, self.rest = self.rest.split(b"\0", 1)
        message = json.loads(line)
        if "method" in message:
            self._note(message)
        return message

    def _note(self, message):
        method, given = message["method"], message.get("params", {})
        if method == "Network.requestWillBeSent":
            self.requests.append(given["request"]["url"])
        elif method == "Runtime.consoleAPICalled":
            self.messages.append(" ".join(str(item.get("value", item.get("description", ""))) for item in given["args"]))
        elif method == "Runtime.exceptionThrown":
            details = given["exceptionDetails"]
            self.messages.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Log.entryAdded":
            self.messages.append(given["entry"]["text"])
        self.events.append(method)

    def call(self, method, **params):
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        if self.session and not method.startswith(("Target.", "Browser.")):
            message["sessionId"] = self.session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + self.seconds
        while True:
            answer = self._receive(deadline)
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]

    def open(self, page):
        self.open_address(page.resolve().as_uri())

    def open_address(self, address):
        self._load(lambda: self.call("Page.navigate", url=address))

    def load_by(self, script):
        """Runs a script that loads the page anew, and returns once it is loaded. Chromium answers before the
        script runs: what it is asked while a page goes away, it refuses."""
        self._load(lambda: self.run(f"void setTimeout(() => {{ {script} }})"))

    def _load(self, begin):
        self.events = [event for event in self.events if event != "Page.loadEventFired"]
        begin()
        deadline = time.monotonic() + self.seconds
        while "Page.loadEventFired" not in self.events:
            self._receive(deadline)

    def run(self, script):
        """What a script gives, a promise of it too."""
        result = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True, userGesture=True)
        if "exceptionDetails" in result:
            details = result["exceptionDetails"]
            raise RuntimeError(details.get("exception", {}).get("description", details["text"]))
        return result["result"].get("value")

    def wait(self, script, seconds=60):
        """True once a condition holds; False if it does not in time."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            if self.run(script):
                return True
            time.sleep(0.05)
        return False

    def key(self, key, code=None, shift=False, hold=0.0, repeats=0):
        text = key if len(key) == 1 else ""
        codes = {" ": ("Space", 32), "Escape": ("Escape", 27), "Tab": ("Tab", 9), "Home": ("Home", 36), "End": ("End", 35), "ArrowLeft": ("ArrowLeft", 37),
                 "ArrowRight": ("ArrowRight", 39), "ArrowUp": ("ArrowUp", 38), "ArrowDown": ("ArrowDown", 40)}
        name, number = codes.get(key, (code or f"Key{key.upper()}", ord(key.upper()) if text else 0))
        given = {"key": key, "code": name, "windowsVirtualKeyCode": number, "modifiers": 8 if shift else 0}
        for count in range(1 + repeats):
            self.call("Input.dispatchKeyEvent", type="keyDown", autoRepeat=count > 0, **({"text": text} if text else {}), **given)
        time.sleep(hold)
        self.call("Input.dispatchKeyEvent", type="keyUp", **given)

    def mouse(self, kind, x, y, shift=False, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, modifiers=8 if shift else 0, **more)

    def click(self, x, y):
        self.mouse("mousePressed", x, y, button="left", buttons=1, clickCount=1)
        self.mouse("mouseReleased", x, y, button="left", clickCount=1)

    def drag(self, start, end, shift=False):
        self.mouse("mousePressed", *start, shift=shift, button="left", buttons=1, clickCount=1)
        for step in range(1, 6):
            self.mouse("mouseMoved", *(one + (two - one) * step / 5 for one, two in zip(start, end)), shift=shift, button="left", buttons=1)
        self.mouse("mouseReleased", *end, shift=shift, button="left", clickCount=1)

    def picture(self, path):
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))
