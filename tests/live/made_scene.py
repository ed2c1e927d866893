# SPDX-License-Identifier: Apache-2.0
"""A made scene that a camera shows again and again."""
import subprocess


def make_scene(sdmt, folder, frames, walkers, size, shown):
    """Makes a scene in `folder`; returns its pictures, JPEG, and leaves in `folder`/det.txt the boxes
    of the people for the frames of a camera that shows them `shown` times."""
    scene = folder / "scene"
    width, height = map(str, size)
    subprocess.run([sdmt, "synth", "scene", "--output", scene, "--frames", str(frames), "--walkers",
                    str(walkers), "--width", width, "--height", height], check=True,
                   capture_output=True)
    rows = [row.split(",", 1) for row in (scene / "det/det.txt").read_text().split()]
    (folder / "det.txt").write_text("".join(
        f"{int(frame) + frames * turn},{rest}\n" for turn in range(shown) for frame, rest in rows))
    return [file.read_bytes() for file in sorted((scene / "img1").iterdir())]
