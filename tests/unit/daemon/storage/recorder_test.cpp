#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <limits>

#include "daemon/storage/recorder/sqlite.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace recorder_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;
using std::chrono::milliseconds;

TEST_CASE("a campaign comes back from its file as it was recorded") {
  const TemporaryFolder folder;
  REQUIRE(record_campaign(folder / "c.weft", 3, 100));
  const auto dataset = load_campaign(folder / "c.weft");
  REQUIRE(dataset);
  REQUIRE(check(*dataset));
  REQUIRE(dataset->trials.size() == 3);

  const DatasetInfo& info = dataset->info;
  CHECK(info.kind == BenchKind::simulated);
  CHECK(info.seed == 0xFEDCBA9876543210);
  CHECK(info.recipe_sha256.size() == 64);
  CHECK(info.axes == small_header().info.axes);
  CHECK(info.devices == small_header().info.devices);

  const classifier::Trial& trial = dataset->trials[2];
  const TrialRecord& record = dataset->records[2];
  CHECK(trial.file == "0002-Denim-M1-r01");
  CHECK(trial.group == "r1");
  CHECK(record.spec.patch_seed == 0xFFFFFFFFFFFFFFF2);
  CHECK(record.quality.force_in_band_fraction == 0.99);
  REQUIRE(trial.samples() == 100);
  for (std::uint32_t i = 0; i < 100; ++i) {
    const auto expected = frame(2, i);
    for (std::size_t k = 0; k < 3; ++k) CHECK(trial.row(i)[k] == expected[k]);
    CHECK(trial.phase[i] == (i < 50 ? Phase::press : Phase::motion));
    CHECK(record.t_ns[i] == 200000000000 + 10000000 * std::int64_t{i});
    CHECK(record.device_us[i] == 4294967000U + 10 * i);
    CHECK(record.wrench.force_n(i, 0) == Approx(0.1 * i).margin(1e-6));
    CHECK(record.wrench.torque_nm(i, 2) == Approx(1e-6 * i).margin(1e-9));
    CHECK(record.stages.quanta[2 * i] == static_cast<std::int32_t>(1000 * i));
    CHECK(record.stages.quanta[2 * i + 1] == -50000000);
  }
}

TEST_CASE("a force of a whole number of sensor counts loses nothing") {
  const TemporaryFolder folder;
  auto recorder = Recorder::create(folder / "c.weft", small_header());
  REQUIRE(recorder);
  REQUIRE(recorder->begin_trial(small_spec(0), at_ms(0)));
  // Net F/T at 1e6 counts per N: the driver publishes counts / 1e6.
  const std::array<int, 5> counts{0, 1, -1, 4999999, -79999999};
  for (std::uint32_t i = 0; i < counts.size(); ++i) {
    WrenchSample sample;
    sample.force_n = {counts[i] / 1e6, 0, 0};
    REQUIRE(recorder->wrench({at_ms(i), i, 0}, sample));
  }
  TaxelSample taxel;
  taxel.counts = frame(0, 0);
  REQUIRE(recorder->end_trial(TrialOutcome::complete, {}, at_ms(1)));
  REQUIRE(recorder->finish());
  const auto dataset = load_campaign(folder / "c.weft");
  REQUIRE(dataset);
  for (std::size_t i = 0; i < counts.size(); ++i)
    CHECK(dataset->records[0].wrench.force_n(i, 0) == counts[i] / 1e6);
}

TEST_CASE("the time that commits take is reported once, with and without a writer thread") {
  for (const bool is_behind : {false, true}) {
    const TemporaryFolder folder;
    auto recorder = Recorder::create(folder / "c.weft", small_header());
    REQUIRE(recorder);
    if (is_behind) recorder->write_behind();
    CHECK_FALSE(recorder->commit_lag());
    REQUIRE(recorder->begin_trial(small_spec(0), at_ms(0)));
    REQUIRE(recorder->end_trial(TrialOutcome::complete, {}, at_ms(1)));
    REQUIRE(recorder->finish());  // waits for the thread
    const auto lag = recorder->commit_lag();
    REQUIRE(lag);
    CHECK(lag->count() > 0);
    CHECK_FALSE(recorder->commit_lag());
  }
}

TEST_CASE("lost frames are counted and the samples around a gap are kept") {
  const TemporaryFolder folder;
  auto recorder = Recorder::create(folder / "c.weft", small_header());
  REQUIRE(recorder);
  REQUIRE(recorder->begin_trial(small_spec(0), at_ms(0)));
  std::uint32_t sequence = 65530;
  for (const std::uint32_t lost : {0U, 0U, 4U, 0U, 2U}) {
    const auto counts = frame(0, sequence);
    TaxelSample sample;
    sample.counts = counts;
    sequence += lost;
    REQUIRE(recorder->taxel({at_ms(sequence), sequence, lost}, sample, Phase::motion));
    ++sequence;
  }
  REQUIRE(recorder->end_trial(TrialOutcome::complete, {}, at_ms(1)));
  const auto dataset = load_campaign(folder / "c.weft");
  REQUIRE(dataset);
  CHECK(dataset->trials[0].samples() == 5);
  CHECK(dataset->records[0].lost_samples == 6);
}

TEST_CASE("a stream longer than a buffer is kept whole and in order") {
  const TemporaryFolder folder;
  REQUIRE(record_campaign(folder / "c.weft", 1, 20000));
  const auto dataset = load_campaign(folder / "c.weft");
  REQUIRE(dataset);
  const TrialRecord& record = dataset->records[0];
  REQUIRE(record.t_ns.size() == 20000);
  CHECK(std::ranges::is_sorted(record.t_ns));
  CHECK(record.wrench.samples() == 20000);
  CHECK(dataset->trials[0].row(19999)[0] == 19999);
}

TEST_CASE(
    "transfers stay in the file and out of the data set, unfinished trials unless asked for") {
  const TemporaryFolder folder;
  auto recorder = Recorder::create(folder / "c.weft", small_header());
  REQUIRE(recorder);
  const auto counts = frame(0, 0);
  TaxelSample sample;
  sample.counts = counts;
  for (std::uint32_t trial = 0; trial < 3; ++trial) {
    REQUIRE(recorder->begin_trial(small_spec(trial), at_ms(0)));
    REQUIRE(recorder->taxel({at_ms(1), 0, 0}, sample, Phase::none));
    REQUIRE(recorder->taxel({at_ms(2), 1, 0}, sample, Phase::motion));
    if (trial == 2) break;  // without an end
    REQUIRE(recorder->end_trial(trial == 0 ? TrialOutcome::complete : TrialOutcome::failed, {},
                                at_ms(3)));
  }
  REQUIRE(recorder->commit());

  const auto usual = load_campaign(folder / "c.weft");
  REQUIRE(usual);
  REQUIRE(usual->trials.size() == 1);
  CHECK(usual->trials[0].samples() == 1);
  const auto all = load_campaign(folder / "c.weft", {.all_outcomes = true});
  REQUIRE(all);
  REQUIRE(all->trials.size() == 3);
  CHECK(all->records[1].outcome == TrialOutcome::failed);
  CHECK(all->records[2].outcome == TrialOutcome::interrupted);
  CHECK(all->trials[2].samples() == 1);
  auto file = sqlite::Database::open(folder / "c.weft", sqlite::Mode::read_only);
  REQUIRE(file);
  const auto taxel_rows = file->integer("SELECT sum(rows) FROM chunk WHERE stream = 0");
  REQUIRE(taxel_rows);
  CHECK(taxel_rows->value() == 6);  // both samples of all three trials
}

TEST_CASE("the same seed gives the same digest whatever the chunks and the wall clock") {
  const TemporaryFolder folder;
  const auto record = [&](const std::string& name, std::int64_t wall_step_ms, std::int64_t utc) {
    auto header = small_header();
    header.created_utc_ns = utc;
    auto recorder = Recorder::create(folder / name, header);
    REQUIRE(recorder);
    REQUIRE(recorder->begin_trial(small_spec(0), at_ms(0)));
    for (std::uint32_t i = 0; i < 50; ++i) {
      const auto counts = frame(0, i);
      TaxelSample sample;
      sample.counts = counts;
      REQUIRE(recorder->taxel({at_ms(10 * i), i, 0}, sample, Phase::motion));
      REQUIRE(recorder->commit_if_due(milliseconds(wall_step_ms * i)));
    }
    REQUIRE(recorder->end_trial(TrialOutcome::complete, {}, at_ms(500)));
    REQUIRE(recorder->finish());
    return dataset_sha256(*load_campaign(folder / name));
  };
  CHECK(record("fast", 0, 1) == record("slow", 60, 2));
}

TEST_CASE("written by a thread behind the caller's back, a campaign is the same") {
  const TemporaryFolder folder;
  const auto record = [&](const std::string& name, bool behind) {
    auto recorder = Recorder::create(folder / name, small_header());
    REQUIRE(recorder);
    if (behind) recorder->write_behind();
    for (std::uint32_t trial = 0; trial < 3; ++trial) {
      REQUIRE(recorder->begin_trial(small_spec(trial), at_ms(1000 * trial)));
      for (int part = 0; part < 5; ++part) {
        REQUIRE(record_samples(*recorder, trial, 200));
        REQUIRE(recorder->commit_if_due(milliseconds(1000 * trial + 60 * part)));
      }
      REQUIRE(recorder->journal(at_ms(1), "note"));
      REQUIRE(recorder->end_trial(TrialOutcome::complete, {}, at_ms(1000 * trial + 500)));
    }
    REQUIRE(recorder->finish());
    CHECK(load_journal(folder / name)->size() == 3);
    return dataset_sha256(*load_campaign(folder / name));
  };
  CHECK(record("behind", true) == record("at once", false));
}

TEST_CASE("a sample waits for its commit no longer than the budget") {
  const TemporaryFolder folder;
  auto recorder = Recorder::create(folder / "c.weft", small_header());
  REQUIRE(recorder);
  REQUIRE(recorder->begin_trial(small_spec(0), at_ms(0)));
  REQUIRE(recorder->commit_if_due(milliseconds(1000)));
  REQUIRE(record_samples(*recorder, 0, 10));
  const auto stored = [&] {
    return load_campaign(folder / "c.weft", {.all_outcomes = true})->trials[0].samples();
  };
  REQUIRE(recorder->commit_if_due(milliseconds(1099)));
  CHECK(stored() == 0);
  REQUIRE(recorder->commit_if_due(milliseconds(1100)));
  CHECK(stored() == 10);
}

TEST_CASE("values that cannot be recorded are refused and leave the trial usable") {
  const TemporaryFolder folder;
  auto recorder = Recorder::create(folder / "c.weft", small_header());
  REQUIRE(recorder);
  REQUIRE(recorder->begin_trial(small_spec(0), at_ms(0)));
  WrenchSample wrench;
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity(), 2200.0, -1e300}) {
    wrench.force_n[1] = bad;
    const auto refused = recorder->wrench({at_ms(0), 0, 0, "ft"}, wrench);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == Errc::range);
    CHECK(refused.error().where == "ft");
    CHECK_FALSE(refused.error().hint.empty());
  }
  const std::array positions{0.1, 22.0};  // [m], [rad]
  CHECK(recorder->stages({at_ms(0), 0, 0}, positions).error().where == "a");
  const std::array<std::uint16_t, 2> two{};
  TaxelSample taxel;
  taxel.counts = two;
  CHECK(recorder->taxel({at_ms(0), 0, 0}, taxel, Phase::rest).error().expected == "3");
  REQUIRE(record_samples(*recorder, 0, 4));
  REQUIRE(recorder->end_trial(TrialOutcome::complete, {}, at_ms(1)));
  const auto dataset = load_campaign(folder / "c.weft");
  REQUIRE(dataset);
  CHECK(dataset->records[0].wrench.samples() == 4);
  CHECK(dataset->records[0].stages.samples() == 4);
}

TEST_CASE("calls out of order are refused") {
  const TemporaryFolder folder;
  auto recorder = Recorder::create(folder / "c.weft", small_header());
  REQUIRE(recorder);
  CHECK(recorder->wrench({}, {}).error().code == Errc::wrong_state);
  CHECK(recorder->end_trial(TrialOutcome::complete, {}, at_ms(0)).error().code ==
        Errc::wrong_state);
  REQUIRE(recorder->begin_trial(small_spec(0), at_ms(0)));
  CHECK(recorder->begin_trial(small_spec(1), at_ms(0)).error().code == Errc::wrong_state);
  CHECK(recorder->finish().error().code == Errc::wrong_state);
  REQUIRE(recorder->end_trial(TrialOutcome::stopped, {}, at_ms(0)));
  REQUIRE(recorder->finish());
  CHECK(recorder->begin_trial(small_spec(1), at_ms(0)).error().code == Errc::wrong_state);
  CHECK(recorder->journal(at_ms(0), "late").error().code == Errc::wrong_state);
}

TEST_CASE("a campaign file is never overwritten, and a finished one is a single file") {
  const TemporaryFolder folder;
  REQUIRE(record_campaign(folder / "c.weft", 1, 10));
  CHECK(files_in(folder.path()) == 1);
  const std::string before = read_file(folder / "c.weft");
  const auto again = Recorder::create(folder / "c.weft", small_header());
  REQUIRE_FALSE(again);
  CHECK(again.error().code == Errc::wrong_state);
  CHECK(read_file(folder / "c.weft") == before);
}

TEST_CASE("the journal keeps its order, times and payloads") {
  const TemporaryFolder folder;
  auto recorder = Recorder::create(folder / "c.weft", small_header());
  REQUIRE(recorder);
  REQUIRE(recorder->journal(at_ms(5), "armed"));
  REQUIRE(recorder->journal(at_ms(3), "guard", R"({"force_n":9})"));
  REQUIRE(recorder->commit());
  const auto journal = load_journal(folder / "c.weft");
  REQUIRE(journal);
  REQUIRE(journal->size() == 2);
  CHECK(journal->at(0).kind == "armed");
  CHECK(journal->at(1).time == at_ms(3));
  CHECK(journal->at(1).payload_json == R"({"force_n":9})");
  CHECK(journal->at(1).sequence > journal->at(0).sequence);
}

TEST_CASE(
    "a process killed in a trial leaves a readable file that lacks only what was not committed") {
  const TemporaryFolder folder;
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    auto recorder = Recorder::create(folder / "c.weft", small_header());
    bool fine = recorder && recorder->begin_trial(small_spec(0), at_ms(0)) &&
                record_samples(*recorder, 0, 40) &&
                recorder->end_trial(TrialOutcome::complete, {}, at_ms(1)) &&
                recorder->begin_trial(small_spec(1), at_ms(2)) &&
                record_samples(*recorder, 1, 30) && recorder->commit() &&
                record_samples(*recorder, 1, 7);
    _exit(fine ? 9 : 1);  // no destructor runs
  }
  int state = 0;
  REQUIRE(waitpid(child, &state, 0) == child);
  REQUIRE(WEXITSTATUS(state) == 9);

  const auto dataset = load_campaign(folder / "c.weft", {.all_outcomes = true});
  REQUIRE(dataset);
  REQUIRE(dataset->trials.size() == 2);
  CHECK(dataset->trials[0].samples() == 40);
  CHECK(dataset->trials[1].samples() == 30);
  CHECK(dataset->records[1].outcome == TrialOutcome::interrupted);
  CHECK(load_campaign(folder / "c.weft")->trials.size() == 1);
  CHECK(is_campaign_file(folder / "c.weft"));
  CHECK(load_progress(folder / "c.weft")->planned == 2);
  CHECK_FALSE(load_progress(folder / "c.weft")->finished);
}

TEST_CASE("the progress of a campaign file is read, other files are refused") {
  const TemporaryFolder folder;
  REQUIRE(record_campaign(folder / "c.weft", 2, 5));
  CHECK(load_progress(folder / "c.weft")->finished);
  write_file(folder / "text", "SQLite format 3");  // without the zero byte
  CHECK_FALSE(is_campaign_file(folder / "text"));
  CHECK_FALSE(is_campaign_file(folder / "gone"));
  CHECK_FALSE(load_progress(folder / "text"));
  CHECK(load_progress(folder / "gone").error().code == Errc::not_found);
}

TEST_CASE("a full disk is an error that stays, and what was committed before it can be read") {
  const TemporaryFolder folder;
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    auto recorder = Recorder::create(folder / "c.weft", small_header());
    bool fine = recorder && recorder->begin_trial(small_spec(0), at_ms(0)) &&
                record_samples(*recorder, 0, 40) &&
                recorder->end_trial(TrialOutcome::complete, {}, at_ms(1)) &&
                recorder->begin_trial(small_spec(1), at_ms(2));
    // No file can grow beyond 512 KiB from here on, like on a full disk.
    const rlimit limit{1 << 19, 1 << 19};
    setrlimit(RLIMIT_FSIZE, &limit);
    Status done;
    for (int k = 0; k < 100 && done; ++k) {
      done = record_samples(*recorder, 1, 2000);
      if (done) done = recorder->commit();
    }
    fine = fine && !done && done.error().code == Errc::io && !recorder->commit() &&
           !recorder->journal(at_ms(0), "x") && !recorder->wrench({}, {});
    _exit(fine ? 9 : 1);
  }
  int state = 0;
  REQUIRE(waitpid(child, &state, 0) == child);
  REQUIRE(WEXITSTATUS(state) == 9);
  const auto dataset = load_campaign(folder / "c.weft");
  REQUIRE(dataset);
  CHECK(dataset->trials.size() == 1);
  CHECK(dataset->trials[0].samples() == 40);
}

TEST_CASE("a folder that cannot be written to is an error") {
  const auto recorder = Recorder::create("/proc/weft/c.weft", small_header());
  REQUIRE_FALSE(recorder);
  CHECK(recorder.error().code == Errc::io);
}

TEST_CASE("the forecast covers what a campaign takes, and the free space is compared with it") {
  const TemporaryFolder folder;
  REQUIRE(record_campaign(folder / "c.weft", 2, 5000));
  RecordingForecast forecast{2, 50.0, 3, 2, 100, 100, 100};
  CHECK(forecast_bytes(forecast) > std::filesystem::file_size(folder / "c.weft"));
  CHECK(check_space(folder.path(), 1));
  const auto refused = check_space(folder.path(), std::numeric_limits<std::uint64_t>::max());
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::no_space);
  CHECK(refused.error().got.ends_with(" bytes"));
  CHECK_FALSE(check_space(folder / "absent", 1));
}

}  // namespace recorder_test
