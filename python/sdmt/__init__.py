# SPDX-License-Identifier: Apache-2.0
"""Deep similarity metric learning for real-time pedestrian tracking.

    tracker = sdmt.Tracker(model="sdmt-lite")
    for image in camera:
        for frame in tracker.update(*detect(image), image=image):
            show(frame.frame, frame.ids, frame.boxes)
    for frame in tracker.finish():
        show(frame.frame, frame.ids, frame.boxes)

Boxes are left, top, width and height in pixels, the first pixel is 1, as in MOTChallenge's files.
What is wrong with an argument or a file raises ValueError, what fails while running RuntimeError;
the message names field, value and what was expected.

DETECTED, BOOSTED and INTERPOLATED (0, 1, 2) say in FinishedFrame.sources where a box comes from: a
detection, a search by appearance where the detector missed somebody, or the boxes before and after.
"""
import json as _json
import os as _os
import sys as _sys
from pathlib import Path as _Path

from . import _sdmt
from ._sdmt import (BOOSTED, DETECTED, INTERPOLATED, CameraMotionEstimator, Detections,
                    FinishedFrame, __version__, find_sequences, reid_metrics, validate_roc)

__all__ = ["BOOSTED", "DETECTED", "INTERPOLATED", "CameraMotionEstimator", "Detections", "Embedder",
           "FinishedFrame", "Model", "Tracker", "evaluate", "find_sequences", "read_detections",
           "read_ground_truth", "read_results", "reid_metrics", "set_num_threads", "train",
           "tracker_options", "tune", "validate_roc", "write_results"]


def _shipped(folder, name, suffix):
    """The file `name`, or the one shipped under that name."""
    name = _os.fspath(name)
    if _os.path.exists(name) or _os.path.dirname(name):
        return name
    places = [_Path(__file__).parent, _Path(_sys.prefix) / "share/sdmt",
              _Path("/usr/local/share/sdmt"), _Path("/usr/share/sdmt")]
    if _os.environ.get("SDMT_SHARE_DIR"):
        places = [_Path(_os.environ["SDMT_SHARE_DIR"])]
    tried = [place / folder / (name if name.endswith(suffix) else name + suffix)
             for place in places]
    for path in tried:
        if path.is_file():
            return str(path)
    raise ValueError(f"{name}: no such file (tried {', '.join(map(str, tried))})")


def _option(name):
    """An option as the command line names it: lambda_ is lambda, min_iou is min-iou."""
    return name.rstrip("_").replace("_", "-")


def _text(value):
    return str(value).lower() if isinstance(value, bool) else str(value)


def _texts(options):
    """Options as the command line writes them."""
    return {_option(name): _text(value) for name, value in options.items()}


def _config(config):
    if config is None or isinstance(config, dict):
        return _texts(config or {})
    if isinstance(config, (str, _os.PathLike)):
        with open(_shipped("configs", config, ".json"), encoding="utf-8") as file:
            return _texts(_json.load(file))
    return {name: text for part in config for name, text in _config(part).items()}


def _paths(paths):
    """One path or several as a list of texts."""
    several = not isinstance(paths, (str, _os.PathLike))
    return [_os.fspath(path) for path in (paths if several else [paths])]


class Model(_sdmt._Model):
    """A network that tells people apart. Any number of trackers, embedders and threads share one.

    name: a model file, or a shipped one by its name: "sdmt-lite", "sdmt-vgg16" (the paper's).
    Raises ValueError for a file that is missing or no model.
    """

    def __init__(self, name):
        super().__init__(_model_file(name))


def _model_file(name):
    return _shipped("models", name, ".safetensors")


def _model(model):
    return model if model is None or isinstance(model, Model) else Model(model)


class Tracker(_sdmt._Tracker):
    """The tracker: boxes of a frame in, finished frames out.

    model: what tells people apart, a Model or what Model() takes; None: by motion alone.
    embeddings: True: people are told apart by vectors that update() gets with the boxes; needs
        tau_a, the threshold of the network that makes them.
    order: of the channels of images, "bgr" as OpenCV has it, or "rgb".
    config: a JSON file of options, the name of a shipped one ("track-paper"), a dictionary, or a
        list of these, the later wins.
    options: those of `sdmt track` with underscores, see tracker_options(): min_iou=0.3,
        delay=0, association=False; lambda_ for lambda.

    Raises ValueError naming option, value and range. A tracker may be used by several threads,
    which take turns; it lets other Python threads run while it works. The same calls give the same
    output as `sdmt track`, whatever the number of threads.
    """

    def __init__(self, model=None, *, embeddings=False, order="bgr", config=None, **options):
        super().__init__(_model(model), embeddings, order, {**_config(config), **_texts(options)})

    def update_xyxy(self, xyxy, confidence=None, class_id=None, image=None, *, time=None,
                    embeddings=None, camera=None, classes=(0,)):
        """update() for boxes as detectors and `supervision` have them.

        xyxy: (n, 4) left, top, right, bottom; the first pixel begins at 0.
        confidence: (n,) probabilities, or None.
        class_id: (n,) whole numbers, or None; boxes of other classes than `classes` are left out.
            The default is COCO's 0, people.
        image, time, embeddings, camera: as update()'s.

            tracker.update_xyxy(found.xyxy, found.confidence, found.class_id, image)

        Returns and raises as update(); the frames' xyxy are corners that count from 0 again.
        """
        import numpy as np

        corners = np.asarray(xyxy, float).reshape(-1, 4)
        boxes = np.empty_like(corners)
        boxes[:, :2] = corners[:, :2] + 1
        boxes[:, 2:] = corners[:, 2:] - corners[:, :2]
        if class_id is not None:
            wanted = np.isin(class_id, classes)
            boxes = boxes[wanted]
            confidence = None if confidence is None else np.asarray(confidence)[wanted]
            embeddings = None if embeddings is None else np.asarray(embeddings)[wanted]
        return self.update(boxes, confidence, image, time, embeddings, camera)


class Embedder(_sdmt._Embedder):
    """Turns boxes of images into vectors that tell people apart.

    model: a Model or what Model() takes. order: of the channels, "bgr" or "rgb".
    """

    def __init__(self, model="sdmt-lite", *, order="bgr"):
        super().__init__(_model(model), order)


def tracker_options():
    """Every option of the tracker: a list of dictionaries with name, group, help, takes (a range,
    words or bool) and default, as text."""
    return _sdmt.tracker_options()


def read_detections(path, format=None, *, classes=None, frame_offset=0, width=0, height=0):
    """Boxes in anybody's format, as Detections.

    format: "mot", "csv", "jsonl", "kitti", "coco", "yolo" or None, which finds it out.
    classes: names and numbers, "person,3", or "all"; None: people, where a format has classes.
    frame_offset: added to every frame number. width, height: of the picture, for yolo.
    Raises ValueError naming file, line, value and what was expected.
    """
    return _sdmt.read_detections(_os.fspath(path), format, classes, frame_offset, width, height)


def read_results(path):
    """Result rows of MOTChallenge: a dictionary of arrays frame, id, boxes (n, 4), confidence."""
    return _sdmt.read_results(_os.fspath(path))


def read_ground_truth(path):
    """Ground truth of MOTChallenge: a dictionary of arrays frame, id, boxes (n, 4), keep, category,
    visibility."""
    return _sdmt.read_ground_truth(_os.fspath(path))


def write_results(path, frames):
    """Writes finished frames as MOTChallenge result rows, the bytes of `sdmt track --output`. The
    file appears whole or not at all."""
    _sdmt.write_results(_os.fspath(path), list(frames))


def evaluate(gt, results, *, benchmark="MOT16", compat="trackeval", allow_missing=False):
    """Scores tracks: HOTA, CLEAR MOT and Identity, to the digit of the benchmark's evaluator.

    gt: a sequence folder with gt/gt.txt, or a folder of such.
    results: a file of result rows (one sequence), or a folder with a NAME.txt for each.
    benchmark: whose rules, "MOT15", "MOT16", "MOT17" or "MOT20".
    compat: counts as "trackeval", or as the "devkit" of papers up to 2020.
    allow_missing: a sequence without results is scored as if nothing had been found.

    Returns {"sequences": {name: scores}, "combined": scores}, scores under TrackEval's names
    ("HOTA", "MOTA", "IDF1", "IDSW", ...), ratios as fractions, and "per_alpha" with an array of 19
    values each. Raises ValueError for what is missing or malformed.
    """
    results = _Path(results)
    sequences = find_sequences(_os.fspath(gt))
    scores = {}
    for name, folder in sequences:
        file = results / f"{name}.txt" if results.is_dir() else results
        if not results.is_dir() and len(sequences) > 1:
            raise ValueError(f"{results}: one file for {len(sequences)} sequences, expected a "
                             "folder with a NAME.txt for each")
        if not file.is_file() and not allow_missing:
            raise ValueError(f"sequence {name} has no results: no such file {file} "
                             "(allow_missing=True scores it as empty)")
        scores[name] = _sdmt.score(folder, str(file) if file.is_file() else "", benchmark, compat)
    combined = _sdmt.combine(list(scores.values()), compat)
    return {"sequences": {name: score.fields() for name, score in scores.items()},
            "combined": combined.fields()}


def train(data, output, *, architecture=None, model=None, trunk=None, freeze_trunk=False,
          unfreeze="", validate=(), holdout_ids=0, unlabelled=(), teacher=(), storage="float32",
          checkpoint=None, checkpoint_every=None, resume=None, progress=None, config=None, **options):
    """Trains an embedding network as `sdmt train-embedder` does and writes the model file `output`.

    data: a data set in Market-1501's layout or a folder of its images, or several of them.
    architecture: "vgg16" (the default), "lite" or a JSON file; model: a model file to go on from.
    trunk: pre-trained weights; freeze_trunk: train the head only; unfreeze: first layer to train.
    validate: data sets to validate on; holdout_ids: people of each data set kept out for it.
    unlabelled: folders of images without identities; teacher: files of vectors of another network.
    checkpoint: written every checkpoint_every (1000) iterations and when the training is interrupted;
    resume: a checkpoint to go on from.
    progress: called after every iteration with a dictionary: iteration, loss, learning_rate,
        validation_auc ({set: AUC}, or None when not validated), warning, ...
    config, options: as Tracker's, those of `sdmt train-embedder`: iterations=3000, seed=0, ...

    Returns a dictionary: iterations, loss, images, people, unreadable, best_iteration, best_auc.
    Raises ValueError for data and options, RuntimeError for what cannot be written.
    """
    try:
        from . import _train
    except ImportError as missing:
        raise RuntimeError(f"this build of sdmt cannot train: {missing}") from missing
    texts = {**_config(config), **_texts(options)}
    told = {name: texts.pop(name, "") for name in
            ("architecture", "freeze-trunk", "unfreeze", "holdout-ids", "checkpoint-every")}
    architecture = architecture or told["architecture"] or "vgg16"
    freeze_trunk = freeze_trunk or told["freeze-trunk"] == "true"
    unfreeze = unfreeze or told["unfreeze"]
    holdout_ids = holdout_ids or int(told["holdout-ids"] or 0)
    checkpoint_every = checkpoint_every or int(told["checkpoint-every"] or 1000)
    return _train.train(_paths(data), _paths(unlabelled), _paths(teacher), _paths(validate),
                        holdout_ids, _os.fspath(output), _os.fspath(model or ""),
                        _os.fspath(architecture), _os.fspath(trunk or ""), unfreeze, freeze_trunk,
                        storage, _os.fspath(checkpoint or ""), checkpoint_every,
                        _os.fspath(resume or ""), texts, progress)


def tune(sequences, options, *, output=None, state=None, settings=200, draws=4, drop=0.02, seed=1,
         model=None, progress=None, config=None, **base_options):
    """Chooses options of the tracker on sequences with ground truth, as `sdmt tune` does, and says
    what the choice brings on others: each sequence is tracked with what is best on all other ones.

    sequences: "DIR", "DIR=FILE" or "DIR=FILE@CALIBRATION", or a list of these, of two sequences at
        least. DIR: a MOTChallenge sequence or a folder of them; FILE: detections in det/, det.txt
        by default; CALIBRATION: how their scores are read, as the option calibration.
    options: a dictionary of options with the values to try, {"min_iou": [0.2, 0.3], ...}, named as
        Tracker's.
    output: a file for the chosen options, JSON as config takes it.
    state: a file that keeps the runs that are done; the same call goes on from it, also after
        Ctrl-C and when progress has thrown.
    settings: the most settings to run, 1..100000; of more combinations so many are drawn.
    draws: runs of a setting over a sequence, 1..1000, the first with all boxes, the others with the
        share `drop` (0..0.9) of them left out. seed: of the draws.
    model: what tells people apart, a Model or what Model() takes: boxes are then embedded once, on
        the sequences' frames, and Ctrl-C is the only thing heard meanwhile. None: by motion alone.
    progress: called as progress(done, total) after each run, by any thread, one at a time.
    config, base_options: as Tracker's, the base that is compared with.

    Returns the dictionary of `sdmt tune --json` and "preset", a dictionary for Tracker(config=...).
    "base", "in_sample" (the best on all), "held_out" (the best on the others) and "bytetrack" have
    means over sequences and draws, "mota" and "idf1", of all boxes together "pooled_mota" and
    "pooled_idf1", and what they gain over the base with its standard error over sequences,
    "gain_mota" and "gain_mota_error", "gain_idf1" and "gain_idf1_error": fractions. "chosen":
    {option: value}; "options": what trying each is worth; "by_sequence": scores and choices of
    each. It is the same for any number of threads and interruptions.
    Raises ValueError for sequences, options and the state of another call, RuntimeError for what
    cannot be written.
    """
    try:
        from . import _tuning
    except ImportError as missing:
        raise RuntimeError(f"this build of sdmt cannot tune: {missing}") from missing
    tuned = [(_option(name), [_text(value) for value in values])
             for name, values in options.items()]
    if isinstance(model, Model):
        model = model.path
    elif model is not None:
        model = _model_file(model)
    found, preset = _tuning.tune(_paths(sequences), tuned,
                                 {**_config(config), **_texts(base_options)}, model or "", settings,
                                 draws, drop, seed, _os.fspath(output or ""),
                                 _os.fspath(state or ""), progress)
    return {**_json.loads(found), "preset": _json.loads(preset)}


def set_num_threads(threads):
    """Threads that embedding, training and tuning use from now on when called by this Python thread,
    1..1024. Results do not depend on it."""
    _sdmt.set_num_threads(threads)
