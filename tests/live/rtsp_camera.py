# SPDX-License-Identifier: Apache-2.0
"""A camera on this machine that speaks RTSP, with H.264 as cameras send it: GStreamer's server, in a
process of its own, which may be stopped, killed and started again. Its Python is the system's.

    rtsp_camera.py PORT FOLDER RATE      shows the JPEG pictures of FOLDER (000001.jpg, ...) for ever
"""
import signal
import socket
import subprocess
import sys
import threading

from ports import wait_for_port

PYTHON = "/usr/bin/python3"


def missing():
    """What is not installed, or nothing."""
    try:
        tried = subprocess.run([PYTHON, __file__], capture_output=True, text=True)
    except OSError as error:
        return str(error)
    return tried.stderr.strip().split("\n")[-1] if tried.returncode else ""


class RtspCamera:
    def __init__(self, port, folder, rate):
        self.port, self.folder, self.rate, self.process = port, folder, rate, None
        self.url = f"rtsp://127.0.0.1:{port}/video"

    def start(self, folder=None):
        self.folder = folder or self.folder
        self.process = subprocess.Popen(
            [PYTHON, __file__, str(self.port), str(self.folder), str(self.rate)],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wait_for_port(self.port, self.process)

    def stall(self):
        self.process.send_signal(signal.SIGSTOP)

    def go_on(self):
        self.process.send_signal(signal.SIGCONT)

    def die(self):
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            self.process = None


class BadWire:
    """Hands on what a server sends, with `spoilt` of its pieces overwritten in the middle."""

    def __init__(self, port, dice):
        self.behind, self.dice, self.spoilt = port, dice, 0.0
        self.server = socket.create_server(("127.0.0.1", 0))
        self.port = self.server.getsockname()[1]
        threading.Thread(target=self.serve, daemon=True).start()

    def serve(self):
        while True:
            try:
                caller = self.server.accept()[0]
                camera = socket.create_connection(("127.0.0.1", self.behind))
            except OSError:
                return
            for a, b, wire in (caller, camera, False), (camera, caller, True):
                threading.Thread(target=self.hand_on, args=(a, b, wire), daemon=True).start()

    def hand_on(self, a, b, spoil):
        try:
            while piece := a.recv(4096):
                if spoil and len(piece) > 400 and self.dice.random() < self.spoilt:
                    at = self.dice.randrange(100, len(piece) - 300)
                    piece = piece[:at] + self.dice.randbytes(200) + piece[at + 200:]
                b.sendall(piece)
        except OSError:
            pass
        for end in a, b:
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def close(self):
        self.server.close()


def main(words):
    import gi
    gi.require_version("Gst", "1.0")
    gi.require_version("GstRtspServer", "1.0")
    from gi.repository import GLib, Gst, GstRtspServer
    Gst.init(None)
    absent = [name for name in ("multifilesrc", "jpegdec", "x264enc", "rtph264pay")
              if Gst.ElementFactory.find(name) is None]
    if absent:
        raise SystemExit("GStreamer has no " + ", ".join(absent))
    if not words:
        return
    port, folder, rate = words
    server, factory = GstRtspServer.RTSPServer(), GstRtspServer.RTSPMediaFactory()
    server.set_address("127.0.0.1")
    server.set_service(port)
    factory.set_shared(True)
    factory.set_launch(
        f"( multifilesrc location={folder}/%06d.jpg start-index=1 loop=true "
        f"caps=image/jpeg,framerate={rate}/1 ! jpegdec ! videoconvert ! video/x-raw,format=I420 ! "
        "x264enc tune=zerolatency speed-preset=ultrafast key-int-max=15 ! "
        "rtph264pay config-interval=-1 name=pay0 pt=96 )")
    server.get_mount_points().add_factory("/video", factory)
    server.attach(None)
    GLib.MainLoop().run()


if __name__ == "__main__":
    main(sys.argv[1:])
