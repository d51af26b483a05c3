#!/usr/bin/env python3
"""Weft configures on a machine with other software, and leaves out libraries that do not work there.

    configure_elsewhere.py CMAKE SOURCE_ROOT NINJA
"""
import os
import pathlib
import subprocess
import sys
import tempfile

CMAKE, ROOT, NINJA = sys.argv[1:4]


def program(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n" + text + "\n")
    path.chmod(0o755)


def other_software(prefix):
    """Files that scipy, h5py, conda and others leave on a machine, all of them unusable for a build."""
    missing = prefix / "no/such/include"
    for wrapper in ("mpicxx", "mpic++", "mpiCC", "mpicc"):
        program(prefix / "bin" / wrapper, f"""case "$1" in
  *compile*) echo "-I{missing} -pthread" ;;
  *link*) echo "-pthread -L{prefix}/lib -lmpi" ;;
  *) echo "{missing}" ;;
esac""")
    program(prefix / "bin/mpiexec", "exit 1")
    (prefix / "pkgconfig").mkdir()
    (prefix / "pkgconfig/mpi-c.pc").write_text(f"Name: mpi-c\nDescription: of a runtime\nVersion: 4.1\nCflags: -I{missing}\nLibs: -L{prefix}/lib -lmpi\n")
    program(prefix / "bin/python3", "echo 'another python3 was called' >&2; exit 1")
    for package in ("Boost", "OpenSSL", "Eigen3", "spdlog", "nlohmann_json"):
        folder = prefix / "lib/cmake" / package
        folder.mkdir(parents=True)
        (folder / f"{package}Config.cmake").write_text(f'message(FATAL_ERROR "the {package} of another prefix was used")\n')
    for header in ("openssl/ssl.h", "boost/beast/http/parser.hpp", "sndfile.h", "xgboost/c_api.h"):
        (prefix / "include" / header).parent.mkdir(parents=True, exist_ok=True)
        (prefix / "include" / header).write_text("#error of another prefix\n")


def cache_of(build):
    lines = (build / "CMakeCache.txt").read_text().splitlines()
    return dict((line.split(":")[0], line.split("=", 1)[1]) for line in lines if ":" in line and "=" in line)


def configure(build, prefix, *options):
    # Hides this machine's MPI: pkg-config must find the fake runtime only.
    environment = dict(os.environ, PATH=f"{prefix}/bin:{os.environ['PATH']}", PKG_CONFIG_PATH=str(prefix / "pkgconfig"))
    return subprocess.run([CMAKE, "-S", ROOT, "-B", str(build), "-G", "Ninja", f"-DCMAKE_MAKE_PROGRAM={NINJA}", "-DCMAKE_BUILD_TYPE=Release", *options],
                          capture_output=True, text=True, env=environment, timeout=240)


def main():
    problems = []
    with tempfile.TemporaryDirectory() as folder:
        prefix, build = pathlib.Path(folder) / "other", pathlib.Path(folder) / "build"
        other_software(prefix)
        done = configure(build, prefix)
        if done.returncode != 0:
            print(done.stdout[-2000:], done.stderr[-3000:])
            problems.append(f"configuring failed (expected exit 0, got {done.returncode})")
        else:
            cache = cache_of(build)
            if cache.get("WEFT_MPI") not in ("OFF", "FALSE", "", None) or "weft-train-mpi" in (build / "build.ninja").read_text():
                problems.append(f"WEFT_MPI is {cache.get('WEFT_MPI')} with an MPI that cannot compile (expected OFF)")
            for name, value in cache.items():
                if value.startswith(str(prefix)) and not name.startswith("MPI"):
                    problems.append(f"{name} is {value} (expected a place outside the other prefix)")
        forced = configure(pathlib.Path(folder) / "forced", prefix, "-DWEFT_MPI=ON")
        if forced.returncode == 0 or "-DWEFT_MPI=OFF" not in " ".join(forced.stderr.split()):
            problems.append("an option that is ON and does not work is refused with what to do (expected an error that names -DWEFT_MPI=OFF)")
    print("\n".join(problems) or "configured beside other software: 2 cases")
    return 1 if problems else 0


sys.exit(main())
