#!/usr/bin/env python3
"""The plan of a recipe and its differences from another one; the files of a data set over HTTP, by the byte. All simulated.

    weftd_data.py WEFTD WEFT SOURCE_ROOT
"""
import hashlib
import http.client
import json
import pathlib
import socket
import subprocess
import sys
import tempfile

from cli_support import has, line_has
from weftd_support import PATIENCE_S, Client, Daemon, token_of

WEFTD, WEFT, ROOT = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])


def recipes(folder):
    (folder / "recipes").mkdir()
    small = json.loads((ROOT / "recipes/library/m1.json").read_text())
    small.update(fabrics=["pile", "nylon"], repetitions=4, hand_over={"learner": "lda", "groups": 2})
    phases = small["explorations"]["M1"]["phases"]
    phases[2].update(speed_mm_s=4, path=[{"dx_mm": 0, "dy_mm": 8}])
    (folder / "recipes/small.json").write_text(json.dumps(small))
    phases[2]["speed_mm_s"] = 2
    small["fabrics"].append("denim")
    del small["description"]
    (folder / "recipes/slower.json").write_text(json.dumps(small))
    (folder / "recipes/wrong.json").write_text(json.dumps(small | {"repetitions": 0}))


def schema(client):
    """Draft 2020-12, checked by a validator for it; the validator of the unit tests supports draft 7."""
    told = client.call("recipe.schema")
    assert told["$schema"].endswith("/2020-12/schema") and told["properties"]["approach"]["properties"]["speed_mps"]["x-unit"] == "m/s"
    try:
        import jsonschema
    except ImportError:
        print("python3-jsonschema is not installed: the schema was not put before it")
        return
    jsonschema.Draft202012Validator.check_schema(told)
    judge = jsonschema.Draft202012Validator(told)
    for file in (ROOT / "recipes/library").glob("*.json"):
        judge.validate(json.loads(file.read_text()))
    wrong = json.loads((ROOT / "recipes/library/m1.json").read_text())
    wrong["explorations"]["M1"]["phases"].append({"phase": "E", "duration_s": 1})
    assert not judge.is_valid(wrong), "five phases"


def plans(client):
    plan = client.call("recipe.plan", recipe="small")
    assert plan["trials"] == 8 == len(plan["steps"]) and plan["next"] is None, plan
    assert abs(sum(s["lasts_s"] for s in plan["steps"]) - plan["duration_s"]) < 1e-6, plan
    checked = client.call("recipe.check", recipe="small")
    assert (plan["duration_s"], plan["bytes"], plan["digest"]) == (checked["plan"]["eta_s"], checked["plan"]["bytes"], checked["digest"])
    assert [s["mounts"] for s in plan["steps"]] == [True, False, False, False] * 2, "blocked: a fabric is mounted once"
    assert [p["phase"] for p in plan["explorations"][0]["phases"]] == ["S", "P", "M", "E"], plan["explorations"]
    assert plan["hand_over"]["groups"] == 2
    page = client.call("recipe.plan", recipe="small", most=3)
    rest = client.call("recipe.plan", recipe="small", **{"from": page["next"]})
    assert page["next"] == 3 and page["steps"] + rest["steps"] == plan["steps"], (page, rest)
    assert client.call("recipe.plan", recipe="small", **{"from": 99})["steps"] == []
    refused = client.refused("recipe.plan", recipe="wrong")["data"]
    assert refused["where"] == "/repetitions", refused
    for wrong in {"most": 0}, {"most": 1001}, {"from": -1}:
        client.refused("recipe.plan", recipe="small", **wrong)


def differences(client, folder, run):
    told = client.call("recipe.diff", recipe="small", other="slower")
    found = {d["where"]: (d["change"], d.get("was"), d.get("is")) for d in told["differences"]}
    assert found == {"/explorations/M1/phases/2/speed_mm_s": ("changed", 4, 2), "/fabrics/2": ("added", None, "denim"),
                     "/description": ("removed", json.loads((folder / "recipes/small.json").read_text())["description"], None)}, found
    assert (told["same"], told["same_campaign"], told["count"]) == (False, False, 3), told
    assert client.call("recipe.diff", recipe="small", other="small")["same"]
    # changes of the recipe since that run
    file = folder / "recipes/small.json"
    text = file.read_text()
    assert client.call("recipe.diff", recipe=run, other="small") == {"same": True, "same_campaign": True, "count": 0, "differences": []}
    file.write_text(json.dumps(json.loads(text) | {"description": "another word", "seed": 2016}))
    changed = client.call("recipe.diff", recipe=run, other="small")
    assert (changed["same"], changed["same_campaign"]) == (False, True), "words are no part of a campaign"
    file.write_text(text)
    assert client.refused("recipe.diff", recipe="small", other="smal")["data"]["where"] == "/params/other"


class Web:
    def __init__(self, port, token):
        self.port, self.token = port, token

    def get(self, path, **headers):
        wire = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        sent = {"Authorization": f"Bearer {self.token}"} | {k.replace("_", "-"): v for k, v in headers.items()}
        wire.putrequest("GET", path, skip_accept_encoding=True)
        for name, value in sent.items():
            if value is not None:
                wire.putheader(name, value)
        wire.endheaders()
        response = wire.getresponse()
        return response.status, response.headers, response.read()


    def post(self, method, **params):
        wire = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        text = json.dumps({"jsonrpc": "2.0", "id": 1, "method": method, "params": params})
        wire.request("POST", "/rpc", text, {"Authorization": f"Bearer {self.token}", "Content-Type": "application/json"})
        return json.loads(wire.getresponse().read())


def roles(web, run):
    """An observer can read everything, and can start and end nothing."""
    for method in ("data.list", "recipe.schema"):
        assert "result" in web.post(method), method
    assert "result" in web.post("data.get", run=run) and "result" in web.post("recipe.plan", recipe=run)
    for method in ("handover.start", "handover.cancel"):
        assert web.post(method, run=run)["error"]["data"]["kind"] == "access.role", method


def fetched(web, client, folder, run):
    (listed,) = client.call("data.list")["datasets"]
    told = client.call("data.get", run=run)
    assert listed["run"] == run and listed["dataset_sha256"] == told["dataset_sha256"], (listed, told)
    files = {f["name"]: f for f in told["files"]}
    assert set(files) == {"certificate.json", "campaign.sqlite", "dataset.h5", "handover/M1.model", "handover/M1.html", "handover/M1.json",
                          "handover/evaluation.json", "handover/report.html", "handover/report.json"}, files
    for file in files.values():
        status, headers, body = web.get(file["path"])
        assert (status, len(body), headers["ETag"]) == (200, file["bytes"], f'"{file["sha256"]}"'), (file, status, len(body))
        assert hashlib.sha256(body).hexdigest() == file["sha256"], file
        assert headers["Content-Disposition"] == "attachment", "no page of ours runs in a browser"
    data = files["dataset.h5"]
    half = data["bytes"] // 2
    parts = [web.get(data["path"], Range=r) for r in (f"bytes=0-{half - 1}", f"bytes={half}-{half}", f"bytes={half + 1}-")]
    assert [p[0] for p in parts] == [206] * 3 and parts[1][1]["Content-Range"] == f"bytes {half}-{half}/{data['bytes']}"
    joined = folder / "joined.h5"
    joined.write_bytes(b"".join(p[2] for p in parts))
    assert hashlib.sha256(joined.read_bytes()).hexdigest() == data["sha256"]
    info = subprocess.run([WEFT, "--json", "dataset", "info", joined], check=True, capture_output=True, text=True)
    assert json.loads(info.stdout)["dataset_sha256"] == told["dataset_sha256"]
    assert web.get(data["path"], Range=f"bytes={data['bytes']}-")[0] == 416
    assert web.get(data["path"], If_None_Match=f'"{data["sha256"]}"')[::2] == (304, b"")
    assert web.get(data["path"] + "?sha256=" + data["sha256"], Range="bytes=-4")[0] == 206
    assert web.get(data["path"] + "?sha256=" + "0" * 64)[0] == 412
    return data


def devices(client):
    """Every device of the rig with the schema of its driver's configuration."""
    told = client.call("device.list")
    assert told["bench"] == "simulated" and [d["role"] for d in told["devices"]] == ["x", "y", "z", "rx", "ry", "wrench", "taxels"], told
    for device in told["devices"]:
        found = client.call("device.describe", device=device["device"])
        schema = found["config_schema"]
        assert found["driver"] == device["driver"] and found["plugin"] is None and found["summary"], found
        assert schema["$schema"].endswith("/2020-12/schema") and set(found["config"]) <= set(schema["properties"]), found
    stage = client.call("device.describe", device="stage.z")["config_schema"]["properties"]
    assert stage["max_speed_mm_s"]["x-unit"] == "mm/s" and stage["max_speed_mm_s"]["x-safety"] is True, stage
    assert "x-safety" not in stage["poll_hz"] and stage["poll_hz"]["x-unit"] == "Hz", stage
    assert has(client.refused("device.describe", device="stage.zz")["data"]["hint"], "stage.z?")


def certificate(web, client, run):
    told = client.call("data.certificate", run=run, most=3)
    _, _, body = web.get(told["path"])
    whole = json.loads(body)
    for name in "software_version", "dataset_sha256", "recipe_sha256", "rig_sha256", "trials_planned":
        assert told[name] == whole[name], name
    assert told["bench"] == whole["bench_kind"] == "simulated" and told["attempts"] == 8 and told["next"] == 3
    rest = client.call("data.certificate", run=run, **{"from": 3})
    assert rest["next"] is None
    assert [(t["name"], t["sha256"], t["gaps"]) for t in told["trials"] + rest["trials"]] == [(t["name"], t["sha256"], t["gaps"]) for t in whole["trials"]]
    assert [(f["name"], f["sha256"]) for f in told["files"]] == [(f["name"], f["sha256"]) for f in whole["files"]]
    (stage,) = (d for d in told["devices"] if d["name"] == "stage.z")
    assert stage["identity"]["reported"] == json.loads(next(d["identity_json"] for d in whole["devices"] if d["name"] == "stage.z"))["reported"]
    assert "LTS150" in stage["identity"]["reported"].values(), stage
    for wrong in {"most": 0}, {"most": 1001}, {"from": -1}:
        client.refused("data.certificate", run=run, **wrong)


def notes_and_figures(web, client, run):
    client.call("run.annotate", run=run, note="the cloth was damp")
    (line,) = client.call("log.query", run=run, kind="note")["lines"]
    assert line["data"] == {"tags": [], "note": "the cloth was damp"}, line
    assert web.post("run.annotate", run=run, note="no")["error"]["data"]["kind"] == "access.role"
    before, after = web.post("system.metrics")["result"], client.call("system.metrics")
    assert 0 < before["up_s"] <= after["up_s"] and after["runs"] == {"ended": 1} and after["queued"] == 0, after
    assert after["disk_free_bytes"] > 0 and after["leases"] == 1, after


def exports(web, client, folder, run):
    """The same data set again; a table of its features. Each download has its stated type, and the certificate still holds."""
    first = client.call("data.export", run=run, idem="x1")
    assert client.call("data.export", run=run, idem="x1") == first
    assert (first["name"], first["trials"], first["bench"]) == ("export/dataset.h5", 8, "simulated"), first
    assert first["dataset_sha256"] == client.call("data.get", run=run)["dataset_sha256"]
    table = client.call("data.export", run=run, format="features-csv")
    for made in first, table:
        status, headers, body = web.get(made["path"] + "?sha256=" + made["sha256"])
        assert (status, len(body)) == (200, made["bytes"]) and hashlib.sha256(body).hexdigest() == made["sha256"], made
    info = subprocess.run([WEFT, "features", folder / "data" / run / "dataset.h5", "-o", folder / "f.csv"], check=True, capture_output=True)
    assert (folder / "f.csv").read_bytes() == web.get(table["path"])[2], info
    listed = {f["name"] for f in client.call("data.get", run=run)["files"]}
    assert {"export/dataset.h5", "export/features-M1.csv", "export/list.json", "dataset.h5"} <= listed, listed
    seen = client.call("data.verify", run=run)
    assert seen["holds"] and {e["state"] for e in seen["exports"]} == {"current"} and len(seen["exports"]) == 2, seen
    assert client.call("data.get", run=run)["exports"] == seen["exports"]
    assert web.post("data.export", run=run)["error"]["data"]["kind"] == "access.role", "an observer makes no files"
    for wrong, where in (dict(format="xlsx"), "/params/format"), (dict(exploration="M1"), "/params/exploration"), \
            (dict(format="features-csv", exploration="M9"), "/exploration"):
        assert client.refused("data.export", run=run, **wrong)["data"]["where"] == where, wrong


def partial_export(web, client, lease):
    """Export of an aborted run: the complete trials, and the planned number."""
    client.call("sim.clock", pace=30)
    client.call("sub.open", topics=["run:*"], mode="every")
    client.call("lease.renew", lease=lease)
    run = client.call("run.start", recipe="slower", lease=lease)["run"]
    refused = client.refused("data.export", run=run)
    assert refused["data"]["kind"] == "state.conflict", refused
    while client.event()["delta"].get("trials_done", 0) < 2:
        pass
    client.call("run.abort", run=run)
    client.call("sim.clock", pace=0)
    client.call("run.wait", run=run)
    made = client.call("data.export", run=run)
    assert 2 <= made["trials"] < made["trials_planned"] == 12, made
    assert hashlib.sha256(web.get(made["path"])[2]).hexdigest() == made["sha256"]
    return run


def completed_elsewhere(client, folder, run):
    """`weft run --resume` in the folder of an aborted run: the daemon reports the present contents of the folder, and still lists the run as it
    ended."""
    before = client.call("run.get", run=run)
    out = pathlib.Path(before["folder"])
    recipe = [folder / "recipes/slower.json", "--rig", ROOT / "sim/rigs/bench17.json"]
    subprocess.run([WEFT, "run", *recipe, "--out", out, "--resume", "--no-evaluate"], check=True, capture_output=True)
    while not client.event()["delta"].get("campaign_since"):
        pass
    digest = json.loads((out / "certificate.json").read_text())["dataset_sha256"]
    since = {"trials_done": 12, "trials_planned": 12, "complete": True, "dataset_sha256": digest}
    after = client.call("run.get", run=run)
    assert after == before | {"campaign_since": since, "by": "auto:folder"} and after["outcome"] == "aborted", (before, after)
    assert [r for r in client.call("run.list")["runs"] if r["run"] == run] == [after]
    (listed,) = [d for d in client.call("data.list")["datasets"] if d["run"] == run]
    assert (listed["outcome"], listed["dataset_sha256"], listed["campaign_since"]) == ("aborted", digest, since), listed
    assert client.call("data.get", run=run)["dataset_sha256"] == digest != before["dataset_sha256"]
    status = subprocess.run([WEFT, "status", "--socket", client.wire.getpeername()], check=True, capture_output=True, text=True).stdout
    assert line_has(status, ["12 of 12", "complete"]), status


def nothing_else(web, run, data):
    assert web.get(data["path"], Authorization=None)[0] == 401
    assert web.get(data["path"], Authorization="Bearer wft_" + 64 * "0")[0] == 401
    for path in ("", "/", "/campaign.sqlite-wal", "/../weftd.sqlite", "/%2e%2e/weftd.sqlite", "/handover/../campaign.sqlite", "/handover",
                 "/./dataset.h5", "//dataset.h5", "/dataset.h5/", "/handover/M1.model%00", "/../../tokens.json"):
        assert web.get(f"/data/{run}{path}")[0] == 404, path
    for path in ("/data/", "/data/..", "/data/R-999999/dataset.h5", "/data/weftd.sqlite", "/data//etc/passwd", "/database"):
        assert web.get(path)[0] == 404, path


def beside_others(web, client, folder, data):
    """A client that requests a file and reads nothing blocks no other client. A file that differs from its list is refused."""
    lazy = socket.create_connection(("127.0.0.1", web.port), PATIENCE_S)
    lazy.sendall(f"GET {data['path']} HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer {web.token}\r\n\r\n".encode())
    for _ in range(50):
        assert client.call("system.info")["product"] == "weftd"
    assert web.get(data["path"])[0] == 200
    lazy.close()
    file = pathlib.Path(client.call("data.get", run=data["path"].split("/")[2])["folder"]) / "dataset.h5"
    whole = file.read_bytes()
    file.write_bytes(whole[:-1])
    assert web.get(data["path"])[0] == 409
    altered = bytearray(whole)
    altered[len(whole) // 2] ^= 1  # the length stays
    file.write_bytes(altered)
    for query, headers in ("", {}), ("?sha256=" + data["sha256"], {}), ("", {"If_None_Match": f'"{data["sha256"]}"'}), ("", {"Range": "bytes=0-0"}):
        status, _, body = web.get(data["path"] + query, **headers)
        wanted = 412 if query else 409  # 412 for a request that names the digest
        assert status == wanted and b"data.altered" in body, (query, headers, status, body[:200])
    assert web.get(data["path"], If_Match=f'"{data["sha256"]}"')[0] == 412
    run = data["path"].split("/")[2]
    seen = client.call("data.verify", run=run)
    assert not seen["holds"] and seen["findings"][0]["where"] == "dataset.h5" and seen["findings"][0]["what"].startswith("altered"), seen
    file.write_bytes(whole)
    assert web.get(data["path"])[0] == 200
    seen = web.post("data.verify", run=run)["result"]
    assert seen["holds"] and seen["certified"] and seen["trials_complete"] == 8 and not seen["findings"], seen
    # a link to another folder with exactly the listed files
    elsewhere, place = folder / "elsewhere", file.parent / "handover"
    place.rename(elsewhere)
    place.symlink_to(elsewhere)
    status, _, body = web.get(data["path"].replace("dataset.h5", "handover/M1.model"))
    assert status == 409 and b"symbolic link" in body, (status, body[:200])
    place.unlink()
    elsewhere.rename(place)
    assert web.get(data["path"].replace("dataset.h5", "handover/M1.model"))[0] == 200


def main():
    with tempfile.TemporaryDirectory(prefix="weftd-") as name:
        folder = pathlib.Path(name)
        recipes(folder)
        token = token_of(WEFT, folder / "tokens.json", "viewer", "observer")
        daemon = Daemon(WEFTD, ROOT, folder, "--http", "0", "--tokens", folder / "tokens.json")
        try:
            client = Client(daemon.socket)
            schema(client)
            devices(client)
            plans(client)
            lease = client.call("lease.acquire")["lease"]
            run = client.call("run.start", recipe="small", lease=lease)["run"]
            assert client.refused("data.get", run=run)["data"]["kind"] == "not_found", "nothing is certified yet"
            done = client.call("run.wait", run=run, hand_over=True)
            assert done["handover"]["state"] == "done", done
            differences(client, folder, run)
            web = Web(daemon.port, token)
            roles(web, run)
            data = fetched(web, client, folder, run)
            certificate(web, client, run)
            notes_and_figures(web, client, run)
            exports(web, client, folder, run)
            nothing_else(web, run, data)
            beside_others(web, client, folder, data)
            completed_elsewhere(client, folder, partial_export(web, client, lease))
            assert daemon.end() == 0
        finally:
            daemon.process.kill()
    print("weftd: plans, differences and files, all as they should be (simulated)")


main()
