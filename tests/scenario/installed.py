#!/usr/bin/env python3
"""Checks an installation by `cmake --install`: programs run, manual pages give no warning, a shell accepts the completion, systemd accepts the unit.

    installed.py BUILD_DIR
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile


def run(*command, **more):
    ran = subprocess.run(command, capture_output=True, text=True, timeout=120, **more)
    assert ran.returncode == 0, f"{command}: {ran.returncode} {ran.stdout} {ran.stderr}"
    return ran


def completed(script, *words):
    """Completions of bash after these words; the last word is unfinished."""
    quoted = " ".join(f"'{w}'" for w in words)
    function = "_" + words[0]
    said = run("bash", "-euc", f"source {script}; COMP_WORDS=({quoted}); COMP_CWORD={len(words) - 1}; {function}; printf '%s\\n' \"${{COMPREPLY[@]}}\"")
    return set(said.stdout.split())


def completed_by_zsh(script, *words):
    """Words that zsh offers with their meanings after these words; the last word is unfinished. _describe is a stand-in that prints them."""
    quoted = " ".join(f"'{w}'" for w in words)
    said = run("zsh", "-f", "-c", f"compdef() {{ :; }}; _files() {{ :; }}; _describe() {{ print -rl -- ${{(P)2}}; }}; source {script}; "
                                  f"words=({quoted}); CURRENT={len(words)}; _{words[0]}")
    return dict(line.split(":", 1) for line in said.stdout.splitlines())


def manual(page, *mentioned):
    text = page.read_text()
    assert text.startswith(".TH"), text[:80]
    for word in mentioned:
        assert word in text, f"{page.name} does not name {word}"
    if shutil.which("groff") is None:
        return print("groff is not installed: pages not formatted")
    said = run("groff", "-man", "-Tutf8", "-ww", "-Wbreak", "-z", page)
    assert said.stderr == "", said.stderr


def unit(file, bin_folder):
    text = file.read_text()
    assert f"ExecStart={bin_folder}/weftd --rig" in text, text
    (starts,) = (line for line in text.splitlines() if line.startswith("ExecStart="))
    assert starts.endswith(" $WEFTD_OPTIONS") and "EnvironmentFile=-/etc/weft/weftd.conf" in text, "what turns the page on"
    settings = dict(line.split("=", 1) for line in text.splitlines() if "=" in line and not line.startswith("#"))
    assert (settings["Type"], settings["ExecReload"]) == ("notify", "/bin/kill -HUP $MAINPID"), settings
    assert 0 < int(settings["WatchdogSec"]) < int(settings["TimeoutStopSec"]), "a watchdog, and an end that does not wait for ever"
    if shutil.which("systemd-analyze") is None:
        return print("systemd-analyze is not installed: the unit was not verified")
    said = subprocess.run(["systemd-analyze", "verify", "--man=no", file], capture_output=True, text=True, timeout=120)
    about_it = [line for line in said.stderr.splitlines() if "weftd.service" in line and "not executable" not in line]
    assert about_it == [], about_it


def main():
    build = sys.argv[1]
    with tempfile.TemporaryDirectory() as name:
        root = pathlib.Path(name)
        run("cmake", "--install", build, "--prefix", root)
        for program in ("weft", "weftd", "weft-rig"):
            assert program in run(root / "bin" / program, "--help").stdout
        manual(root / "share/man/man1/weft.1", "weft dataset import", "fidelity", "\\-\\-accuracy")
        manual(root / "share/man/man1/weftd.1", "\\-\\-recipes")
        manual(root / "share/man/man1/weft-rig.1", "\\-\\-tcp")
        script = root / "share/bash-completion/completions/weft"
        assert completed(script, "weft", "ver") == {"verify"}
        assert {"import", "export", "info"} <= completed(script, "weft", "dataset", "")
        assert completed(script, "weft", "dataset", "import", "--form") == {"--format"}
        assert completed(script, "weft", "--json", "run", "a.json", "--ri") == {"--rig"}
        assert "--rig" in completed(root / "share/bash-completion/completions/weftd", "weftd", "--r")
        for program in ("weft", "weftd", "weft-rig"):
            page = root / f"share/zsh/vendor-completions/_{program}"
            assert page.read_text().startswith(f"#compdef {program}\n")
            if shutil.which("zsh"):
                assert completed_by_zsh(page, program, "")["--help"]
        if shutil.which("zsh"):
            offered = completed_by_zsh(root / "share/zsh/vendor-completions/_weft", "weft", "--json", "dataset", "")
            assert {"import", "export", "info", "--json"} <= set(offered) and all(offered.values()), offered
        else:
            print("zsh is not installed: its completion was not run")
        share = root / "share/weft"
        run(root / "bin/weft", "check", share / "recipes/m1.json", "--rig", share / "sim/rigs/bench17.json", cwd="/")
        # The fabric table is found without naming it, outside the source tree.
        run(root / "bin/weft", "trade", "sim", "--quick", "--scenes", "none", "--timings", "1", "-o", root / "page.html", cwd="/")
        unit(root / "lib/systemd/system/weftd.service", root / "bin")
        for program in ("weft", "weftd", "weft-rig"):
            said = subprocess.run([root / "bin" / program, "--no-such-option"], capture_output=True, text=True, timeout=120)
            assert said.returncode == 2 and said.stderr, f"{program}: {said.returncode} {said.stderr}"
        assert "128 + n" in (root / "share/man/man1/weft.1").read_text()
    print("installed: programs, pages, completion, recipes and unit")


main()
