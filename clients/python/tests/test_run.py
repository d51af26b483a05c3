import unittest

from weft_client._run import end_of


class Ends(unittest.TestCase):
    def test_a_run_that_failed_says_what_went_wrong(self):
        """As run.wait of weftd reports it; tests/scenario/python_client_scene.py makes a run fail."""
        end = end_of({"run": "R-000001", "state": "ended", "outcome": "failed", "cleanup": "done", "rig": "safe", "error": "z: no answer"})
        self.assertEqual((end.outcome, end.cleanup, end.rig, end.error), ("failed", "done", "safe", "z: no answer"))

    def test_one_that_was_complete_has_no_error(self):
        self.assertEqual(end_of({"outcome": "complete", "dataset_sha256": "0a"}).error, "")


if __name__ == "__main__":
    unittest.main()
