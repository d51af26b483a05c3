#pragma once
// A desk of weftd whose thread is the test's.

#include <catch2/catch.hpp>
#include <condition_variable>
#include <mutex>
#include <stdexcept>

#include "daemon/service/runs/run_desk.hpp"
#include "tests/unit/daemon/benches/kill_points.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace weft::daemon::test {

/// Work for the desk's thread, which is the test's.
class Posted {
 public:
  void post(std::function<void()> work) {
    const std::lock_guard passing(held_);
    const std::lock_guard lock(mutex_);
    if (std::exchange(throws_, false)) throw std::runtime_error("nobody takes this");
    waiting_.push_back(std::move(work));
    arrived_.notify_all();
  }
  void throw_once() { throws_ = true; }
  /// Whoever posts waits until `let_go`.
  void hold() { held_.lock(); }
  void let_go() { held_.unlock(); }
  /// Something is posted, which stays there.
  bool arrives() {
    std::unique_lock lock(mutex_);
    return comes(lock);
  }
  /// Does what is posted until `enough`; false when nothing comes any more.
  bool run_until(const std::function<bool()>& enough) {
    while (!enough()) {
      std::unique_lock lock(mutex_);
      if (!comes(lock)) return false;
      const auto work = std::move(waiting_.front());
      waiting_.pop_front();
      works_ = true;
      lock.unlock();
      work();
      lock.lock();
      works_ = false;
      drained_.notify_all();
    }
    return true;
  }
  /// A run's thread waits here until the test has done what was posted: else a simulated run may be
  /// over before a busy machine lets the test give an order. Not for ever, as some tests never do.
  void keep_step() {
    std::unique_lock lock(mutex_);
    drained_.wait_for(lock, std::chrono::seconds(2),
                      [this] { return is_ending_ || (waiting_.empty() && !works_); });
  }
  void end() {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
    drained_.notify_all();
  }

 private:
  bool comes(std::unique_lock<std::mutex>& lock) {
    constexpr std::chrono::seconds patience(120);
    return arrived_.wait_for(lock, patience, [this] { return !waiting_.empty(); });
  }

  std::mutex mutex_, held_;
  std::condition_variable arrived_, drained_;
  bool works_ = false, is_ending_ = false;
  std::deque<std::function<void()>> waiting_;
  bool throws_ = false;
};

/// A daemon's desk over a folder.
struct DeskBench {
  const TemporaryFolder& folder;
  CampaignRequest request;
  Posted posted;
  control::RunStore store;
  /// What every run's thread does at each line of its progress.
  std::function<void(const TrialProgress&, RunOrders&)> at_line = {};
  /// Likewise, at each change of its engine's step.
  std::function<void(const RunMoment&)> at_moment = {};
  /// Likewise, before it looks at anything.
  std::function<void()> at_start = {};
  /// Likewise, when it asks for the rig.
  std::function<void()> at_asking = {};
  /// Likewise, once it has the rig and before anything moves.
  std::function<void()> at_rig = {};
  /// What its bench tells at the end may be changed.
  std::function<void(CampaignSummary&)> bench_ends = {};
  bool no_bench_comes_up = false;
  std::atomic<bool> disk_is_full = false;
  control::RunMachine::Clock now{};
  bool rig_file_is_broken = false;
  std::unique_ptr<control::RunDesk> desk;

  explicit DeskBench(const TemporaryFolder& where, const std::string& recipe = tiny_recipe(2),
                     bool one_run = false)
      : folder(where),
        request(request_in(where, recipe)),
        store(std::move(control::RunStore::open(where / "weftd.sqlite").value())) {
    desk = std::make_unique<control::RunDesk>(
        control::RunDesk::Surroundings{
            .rig = request.rig,
            .data = where.path(),
            .post = [this](std::function<void()> work) { posted.post(std::move(work)); },
            .now = [this] { return now; },
            .utc_us = [] { return std::int64_t{0}; },
            .changed = {},
            .stands = {},
            .perform = [this](const CampaignRequest& wanted,
                              const CampaignHooks& hooks) { return performed(wanted, hooks); },
            .room = [this](const std::filesystem::path&, std::uint64_t bytes) -> Status {
              if (bytes > 0 && disk_is_full)
                return fail({.code = Errc::io, .what = "not enough free space"});
              return {};
            },
            .one_run = one_run},
        store);
  }

  ~DeskBench() { posted.end(); }

  Result<CampaignSummary> performed(const CampaignRequest& wanted, CampaignHooks hooks) {
    if (at_start) at_start();
    if (rig_file_is_broken)
      return fail(
          {.code = Errc::invalid_argument, .where = wanted.rig.string(), .what = "not JSON"});
    if (no_bench_comes_up) {
      hooks.planned(check_request(wanted)->plan);
      return fail({.code = Errc::io, .where = "stage.x", .what = "no device answers"});
    }
    hooks.progress = [this, &hooks, told = hooks.progress](const TrialProgress& line) {
      told(line);
      if (at_line) at_line(line, *hooks.orders);
      posted.keep_step();
    };
    hooks.moment = [this, told = hooks.moment](const RunMoment& moment) {
      told(moment);
      if (at_moment) at_moment(moment);
      posted.keep_step();
    };
    hooks.rig_taken = [this, taken = hooks.rig_taken] {
      if (at_asking) at_asking();
      Status leave = taken();
      if (leave && at_rig) at_rig();
      return leave;
    };
    auto summary = run_campaign(wanted, hooks);
    if (summary && bench_ends) bench_ends(*summary);
    return summary;
  }
  control::RunView submit() {
    const auto run = desk->submit({request.recipe, {}, {}, "test"});
    if (!run) FAIL(to_string(run.error()));
    return *run;
  }
  control::RunView ended(const std::string& id) {
    const auto over = [&] {
      const control::RunState state = desk->get(id).value().machine.state;
      return state == control::RunState::ended || state == control::RunState::interrupted;
    };
    REQUIRE(posted.run_until(over));
    return desk->get(id).value();
  }
};

/// A folder in which a daemon died under its only run, at least so many trials of which are on
/// record.
inline void leave_interrupted(const TemporaryFolder& folder, int repetitions = 2,
                              std::size_t trials = 2) {
  CampaignRequest request = request_in(folder, tiny_recipe(repetitions));
  request.error_check = false;
  control::StoredRun run;
  run.recipe = request.recipe;
  run.rig = request.rig;
  run.folder = request.out = folder / "R-000001";
  run.state = control::RunState::running;
  REQUIRE(killed_at(request, {.write = 10, .after_trials = trials}) == true);
  control::RunStore store = std::move(control::RunStore::open(folder / "weftd.sqlite").value());
  REQUIRE(store.add(run));
}

}  // namespace weft::daemon::test
