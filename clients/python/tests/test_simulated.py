import json
import os
import pathlib
import tempfile
import time
import unittest
from unittest import mock

from weft_client import _simulated
from weft_client._simulated import Process, ProgramMissing, RigRefused, find_program, find_rig, isolate, only_daemon, read_rig

PORTS = [{"kind": "serial", "path": "/dev/ttyUSB0"}, {"kind": "tcp", "host": "192.0.2.1", "port": 49152},
         {"kind": "udp", "host": "192.0.2.1", "port": 1, "local_port": 2}]
FOLDER = pathlib.Path("/tmp/of-a-test")


def rig_of(bench, link):
    return {"bench": bench, "devices": [{"name": "a", "link": dict(link)}], "simulation": {}}


class Rigs(unittest.TestCase):
    def test_no_ports_outside_the_test_remain(self):
        rig = {"bench": "emulated", "simulation": {"console": {"host": "192.0.2.1", "port": 3}},
               "devices": [{"name": f"d{n}", "link": link, "http": PORTS[1], "commands": PORTS[1], "also": PORTS} for n, link in enumerate(PORTS)]}
        moved = isolate(json.loads(json.dumps(rig)), FOLDER, "emulated", FOLDER)
        text = json.dumps(moved)
        self.assertNotIn("192.0.2.1", text)
        self.assertNotIn("/dev/", text)
        ports = [port["port"] for port in _simulated._ports_of(moved["devices"]) if "port" in port]
        self.assertEqual((len(set(ports)), len(ports)), (14, 14))
        paths = [port["path"] for port in _simulated._ports_of(moved["devices"]) if "path" in port]
        self.assertEqual(len(set(paths)), len(paths))

    def test_a_port_stays_in_the_folder_whatever_its_device_is_called(self):
        for name in "/dev/ttyUSB0", "../../x", "..", "a/b":
            rig = rig_of("emulated", {"kind": "serial", "path": "x"})
            rig["devices"][0]["name"] = name
            path = pathlib.Path(isolate(rig, FOLDER, "emulated", FOLDER)["devices"][0]["link"]["path"])
            self.assertEqual(path.resolve().parent, FOLDER / "ports", name)

    def test_a_simulation_that_is_no_object_is_refused(self):
        with self.assertRaises(RigRefused):
            isolate({"bench": "simulated", "devices": [], "simulation": None}, FOLDER, "simulated", FOLDER)

    def test_a_bench_of_another_kind_is_refused(self):
        for found, expected in (("real", "simulated"), ("real", "emulated"), ("real", "real"), (None, "simulated"), ("emulated", "simulated"),
                                ("Simulated", "simulated")):
            with self.assertRaises(RigRefused, msg=(found, expected)):
                isolate(rig_of(found, {"kind": "memory"}), FOLDER, expected, FOLDER)

    def test_an_unknown_kind_of_port_is_refused(self):
        for link in {"kind": "usb"}, {}:
            with self.assertRaises(RigRefused):
                isolate(rig_of("emulated", link), FOLDER, "emulated", FOLDER)

    def test_faults_are_added_to_those_of_the_file_and_paths_become_absolute(self):
        rig = rig_of("simulated", {"kind": "memory"})
        rig["simulation"] = {"fabrics": "../fabrics.json", "faults": [{"device": "a", "fault": "drop"}]}
        made = isolate(rig, pathlib.Path("/lab/rigs"), "simulated", FOLDER, [{"device": "a", "fault": "silent"}])["simulation"]
        self.assertEqual(made, {"fabrics": "/lab/fabrics.json", "faults": [{"device": "a", "fault": "drop"}, {"device": "a", "fault": "silent"}]})

    def test_sources(self):
        with tempfile.TemporaryDirectory() as name:
            root = pathlib.Path(name).resolve()
            for place in "bin", "share/weft/sim/rigs", "own":
                (root / place).mkdir(parents=True)
            (root / "share/weft/sim/rigs/bench17.json").write_text('{"bench": "simulated"}')
            (root / "own/mine.json").write_text('{"bench": "emulated"}')
            (root / "own/list.json").write_text("[]")
            program = root / "bin/weftd"
            self.assertEqual(read_rig("bench17", root, program), ({"bench": "simulated"}, root / "share/weft/sim/rigs"))
            self.assertEqual(read_rig("own/mine.json", root, program), ({"bench": "emulated"}, root / "own"))
            document = {"bench": "simulated", "devices": []}
            copy, base = read_rig(document, root, program)
            copy["devices"].append(1)
            self.assertEqual((document["devices"], base), ([], root))
            for wrong in "other", "own/none.json", "own/list.json":
                with self.assertRaises(RigRefused, msg=wrong):
                    read_rig(wrong, root, program)
            with self.assertRaises(RigRefused):
                find_rig("bench17", pathlib.Path("/nowhere/at/all/weftd"))


class Programs(unittest.TestCase):
    def test_found_in_weft_bin_or_on_path(self):
        with tempfile.TemporaryDirectory() as name:
            with mock.patch.dict(os.environ, {"PATH": name}):
                os.environ.pop("WEFT_BIN", None)
                with self.assertRaises(ProgramMissing):
                    find_program("weftd")
                os.environ["WEFT_BIN"] = name
                with self.assertRaises(FileNotFoundError):
                    find_program("weftd")
                program = pathlib.Path(name, "weftd")
                program.touch(mode=0o755)
                self.assertEqual(find_program("weftd"), program)
                del os.environ["WEFT_BIN"]
                self.assertEqual(find_program("weftd"), program)

    def test_a_program_that_ignores_the_signal_is_killed_with_its_children(self):
        with tempfile.TemporaryDirectory() as name, mock.patch.object(_simulated, "STOP_S", 0.2):
            process = Process(["sh", "-c", "trap '' TERM; sleep 600 & echo $!; echo ready; wait"], pathlib.Path(name, "log"), "^ready$")
            child = int(process.text().split()[0])
            self.assertEqual(process.stop(), -9)
            self.assertEqual(process.stop(), -9)
            self.assertTrue(has_ended(child))

    def test_children_of_a_program_that_ends_are_killed(self):
        with tempfile.TemporaryDirectory() as name:
            process = Process(["sh", "-c", "sleep 600 & echo $!; echo ready; exit 3"], pathlib.Path(name, "log"), "^ready$")
            child = int(process.text().split()[0])
            os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)  # stop() must come after its end
            self.assertEqual(process.stop(), 3)
            self.assertTrue(has_ended(child))

    def test_a_start_that_is_interrupted_leaves_no_process(self):
        started = []

        def interrupted(process, *_):
            started.append(process.pid)
            raise KeyboardInterrupt

        with tempfile.TemporaryDirectory() as folder, mock.patch.object(Process, "_wait_until", interrupted):
            with self.assertRaises(KeyboardInterrupt):
                Process(["sleep", "600"], pathlib.Path(folder) / "log", "never")
        with self.assertRaises(ProcessLookupError):
            os.kill(started[0], 0)

    def test_a_program_that_is_never_ready_ends(self):
        with tempfile.TemporaryDirectory() as name, mock.patch.object(_simulated, "START_S", 0.2):
            for script in "echo $$; exec sleep 600", "echo $$; exit 1":
                log = pathlib.Path(name, "log")
                with self.assertRaises(RuntimeError):
                    Process(["sh", "-c", script], log, "^ready$")
                self.assertTrue(has_ended(int(log.read_text())))


def has_ended(pid, patience=500):
    """A killed child of another process is a zombie until it is reaped."""
    for _ in range(patience):
        try:
            if pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z":
                return True
        except OSError:
            return True
        time.sleep(0.01)
    return False


class Environment(unittest.TestCase):
    def test_one_daemon_only_in_the_block(self):
        before = {"WEFT_DAEMON": "tls://bench.example:7001", "WEFT_TOKEN": "wft_x", "WEFT_TLS_CA": "ca.pem"}
        with mock.patch.dict(os.environ, before):
            os.environ.pop("WEFT_SOCKET", None)
            with only_daemon(pathlib.Path("/tmp/s")):
                self.assertEqual({name: os.environ.get(name) for name in ("WEFT_SOCKET", *before)},
                                 {"WEFT_SOCKET": "/tmp/s", **dict.fromkeys(before)})
            self.assertEqual({name: os.environ.get(name) for name in ("WEFT_SOCKET", *before)}, {"WEFT_SOCKET": None, **before})


if __name__ == "__main__":
    unittest.main()
