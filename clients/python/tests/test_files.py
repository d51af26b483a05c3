import errno
import hashlib
import http.server
import pathlib
import tempfile
import threading
import unittest

from weft_client import AccessError, ConnectionLost, DataAltered, DataFile, RequestError
from weft_client._files import Http, fetch

CONTENT = bytes(range(256)) * 4000
DIGEST = hashlib.sha256(CONTENT).hexdigest()
FILE = DataFile("handover/M1.model", len(CONTENT), DIGEST, "/data/R-000001/handover/M1.model")


class Server(http.server.BaseHTTPRequestHandler):
    """Sends `cuts[0]` bytes of the requested file, then `cuts[1]`, ...; after the last cut the whole rest."""

    def do_GET(self):
        server = self.server
        server.asked.append((self.path, self.headers.get("Range")))
        if self.headers["Authorization"] != "Bearer wft_good":
            return self.answer(401, b'{"error":{"code":2001,"message":"token invalid or expired","data":{"kind":"access.token"}}}')
        if server.altered:
            return self.answer(409, b'{"error":{"code":6003,"message":"altered","data":{"kind":"data.altered"}}}')
        first = int(self.headers["Range"][6:-1]) if self.headers.get("Range") else 0
        body = server.content[first:]
        self.answer(206 if first else 200, body[:server.cuts.pop(0)] if server.cuts else body, len(body))

    def answer(self, status, body, length=None):
        self.send_response(status)
        self.send_header("Content-Length", str(len(body) if length is None else length))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_):
        pass


class Files(unittest.TestCase):
    def setUp(self):
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Server)
        self.server.content, self.server.cuts, self.server.altered, self.server.asked = CONTENT, [], False, []
        threading.Thread(target=self.server.serve_forever, args=(0.01,), daemon=True).start()
        self.folder = tempfile.TemporaryDirectory()
        self.to = pathlib.Path(self.folder.name)
        self.source = self.source_with("wft_good")

    def source_with(self, token):
        return Http(f"http://127.0.0.1:{self.server.server_address[1]}", token, None, 30)

    def tearDown(self):
        self.server.shutdown()
        self.server.server_close()
        self.folder.cleanup()

    def test_whole_and_of_the_digest_that_was_asked_for(self):
        self.assertEqual(fetch(self.source, FILE, self.to), self.to / "M1.model")
        self.assertEqual((self.to / "M1.model").read_bytes(), CONTENT)
        self.assertEqual(self.server.asked, [(FILE.path + "?sha256=" + DIGEST, None)])
        self.assertFalse((self.to / "M1.model.part").exists())

    def test_cut_off_it_is_gone_on_with(self):
        self.server.cuts = [100_000, 1, 500_000]
        fetch(self.source, FILE, self.to / "mine")
        self.assertEqual((self.to / "mine").read_bytes(), CONTENT)
        self.assertEqual([r for _, r in self.server.asked], [None, "bytes=100000-", "bytes=100001-", "bytes=600001-"])

    def test_what_an_earlier_program_left_is_gone_on_with(self):
        (self.to / "M1.model.part").write_bytes(CONTENT[:7])
        fetch(self.source, FILE, self.to)
        self.assertEqual([r for _, r in self.server.asked], ["bytes=7-"])

    def test_bytes_of_something_else_are_not_kept(self):
        (self.to / "M1.model.part").write_bytes(b"another")
        with self.assertRaises(DataAltered) as refused:
            fetch(self.source, FILE, self.to)
        self.assertEqual((refused.exception.kind, refused.exception.where, refused.exception.expected), ("data.altered", FILE.name, DIGEST))
        self.assertEqual(list(self.to.iterdir()), [])
        fetch(self.source, FILE, self.to)

    def test_one_that_never_brings_a_byte_is_given_up(self):
        self.server.cuts = [0] * 50
        with self.assertRaises(ConnectionLost):
            fetch(self.source, FILE, self.to)
        self.assertEqual(len(self.server.asked), 5)

    def test_a_disk_that_is_full_is_said_at_once(self):
        (self.to / "mine.part").symlink_to("/dev/full")
        with self.assertRaises(OSError) as refused:
            fetch(self.source, FILE, self.to / "mine")
        self.assertEqual(refused.exception.errno, errno.ENOSPC)
        self.assertEqual(len(self.server.asked), 1)

    def test_refusals(self):
        with self.assertRaises(AccessError):
            fetch(self.source_with("wft_bad"), FILE, self.to)
        with self.assertRaises(RequestError):
            fetch(self.source_with(None), FILE, self.to)
        self.server.altered = True
        with self.assertRaises(DataAltered):
            fetch(self.source, FILE, self.to)

    def test_an_empty_file_is_a_file(self):
        nothing = DataFile("empty", 0, hashlib.sha256(b"").hexdigest(), "/data/R-000001/empty")
        self.assertEqual(fetch(self.source, nothing, self.to).read_bytes(), b"")


if __name__ == "__main__":
    unittest.main()
