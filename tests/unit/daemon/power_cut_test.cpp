// What the disk has of a campaign when the power goes: of each file what it was when SQLite had
// last waited for it, and nothing that was written since.

#include <catch2/catch.hpp>
#include <thread>

#include "tests/unit/daemon/kill_points.hpp"
#include "tests/unit/dataset/support.hpp"

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;
namespace fs = std::filesystem;

namespace {

void keep_copy(const char* file) {
  std::error_code none;
  fs::copy_file(file, std::string(file) + ".disk", fs::copy_options::overwrite_existing, none);
}

/// In a child that dies once readers see the first trial as complete, in the middle of the second.
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
  while (fine && !seen()) std::this_thread::yield();
  if (fine) killing::die();
  _exit(1);
}

/// Complete trials on the disk that a power cut leaves.
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

TEST_CASE("a power cut takes no trial that was told complete from a bench in real time") {
  const TemporaryFolder folder;
  CHECK(left_by_power_cut(folder / "real.weft", true) == 1);
}

TEST_CASE("in virtual time the disk is not waited for, and a power cut may take a trial") {
  const TemporaryFolder folder;
  CHECK(left_by_power_cut(folder / "virtual.weft", false) == 0);
}
