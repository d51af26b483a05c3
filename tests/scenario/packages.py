#!/usr/bin/env python3
"""Checks the packages that cpack makes of the build tree: control fields, files, maintainer scripts, udev rules. script/try-packages installs them.

    packages.py BUILD_DIR SOURCE_ROOT
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

BUILD, ROOT = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
NAMES = {"weft": "amd64", "weftd": "amd64", "weft-rig": "amd64", "weft-dev": "all", "python3-weft": "all"}
CONFFILES = ["/etc/security/limits.d/weft.conf", "/etc/weft/recipes/first.json", "/etc/weft/weftd.conf"]
FILES = {"weft": ["usr/bin/weft", "usr/share/man/man1/weft.1", "usr/share/bash-completion/completions/weft", "usr/share/weft/recipes/m1.json",
                  "usr/share/weft/sim/fabrics.json", "usr/share/weft/sim/fidelity.json", "usr/share/weft/sim/rigs/bench17.json"],
         "weftd": ["usr/bin/weftd", "usr/share/man/man1/weftd.1", "usr/lib/systemd/system/weftd.service", "usr/lib/udev/rules.d/60-weft.rules",
                   *(file[1:] for file in CONFFILES)],
         "weft-rig": ["usr/bin/weft-rig", "usr/share/man/man1/weft-rig.1"],
         "weft-dev": ["usr/include/weft/drivers/api/weft_driver.h", "usr/lib/cmake/weft/weftConfig.cmake", "usr/share/weft/sdk/drivers/api/plugin.cpp",
                      "usr/share/doc/weft-dev/examples/sample_driver/line_taxels.cpp"],
         "python3-weft": ["usr/lib/python3/dist-packages/weft_client/__init__.py"]}


def run(*command, status=0, **more):
    ran = subprocess.run(command, capture_output=True, text=True, timeout=300, **more)
    assert ran.returncode == status, f"{command}: {ran.returncode} (expected {status})\n{ran.stdout}{ran.stderr}"
    return ran.stdout


def pack(folder, number, *more):
    environment = {**os.environ, "WEFT_BUILD_NUMBER": number}
    run("cpack", "-B", folder, *more, cwd=BUILD, env=environment)
    return {file.name.split("_")[0]: file for file in folder.glob("*.deb")}


def fields_of(package):
    text = run("dpkg-deb", "-f", package)
    return dict(re.findall(r"^([A-Z][\w-]*): (.*(?:\n .*)*)", text, re.M))


def control_fields(packages):
    for name, architecture in NAMES.items():
        fields = fields_of(packages[name])
        here = architecture if architecture == "all" else run("dpkg", "--print-architecture").strip()
        assert (fields["Package"], fields["Architecture"]) == (name, here), fields
        assert re.match(r"\d+\.\d+\.\d+\+9(\.g|$)", fields["Version"]) and fields["Section"] and len(fields["Description"].splitlines()) >= 2, fields
        assert all(len(line) <= 80 for line in fields["Description"].splitlines()), fields["Description"]
    for name in ("weft", "weftd", "weft-rig"):
        assert re.search(r"\blibc6 \(>= ", fields_of(packages[name])["Depends"]), "shlibdeps"
    for name in ("weftd", "weft-rig"):
        assert f"weft (= {fields_of(packages['weft'])['Version']})" in fields_of(packages[name])["Depends"], name


def files(folder, packages):
    """Every package has its files, and no file belongs to two packages."""
    owners = {}
    for name, package in packages.items():
        root = folder / "files" / name
        root.mkdir(parents=True)
        run("dpkg-deb", "-x", package, root)
        found = {str(file.relative_to(root)) for file in root.rglob("*") if not file.is_dir()}
        missing = set(FILES[name]) - found
        assert not missing, (name, missing)
        strange = [file for file in found if not file.startswith(("usr/", "etc/")) or file.startswith("usr/local")]
        assert not strange and not any("__pycache__" in file for file in found), (name, strange)
        for file in found:
            assert owners.setdefault(file, name) == name, (file, owners[file], name)
    return folder / "files"


def installed_sample(root):
    """The sample rig names tables at their place in package weft, and the unit names the programs and the rig."""
    rig = json.loads((root / "weftd/usr/share/weft/sample-rig.json").read_text())
    for key in ("fabrics", "fidelity"):
        path = rig["simulation"][key]
        assert path.startswith("/usr/share/weft/") and (root / "weft" / path[1:]).exists(), path
    unit = (root / "weftd/usr/lib/systemd/system/weftd.service").read_text()
    assert "ExecStart=/usr/bin/weftd --rig /etc/weft/rig.json --recipes /etc/weft/recipes --data /var/lib/weft" in unit, unit
    assert "\nWants=modprobe@usbserial.service modprobe@cdc_acm.service\nAfter=modprobe@usbserial.service" in unit, unit
    assert "\nProtectProc" not in unit and "\nProcSubset" not in unit, "who holds a file is read there"
    assert "\nLimitRTPRIO=" in unit and "\nLimitMEMLOCK=infinity\n" in unit and "\nProtectSystem=strict\n" in unit, unit


def maintainer_scripts(folder, packages):
    for name in ("weftd", "python3-weft"):
        control = folder / "control" / name
        control.mkdir(parents=True)
        run("dpkg-deb", "-e", packages[name], control)
        for script in ("postinst", "prerm", *(["postrm"] if name == "weftd" else [])):
            assert os.access(control / script, os.X_OK), script
            for shell in ("sh", "dash"):
                if shutil.which(shell):
                    run(shell, "-n", control / script)
    assert (folder / "control/weftd/conffiles").read_text().split() == CONFFILES
    for script in ("postinst", "prerm", "postrm"):
        run(folder / "control/weftd" / script, "no-such-step", status=1)
    refuses_removal(folder, folder / "control/weftd/prerm")


def refuses_removal(folder, prerm):
    """By the daemon's answer: an active run or a moving rig prevents the removal."""
    stubs = folder / "stubs"
    stubs.mkdir()
    (stubs / "deb-systemd-invoke").write_text("#!/bin/sh\n")
    (stubs / "weft").write_text('#!/bin/sh\n[ -n "$WEFT_SAYS" ] || exit 1\necho "$WEFT_SAYS"\n')
    for stub in stubs.iterdir():
        stub.chmod(0o755)
    active = json.dumps({"active": {"run": "R-000001"}, "rig": {"rig": "safe"}}, indent=2)
    moving = json.dumps({"active": None, "rig": {"rig": "moving"}}, indent=2)
    idle = json.dumps({"active": None, "rig": {"rig": "safe"}}, indent=2)
    (stubs / "timeout").write_text('#!/bin/sh\n[ "$WEFT_SAYS" != late ] || exit 124\nshift\nexec "$@"\n')
    (stubs / "timeout").chmod(0o755)
    for says, status in ((active, 1), (moving, 1), (idle, 0), ("", 0), ("late", 1)):
        environment = {**os.environ, "PATH": f"{stubs}:{os.environ['PATH']}", "WEFT_SAYS": says}
        run(prerm, "remove", status=status, env=environment)
        run(prerm, "upgrade", "1", env=environment)


def udev_rules(file):
    """Checks with udevadm if possible (systemd 254), else by the grammar of udev(7): keys, operators, and the jumps' labels."""
    if shutil.which("udevadm") and "verify" in run("udevadm", "--help"):
        run("udevadm", "verify", file)
    text = re.sub(r"\\\n", "", file.read_text())
    term = re.compile(r'(ACTION|SUBSYSTEMS?|DRIVER|KERNEL|ENV\{\w+\}|ATTRS?\{\w+\}|GROUP|MODE|SYMLINK|RUN|GOTO|LABEL)(==|!=|\+=|:=|=)"[^"]*"')
    rules = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    for rule in rules:
        assert re.fullmatch(rf"{term.pattern}(, {term.pattern})*", rule), rule
    assert re.findall(r'GOTO="(\w+)"', text) == re.findall(r'LABEL="(\w+)"', text)
    (latency,) = (rule for rule in rules if "latency_timer" in rule)
    assert 'SUBSYSTEM=="usb-serial"' in latency and 'ATTR{latency_timer}="1"' in latency, latency
    assert any('ATTRS{idProduct}=="faf0"' in rule and 'GROUP="weft"' in rule for rule in rules), rules
    assert any('ATTRS{idVendor}=="0403"' in rule and 'SYMLINK+="weft/$attr{serial}"' in rule for rule in rules), rules


def later_build_is_later(folder, packages):
    later = pack(folder / "later", "10", "-D", "CPACK_COMPONENTS_ALL=python")
    versions = [fields_of(made["python3-weft"])["Version"] for made in (packages, later)]
    run("dpkg", "--compare-versions", versions[0], "lt", versions[1])
    refused = subprocess.run(["cpack", "-B", folder / "none"], cwd=BUILD, env={**os.environ, "WEFT_BUILD_NUMBER": "nine"}, capture_output=True, timeout=300)
    assert refused.returncode != 0 and not list((folder / "none").glob("*.deb")), "a build number that is none"


def main():
    missing = [program for program in ("cpack", "dpkg-deb", "dpkg-shlibdeps", "file") if shutil.which(program) is None]
    if missing:
        print(f"skipped: not installed: {missing} (Debian: cmake dpkg-dev file)")
        sys.exit(77)
    with tempfile.TemporaryDirectory(prefix="weft-packages-") as name:
        folder = pathlib.Path(name)
        packages = pack(folder / "made", "9")
        assert packages.keys() == NAMES.keys(), packages
        control_fields(packages)
        root = files(folder, packages)
        installed_sample(root)
        maintainer_scripts(folder, packages)
        udev_rules(root / "weftd/usr/lib/udev/rules.d/60-weft.rules")
        later_build_is_later(folder, packages)
    print("packages: five, each with its files, scripts and fields")


main()
