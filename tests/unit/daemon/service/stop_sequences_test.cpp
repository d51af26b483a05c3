// Random sequences of orders, manual motions, faults, a full disk, a missing database, restarts and
// passing time on a run manager with a scripted bench in virtual time. Nothing moves without a
// person's order after an end other than complete, nor while latched, locked out or unacknowledged.
// It ends idle, and a person can bring the rig to safe. SIMULATED.

#include <condition_variable>
#include <mutex>
#include <random>

#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace stop_sequences_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using namespace std::chrono_literals;
using test::Posted;
using test::TemporaryFolder;

namespace {

/// Events at the bench of the run in progress.
enum class BenchEvent : std::uint8_t { poll_orders, trial_done, device_fails, disk_full };

/// Takes events one by one from the test's thread; the run's thread waits in between.
class ScriptedBench {
 public:
  static constexpr std::size_t planned = 3;

  Result<CampaignSummary> perform(const CampaignRequest& request, const CampaignHooks& hooks) {
    std::error_code ignored;
    std::filesystem::create_directories(request.out, ignored);
    std::ofstream(request.out / campaign_file_name) << "scripted";  // the file that a recovery
                                                                    // requires
    if (is_down) return fail({.code = Errc::io, .where = "stage.x", .what = "no device answers"});
    if (Status granted = hooks.rig_acquired(); !granted) return pass(granted.error());
    ++motions;
    CampaignSummary end;
    end.trials_planned = planned;
    for (is_held_ = is_pausing_ = is_stopping_ = false;;) {
      RunStatusUpdate moment;
      moment.trial = end.trials_complete;
      moment.planned = planned;
      moment.step = is_held_ ? recipes::Step::held : recipes::Step::pressing;
      hooks.moment(moment);
      const BenchEvent event = next();
      if (const auto cut = cut_by_orders(*hooks.orders)) {
        end.outcome = recipes::Outcome::aborted;
        end.rig = *cut;
        return end;
      }
      if (event == BenchEvent::device_fails || event == BenchEvent::disk_full)
        return failed(std::move(end), event == BenchEvent::disk_full);
      const bool is_done = event == BenchEvent::trial_done && !is_held_;
      if (is_done) ++end.trials_complete;
      TrialProgress progress;
      progress.done = end.trials_complete;
      progress.planned = planned;
      hooks.progress(progress);
      if (end.trials_complete == planned) return end;
      if (is_stopping_ && (is_done || is_held_)) {
        end.outcome = recipes::Outcome::stopped;
        return end;
      }
      is_held_ = is_held_ || (is_pausing_ && is_done);
    }
  }

  /// A manual motion: the event trial_done ends it.
  Result<MaintenanceSummary> maintain(const MaintenanceHooks& hooks) {
    if (is_down) return fail({.code = Errc::io, .where = "stage.z", .what = "no device answers"});
    ++motions;
    hooks.begins({});
    MaintenanceSummary end;
    for (;;) {
      const BenchEvent event = next();
      if (const auto cut = cut_by_orders(*hooks.orders)) {
        end.done = {recipes::Outcome::aborted, RigFact::holding, {}};
        return end;
      }
      if (event == BenchEvent::trial_done) return end;
      if (event == BenchEvent::poll_orders) continue;
      end.done = {recipes::Outcome::failed, RigFact::unknown, Error{.what = "scripted"}};
      return end;
    }
  }

  void give(BenchEvent event) {
    const std::lock_guard lock(mutex_);
    if (!is_waiting_) return;  // no run is at the bench
    event_ = event;
    is_waiting_ = false;
    given_.notify_all();
  }
  [[nodiscard]] bool is_waiting() const {
    const std::lock_guard lock(mutex_);
    return is_waiting_;
  }
  /// The daemon dies: its run polls its orders until it gets one to end.
  void set_dying(bool dying) {
    const std::lock_guard lock(mutex_);
    is_dying_ = dying;
    given_.notify_all();
  }

  std::atomic<bool> is_down = false;
  std::atomic<int> motions = 0;

 private:
  /// State in which the rig is left if an order ends the run at once.
  std::optional<RigFact> cut_by_orders(RunOrders& orders) {
    while (const auto given = orders.take()) {
      if (given->order == Order::abort) return RigFact::safe;
      if (given->order == Order::halt) return RigFact::holding;
      is_stopping_ = is_stopping_ || given->order == Order::stop;
      is_pausing_ = given->order == Order::pause || given->order == Order::pause_now;
      if (given->order == Order::resume) is_held_ = false;
    }
    return std::nullopt;
  }
  static CampaignSummary failed(CampaignSummary end, bool is_full) {
    end.outcome = recipes::Outcome::failed;
    end.error = Error{.code = is_full ? Errc::no_space : Errc::timeout, .what = "scripted"};
    end.rig = is_full ? RigFact::safe : RigFact::unknown;
    return end;
  }
  BenchEvent next() {
    std::unique_lock lock(mutex_);
    is_waiting_ = true;
    given_.wait(lock, [&] { return event_ || is_dying_; });
    is_waiting_ = false;
    return std::exchange(event_, std::nullopt).value_or(BenchEvent::poll_orders);
  }

  mutable std::mutex mutex_;
  std::condition_variable given_;
  std::optional<BenchEvent> event_;
  bool is_waiting_ = false, is_dying_ = false;
  bool is_held_ = false, is_pausing_ = false, is_stopping_ = false;  // used by the run's thread
};

/// A daemon over a folder, its users, and their orders.
class Sequence final : private RunObserver {
 public:
  Sequence(const TemporaryFolder& folder, const CampaignRequest& request, const Checked& checked,
           unsigned seed)
      : folder_(folder), request_(request), checked_(checked), random_(seed) {
    start();
  }
  ~Sequence() override { die(); }

  int begun = 0;

  void play(int events) {
    for (int i = 0; i < events; ++i) {
      take_event();
      settle();
    }
    end_idle();
  }

 private:
  using Word = std::int64_t;  ///< sequence number of an event, from 1

  std::size_t below(std::size_t n) { return random_() % n; }

  void start() {
    store_.emplace(std::move(RunStore::open(folder_ / "weftd.sqlite").value()));
    manager_ = std::make_unique<RunManager>(
        RunContext{
            .rig = request_.rig,
            .data = folder_.path(),
            .post = [this](std::function<void()> work) { post(std::move(work)); },
            .now = [this] { return now_; },
            .utc_us = [this] { return now_.count() / 1000; },
            .observer = this,
            .perform = [this](const CampaignRequest& wanted,
                              const CampaignHooks& hooks) { return bench_.perform(wanted, hooks); },
            .maintain = [this](const MaintenanceRequest&,
                               const MaintenanceHooks& hooks) { return bench_.maintain(hooks); },
            .check_space = [this](const std::filesystem::path&, std::uint64_t bytes) -> Status {
              if (bytes > 0 && is_disk_full_) return fail({.code = Errc::no_space, .what = "full"});
              return {};
            },
            .check_rig_file = [](const std::filesystem::path&) { return Status(); }},
        *store_);
  }
  void die() {
    states_.clear();
    bench_.set_dying(true);
    manager_.reset();
    bench_.set_dying(false);
    store_.reset();
    put_catalogue(true);
    const std::lock_guard lock(mutex_);
    waiting_.clear();
  }

  void post(std::function<void()> work) {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(work));
    posted_.notify_all();
  }
  /// Waits until the run in progress waits for the next event of its bench, or there is none.
  void settle() {
    std::unique_lock lock(mutex_);
    for (;;) {
      while (!waiting_.empty()) {
        const auto work = std::move(waiting_.front());
        waiting_.pop_front();
        lock.unlock();
        work();
        lock.lock();
      }
      const bool is_at_rest = !is_busy() || bench_.is_waiting();
      if (is_at_rest) return;
      posted_.wait_for(lock, 1ms, [this] { return !waiting_.empty(); });
    }
  }

  [[nodiscard]] bool is_busy() const {
    return manager_->active() || manager_->status().maintenance;
  }
  /// An order that needs the database is refused while it is missing.
  void put_catalogue(bool here) {
    if (here == is_catalogue_here_) return;
    const auto file = folder_ / "weftd.sqlite", away = folder_ / "away.sqlite";
    std::filesystem::rename(here ? away : file, here ? file : away);
    is_catalogue_here_ = here;
  }

  void person(const std::function<void(std::string_view id)>& orders) {
    orders(run_id(1 + static_cast<std::int64_t>(below(runs_ + 1))));
  }
  /// Does something that must start no motion.
  void no_motion(const std::function<void()>& what) {
    const int before = bench_.motions;
    const auto active = manager_->active();
    what();
    settle();
    if (manager_->active() != active && manager_->active()) FAIL("a run began by itself");
    if (bench_.motions != before && !active) FAIL("motion by itself");
  }

  void submit() {
    RunRequest wanted{request_.recipe, {}, {}, "ada"};
    wanted.keep_going = below(4) == 0;
    wanted.copies = 1 + below(3) / 2;
    if (runs_ > 0 && below(4) == 0)
      wanted.after = run_id(1 + static_cast<std::int64_t>(below(runs_)));
    ++word_;  // they may start at once
    for (std::size_t i = 1; i <= wanted.copies; ++i)
      words_[static_cast<std::int64_t>(runs_ + i)] = word_;
    if (manager_->submit(wanted, checked_)) runs_ += wanted.copies;
  }
  void resume_queue() {
    const auto before = words_;
    ++word_;
    for (const std::int64_t run : manager_->queue().runs()) words_[run] = word_;
    if (!manager_->resume_queue("ada")) words_ = before;
  }
  /// A run that need not wait for another may start because of this.
  void edit(std::string_view id) {
    if (below(2) == 0) return static_cast<void>(manager_->edit(id, {.place = below(3)}, "ada"));
    const auto before = words_;
    ++word_;
    for (const std::int64_t run : manager_->queue().runs()) words_[run] = word_;
    if (!manager_->edit(id, {.after = ""}, "ada")) words_ = before;
  }
  void reset() {
    no_motion([this] {
      if (manager_->reset("looked at it", "ada")) bad_end_ = ++word_;
    });
  }
  void unlock() {
    no_motion([this] {
      if (manager_->unlock({"ada"}, "ada")) bad_end_ = ++word_;
    });
  }
  /// A person removes the obstacles to motion; otherwise little would move.
  void set_going() {
    no_motion([this] {
      put_catalogue(true);
      is_disk_full_ = bench_.is_down = false;
      manager_->tick();
    });
    unlock();
    reset();
    submit();
    resume_queue();
  }
  void recover(std::string_view id) {
    const auto before = words_;
    words_[std::stoll(std::string(id.substr(2)))] = ++word_;
    const auto request = manager_->request_to_recover(id);
    if (!request || !manager_->recover(id, {"ada", "ada"}, checked_)) words_ = before;
  }
  void give_order(std::string_view id) {
    constexpr std::array orders{Order::pause, Order::pause_now, Order::resume, Order::stop,
                                Order::abort};
    const Order order = orders[below(orders.size())];
    const auto ordered = manager_->order(id, order, "ada");
    if (ordered && order >= Order::stop) stopped_ = ordered->stored.number;
  }
  void maintain(recipes::MaintenanceKind kind) {
    const RigState before = manager_->rig_state();
    const auto run = manager_->active();
    const auto answered = std::make_shared<std::optional<RigFact>>();
    moved_by_hand_ = answered;
    const auto is_ordering = std::make_shared<bool>(true);
    const recipes::MaintenanceOrder order{.kind = kind, .distance = -1e-3};
    manager_->maintain(order, "ada", [this, answered, is_ordering](const auto& summary) {
      *answered = summary ? summary->done.rig : RigFact::unknown;
      if (!*is_ordering) bad_end_ = ++word_;  // a run that came meanwhile waits for a person
    });
    *is_ordering = false;
    if (*answered) return;
    if (run || !before.can_move()) FAIL("a motion by hand although the rig may not move");
  }
  void restart() {
    no_motion([this] {
      die();
      start();
    });
    bad_end_ = ++word_;
  }
  void pass_time() {
    constexpr std::array<Deadlines::Duration, 4> steps{1s, 20s, 15min, 24h};
    no_motion([this, &steps] {
      now_ += steps[below(steps.size())];
      manager_->tick();
    });
  }

  void take_event() {
    switch (below(30)) {
      case 0:
      case 1:
      case 2:
        return submit();
      case 3:
      case 4:
        return resume_queue();
      case 5:
        if (below(3) == 0) return static_cast<void>(manager_->clear_queue("ada"));
        return static_cast<void>(manager_->pause_queue("ada"));
      case 6:
        return person([this](auto id) { static_cast<void>(manager_->remove(id, "ada")); });
      case 7:
        return person([this](auto id) { edit(id); });
      case 8:
      case 9:
      case 10:
        return person([this](auto id) { give_order(id); });
      case 11:
        no_motion([this] { manager_->halt(RigState::Stop(below(2)), "bo", "smoke"); });
        bad_end_ = ++word_;
        return;
      case 12:
        return reset();
      case 13:
        return no_motion([this] {
          static_cast<void>(manager_->lock_out({"ada", "cable", 1}, "ada"));
        });
      case 14:
        return unlock();
      case 15:
        return person([this](auto id) { recover(id); });
      case 16:
        is_disk_full_ = !is_disk_full_;
        return no_motion([this] { manager_->tick(); });
      case 17:
        bench_.is_down = below(3) == 0;
        return;
      case 18:
        return restart();
      case 19:
        return pass_time();
      case 20:
      case 21:
        return maintain(recipes::MaintenanceKind(below(3)));
      case 22:
        return no_motion([this] {
          put_catalogue(!is_catalogue_here_);
          manager_->tick();
        });
      case 23:
      case 24:
      case 25:
        return set_going();
      default: {
        const auto event = BenchEvent(below(8) < 5 ? 1 : below(4));
        is_disk_event_ = event == BenchEvent::disk_full;
        return bench_.give(event);
      }
    }
  }

  void on_run_changed(const RunView& run) override {
    if (manager_) static_cast<void>(manager_->status());  // as a daemon does in each callback
    const std::int64_t number = run.stored.number;
    const RunState before = std::exchange(states_[number], run.state());
    if (run.state() == RunState::arming && before != RunState::arming) on_begun(run);
    const bool was_under_way =
        before != RunState::queued && before != RunState::ended && before != RunState::interrupted;
    if (run.is_over() && was_under_way) on_ended(run);
  }
  void on_vote(const RunView&) override {}
  void on_run_unloaded(std::int64_t) override {}
  void on_queue_changed(const RunQueue&, std::string_view) override {}
  void on_rig_state_changed(const RigState&, std::string_view) override {}

  void on_begun(const RunView& run) {
    motions_before_ = bench_.motions;
    stopped_ = 0;
    is_disk_event_ = false;
    if (words_[run.stored.number] <= bad_end_) FAIL(run.stored.id() << " begins without an order");
    if (!manager_->rig_state().can_move(run.stored.number))
      FAIL("it begins on a rig that may not move");
    ++begun;
  }
  void on_ended(const RunView& run) {
    const StoredRun& stored = run.stored;
    if (stored.outcome.empty() || stored.cleanup.empty() || stored.rig_fact.empty())
      FAIL("an end without its facts");
    const bool has_moved = bench_.motions != motions_before_;
    const bool is_full = is_disk_event_ && stored.outcome == "failed";
    const bool is_covered = stored.keep_going && has_moved && !is_full;
    const bool is_complete = stored.outcome == "complete" && run.state() == RunState::ended;
    const bool is_stopped = stopped_ == stored.number;  // possibly too late to end it
    if ((!is_complete || is_stopped) && !is_covered) bad_end_ = ++word_;
  }

  /// The daemon ends idle by itself; then a person can make the rig safe.
  void end_idle() {
    put_catalogue(true);
    for (int i = 0; i < 40 && is_busy(); ++i) {
      bench_.give(manager_->active() ? BenchEvent::poll_orders : BenchEvent::trial_done);
      settle();
      now_ += 24h * 30;
      manager_->tick();
      settle();
    }
    if (is_busy()) FAIL("it does not come to rest");
    for (const RunView& run : manager_->loaded())
      if (run.state() != RunState::queued && !run.is_over()) FAIL("a run is under way at the end");
    bench_.is_down = false;
    no_motion([this] { static_cast<void>(manager_->pause_queue("ada")); });
    unlock();
    reset();
    maintain(recipes::MaintenanceKind::retract);
    settle();
    bench_.give(BenchEvent::trial_done);
    while (!*moved_by_hand_) settle();
    if (*moved_by_hand_ != RigFact::safe) FAIL("a retract does not make the rig safe");
    if (manager_->rig_state().facts().fact != RigFact::safe) FAIL("the rig is not safe");
    if (is_busy()) FAIL("something moves after the retract");
  }

  const TemporaryFolder& folder_;
  const CampaignRequest& request_;
  const Checked& checked_;
  std::mt19937 random_;
  std::mutex mutex_;
  std::condition_variable posted_;
  std::deque<std::function<void()>> waiting_;
  ScriptedBench bench_;
  std::optional<RunStore> store_;
  std::unique_ptr<RunManager> manager_;
  RunStateMachine::Clock now_{};
  std::atomic<bool> is_disk_full_ = false;
  std::size_t runs_ = 0;
  Word word_ = 0, bad_end_ = 0;
  std::map<std::int64_t, Word> words_;  ///< of a person's permission for a run to start
  std::map<std::int64_t, RunState> states_;
  bool is_disk_event_ = false, is_catalogue_here_ = true;
  std::shared_ptr<std::optional<RigFact>> moved_by_hand_;  ///< result of the newest one
  int motions_before_ = 0;
  std::int64_t stopped_ = 0;  ///< the run that a person ordered to end
};

void play_sequences(unsigned first, unsigned count) {
  const TemporaryFolder shared;
  const CampaignRequest request = test::request_in(shared, test::tiny_recipe(2));
  const Checked checked = check_quickly(request);
  REQUIRE(checked);
  int begun = 0;
  for (unsigned seed = first; seed < first + count; ++seed) {
    INFO("seed " << seed);
    const TemporaryFolder folder;
    Sequence sequence(folder, request, checked, seed);
    sequence.play(60);
    begun += sequence.begun;
  }
  CHECK(begun > static_cast<int>(count));  // otherwise the test would check little
}

}  // namespace

TEST_CASE("nothing begins without a person's order after an end other than complete") {
  play_sequences(1, 150);
}

// 100 000 sequences in two halves: each takes a core.
TEST_CASE("the same in 50 000 sequences", "[.][sequences-1]") {
  play_sequences(1000, 50'000);
}

TEST_CASE("the same in another 50 000 sequences", "[.][sequences-2]") {
  play_sequences(51'000, 50'000);
}

}  // namespace stop_sequences_test
