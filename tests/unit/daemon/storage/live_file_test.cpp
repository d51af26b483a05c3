// A campaign file that this process writes, read at the same time by it and by others.

#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <thread>

#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"
#include "daemon/storage/recorder/log_check.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace live_file_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

namespace {

/// Locks of this process on the file, as reported by the system (proc_locks(5)).
int locks_on(const std::filesystem::path& file) {
  struct stat status {};
  REQUIRE(stat(file.c_str(), &status) == 0);
  const std::string process = std::to_string(getpid());
  const std::string inode = ":" + std::to_string(status.st_ino);
  int locks = 0;
  std::ifstream all("/proc/locks");
  for (std::string line; std::getline(all, line);) {
    std::istringstream words(line);
    std::string number, kind, manner, access, owner, where;
    words >> number >> kind >> manner >> access >> owner >> where;
    if (kind == "POSIX" && owner == process && where.ends_with(inode)) ++locks;
  }
  return locks;
}

}  // namespace

TEST_CASE("looking at a file that is being written leaves the writer its locks") {
  const TemporaryFolder folder;
  const auto path = folder / "campaign.sqlite";
  auto recorder = Recorder::create(path, small_header());
  REQUIRE(recorder);
  REQUIRE(recorder->journal(at_ms(1), "line", "{}"));
  REQUIRE(recorder->commit());
  const int held = locks_on(path);
  REQUIRE(held > 0);
  const auto still_held = [&](const char* after) {
    INFO("after " << after);
    CHECK(locks_on(path) == held);
  };
  CHECK(is_campaign_file(path));
  still_held("is_campaign_file");
  CHECK(load_journal(path)->size() == 1);
  still_held("load_journal");
  CHECK(load_history(path));
  still_held("load_past");
  CHECK(read_log(path));
  still_held("read_log");
  CHECK(expects_log(path));
  still_held("expects_log");
  CHECK(file_checksums(path));
  still_held("print_of");
  CHECK(verify(folder.path()));
  still_held("verify");
}

TEST_CASE("a campaign begins while another process reads its file again and again") {
  constexpr int campaigns = 40;
  const TemporaryFolder folder;
  std::atomic<int> at = 0;
  std::atomic<int> looked = 0;
  const std::jthread frame_sampler([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const auto path = folder / (std::to_string(at) + ".sqlite");
      std::this_thread::yield();
      if (!std::filesystem::exists(path)) continue;
      auto reader = sqlite::Database::open(path, sqlite::Mode::read_only);
      auto query = reader ? reader->prepare("SELECT count(*) FROM campaign")
                          : Result<sqlite::Statement>(pass(reader.error()));
      if (query && query->step()) ++looked;
    }
  });
  for (; at < campaigns; ++at) {
    auto recorder = Recorder::create(folder / (std::to_string(at) + ".sqlite"), small_header());
    if (!recorder) FAIL("campaign " << at << ": " << to_string(recorder.error()));
    for (int line = 0; line < 20; ++line) {
      REQUIRE(recorder->journal(at_ms(line), "line", "{}"));
      REQUIRE(recorder->commit());
    }
  }
  CHECK(looked > 0);
}

TEST_CASE("a campaign ends while its file is open elsewhere, and the file is whole without a log") {
  const TemporaryFolder folder;
  const auto path = folder / "campaign.sqlite";
  auto reader = sqlite::Database::open(path, sqlite::Mode::read_only);
  {
    auto recorder = Recorder::create(path, small_header());
    REQUIRE(recorder);
    reader = sqlite::Database::open(path, sqlite::Mode::read_only);
    REQUIRE(reader);
    REQUIRE(reader->prepare("SELECT count(*) FROM campaign")->step());
    REQUIRE(recorder->journal(at_ms(1), "line", "{}"));
    REQUIRE(recorder->finish());
  }
  const auto alone = folder / "alone.sqlite";
  write_file(alone, read_file(path));
  CHECK(load_journal(alone)->size() == 1);
  CHECK(load_progress(alone)->finished);
  CHECK_FALSE(expects_log(alone).value());
  CHECK(verify(path)->found_problems.empty());
}

}  // namespace live_file_test
