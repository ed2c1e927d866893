# SPDX-License-Identifier: Apache-2.0
from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Path = str | PathLike[str]
Option = bool | float | str
Config = Path | Mapping[str, Option] | Sequence["Config"]

__version__: str
DETECTED: int
BOOSTED: int
INTERPOLATED: int

class Model:
    def __init__(self, name: Path) -> None: ...
    @property
    def dimension(self) -> int: ...
    @property
    def tau_a(self) -> float | None: ...
    @property
    def path(self) -> str: ...

class FinishedFrame:
    @property
    def frame(self) -> int: ...
    @property
    def ids(self) -> NDArray[np.int32]: ...
    @property
    def boxes(self) -> NDArray[np.float64]: ...
    @property
    def xyxy(self) -> NDArray[np.float64]: ...
    @property
    def scores(self) -> NDArray[np.float64]: ...
    @property
    def sources(self) -> NDArray[np.int32]: ...
    @property
    def merges(self) -> NDArray[np.int32]: ...
    def __len__(self) -> int: ...

class Tracker:
    def __init__(
        self,
        model: Model | Path | None = None,
        *,
        embeddings: bool = False,
        order: Literal["bgr", "rgb"] = "bgr",
        config: Config | None = None,
        **options: Option,
    ) -> None: ...
    def update(
        self,
        boxes: ArrayLike,
        scores: ArrayLike | None = None,
        image: NDArray[np.uint8] | None = None,
        time: float | None = None,
        embeddings: ArrayLike | None = None,
        camera: ArrayLike | None = None,
    ) -> list[FinishedFrame]: ...
    def skip(
        self,
        image: NDArray[np.uint8] | None = None,
        time: float | None = None,
        camera: ArrayLike | None = None,
    ) -> list[FinishedFrame]: ...
    def save(self) -> bytes: ...
    def restore(self, snapshot: bytes) -> None: ...
    def update_xyxy(
        self,
        xyxy: ArrayLike,
        confidence: ArrayLike | None = None,
        class_id: ArrayLike | None = None,
        image: NDArray[np.uint8] | None = None,
        *,
        time: float | None = None,
        embeddings: ArrayLike | None = None,
        camera: ArrayLike | None = None,
        classes: Sequence[int] = (0,),
    ) -> list[FinishedFrame]: ...
    def finish(self) -> list[FinishedFrame]: ...
    def state(self) -> dict[str, Any]: ...

class CameraMotionEstimator:
    def __init__(self, *, order: Literal["bgr", "rgb"] = "bgr") -> None: ...
    def next(
        self, image: NDArray[np.uint8], boxes: ArrayLike = ()
    ) -> NDArray[np.float64] | None: ...

class Embedder:
    def __init__(
        self, model: Model | Path = "sdmt-lite", *, order: Literal["bgr", "rgb"] = "bgr"
    ) -> None: ...
    def embed(
        self, image: NDArray[np.uint8], boxes: ArrayLike
    ) -> tuple[NDArray[np.float32], NDArray[np.bool_]]: ...
    @property
    def dimension(self) -> int: ...
    @property
    def tau_a(self) -> float | None: ...

class Detections:
    def frame(self, frame: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
    def embeddings(self, frame: int) -> NDArray[np.float32] | None: ...
    @property
    def last_frame(self) -> int: ...
    @property
    def has_scores(self) -> bool: ...
    def __len__(self) -> int: ...

def tracker_options() -> list[dict[str, str]]: ...
def read_detections(
    path: Path,
    format: Literal["mot", "csv", "jsonl", "kitti", "coco", "yolo"] | None = None,
    *,
    classes: str | None = None,
    frame_offset: int = 0,
    width: int = 0,
    height: int = 0,
) -> Detections: ...
def read_results(path: Path) -> dict[str, NDArray[Any]]: ...
def read_ground_truth(path: Path) -> dict[str, NDArray[Any]]: ...
def write_results(path: Path, frames: Iterable[FinishedFrame]) -> None: ...
def find_sequences(path: str) -> list[tuple[str, str]]: ...
def evaluate(
    gt: Path,
    results: Path,
    *,
    benchmark: Literal["MOT15", "MOT16", "MOT17", "MOT20"] = "MOT16",
    compat: Literal["trackeval", "devkit"] = "trackeval",
    allow_missing: bool = False,
) -> dict[str, Any]: ...
def validate_roc(
    embeddings: ArrayLike,
    person_ids: ArrayLike,
    camera_ids: ArrayLike | None = None,
    *,
    pair_set: Literal["person-only", "cross-camera", "paper"] = "person-only",
    pairs: int = 0,
    seed: int = 1,
) -> dict[str, Any]: ...
def reid_metrics(
    query: ArrayLike,
    query_ids: ArrayLike,
    query_cameras: ArrayLike,
    gallery: ArrayLike,
    gallery_ids: ArrayLike,
    gallery_cameras: ArrayLike,
) -> dict[str, float] | None: ...
def train(
    data: Path | Sequence[Path],
    output: Path,
    *,
    architecture: Path | None = None,
    model: Path | None = None,
    trunk: Path | None = None,
    freeze_trunk: bool = False,
    unfreeze: str = "",
    validate: Path | Sequence[Path] = (),
    holdout_ids: int = 0,
    unlabelled: Path | Sequence[Path] = (),
    teacher: Path | Sequence[Path] = (),
    storage: Literal["float32", "float16", "int8"] = "float32",
    checkpoint: Path | None = None,
    checkpoint_every: int | None = None,
    resume: Path | None = None,
    progress: Callable[[dict[str, Any]], object] | None = None,
    config: Config | None = None,
    **options: Option,
) -> dict[str, Any]: ...
def tune(
    sequences: Path | Sequence[Path],
    options: Mapping[str, Iterable[Option]],
    *,
    output: Path | None = None,
    state: Path | None = None,
    settings: int = 200,
    draws: int = 4,
    drop: float = 0.02,
    seed: int = 1,
    model: Model | Path | None = None,
    progress: Callable[[int, int], object] | None = None,
    config: Config | None = None,
    **base_options: Option,
) -> dict[str, Any]: ...
def set_num_threads(threads: int) -> None: ...
