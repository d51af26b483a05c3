// The files after a write, and the properties taken from the replaced file.

#include "daemon/base/file/atomic_file.hpp"

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>

#include "daemon/storage/dataset/hdf5_file.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace atomic_file_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

namespace {

mode_t mode_of(const std::filesystem::path& file) {
  struct stat state {};
  REQUIRE(::stat(file.c_str(), &state) == 0);
  return state.st_mode & 07777;
}

Dataset small_set(const TemporaryFolder& folder) {
  REQUIRE(record_campaign(folder / "campaign.weft", 2, 20));
  auto dataset = load_campaign(folder / "campaign.weft");
  REQUIRE(dataset);
  return std::move(*dataset);
}

/// The id of a process that has ended.
pid_t gone() {
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) _exit(0);
  REQUIRE(waitpid(child, nullptr, 0) == child);
  return child;
}

}  // namespace

TEST_CASE("what a killed writer left behind is removed by the next one, and nothing else") {
  const TemporaryFolder folder;
  const auto target = folder / "d.h5";
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    const AtomicFile file(target);
    write_file(file.temporary(), "half");
    raise(SIGKILL);
  }
  REQUIRE(waitpid(child, nullptr, 0) == child);
  const auto left = target.string() + ".partial-" + std::to_string(child);
  REQUIRE(std::filesystem::exists(left));
  write_file(left + ".partial-" + std::to_string(child), "written through two of them");
  const std::string over = std::to_string(gone());
  const std::vector<std::string> saved{"d.h5.partial-" + std::to_string(getppid()),
                                       "d.h5.partial-" + over + "x", "d.h5.partial-",
                                       "e.h5.partial-" + over, "d.h5.partial-99999999999999999999"};
  for (const std::string& name : saved) write_file(folder / name, "another's");
  REQUIRE(write_text_file(target, "whole"));
  CHECK(read_file(target) == "whole");
  CHECK_FALSE(std::filesystem::exists(left));
  CHECK_FALSE(std::filesystem::exists(left + ".partial-" + std::to_string(child)));
  for (const std::string& name : saved) CHECK(std::filesystem::exists(folder / name));
}

TEST_CASE("a file that is written again keeps its mode, and is never more open meanwhile") {
  const TemporaryFolder folder;
  const auto set = folder / "d.h5", text = folder / "t.csv";
  const Dataset dataset = small_set(folder);
  REQUIRE(write_hdf5(dataset, set));
  REQUIRE(write_text_file(text, "a"));
  const mode_t fresh = mode_of(text);
  CHECK(mode_of(set) == (fresh | (mode_of(set) & 0022)));  // as set by the umask
  for (const mode_t mode : {0600, 0640, 0444}) {
    for (const auto& file : {set, text}) REQUIRE(::chmod(file.c_str(), mode) == 0);
    REQUIRE(write_hdf5(dataset, set));
    REQUIRE(write_text_file(text, "b"));
    REQUIRE(write_streamed_file(text, [&](std::ostream& out) {
      CHECK((mode_of(text.string() + ".partial-" + std::to_string(getpid())) & 0077) == 0);
      out << "c";
      return Status{};
    }));
    CHECK(mode_of(set) == mode);
    CHECK(mode_of(text) == mode);
  }
  REQUIRE(::chmod(text.c_str(), 0644) == 0);
  REQUIRE(write_text_file(text, "secret", Readers::owner));
  CHECK(mode_of(text) == 0600);
}

}  // namespace atomic_file_test
