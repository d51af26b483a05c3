#pragma once
// A run manager of weftd on the test's thread.

#include <catch2/catch.hpp>
#include <condition_variable>
#include <mutex>
#include <stdexcept>

#include "daemon/service/runs/run_manager.hpp"
#include "tests/unit/daemon/benches/kill_points.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace weft::daemon::test {

/// Work for the manager's thread, which is the test's thread.
class Posted {
 public:
  void post(std::function<void()> work) {
    const std::lock_guard passing(held_);
    const std::lock_guard lock(mutex_);
    if (std::exchange(throws_, false)) throw std::runtime_error("scripted");
    waiting_.push_back(std::move(work));
    arrived_.notify_all();
  }
  void throw_once() { throws_ = true; }
  /// Threads that post wait until `let_go`.
  void hold() { held_.lock(); }
  void let_go() { held_.unlock(); }
  /// Waits until something is posted, and leaves it there.
  bool arrives() {
    std::unique_lock lock(mutex_);
    return comes(lock);
  }
  /// Does the posted work until `enough`; false when nothing comes any longer.
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
  /// A run's thread waits here until the test has done the posted work. Otherwise a simulated run
  /// may end before a busy machine lets the test give an order. The wait is limited, as some tests
  /// never do the work.
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

/// Checks the recipe and submits it, on this thread.
inline Result<runs::RunView> submit(runs::RunManager& manager, const runs::RunRequest& wanted,
                                    const std::filesystem::path& rig) {
  return manager.submit(wanted, check_quickly(runs::request_for(wanted, rig)));
}
inline Result<runs::RunView> recover(runs::RunManager& manager, std::string_view id,
                                     std::string_view by) {
  const auto request = manager.request_to_recover(id);
  if (!request) return pass(request.error());
  const runs::RecoverRequest wanted{std::string(by), std::string(by)};
  return manager.recover(id, wanted, check_quickly(*request));
}

/// Gives the run its number and writes it.
inline Status add(runs::RunStore& store, runs::StoredRun& run) {
  const auto number = store.next_number();
  if (!number) return pass(number.error());
  run.number = *number;
  return store.commit({.runs = {run}});
}

/// A daemon's run manager over a folder.
struct RunManagerBench {
  const TemporaryFolder& folder;
  CampaignRequest request;
  Posted posted;
  runs::RunStore store;
  /// Called by every run's thread at each line of its progress.
  std::function<void(const TrialProgress&, RunOrders&)> at_line = {};
  /// Called at each change of its engine's step.
  std::function<void(const RunStatusUpdate&)> at_moment = {};
  /// Called before the run's thread does anything.
  std::function<void()> at_start = {};
  /// Called when the run's thread requests the rig.
  std::function<void()> at_asking = {};
  /// Called when the run has the rig, before any motion.
  std::function<void()> at_rig = {};
  /// Called by the thread of a motion outside a run, before any motion.
  std::function<void()> at_motion = {};
  /// May change the final summary of the bench.
  std::function<void(CampaignSummary&)> bench_ends = {};
  bool no_bench_comes_up = false;
  std::atomic<bool> disk_is_full = false;
  runs::RunStateMachine::Clock now{};
  bool rig_file_is_broken = false;
  std::unique_ptr<runs::RunManager> manager;

  explicit RunManagerBench(const TemporaryFolder& where, const std::string& recipe = tiny_recipe(2),
                           bool one_run = false)
      : folder(where),
        request(request_in(where, recipe)),
        store(std::move(runs::RunStore::open(where / "weftd.sqlite").value())) {
    manager = std::make_unique<runs::RunManager>(
        runs::RunContext{
            .rig = request.rig,
            .data = where.path() / "",  // with a slash, as a user may type it
            .post = [this](std::function<void()> work) { posted.post(std::move(work)); },
            .now = [this] { return now; },
            .utc_us = [] { return std::int64_t{0}; },
            .perform = [this](const CampaignRequest& wanted,
                              const CampaignHooks& hooks) { return performed(wanted, hooks); },
            .maintain =
                [this](const MaintenanceRequest& wanted, MaintenanceHooks hooks) {
                  hooks.begins = [this, reported = hooks.begins](const MaintenanceBegin& begin) {
                    reported(begin);
                    if (at_motion) at_motion();
                    posted.keep_step();
                  };
                  return run_maintenance(wanted, hooks);
                },
            .check_space = [this](const std::filesystem::path&, std::uint64_t bytes) -> Status {
              if (bytes > 0 && disk_is_full)
                return fail({.code = Errc::io, .what = "not enough free space"});
              return {};
            },
            .one_run = one_run},
        store);
  }

  ~RunManagerBench() { posted.end(); }

  Result<CampaignSummary> performed(const CampaignRequest& wanted, CampaignHooks hooks) {
    if (at_start) at_start();
    if (rig_file_is_broken)
      return fail(
          {.code = Errc::invalid_argument, .where = wanted.rig.string(), .what = "not JSON"});
    if (no_bench_comes_up) {
      hooks.planned(check_request(wanted)->plan);
      return fail({.code = Errc::io, .where = "stage.x", .what = "no device answers"});
    }
    hooks.progress = [this, &hooks, reported = hooks.progress](const TrialProgress& line) {
      reported(line);
      if (at_line) at_line(line, *hooks.orders);
      posted.keep_step();
    };
    hooks.moment = [this, reported = hooks.moment](const RunStatusUpdate& moment) {
      reported(moment);
      if (at_moment) at_moment(moment);
      posted.keep_step();
    };
    hooks.rig_acquired = [this, taken = hooks.rig_acquired] {
      if (at_asking) at_asking();
      Status leave = taken();
      if (leave && at_rig) at_rig();
      return leave;
    };
    auto summary = run_campaign(wanted, hooks);
    if (summary && bench_ends) bench_ends(*summary);
    return summary;
  }
  /// Checks the recipe and submits it, on this thread.
  Result<runs::RunView> submit(const runs::RunRequest& wanted) const {
    return test::submit(*manager, wanted, request.rig);
  }
  [[nodiscard]] Result<runs::RunView> recover(std::string_view id, std::string_view by) const {
    return test::recover(*manager, id, by);
  }
  runs::RunView submit() {
    const auto run = submit({request.recipe, {}, {}, "test"});
    if (!run) FAIL(to_string(run.error()));
    return *run;
  }
  runs::RunView ended(const std::string& id) {
    const auto over = [&] {
      const runs::RunState state = manager->get(id).value().machine.state;
      return state == runs::RunState::ended || state == runs::RunState::interrupted;
    };
    REQUIRE(posted.run_until(over));
    return manager->get(id).value();
  }
};

/// A folder in which a daemon died during its only run, with at least `trials` trials recorded.
inline void leave_interrupted(const TemporaryFolder& folder, int repetitions = 2,
                              std::size_t trials = 2) {
  CampaignRequest request = request_in(folder, tiny_recipe(repetitions));
  request.error_check = false;
  runs::StoredRun run;
  run.recipe = request.recipe;
  run.rig = request.rig;
  run.folder = request.out = folder / "R-000001";
  run.state = runs::RunState::running;
  // A daemon was started before its run.
  REQUIRE(runs::RunStore::open(folder / "weftd.sqlite")
              ->append_journal(0, "", "daemon.started", "test"));
  REQUIRE(killed_at(request, {.write = 10, .after_trials = trials}) == true);
  run.number = 1;
  runs::RunStore store = std::move(runs::RunStore::open(folder / "weftd.sqlite").value());
  REQUIRE(store.commit({.runs = {run}}));
}

}  // namespace weft::daemon::test
