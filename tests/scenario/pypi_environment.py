"""A virtual environment of pinned packages from PyPI, made once in a build tree."""
import fcntl
import hashlib
import os
import pathlib
import platform
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77
LIMIT_S = 150  # for all packages, which take 10 to 70 s
PINNED_FOR = ("CPython", "3.11", "Linux", "x86_64")


def skip(why):
    print(f"skipped: {why}")
    sys.exit(SKIPPED)


def pip(python, *arguments, limit_s):
    return subprocess.run([python, "-m", "pip", "--disable-pip-version-check", "--no-input", *map(str, arguments)], text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=limit_s)


def reachable(python):
    """Whether pip's index (PyPI or a mirror) delivers anything: pip itself, of any version."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            return pip(python, "download", "-q", "--no-deps", "--no-cache-dir", "--retries", 1, "--timeout", 10, "-d", folder, "pip",
                       limit_s=40).returncode == 0
        except subprocess.TimeoutExpired:
            return False


def install(python, pins):
    """Installs the pinned wheels, each with its digest. Skips if PyPI cannot be reached or is too slow; any other failure is an error."""
    names = " and ".join(each.name for each in pins)
    try:
        said = pip(python, "install", "-q", "--no-deps", "--only-binary", ":all:", "--require-hashes", "--retries", 1, "--timeout", 15,
                   *(word for each in pins for word in ("-r", each)), limit_s=LIMIT_S)
    except subprocess.TimeoutExpired:
        skip(f"the packages of {names} did not come from PyPI within {LIMIT_S} s")
    if said.returncode == 0:
        return
    if not reachable(python):
        skip(f"PyPI cannot be reached from here, and the packages of {names} are not in the build tree")
    sys.exit(f"pip could not install {names}, though PyPI answers. Pins and digests there have to be looked at:\n{said.stdout}")


def made(folder, *pins, base=None):
    """Python of the environment in `folder`, which is made again if it is incomplete or has other packages than the files `pins`. `base`: another
    interpreter than this one, for which the pins have wheels."""
    version = PINNED_FOR[1] if base else "{}.{}".format(*sys.version_info)
    found = (platform.python_implementation(), version, platform.system(), platform.machine())
    if found != PINNED_FOR:
        skip(f"the wheels of {pins[0].name} are for {' '.join(PINNED_FOR)}, this is {' '.join(found)}")
    python, stamp = folder / "bin/python", folder / "installed"
    digest = hashlib.sha256(b"".join(each.read_bytes() for each in pins)).hexdigest()
    folder.parent.mkdir(parents=True, exist_ok=True)
    with open(f"{folder}.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (python.exists() and stamp.exists() and stamp.read_text() == digest):
            shutil.rmtree(folder, ignore_errors=True)
            subprocess.run([base or sys.executable, "-m", "venv", folder], check=True, timeout=60)
            install(python, pins)
            stamp.write_text(digest)
    return python


def enter(folder, *pins):
    """Continues this program in the environment's Python."""
    if pathlib.Path(sys.prefix).resolve() == pathlib.Path(folder).resolve():
        return
    python = made(pathlib.Path(folder), *map(pathlib.Path, pins))
    sys.stdout.flush()
    os.execv(python, [str(python), *sys.argv])
