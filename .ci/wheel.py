"""Build a wheel, and the sources that it is built from: ``python .ci/wheel.py dist``.

Needs maturin, on Linux with ziglang, which links with the C library of 2014. On x86-64 the core is
compiled twice: for every processor, and for those since 2013 (x86-64-v3), which `pamrs` loads
where it can (docs/decisions/0112).
"""

import os
import platform
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "python" / "pamrs"
LINUX = ["--zig", "--compatibility", "manylinux2014"] if sys.platform == "linux" else []


def build(out: Path, flags: str = "") -> Path:
    """A wheel in a folder, compiled with some flags."""
    command = [sys.executable, "-m", "maturin", "build", "--release", "--locked", *LINUX]
    environment = os.environ | {"RUSTFLAGS": flags}
    subprocess.run([*command, "--out", out], cwd=ROOT, env=environment, check=True)
    (wheel,) = out.glob("*.whl")
    return wheel


def main(dist: Path) -> None:
    """The wheel with its second core where there is one, and the sources."""
    second = PACKAGE / "_core_v3.none"
    try:
        if platform.machine().lower() in ("x86_64", "amd64"):
            with tempfile.TemporaryDirectory() as place:
                wheel = build(Path(place), "-C target-cpu=x86-64-v3")
                with zipfile.ZipFile(wheel) as files:
                    names = files.namelist()
                    (name,) = (n for n in names if n in ("pamrs/_core.abi3.so", "pamrs/_core.pyd"))
                    second = PACKAGE / Path(name).name.replace("_core", "_core_v3", 1)
                    second.write_bytes(files.read(name))
        sdist = [sys.executable, "-m", "maturin", "sdist", "--out", dist]
        subprocess.run(sdist, cwd=ROOT, check=True)
        build(dist)
    finally:
        second.unlink(missing_ok=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
