"""Builds the wheel of the Python module: CMake makes the extension, the rest is a zip file (PEP 517, PEP 427).

Nothing but Python and CMake is needed for that, so that no build system has to be installed or pinned. Settings, given as
`python3 -m build --config-setting=NAME=VALUE`: `build-dir`, the CMake folder (default: build beside the sources, as
scripts/test has it); `jobs`, compilers at a time.
"""

import base64
import csv
import hashlib
import io
import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import zipfile

root = pathlib.Path(__file__).resolve().parents[2]

# What the extension is built from, and what CMake wants to see of the rest.
SOURCES = ["CMakeLists.txt", "LICENSE", "README.md", "apps", "cmake", "config", "python", "src"]


def cmake_project():
    """Version, home page and summary, which CMakeLists.txt has."""
    text = (root / "CMakeLists.txt").read_text()
    found = [re.search(pattern, text) for pattern in (r"project\(pade VERSION ([0-9.]+)", r'HOMEPAGE_URL "(.*)"', r'DESCRIPTION "(.*)"')]
    if None in found:
        sys.exit(f"{root}/CMakeLists.txt: found no VERSION, HOMEPAGE_URL or DESCRIPTION, expected them in project()")
    return [match.group(1) for match in found]


def metadata():
    version, homepage, summary = cmake_project()
    return (
        f"Metadata-Version: 2.1\nName: pade\nVersion: {version}\nSummary: {summary}\nHome-page: {homepage}\n"
        "License: BSD-3-Clause\nRequires-Python: >=3.9\nRequires-Dist: numpy<2\n"
        "Description-Content-Type: text/markdown\n\n"
        "Obstacle mapping from one camera and a GPS/INS: flow, metric depth with its uncertainty, a 3-D map.\n"
        "The wheel uses the system's OpenCV, OctoMap, GeographicLib, yaml-cpp and fmt: docs/python.md names the packages.\n"
    )


def tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{re.sub('[-.]', '_', sysconfig.get_platform())}"


def extension():
    return "_pade" + sysconfig.get_config_var("EXT_SUFFIX")


def make_extension(settings):
    """The package as CMake leaves it."""
    folder = pathlib.Path((settings or {}).get("build-dir", root / "build")).resolve()
    jobs = str((settings or {}).get("jobs", os.cpu_count() or 1))
    configure = ["cmake", "-S", root, "-B", folder, "-DPADE_BUILD_PYTHON=ON", f"-DPython_EXECUTABLE={sys.executable}"]
    if not (folder / "CMakeCache.txt").exists():
        configure += ["-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_UNITY_BUILD=ON", "-DPADE_BUILD_TESTS=OFF"]
        if shutil.which("ninja"):
            configure += ["-G", "Ninja"]
    for command in (configure, ["cmake", "--build", folder, "-j", jobs, "--target", "pade_python"]):
        print("+", *command, flush=True)
        if subprocess.run(command).returncode != 0:
            sys.exit(f"{command[0]} failed: see its output above")
    package = folder / "python" / "pade"
    if not (package / extension()).exists():
        sys.exit(f"{package}: found no {extension()}; {folder} was configured for another Python: choose another build-dir")
    return package


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    package = make_extension(config_settings)
    version = cmake_project()[0]
    files = {f"pade/{name}": (package / name).read_bytes() for name in ("__init__.py", "_pade.pyi", "py.typed", extension())}
    info = f"pade-{version}.dist-info"
    files[f"{info}/METADATA"] = metadata().encode()
    files[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: pade_build\nRoot-Is-Purelib: false\nTag: {tag()}\n".encode()
    files[f"{info}/LICENSE"] = (root / "LICENSE").read_bytes()
    record = io.StringIO()
    rows = csv.writer(record, lineterminator="\n")
    for name, content in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        rows.writerow([name, f"sha256={digest}", len(content)])
    rows.writerow([f"{info}/RECORD", "", ""])
    files[f"{info}/RECORD"] = record.getvalue().encode()

    wheel = f"pade-{version}-{tag()}.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name)  # of 1980: the same content is the same file
            entry.external_attr = (0o755 if name.endswith(".so") else 0o644) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    return wheel


def build_sdist(sdist_directory, config_settings=None):
    """The sources of library, program and module; its pyproject.toml lies at the top."""
    version = cmake_project()[0]
    top = f"pade-{version}"

    def wanted(entry):
        skip = "/__pycache__" in entry.name or entry.name.endswith(".pyc")
        entry.uid = entry.gid = entry.mtime = 0
        entry.uname = entry.gname = ""
        return None if skip else entry

    name = f"{top}.tar.gz"
    with tarfile.open(pathlib.Path(sdist_directory) / name, "w:gz", format=tarfile.PAX_FORMAT) as archive:
        for source in SOURCES:
            if (root / source).exists():
                archive.add(root / source, f"{top}/{source}", filter=wanted)
        project = (root / "python" / "pyproject.toml").read_text()
        project = project.replace('backend-path = ["backend"]', 'backend-path = ["python/backend"]')
        for path, text in (("pyproject.toml", project), ("PKG-INFO", metadata())):
            entry = tarfile.TarInfo(f"{top}/{path}")
            entry.size = len(text.encode())
            archive.addfile(entry, io.BytesIO(text.encode()))
    return name
