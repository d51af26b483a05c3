import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from generate_methods import source_of  # noqa: E402


def method(name, *params, summary="a summary", **more):
    return {"name": name, "summary": summary, "params": [dict(zip(("name", "required", "description", "schema"), p)) for p in params],
            "result": {"description": "the run"}, "x-role": "operator", "x-changes": False, **more}


def made(*methods):
    names = {}
    exec(compile(source_of({"info": {"version": "1.0.0"}, "methods": list(methods)}), "made", "exec"), names)  # annotations stay text
    sent = []
    return names, names["Api"](lambda name, params: sent.append((name, params)) or {}), sent


class Generated(unittest.TestCase):
    def test_needed_parameters_come_first_and_keywords_are_bent(self):
        names, api, sent = made(method("log.query", ("from", False, "this sequence number on", {"type": "integer"}),
                                       ("run", True, "its name", {"type": "string"})))
        api.log.query(run="R-000001", from_=7)
        self.assertEqual(sent, [("log.query", {"run": "R-000001", "from": 7})])
        with self.assertRaises(TypeError):
            api.log.query(from_=7)
        self.assertIn("from_: this sequence number on", names["LogMethods"].query.__doc__)

    def test_units_and_roles_are_in_the_documentation(self):
        params = ("ttl_ms", True, "duration [ms]", {"type": "integer"})
        names, _, _ = made(method("lease.renew", params, **{"x-changes": True}), method("lease.list", params))
        for word in "ttl_ms: duration [ms]", "operator":
            self.assertIn(word, names["LeaseMethods"].renew.__doc__)
        self.assertGreater(len(names["LeaseMethods"].renew.__doc__), len(names["LeaseMethods"].list.__doc__))

    def test_long_lines_are_broken_where_python_allows(self):
        params = [(f"parameter_of_some_length_{i}", i == 0, "x", {"type": "array"}) for i in range(9)]
        _, api, sent = made(method("run.start", *params, summary="a \"quoted\" thing and a \\ sign " * 9))
        api.run.start(parameter_of_some_length_0=[1], parameter_of_some_length_8=[2])
        self.assertEqual(sent[0][1]["parameter_of_some_length_8"], [2])
        text = source_of({"info": {"version": "1.0.0"}, "methods": [method("run.start", *params)]})
        self.assertLessEqual(max(map(len, text.splitlines())), 160)


if __name__ == "__main__":
    unittest.main()
