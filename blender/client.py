"""HTTP to a motionloom server, and the process of one. Only the standard library."""

import atexit
import json
import shutil
import subprocess
import tempfile
import time
import urllib.error
import urllib.parse
import urllib.request


class Problem(Exception):
    """What went wrong, in one sentence for the user."""


class Client:
    """A server at an address.

    address: such as http://127.0.0.1:8020. token: what it asks for, or empty. patience: seconds to wait for an answer.
    """

    def __init__(self, address, token="", patience=60.0):
        self.address, self.token, self.patience = address.rstrip("/"), token, patience

    def ask(self, method, path, body=None):
        """The bytes of the answer; body: bytes, or what becomes JSON. Raises `Problem`."""
        data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
        headers = {"X-Client": "blender"}
        if data is not None:
            headers["Content-Type"] = "application/octet-stream" if isinstance(body, bytes) else "application/json"
        if self.token:
            headers["Authorization"] = f"Bearer {self.token}"
        request = urllib.request.Request(self.address + path, data=data, headers=headers, method=method)
        try:
            with _OPENER.open(request, timeout=self.patience) as answer:
                return answer.read()
        except urllib.error.HTTPError as error:
            raise Problem(_sentence(error)) from None
        except (OSError, ValueError) as error:
            reason = getattr(error, "reason", error)
            raise Problem(
                f"No motionloom server answers at {self.address} ({reason}): start it in the panel, or name another "
                "address in the add-on's preferences"
            ) from None

    def json(self, method, path, body=None):
        """The answer as JSON."""
        try:
            return json.loads(self.ask(method, path, body))
        except ValueError:
            raise Problem(f"What answers at {self.address} is no motionloom server: it sent no JSON") from None

    def send(self, kind, name, data):
        """What the server says of a file that it was sent: ``kind`` is characters or motions."""
        return self.json("POST", f"/{kind}?name={urllib.parse.quote(name)}", data)


_OPENER = urllib.request.build_opener(urllib.request.ProxyHandler({}))
"""A proxy of the environment is for the internet, not for a server that the user names."""


def _sentence(error):
    try:
        return str(json.loads(error.read())["error"])
    except (ValueError, KeyError, TypeError, OSError):
        return f"The server answered {error.code} {error.reason}"


class Process:
    """The server that this Blender started, if it did."""

    def __init__(self):
        self.process = self.said = None

    @property
    def running(self):
        """Whether it was started and did not end."""
        return self.process is not None and self.process.poll() is None

    def start(self, command, client, folder):
        """Start `motionloom serve` for the client's address, with its projects in a folder. Raises `Problem`."""
        try:
            client.json("GET", "/health")
        except Problem:
            pass
        else:
            raise Problem(f"A server answers at {client.address} already: there is none to start")
        place = urllib.parse.urlsplit(client.address)
        if place.hostname not in ("127.0.0.1", "localhost", "::1"):
            raise Problem(f"{client.address} is on another computer: start it there, with 'motionloom serve --host'")
        program = shutil.which(command)
        if program is None:
            raise Problem(
                f"There is no program {command!r}: install it (pip install 'motionloom[studio]') and write where it is "
                "in the add-on's preferences"
            )
        words = [program, "serve", "--port", str(place.port or 80), "--project", folder]
        words += ["--token", client.token] if client.token else []
        # A pipe that nobody reads would fill and stop it; the file is gone with the process.
        self.said = tempfile.TemporaryFile()  # noqa: SIM115
        try:
            self.process = subprocess.Popen(
                words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self.said
            )
        except OSError as error:
            raise Problem(f"{program} does not start: {error.strerror}") from None

    def wait(self, client, seconds=60.0):
        """Until it answers. Raises `Problem` where it ended, or took longer."""
        for _ in range(int(seconds * 5)):
            if not self.running:
                self.said.seek(0)
                said = self.said.read().decode(errors="replace").strip().splitlines()
                raise Problem(said[-1] if said else "The server ended at once and said nothing")
            try:
                client.json("GET", "/health")
                return
            except Problem:
                time.sleep(0.2)
        raise Problem(f"The server does not answer after {seconds:g} s; see what 'motionloom serve' says in a terminal")

    def stop(self):
        """End it, if this Blender started it."""
        if self.running:
            self.process.terminate()
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self.process = None


SERVER = Process()
atexit.register(SERVER.stop)
