"""A PostgreSQL server of a test's own, from Debian's programs: in a temporary folder, on a Unix socket, without TCP unless TLS is tested."""
import os
import pathlib
import pwd
import shutil
import subprocess
import tempfile

PATIENCE_S = 120  # of one program of the server [s]
NOT_INSTALLED = "skipped: PostgreSQL's server programs are not installed (Debian: postgresql)"


def programs():
    """Folder of initdb and pg_ctl, newest version; None without them."""
    found = sorted(pathlib.Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda path: int(path.parts[-3]))
    return found[-1].parent if found else None


def reachable_folder():
    """A temporary folder that the server's user can reach: TMPDIR may be root's alone."""
    for place in map(pathlib.Path, (tempfile.gettempdir(), "/tmp", "/var/tmp")):
        if os.geteuid() != 0 or all(folder.stat().st_mode & 0o001 for folder in (place, *place.parents)):
            return place
    raise AssertionError("no temporary folder that the user postgres can reach")


class Server:
    """The superuser is `admin`; every login is accepted on the socket without a password, unless `rules` (pg_hba.conf) state otherwise."""

    def __init__(self, rules="local all all trust\n", settings=""):
        self.programs = programs()
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="weft-lab-", dir=reachable_folder()))
        # initdb refuses root.
        self.user = ["runuser", "-u", "postgres", "--"] if os.geteuid() == 0 else []
        if self.user:
            entry = pwd.getpwnam("postgres")
            os.chown(self.folder, entry.pw_uid, entry.pw_gid)
        self.folder.chmod(0o755)
        self.data = self.folder / "data"
        self.call("initdb", "-D", self.data, "-U", "admin", "--auth=trust", "--no-sync", "--encoding=UTF8", "--locale=C.UTF-8")
        self.write(self.data / "pg_hba.conf", rules)
        self.write(self.data / "postgresql.auto.conf", "listen_addresses = ''\nfsync = off\n"
                   f"unix_socket_directories = '{self.folder}'\nlog_min_duration_statement = 0\nlog_connections = on\n" + settings)
        self.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        subprocess.run([*self.user, self.programs / "pg_ctl", "-D", self.data, "-m", "immediate", "stop"], stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL, timeout=PATIENCE_S, check=False)
        shutil.rmtree(self.folder, ignore_errors=True)

    def write(self, path, text, mode=0o600):
        """A file of the server's user."""
        path.write_text(text)
        path.chmod(mode)
        if self.user:
            shutil.chown(path, "postgres", "postgres")

    def call(self, program, *args):
        subprocess.run([*self.user, self.programs / program, *args], check=True, cwd="/", stdout=subprocess.DEVNULL, timeout=PATIENCE_S)

    def start(self):
        self.call("pg_ctl", "-D", self.data, "-w", "-l", self.folder / "log", "start")

    def stop(self):
        self.call("pg_ctl", "-D", self.data, "-w", "-m", "fast", "stop")

    def restart_command(self):
        """For programs that restart the server in a test."""
        return " ".join(str(part) for part in [*self.user, self.programs / "pg_ctl", "-D", self.data, "-w", "-m", "fast", "-l",
                                               self.folder / "log", "restart"]) + " >/dev/null"

    def log(self):
        return (self.folder / "log").read_text(errors="replace")

    def uri(self, login, database="lab"):
        return f"postgresql://{login}@/{database}?host={self.folder}"

    def psql(self, login, sql, database="lab"):
        """(exit status, output, SQLSTATE of the error or "")."""
        # Debian's /usr/bin/psql is a slow wrapper.
        done = subprocess.run([self.programs / "psql", "-X", "-A", "-t", "-q", "-v", "ON_ERROR_STOP=1", "-v", "VERBOSITY=sqlstate", "-d",
                               self.uri(login, database), "-c", sql], capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        state = done.stderr.partition("ERROR:")[2].strip()[:5]
        return done.returncode, done.stdout.strip(), state

    def sql(self, sql, login="admin", database="lab"):
        """Output of a statement that must succeed."""
        status, out, state = self.psql(login, sql, database)
        assert status == 0, (sql, state, out)
        return out

    def make_lab(self, *logins):
        """Database `lab`, and logins as (name, role)."""
        self.sql("CREATE DATABASE lab", database="postgres")
        for name, _ in logins:
            self.sql(f'CREATE ROLE "{name}" LOGIN')

    def grant(self, *logins):
        """After the schema's installation."""
        for name, role in logins:
            if role:
                self.sql(f'GRANT {role} TO "{name}"')
