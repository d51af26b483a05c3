// The data of a campaign on the disk after a power cut: each file as it was when SQLite last waited
// for it, without later writes.

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <fstream>
#include <thread>

#include "tests/unit/daemon/benches/kill_points.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace power_cut_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;
namespace fs = std::filesystem;

namespace {

/// Copies completely or not at all: the process may die during the copy. A file opened here is
/// never closed, because that would release the process's locks of SQLite on it (POSIX).
void keep_copy(const char* file) {
  const std::string disk = std::string(file) + ".disk", part = disk + ".part";
  const int from = ::open(file, O_RDONLY | O_CLOEXEC);
  std::ofstream to(part, std::ios::binary | std::ios::trunc);
  std::array<char, 65536> some;
  ssize_t got = 0;
  while ((got = ::read(from, some.data(), some.size())) > 0) to.write(some.data(), got);
  to.close();
  if (got == 0 && to) fs::rename(part, disk);
}

/// Records in a child that dies when readers see the first trial as complete, during the second.
void record_until_dead(const fs::path& file, bool real_time) {
  killing::begin({});
  killing::synced = keep_copy;
  auto recorder = Recorder::create(file, small_header());
  if (!recorder) _exit(1);
  if (real_time) recorder->write_behind();
  const auto seen = [&] {
    const auto all = load_campaign(file);
    return all && !all->trials.empty();
  };
  const bool fine = recorder->begin_trial(small_spec(0), at_ms(0)) &&
                    record_samples(*recorder, 0, 50) &&
                    recorder->end_trial(TrialOutcome::complete, {}, at_ms(500)) &&
                    recorder->begin_trial(small_spec(1), at_ms(600));
  // Like a control loop: data that the writer's thread was too busy to take are handed over later.
  for (std::chrono::milliseconds now{}; fine && !seen(); now += Recorder::commit_budget) {
    std::this_thread::yield();
    if (!recorder->commit_if_due(now)) _exit(2);
  }
  if (fine) killing::die();
  _exit(1);
}

/// Complete trials on the disk after a power cut.
std::size_t left_by_power_cut(const fs::path& file, bool real_time) {
  const pid_t child = fork();
  if (child == 0) record_until_dead(file, real_time);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  REQUIRE(WIFSIGNALED(status));
  fs::remove(file.string() + "-shm");
  for (const char* part : {"", "-wal"}) {
    const std::string name = file.string() + part;
    fs::remove(name);
    if (fs::exists(name + ".disk")) fs::rename(name + ".disk", name);
  }
  const auto left = load_campaign(file);
  return left ? left->trials.size() : 0;
}

}  // namespace

TEST_CASE("a power cut loses no trial that was reported complete on a bench in real time") {
  const TemporaryFolder folder;
  CHECK(left_by_power_cut(folder / "real.weft", true) == 1);
}

TEST_CASE("in virtual time the disk is not waited for, and a power cut may take a trial") {
  const TemporaryFolder folder;
  CHECK(left_by_power_cut(folder / "virtual.weft", false) == 0);
}

}  // namespace power_cut_test
