# SPDX-License-Identifier: Apache-2.0
"""docs/examples/track_boxes.c by ctypes: track_boxes.py LIBSDMT DETECTIONS"""
import ctypes
import sys
from ctypes import POINTER, byref, c_char_p, c_double, c_int, c_size_t, c_void_p


class Box(ctypes.Structure):
    _fields_ = [(name, c_double) for name in ("left", "top", "width", "height")]


class Input(ctypes.Structure):
    _fields_ = [("size", c_size_t), ("detections", c_void_p), ("count", c_size_t),
                ("image", c_void_p), ("embeddings", c_void_p), ("dimension", c_size_t),
                ("time", POINTER(c_double))]


class Track(ctypes.Structure):
    _fields_ = [("id", c_int), ("source", c_int), ("box", Box), ("score", c_double)]


def load(path):
    library = ctypes.CDLL(path)
    for name, result, *arguments in (
            ("sdmt_error_new", c_void_p),
            ("sdmt_error_text", c_char_p, c_void_p),
            ("sdmt_detections_read", c_void_p, c_char_p, c_char_p, c_void_p),
            ("sdmt_detections_last_frame", c_int, c_void_p),
            ("sdmt_detections_have_scores", c_int, c_void_p),
            ("sdmt_detections_frame", c_void_p, c_void_p, c_int, POINTER(c_size_t)),
            ("sdmt_options_new", c_void_p, c_void_p),
            ("sdmt_options_set", c_int, c_void_p, c_char_p, c_char_p, c_void_p),
            ("sdmt_tracker_new", c_void_p, c_void_p, c_void_p, c_void_p),
            ("sdmt_tracker_update", c_int, c_void_p, POINTER(Input), c_void_p),
            ("sdmt_tracker_finish", c_int, c_void_p, c_void_p),
            ("sdmt_tracker_finished", c_size_t, c_void_p),
            ("sdmt_tracker_frame", c_void_p, c_void_p, c_size_t),
            ("sdmt_frame_number", c_int, c_void_p),
            ("sdmt_frame_tracks", POINTER(Track), c_void_p, POINTER(c_size_t))):
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


def main(library_path, detections_path):
    sdmt = load(library_path)
    error = sdmt.sdmt_error_new()

    def check(holds):
        if not holds:
            sys.exit(sdmt.sdmt_error_text(error).decode())

    def show():
        count = c_size_t()
        for i in range(sdmt.sdmt_tracker_finished(tracker)):
            frame = sdmt.sdmt_tracker_frame(tracker, i)
            tracks = sdmt.sdmt_frame_tracks(frame, byref(count))
            for person in tracks[:count.value]:
                box = person.box
                print("%d,%d,%.2f,%.2f,%.2f,%.2f,%.6g,-1,-1,-1" % (
                    sdmt.sdmt_frame_number(frame), person.id, box.left, box.top, box.width,
                    box.height, person.score))

    boxes = sdmt.sdmt_detections_read(detections_path.encode(), None, error)
    check(boxes)
    options = sdmt.sdmt_options_new(error)
    if not sdmt.sdmt_detections_have_scores(boxes):
        check(sdmt.sdmt_options_set(options, b"scores", b"false", error) == 0)
    tracker = sdmt.sdmt_tracker_new(options, None, error)
    check(tracker)
    for frame in range(1, sdmt.sdmt_detections_last_frame(boxes) + 1):
        count = c_size_t()
        detections = sdmt.sdmt_detections_frame(boxes, frame, byref(count))
        seen = Input(ctypes.sizeof(Input), detections, count, None, None, 0, None)
        check(sdmt.sdmt_tracker_update(tracker, byref(seen), error) == 0)
        show()
    check(sdmt.sdmt_tracker_finish(tracker, error) == 0)
    show()


if __name__ == "__main__":
    main(*sys.argv[1:])
