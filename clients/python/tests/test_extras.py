"""Optional packages: the core needs none, and a missing one is named with its extra."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

import weft_client
from weft_client._extras import extra

SOURCE = pathlib.Path(weft_client.__file__).resolve().parents[1]


class Extras(unittest.TestCase):
    def test_names_the_missing_package_and_its_extra(self):
        with self.assertRaises(ImportError) as caught:
            extra("no_such_package.part", "parquet")
        self.assertEqual(caught.exception.name, "no_such_package")
        self.assertIn("weft-client[parquet]", str(caught.exception))

    def test_leaves_another_failure_as_it_is(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "weft_test_half.py").write_text("import weft_test_other_half\n")
            sys.path.insert(0, folder)
            try:
                with self.assertRaises(ModuleNotFoundError) as caught:
                    extra("weft_test_half", "parquet")
            finally:
                sys.path.remove(folder)
        self.assertEqual(caught.exception.name, "weft_test_other_half")

    def test_the_core_imports_no_package(self):
        code = ("import sys; sys.path.insert(0, sys.argv[1]); import weft_client; "
                "print(sorted({'numpy', 'h5py', 'pandas', 'xarray', 'pyarrow', 'mcap'} & set(sys.modules)))")
        ran = subprocess.run([sys.executable, "-c", code, str(SOURCE)], capture_output=True, text=True, check=True)
        self.assertEqual(ran.stdout.strip(), "[]")

    def test_modules_without_their_package(self):
        for module, package, name in (("dataset", "numpy", "h5py"), ("campaign", "numpy", "numpy"), ("frames", "pandas", "pandas"),
                                      ("xarrays", "xarray", "xarray"), ("export", "numpy", "h5py")):
            code = (f"import sys; sys.path.insert(0, sys.argv[1])\ntry:\n    import weft_client.{module}\n"
                    "except ImportError as problem:\n    print(problem.name, problem)")
            ran = subprocess.run([sys.executable, "-S", "-c", code, str(SOURCE)], capture_output=True, text=True, check=True)
            with self.subTest(module):
                self.assertEqual(ran.stdout.split(" ")[0], package)
                self.assertIn(f"weft-client[{name}]", ran.stdout)


if __name__ == "__main__":
    unittest.main()
