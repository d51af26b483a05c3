#include <catch2/catch.hpp>
#include <fstream>

#include "daemon/base/file/installed_file.hpp"
#include "tests/unit/temporary_folder.hpp"

namespace installed_file_test {

using namespace weft::daemon;

TEST_CASE("A file that is not in the working folder is the installed one, where there is one") {
  const test::TemporaryFolder folder;
  const std::filesystem::path prefix = folder.path();
  std::filesystem::create_directories(prefix / "share/weft/sim");
  std::ofstream(prefix / "share/weft/sim/made-up.json") << "{}";
  CHECK(find_installed("sim/made-up.json", prefix / "bin") ==
        prefix / "share/weft/sim/made-up.json");
  CHECK(find_installed("sim/absent.json", prefix / "bin") == "sim/absent.json");
  CHECK(find_installed(prefix / "absent.json", prefix / "bin") == prefix / "absent.json");
  CHECK(find_installed(".", prefix / "bin") == ".");
}

}  // namespace installed_file_test
