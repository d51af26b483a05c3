#!/usr/bin/env python3
"""The laboratory's store on a real PostgreSQL: installation, roles, TLS, passwords, `weft lab`, and the tests of LabStore in test_daemon_service.

    lab_store.py WEFT TEST_DAEMON_SERVICE SOURCE_ROOT
"""
import concurrent.futures
import json
import os
import pathlib
import socket
import subprocess
import sys
import threading

import lab_support
from lab_support import PATIENCE_S

WEFT, TESTS, ROOT = (pathlib.Path(arg).resolve() for arg in sys.argv[1:4])
LOGINS = [("ada", "weft_submitter"), ("bob", "weft_submitter"), ("eve", "weft_reader"), ("nil", "")] + [(f"r{i}", "weft_rig") for i in range(1, 9)]
PASSWORD = "correct-horse-battery"
DENIED = "42501"


def weft(*args, uri=None, env=None, expect=0):
    """Output of `weft lab`; its error text with another exit status."""
    where = ["--lab", uri] if uri else []
    done = subprocess.run([str(WEFT), "lab", *args, *where], capture_output=True, text=True, cwd=ROOT, timeout=PATIENCE_S, check=False,
                          env={**{k: v for k, v in os.environ.items() if not k.startswith("PG")}, **(env or {})})
    assert done.returncode == expect, (args, done.returncode, done.stdout, done.stderr)
    assert PASSWORD not in done.stdout + done.stderr
    return done.stdout if expect == 0 else done.stderr


def check_installation(server):
    """No schema is an error with advice; concurrent and repeated installations are harmless; a newer schema is refused."""
    missing = weft("rigs", uri=server.uri("eve"), expect=1)
    assert "no schema of Weft" in missing and "weft lab install" in missing, missing
    refused = weft("install", uri=server.uri("eve"), expect=1)
    assert DENIED in refused, refused
    with concurrent.futures.ThreadPoolExecutor(6) as pool:
        results = list(pool.map(lambda _: json.loads(weft("install", "--json", uri=server.uri("admin")))["applied"], range(6)))
    assert sorted(results) == [[]] * 5 + [[1]], results
    # A second laboratory on the same server shares the roles.
    server.sql("CREATE DATABASE other")
    assert json.loads(weft("install", "--json", uri=server.uri("admin", "other")))["applied"] == [1]
    before = server.sql("SELECT version, name FROM weft.migration")
    assert before == "1|0001_store", before
    assert "permission denied" in weft("rigs", uri=server.uri("nil"), expect=1)
    server.grant(*LOGINS)
    server.sql("INSERT INTO weft.migration (version, name) VALUES (99, 'later')")
    for command in (("rigs",), ("install",)):
        newer = weft(*command, uri=server.uri("admin"), expect=1)
        assert "newer than this program" in newer and "99" in newer and "Update Weft" in newer, newer
    server.sql("DELETE FROM weft.migration WHERE version = 99")


def check_plain_administrator(server):
    """An administrator without superuser rights (CREATEROLE, owner of the database) can install."""
    server.sql("CREATE ROLE chief LOGIN CREATEROLE")
    server.sql("CREATE DATABASE third OWNER chief")
    assert json.loads(weft("install", "--json", uri=server.uri("chief", "third")))["applied"] == [1]
    assert json.loads(weft("install", "--json", uri=server.uri("chief", "third")))["applied"] == []


def must_deny(server, login, *statements):
    for sql in statements:
        status, out, state = server.psql(login, sql)
        assert status != 0 and state == DENIED, (login, sql, status, state, out)


def check_roles(server):
    """The database itself refuses each forbidden action, by SQLSTATE."""
    tables = {"migration": "name", "rig": "login", "run": "rig", "dataset": "place", "certificate": "document", "trial": "outcome",
              "campaign": "name", "part": "holder", "part_lease": "rig"}
    for rig in ("r1", "r2"):
        server.sql(f"SELECT weft.publish_rig('{rig}', 'tls://{rig}', 'simulated', 'safe', '', '{{}}')", rig)
    # Another daemon of the same name and login is refused while the first one publishes.
    again = "SELECT weft.publish_rig('r1', 'tls://r1', 'simulated', 'safe', '', '{{}}', '{}')"
    server.sql(again.format("one"), "r1")
    status, out, state = server.psql("r1", again.format("two"))
    assert status != 0 and state == "WL003", (status, out, state)
    server.sql(again.format("one"), "r1")
    server.sql("UPDATE weft.rig SET seen_at = seen_at - interval '31 seconds' WHERE name = 'r1'")
    server.sql(again.format("two"), "r1")
    publish = "SELECT weft.publish_run('{}', 'R-000001', 'made up', '', 1, '{{velvet}}', 'simulated', 'running', 9, 3, 1, NULL, '', 1)"
    server.sql(publish.format("r1"), "r1")
    submit = "SELECT weft.submit_campaign('made up', '{}', repeat('a', 64), 1, '{}', '{velvet,wool}', '{r1,r2}', NULL)"
    campaign = server.sql(submit, "ada")
    claim = "SELECT campaign, number, token FROM weft.claim_part('{}', '{{}}', '{{}}', '60 s')"
    number, token = server.sql(claim.format("r1"), "r1").split("|")[1:]
    rig_functions = [f"SELECT weft.publish_rig('{{0}}', '', 'real', 'safe', '', '{{{{}}}}')", publish.replace("{}", "{0}"),
                     "SELECT weft.publish_dataset('{0}', 'R-000001', repeat('a', 64), 1, 1, '')",
                     "SELECT weft.publish_certificate('{0}', 'R-000001', repeat('a', 64), '{{}}')",
                     "SELECT weft.publish_trials('{0}', 'R-000001', '[]')", claim.replace("{}", "{0}")]
    lease_functions = [f"SELECT weft.renew_part({campaign}, {number}, '{token}', '60 s')",
                       f"SELECT weft.finish_part({campaign}, {number}, '{token}', true, '', '', '')",
                       f"SELECT weft.give_back_part({campaign}, {number}, '{token}')"]
    submitter_functions = [submit, f"SELECT weft.cancel_campaign({campaign})"]
    inner = ["SELECT weft.require_rig('r1')", "SELECT weft.require_run('r1', 'R-000001')", f"SELECT weft.settle_campaign({campaign})",
             f"SELECT weft.require_lease({campaign}, {number}, '{token}')", "SELECT weft.require_duration('1 s')"]

    # No role changes a table, reads the leases, becomes the owner or adds objects.
    for login in ("nil", "eve", "ada", "r1"):
        must_deny(server, login, "SELECT * FROM weft.part_lease", "SELECT token_sha256 FROM weft.part_lease", "SET ROLE weft_owner",
                  "CREATE TABLE weft.mine (a int)", "DELETE FROM weft.rig", "TRUNCATE weft.trial", "COPY weft.part_lease TO STDOUT",
                  f"UPDATE weft.part SET holder = 'r2' WHERE campaign = {campaign}", "INSERT INTO weft.migration VALUES (2, '')",
                  "ALTER FUNCTION weft.claim_part OWNER TO CURRENT_USER", *inner)
        must_deny(server, login, *(f"UPDATE weft.{table} SET {column} = NULL" for table, column in tables.items()),
                  *(f"DELETE FROM weft.{table}" for table in tables))
    must_deny(server, "nil", *(f"SELECT 1 FROM weft.{table}" for table in tables))
    for table in list(tables)[:-1]:
        server.sql(f"SELECT 1 FROM weft.{table} LIMIT 1", "eve")
    # A reader and a submitter are no rigs, not even with the token; a reader and a rig do not submit.
    for login in ("nil", "eve", "ada"):
        must_deny(server, login, *(one.format("r1") for one in rig_functions), *lease_functions)
    for login in ("nil", "eve", "r1"):
        must_deny(server, login, *submitter_functions)
    # A rig is itself only, and owns one name. Another submitter's campaign is not cancelled.
    must_deny(server, "r2", *(one.format("r1") for one in rig_functions), "SELECT weft.publish_rig('squatted', '', 'real', 'safe', '', '{}')")
    must_deny(server, "bob", f"SELECT weft.cancel_campaign({campaign})")
    for sql in lease_functions:
        status, _, state = server.psql("r2", sql)
        assert status != 0 and state == "WL001", (sql, state)
    # A function's caller cannot put own objects before those of the functions.
    server.sql("CREATE TEMP TABLE rig (name text, login text); INSERT INTO rig VALUES ('r1', 'r2'); SET search_path = pg_temp, weft; "
               "SELECT count(*) FROM rig", "r2")
    must_deny(server, "r2", "CREATE TEMP TABLE rig (name text, login text); INSERT INTO rig VALUES ('r1', 'r2'); SET search_path = pg_temp, weft; "
              "SELECT weft.publish_run('r1', 'R-000009', '', '', 1, '{}', 'real', 'running', 1, 0, 1, NULL, '', 1)")
    assert server.sql(f"SELECT holder, state FROM weft.part WHERE campaign = {campaign} AND number = {number}") == "r1|held"
    # Nothing in the schema is for PUBLIC, and every definer function has a fixed search path.
    assert server.sql("SELECT count(*) FROM pg_proc p WHERE pronamespace = 'weft'::regnamespace AND has_function_privilege('nil', p.oid, 'EXECUTE')") == "0"
    assert server.sql("SELECT count(*) FROM pg_proc p WHERE pronamespace = 'weft'::regnamespace AND prosecdef AND "
                      "NOT coalesce(proconfig @> '{\"search_path=pg_catalog, pg_temp\"}', false)") == "0"
    assert server.sql("SELECT string_agg(rolname, ',' ORDER BY rolname) FROM pg_roles WHERE rolname LIKE 'weft%' AND (rolcanlogin OR rolsuper)") == ""
    server.sql(lease_functions[2], "r1")
    server.sql(submitter_functions[1], "ada")
    server.sql("DELETE FROM weft.run; DELETE FROM weft.part_lease; DELETE FROM weft.part; DELETE FROM weft.campaign")


def check_library(server):
    """LabStore: its tests are in tests/unit/daemon/service/lab_store_test.cpp."""
    pg_ctl = " ".join(map(str, [*server.user, server.programs / "pg_ctl", "-D", server.data, "-w", "-l", server.folder / "log"]))
    subprocess.run([TESTS, "[lab-server]"], check=True, timeout=600, cwd="/",
                   env={**os.environ, "WEFT_LAB_TEST_SOCKET": str(server.folder), "WEFT_LAB_TEST_STOP": pg_ctl + " -m fast stop >/dev/null",
                        "WEFT_LAB_TEST_START": pg_ctl + " start >/dev/null"})


def check_defaults(server):
    """A session's isolation and durability do not come from the defaults of database or login: two last parts at once would leave a campaign running."""
    server.sql("CREATE TABLE public.seen (text text); CREATE FUNCTION public.look() RETURNS trigger LANGUAGE plpgsql SECURITY DEFINER AS $$ BEGIN "
               "INSERT INTO public.seen VALUES (current_setting('transaction_isolation') || ', ' || current_setting('synchronous_commit')); RETURN NEW; "
               "END $$; CREATE TRIGGER look AFTER INSERT ON weft.campaign FOR EACH ROW EXECUTE FUNCTION public.look()")
    server.sql("ALTER DATABASE lab SET default_transaction_isolation = 'repeatable read'; ALTER ROLE ada SET synchronous_commit = off")
    weft("submit", "khan2016", "--rigs", "r1", uri=server.uri("ada"))
    assert server.sql("SELECT * FROM public.seen") == "read committed, on"
    server.sql("ALTER DATABASE lab RESET ALL; ALTER ROLE ada RESET ALL; DROP TRIGGER look ON weft.campaign; DROP FUNCTION public.look; DROP TABLE public.seen")
    server.sql("CREATE DATABASE latin ENCODING 'LATIN1' LC_COLLATE 'C' LC_CTYPE 'C' TEMPLATE template0")
    assert "not UTF8" in weft("install", uri=server.uri("admin", "latin"), expect=1)


def check_hostile_rows(server):
    """One rig's or submitter's row does not spoil the answers to others; a run's row is not overwritten by another run."""
    status = "SELECT weft.publish_rig('r3', '', 'real', 'safe', '', '{}')"
    assert server.psql("r3", status.format('{"x": [' + ", ".join(["1e130000"] * 9) + "]}"))[2] == "23514"
    server.sql(status.format('{"x": 1e400, "http": 5}'), "r3")
    listed = {rig["rig"]: rig["status"] for rig in json.loads(weft("rigs", "--json", uri=server.uri("eve")))["rigs"]}
    assert listed["r3"] == {}, listed
    submit = "SELECT weft.submit_campaign('x', '{{}}', repeat('a', 64), 1, '{}', '{{velvet}}', '{{r3}}', NULL)"
    assert server.psql("ada", submit.format('{"a": "' + 70_000 * "b" + '"}'))[2] == "23514"
    campaign = server.sql(submit.format('{"a": 1e400}'), "ada")
    assert json.loads(weft("campaign", campaign, "--json", uri=server.uri("eve")))["parameters"] == {}
    server.sql(f"SELECT weft.cancel_campaign({campaign})", "ada")
    run = "SELECT weft.publish_run('r3', 'R-000001', '{}', '', 1, '{{velvet}}', 'real', '{}', 9, 9, {}, NULL, '', {})"
    server.sql(run.format("first", "running", 1_000_000, 1), "r3")
    assert server.psql("r3", run.format("other", "running", 2_000_000, 2))[2] == "WL002"
    server.sql(run.format("first", "complete", 1_000_000, 3), "r3")
    assert server.sql("SELECT recipe, state, started_at FROM weft.run WHERE rig = 'r3' AND run = 'R-000001'") == "first|complete|1970-01-01 00:00:01+00"
    server.sql("SELECT weft.publish_dataset('r3', 'R-000001', repeat('d', 64), 1, 1, '/no/dataset.h5')", "r3")
    server.sql(status.format('{"http": 5}'), "r3")
    assert "cannot be reached" in weft("fetch", "dddd", "--out", str(server.folder / "out"), uri=server.uri("eve"), expect=1)


def check_commands(server):
    """`weft lab` as a person uses it; simulated benches are marked in text and JSON."""
    for login in ("r1", "r2"):
        server.sql(f"SELECT weft.publish_rig('{login}', 'tls://{login}', '{'simulated' if login == 'r1' else 'real'}', 'safe', '', "
                   """'{"run": "R-000001", "trial": 3, "trials": 20, "eta_s": 300, "next_action": "mount velvet", "alarms": ["hot"]}')""", login)
    rigs = weft("rigs", uri=server.uri("eve"))
    line = next(line for line in rigs.splitlines() if line.startswith("r1 "))
    for word in ("SIMULATED", "R-000001", "3/20", "5 min", "mount velvet", "hot"):
        assert word in line, rigs
    listed = json.loads(weft("rigs", "--json", uri=server.uri("eve")))["rigs"]
    assert {rig["rig"]: rig["bench"] for rig in listed if rig["rig"] in ("r1", "r2")} == {"r1": "simulated", "r2": "real"}, listed
    env = {"WEFT_LAB": server.uri("ada")}
    text = weft("submit", "khan2016", "--rigs", "r1,r2", "--seed", "7", env=env)
    assert "r1 (SIMULATED)" in text and "terry" in text and "0 of 17 parts done" in text, text
    campaign = text.split()[0]
    parts = json.loads(weft("campaign", campaign, "--json", env=env))
    assert len(parts["parts"]) == 17 and parts["seed"] == 7 and parts["parts"][0]["rigs"][0] == {"rig": "r1", "bench": "simulated"}
    assert "cancelled" in weft("cancel", campaign, env=env)
    assert "submitted by ada" in weft("cancel", campaign, env={"WEFT_LAB": server.uri("bob")}, expect=1)
    assert "unknown in the store: no-rig" in weft("submit", "khan2016", "--rigs", "r1,no-rig", env=env, expect=1)
    assert DENIED in weft("submit", "khan2016", "--rigs", "r1", uri=server.uri("eve"), expect=1)
    # A recipe with problems is refused before anything is sent.
    broken = server.folder / "broken.json"
    broken.write_text('{"name": "x", "fabrics": ["a", "a", ""], "parameters": {"f": {"type": "number"}}}')
    before = server.sql("SELECT count(*) FROM weft.campaign")
    refused = weft("submit", broken, "--rigs", "r1", env=env, expect=1)
    assert "/parameters/f" in refused, refused
    for options in (("--set", "no=1"), ("--rig", "sim/rigs/no-such.json")):
        weft("submit", "khan2016", "--rigs", "r1", *options, env=env, expect=1)
    weft("submit", "khan2016", "--rigs", "r1,r2", "--rig", "sim/rigs/bench17.json", env=env)
    assert server.sql("SELECT count(*) FROM weft.campaign") == str(int(before) + 1)
    page = json.loads(weft("runs", "--json", "--limit", "10", env=env))
    assert len(page["runs"]) == 10 and page["next"] == page["runs"][-1]["key"]
    second = json.loads(weft("runs", "--json", "--limit", "10", "--after", str(page["next"]), env=env))
    assert not {run["key"] for run in page["runs"]} & {run["key"] for run in second["runs"]}
    assert "SIMULATED" in weft("search", "khan", "--fabric", "velvet", "--since", "2026-01-01", env=env)
    assert "no runs" in weft("search", "khan", "--until", "2020-01-01T00:00", env=env)
    assert "WEFT_LAB" in weft("rigs", expect=1)
    assert "2026-11-29" in weft("runs", "--since", "yesterday", env=env, expect=2)


def certificates(folder):
    """A CA and a server certificate for localhost, signed by it."""
    def openssl(*args):
        subprocess.run(["openssl", *args], cwd=folder, check=True, capture_output=True, timeout=PATIENCE_S)
    curve = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    openssl("req", "-x509", *curve, "-days", "2", "-subj", "/CN=lab CA", "-keyout", "ca.key", "-out", "ca.pem")
    openssl("req", *curve, "-subj", "/CN=localhost", "-keyout", "server.key", "-out", "server.csr")
    (folder / "san").write_text("subjectAltName=DNS:localhost\n")
    openssl("x509", "-req", "-in", "server.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-days", "2", "-extfile", "san", "-out",
            "server.pem")
    openssl("req", "-x509", *curve, "-days", "2", "-subj", "/CN=other CA", "-keyout", "other.key", "-out", "other.pem")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def set_password(server):
    """By standard input and with the logging of statements off, as an administrator should."""
    subprocess.run(["psql", "-X", "-q", "-v", "ON_ERROR_STOP=1", "-d", server.uri("admin")], check=True, capture_output=True, timeout=PATIENCE_S, text=True,
                   input=f"SET log_min_duration_statement = -1; ALTER ROLE eve PASSWORD '{PASSWORD}';")


class CommandLines(threading.Thread):
    """Looks for the password in all command lines of the computer while it runs."""

    def __init__(self):
        super().__init__(daemon=True)
        self.found, self.looks, self.ended = [], 0, threading.Event()

    def run(self):
        while not self.ended.is_set():
            for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
                try:
                    text = path.read_bytes()
                except OSError:
                    continue
                if PASSWORD.encode() in text:
                    self.found.append(text)
            self.looks += 1


def check_tls():
    """Over TCP only a verified server with a password from a file; the password is in no output, log or command line."""
    with lab_support.Server() as server:
        certificates(server.folder)
        for name in ("server.key", "server.pem"):
            server.write(server.folder / name, (server.folder / name).read_text())
        port = free_port()
        server.make_lab(("eve", ""))
        weft("install", uri=server.uri("admin"))
        server.grant(("eve", "weft_reader"))
        set_password(server)
        server.write(server.data / "pg_hba.conf", "local all all trust\nhostssl all all 127.0.0.1/32 scram-sha-256\nhost all all 127.0.0.1/32 trust\n")
        server.stop()
        auto = server.data / "postgresql.auto.conf"
        server.write(auto, auto.read_text() + f"listen_addresses = '127.0.0.1'\nport = {port}\nssl = on\nssl_cert_file = '{server.folder}/server.pem'\n"
                     f"ssl_key_file = '{server.folder}/server.key'\n")
        server.start()
        passfile = server.folder / "pgpass"
        passfile.write_text(f"*:{port}:lab:eve:{PASSWORD}\n")
        passfile.chmod(0o600)
        env = {"PGPASSFILE": str(passfile)}
        ca, other = server.folder / "ca.pem", server.folder / "other.pem"

        def uri(host="localhost", more=""):
            return f"postgresql://eve@{host}:{port}/lab?sslrootcert={ca}{more}"
        # The server itself accepts this login in the clear: refusals of TLS below are Weft's.
        subprocess.run(["psql", "-X", "-q", "-c", "SELECT 1", f"postgresql://eve@localhost:{port}/lab?sslmode=disable"], check=True, capture_output=True,
                       timeout=PATIENCE_S)
        watch = CommandLines()
        watch.start()
        assert "no rig" in weft("rigs", uri=uri(), env=env)
        assert "no rig" in weft("rigs", uri=uri("127.0.0.1", "&sslmode=verify-ca"), env=env)
        wrong = weft("rigs", uri=uri("127.0.0.1"), env=env, expect=1)
        assert "does not match host name" in wrong and "host name in the server's certificate" in wrong, wrong
        foreign = weft("rigs", uri=uri().replace(str(ca), str(other)), env=env, expect=1)
        assert "certificate verify failed" in foreign, foreign
        absent = weft("rigs", uri=uri().replace(str(ca), "/no/ca.pem"), env=env, expect=1)
        assert "sslrootcert=FILE" in absent, absent
        for mode in ("disable", "allow", "prefer", "require"):
            assert "does not verify the server" in weft("rigs", uri=uri(more=f"&sslmode={mode}"), env=env, expect=1)
            assert "PGSSLMODE" in weft("rigs", uri=uri(), env={**env, "PGSSLMODE": mode}, expect=1)
        refused = weft("rigs", uri=uri(), env={"PGPASSFILE": "/no/pgpass"}, expect=1)
        assert "password" in refused and "~/.pgpass" in refused, refused
        passfile.write_text(f"*:{port}:lab:eve:wrong-{PASSWORD[::-1]}\n")
        refused = weft("rigs", uri=uri(), env=env, expect=1)
        assert "password authentication failed" in refused and PASSWORD[::-1] not in refused, refused
        opened = [line for line in server.log().splitlines() if "connection authorized: user=eve" in line and "application_name=weft" in line]
        assert len(opened) >= 2 and all("SSL enabled" in line for line in opened), opened
        watch.ended.set()
        watch.join()
        assert not watch.found and watch.looks > 3, (watch.found, watch.looks)
        assert PASSWORD not in server.log() and PASSWORD[::-1] not in server.log()
        in_uri = weft("rigs", uri=f"postgresql://eve:{PASSWORD}@localhost:{port}/lab", expect=1)
        assert "URI has a password" in in_uri and "PGPASSFILE" in in_uri, in_uri


def main():
    if lab_support.programs() is None:
        print(lab_support.NOT_INSTALLED)
        sys.exit(77)
    with lab_support.Server() as server:
        server.make_lab(*LOGINS)
        check_installation(server)
        check_plain_administrator(server)
        check_roles(server)
        check_library(server)
        check_commands(server)
        check_defaults(server)
        check_hostile_rows(server)
    check_tls()
    print("lab store: installation, roles, leases, commands and TLS as expected")


if __name__ == "__main__":
    main()
