# SPDX-License-Identifier: Apache-2.0
"""Every code block of the documentation that python.docs does not run.

  blocks_test.py SDMT SOURCE CXX INCLUDE...

C++ and C compile, between lines that say what is around them. Each command line of `sdmt` runs, page
by page, one after the other, on made-up people and scenes that stand in for the data sets and cameras
that the page names; of those in docs/training.md, which train for hours, the options must exist.
Other commands must name what is there. A block that nobody knows what to do with fails.
"""
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time

SDMT, SOURCE = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])
CXX, INCLUDES = sys.argv[3], sys.argv[4:]

# Languages of fenced blocks that others run: python.docs and package.*.
ELSEWHERE = {"python", "sh", "cmake"}
# What is around the blocks of C++ and C.
AROUND = {
    "cpp": """
#include <vector>
#include "sdmt/reid/embedder.h"
#include "sdmt/track/tracker.h"
using namespace sdmt;
struct Camera { bool read(image::ImageView& image); };
std::vector<mot::Detection> detect(const image::ImageView& image);
void show(const track::FinishedFrame& frame);
void block(Camera camera, image::ImageView image, std::vector<image::Crop> crops) {
%s
}
""",
    "c": """
#include <sdmt.h>
int fail(const sdmt_error* error);
void show(const sdmt_frame* frame);
int block(const sdmt_options* options, const sdmt_model* model, sdmt_error* error,
          const sdmt_detection* boxes, size_t count, sdmt_image image, double seconds);
int block(const sdmt_options* options, const sdmt_model* model, sdmt_error* error,
          const sdmt_detection* boxes, size_t count, sdmt_image image, double seconds) {
%s
  return 0;
}
"""}
BUILDS = {"cmake", "ctest", "gcovr"}  # with presets and options of this project
SYSTEM = {"chmod", "systemctl", "journalctl", "apt-get", "sudo", "npm", "pip", "podman", "dpkg", "for", "cp", "root=build-arm/sysroot"}
# Pictures, output and loops of other libraries: first words.
TEXTS = {"tools", "795", "find_package(sdmt", "import", "tracker"}


def blocks(text):
    """(language, block) of the fenced ones, ("", block) of the indented ones."""
    fence = re.compile(r"^```(\w*)\n(.*?)^```", re.M | re.S)
    yield from fence.findall(text)
    for block in re.findall(r"(?:\A|\n)\n((?:    .*\n)+(?:\n(?:    .*\n)+)*)", fence.sub("", text)):
        yield "", re.sub(r"^    ", "", block, flags=re.M)


def run(*words):
    return subprocess.run([str(w) for w in words], capture_output=True, text=True)


def must(*words):
    result = run(*words)
    assert result.returncode == 0, (words, result.stderr)


def stage():
    """What the pages' files and folders stand for, in the current folder."""
    must(SDMT, "synth", "scene", "--output", "INPUT", "--frames", "12", "--width", "240",
         "--height", "180")
    detections = pathlib.Path("INPUT/det/det.txt")
    for kind in ("frcnn", "frcnn17", "synthetic"):
        shutil.copy(detections, f"INPUT/det/det-{kind}.txt")
    shutil.copy(detections, "det.txt")
    for sequence in ("PETS09-S2L1", "MOT16-02", "SEQ", "mot15/PETS09-S2L1", "mot15/ETH-Sunnyday",
                     "mot15/KITTI-17", "mot15/TUD-Campus", "mot15/TUD-Stadtmitte", "mot16/MOT16-02",
                     "MOT16/train/MOT16-02", "DATA/mot15/PETS09-S2L1"):
        shutil.copytree("INPUT", sequence)
        info = pathlib.Path(sequence, "seqinfo.ini")
        info.write_text(re.sub("name=.*", f"name={pathlib.Path(sequence).name}", info.read_text()))
    must(SDMT, "track", "INPUT", "--no-appearance", "--output", "tracks.txt", "--render",
         "video.mp4", "--jsonl", "boxes.jsonl")
    for results in ("results", "my-results"):
        pathlib.Path(results).mkdir()
        for sequence in ("PETS09-S2L1", "MOT16-02"):
            shutil.copy("tracks.txt", f"{results}/{sequence}.txt")
    pathlib.Path("demo").mkdir()
    shutil.copy("tracks.txt", "demo/tracks.txt")
    shutil.copy("video.mp4", "hall.mp4")
    must(SDMT, "synth", "reid", "--output", "people", "--identities", "16")
    for data in ("DATA/cuhk03", "DATA/pku-reid", "cuhk03", "pku-reid", "DIR"):
        pathlib.Path(data).parent.mkdir(exist_ok=True)
        pathlib.Path(data).symlink_to(pathlib.Path("people").absolute())
    shutil.copy(SOURCE / "models/sdmt-lite.safetensors", "model.safetensors")
    pathlib.Path("models").symlink_to(SOURCE / "models")
    pathlib.Path("docs").symlink_to(SOURCE / "docs")
    shutil.copy(SOURCE / "docs/examples/zones.json", "zones.json")


# What runs here in the place of what a page says: cameras, networks of the user's own, hours.
STAND_INS = [
    (r"(rtsp://|camera:)\S*", "INPUT"),
    (r"\S+\.(onnx|cfg)(@\d+)?", "hog"),
    (r"/data/", "DATA/"),
    (r"\.\.\.", ""),
    (r"--detector-size \d+", ""),
    (r"--(rotate|serve|keep|mqtt|mqtt-[a-z-]+) \S+", ""),  # of cameras; tests/live
    (r"\S+ \| (sdmt track) - --detections - ", r"\1 INPUT "),
    (r"^mpirun .*?(sdmt)", r"\1"),  # tests/mpi
    (r"^srun .*?(sdmt)", r"\1"),
    (r"\$\(.*\)", ""),
]


failures = []


def run_sdmt(page, line):
    for pattern, instead in STAND_INS:
        line = re.sub(pattern, instead, line)
    words = line[line.index("sdmt"):].split(">")[0]
    words = shlex.split(words, comments=True)
    command = words[1]
    if page.name == "training.md":
        known = run(SDMT, *(words[1:3] if command == "synth" else words[1:2]), "--help").stdout
        unknown = [w for w in words
                   if w.startswith("--") and not re.search(rf"{w}(?![\w-])", known)]
        if unknown:
            failures.append(f"{page}: {line}\nsdmt {command} has no {' '.join(unknown)}")
        return
    if command == "ablate":
        words += ["--variants", "SORT"]
    if command in ("track", "ablate") and "--model" not in words:
        words += ["--model", "models/sdmt-lite.safetensors"]
    start = time.monotonic()
    result = subprocess.run(["bash", "-c", " ".join(words).replace("sdmt", str(SDMT), 1)],
                            capture_output=True, text=True,
                            env={**os.environ, "SDMT_SHARE_DIR": str(SOURCE)})
    print(f"{time.monotonic() - start:5.1f} s {page}: {' '.join(words)}", flush=True)
    if result.returncode != 0:
        failures.append(f"{page}: {' '.join(words)}\n{result.stdout[-500:]}{result.stderr[-1500:]}")


def check_command(page, line):
    """A command that is not sdmt's: 1 if it ran."""
    words = line.split()
    if words[0] == "sdmt" or " sdmt " in line and words[0] not in SYSTEM:
        run_sdmt(page, line)
        return 1
    if words[0] in BUILDS:
        for preset in re.findall(r"--preset (\w+)", line):
            presets = json.loads((SOURCE / "CMakePresets.json").read_text())
            assert preset in {p["name"] for p in presets["configurePresets"]}, (page, line)
        for option in re.findall(r"-D(SDMT_\w+)", line):
            assert option in (SOURCE / "CMakeLists.txt").read_text() + \
                (SOURCE / "cmake/aarch64-linux-gnu.cmake").read_text(), (page, line)
        return 0
    if words[0] in SYSTEM or "=" in words[0]:
        return 0
    program = SOURCE / words[0]
    if words[0].startswith("build/"):
        assert re.search(rf"\b{program.name}\b", (SOURCE / "bench/CMakeLists.txt").read_text() +
                         (SOURCE / "bench/peers/CMakeLists.txt").read_text()), (page, line)
    else:
        assert os.access(program, os.X_OK), f"{page}: {line}: there is no such program"
        text = program.read_text()
        for option in re.findall(r" (--[a-z][\w-]*)", line.split(" -- ")[0].split("#")[0]):
            assert option in text, f"{page}: {line}: no option {option}"
    return 0


def compiles(page, language, block):
    source = pathlib.Path(f"block.{language}")
    source.write_text(AROUND[language] % block)
    standard = ["-std=c++20"] if language == "cpp" else ["-x", "c", "-std=c99"]
    result = run(CXX, *standard, "-fsyntax-only", "-Wall", "-Wno-unused-variable",
                 *(f"-I{folder}" for folder in INCLUDES), source)
    assert result.returncode == 0, f"{page}: {block}\n{result.stderr}"


def check(page, language, block):
    if language in AROUND:
        compiles(page, language, block)
        return 0
    if language == "json":
        json.loads(block)
        return 0
    if language:
        assert language in ELSEWHERE, f"{page}: a block of {language}"
        return 0
    first = block.split()[0]
    if first in TEXTS:
        return 0
    if first.startswith("{"):
        json.loads(block)
        if '"layers"' in block:
            pathlib.Path("tiny.json").write_text(block)
            must(SDMT, "init-model", "--architecture", "tiny.json", "--output", "tiny.safetensors")
        return 0
    if first.startswith("#!"):
        syntax = subprocess.run(["bash", "-n"], input=block, text=True)
        assert syntax.returncode == 0, (page, block)
    lines = [re.sub(r"\s+#\s.*", "", line).strip()
             for line in block.replace("\\\n", " ").splitlines()]
    return sum(check_command(page, line) for line in lines if line and not line.startswith("#"))


def main():
    pages = [SOURCE / "README.md", SOURCE / "CONTRIBUTING.md", SOURCE / "models/README.md",
             *sorted((SOURCE / "docs").rglob("*.md"))]
    with tempfile.TemporaryDirectory(prefix="sdmt-docs-") as folder:
        os.chdir(folder)
        stage()
        site = (SOURCE / "mkdocs.yml").read_text()
        for page in pages[3:]:
            assert f" {page.relative_to(SOURCE / 'docs')}\n" in site, f"{page}: not in mkdocs.yml"
        total = ran = 0
        for page in pages:
            for language, block in blocks(page.read_text()):
                ran += check(page.relative_to(SOURCE), language, block)
                total += 1
        print(f"{total} blocks; {ran} command lines of sdmt ran here")
        os.chdir("/")
        assert ran > 50, "blocks are no longer found"
        if failures:
            raise SystemExit("\n".join(failures))


if __name__ == "__main__":
    main()
