# SPDX-License-Identifier: Apache-2.0
"""Builds the Python module with CMake, with the shipped models and presets and the libraries that
not every system has. SDMT_WHEEL_TRAIN=1 adds sdmt.train and sdmt.tune, which then need the system's
OpenCV."""
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).absolute().parent
VERSION = re.search(r"project\(sdmt VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
BUNDLED = re.compile(r"(libhwy|libgomp)\.so")


class CMakeBuild(build_ext):
    def build_extension(self, extension):
        build = ROOT / "build-wheel"
        package = Path(self.get_ext_fullpath(extension.name)).parent.absolute()
        options = {
            "CMAKE_BUILD_TYPE": "Release", "CMAKE_INSTALL_RPATH": "$ORIGIN",
            "Python_EXECUTABLE": sys.executable, "SDMT_PYTHON_DIR": "python",
            "SDMT_BUILD_TRAIN": os.environ.get("SDMT_WHEEL_TRAIN", "0"),
            **{f"SDMT_BUILD_{part}": "OFF" for part in ("C", "TOOLS", "PIPELINE", "TESTS")}}
        try:
            import pybind11
            options["pybind11_DIR"] = pybind11.get_cmake_dir()
        except ImportError:
            pass  # Debian's pybind11-dev, where CMake finds it
        # CMAKE_ARGS and CMAKE_GENERATOR as everywhere.
        subprocess.run(["cmake", "-S", ROOT, "-B", build,
                        *(f"-D{name}={value}" for name, value in options.items()),
                        *os.environ.get("CMAKE_ARGS", "").split()], check=True)
        jobs = os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL", str(os.cpu_count()))
        subprocess.run(["cmake", "--build", build, "--parallel", jobs], check=True)
        subprocess.run(["cmake", "--install", build, "--prefix", build / "install", "--strip",
                        "--component", "python3-sdmt"], check=True)
        package.mkdir(parents=True, exist_ok=True)
        modules = list((build / "install/python/sdmt").glob("*.so"))
        if not modules:
            raise RuntimeError("CMake found no pybind11 or Python headers: no module was built")
        for module in modules:
            shutil.copy2(module, package)
        needed = subprocess.run(["ldd", modules[0]], check=True, capture_output=True, text=True)
        for name, path in re.findall(r"(\S+) => (/\S+)", needed.stdout):
            if BUNDLED.match(name):
                shutil.copy2(path, package / name)
        for folder, pattern in (("models", "*.safetensors"), ("models", "README.md"),
                                ("configs", "*.json")):
            (package / folder).mkdir(exist_ok=True)
            for file in (ROOT / folder).glob(pattern):
                shutil.copy2(file, package / folder)


setup(version=VERSION, packages=["sdmt"], package_dir={"": "python"},
      package_data={"sdmt": ["py.typed", "*.pyi"]},
      ext_modules=[Extension("sdmt._sdmt", [])], cmdclass={"build_ext": CMakeBuild})
