import unittest

from weft_client import merge_patch

# RFC 7386, appendix A: target, patch, result
CASES = [
    ({"a": "b"}, {"a": "c"}, {"a": "c"}), ({"a": "b"}, {"b": "c"}, {"a": "b", "b": "c"}), ({"a": "b"}, {"a": None}, {}),
    ({"a": "b", "b": "c"}, {"a": None}, {"b": "c"}), ({"a": ["b"]}, {"a": "c"}, {"a": "c"}), ({"a": "c"}, {"a": ["b"]}, {"a": ["b"]}),
    ({"a": {"b": "c"}}, {"a": {"b": "d", "c": None}}, {"a": {"b": "d"}}), ({"a": [{"b": "c"}]}, {"a": [1]}, {"a": [1]}),
    (["a", "b"], ["c", "d"], ["c", "d"]), ({"a": "b"}, ["c"], ["c"]), ({"a": "foo"}, None, None), ({"a": "foo"}, "bar", "bar"),
    ({"e": None}, {"a": 1}, {"e": None, "a": 1}), ([1, 2], {"a": "b", "c": None}, {"a": "b"}), ({}, {"a": {"bb": {"ccc": None}}}, {"a": {"bb": {}}}),
]


class Merge(unittest.TestCase):
    def test_every_case_of_the_standard(self):
        for target, patch, result in CASES:
            with self.subTest(target=target, patch=patch):
                self.assertEqual(merge_patch(target, patch), result)

    def test_the_arguments_stay_as_they_were(self):
        target, patch = {"at": {"trial": 1}}, {"at": {"step": "M"}}
        merge_patch(target, patch)
        self.assertEqual((target, patch), ({"at": {"trial": 1}}, {"at": {"step": "M"}}))


if __name__ == "__main__":
    unittest.main()
