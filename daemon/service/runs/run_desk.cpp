#include "daemon/service/runs/run_desk.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/base/file/sha256.hpp"
#include "daemon/service/runs/desk_run.hpp"

namespace weft::daemon::control {
namespace {

using nlohmann::json;

constexpr const char* shutdown = "auto:shutdown";

// A person's name for a folder is one path component, nothing hidden.
Status check_name(const std::string& name) {
  constexpr std::size_t longest = 100;
  const bool fits = name.size() <= longest && !name.starts_with('.') &&
                    std::all_of(name.begin(), name.end(), [](char c) {
                      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                             (c >= '0' && c <= '9') || c == '-' || c == '_' || c == '.';
                    });
  if (fits) return {};
  return fail({.code = Errc::invalid_argument,
               .where = "/params/name",
               .what = "unusable name",
               .expected = "letters, digits, '-', '_' and '.', at most 100",
               .got = name});
}

/// One that is there is an older run's, of a daemon whose memory is gone.
std::filesystem::path free_folder(const std::filesystem::path& wanted) {
  std::filesystem::path folder = wanted;
  std::error_code none;
  for (int i = 2; std::filesystem::exists(folder, none); ++i)
    folder = wanted.string() + "-" + std::to_string(i);
  return folder;
}

}  // namespace

RunDesk::RunDesk(Surroundings around, RunStore& store) : around_(std::move(around)), store_(store) {
  const auto known = store_.load();
  const auto standing = store_.standing();
  if (!known || !standing) return;  // opening has just read them
  standing_ = *standing;
  // Each ask has a line of the journal, so these names are new.
  if (const auto newest = store_.tail("", 1); newest && !newest->empty())
    asks_ = newest->front().sequence;
  for (const StoredRun& stored : *known) {
    auto run = std::make_unique<Run>();
    run->view.stored = stored;
    run->view.machine.state = stored.state;
    run->view.trials_done = static_cast<std::size_t>(stored.trials_done.value_or(0));
    run->view.trials_planned = static_cast<std::size_t>(stored.trials_planned.value_or(0));
    if (stored.state == RunState::interrupted && !stored.trials_done)
      run->counted = count_trials(*run);
    runs_.push_back(std::move(run));
  }
  wall_ahead_ = wall_ahead();
  take_up_line();
}

RunDesk::~RunDesk() {
  for (const auto& run : runs_) run->looker.request_stop();
  for (const auto& run : runs_) {
    give_leave(*run, false);
    if (run->thread.joinable()) run->orders->give({Order::abort, shutdown});
  }
  for (const auto& run : runs_)
    if (run->thread.joinable()) run->thread.join();
  note_repeated(repeated_stops_.all());
}

RunDesk::Run* RunDesk::find(std::string_view id) const {
  const auto found = std::find_if(runs_.begin(), runs_.end(),
                                  [&](const auto& run) { return run->view.stored.id() == id; });
  return found == runs_.end() ? nullptr : found->get();
}

std::optional<std::string> RunDesk::active() const {
  for (const auto& run : runs_)
    if (run->at_work || (run->state() != RunState::queued && !run->is_over()))
      return run->view.stored.id();
  return std::nullopt;
}

std::optional<std::string> RunDesk::lost() const {
  for (const auto& run : runs_)
    if (run->at_work && run->is_over()) return run->view.stored.id();
  return std::nullopt;
}

bool RunDesk::is_at_rest() const {
  const bool settles =
      std::any_of(runs_.begin(), runs_.end(), [](const auto& run) { return run->settling; });
  return !settles && (!active() || lost());
}

CampaignRequest RunDesk::request_for(const RunWish& wish) const {
  return {wish.recipe, around_.rig, {}, wish.seed};
}

Result<RunView> RunDesk::submit(const RunWish& wish, const Checked& checked) {
  if (Status more = takes_more(); !more) return pass(more.error());
  if (around_.one_run && !runs_.empty())
    return fail({.code = Errc::wrong_state,
                 .what = "this daemon is there for one run alone, that of a weft run",
                 .expected = "no further run",
                 .hint = "A weftd of its own takes more: weftd --rig ..."});
  if (Status ok = check_name(wish.name); !ok) return pass(ok.error());
  if (!checked) return pass(checked.error());
  if (Status here = store_.in_place(); !here) return pass(here.error());
  if (Status space = around_.room(around_.data, disk_forecast(checked->plan)); !space)
    return pass(space.error());
  const std::string sha256 = sha256_hex(checked->recipe_text);
  if (!wish.digest.empty() && wish.digest != "sha256:" + sha256)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/digest",
                 .what = "the recipe is another one by now",
                 .expected = "sha256:" + sha256,
                 .got = wish.digest,
                 .hint = "recipe.diff and recipe.check tell what it is"});
  auto run = std::make_unique<Run>();
  StoredRun& stored = run->view.stored;
  stored.recipe_sha256 = sha256;
  stored.recipe = wish.recipe;
  stored.rig = around_.rig;
  stored.seed = wish.seed;
  stored.name = wish.name;
  stored.by = wish.by;
  stored.created_us = around_.utc_us();
  stored.bench = to_string(bench_kind_of(around_.rig));
  stored.trials_done = 0;
  stored.trials_planned = static_cast<std::int64_t>(checked->plan.trials.size());
  plan_known(*run, known_of(checked->plan));
  RunLine line = line_;
  ++line.revision;
  const Status kept = store_.together([&] {
    Status done = store_.keep_recipe(sha256, checked->recipe_text);
    if (done) done = store_.add(stored);
    if (!done) return done;
    stored.folder = wish.folder;
    if (wish.folder.empty())
      stored.folder =
          free_folder(around_.data / (stored.id() + (wish.name.empty() ? "" : "-" + wish.name)));
    done = store_.update(stored);
    if (!done) return done;
    line.put(stored.number, wish.place.value_or(line.runs.size()));
    done = store_.keep(line);
    return done ? store_.journal(stored.created_us, stored.id(), "submitted", wish.by) : done;
  });
  if (!kept) return pass(kept.error());
  line_ = line;
  runs_.push_back(std::move(run));
  Run& added = *runs_.back();
  tell(added, wish.by);
  if (around_.lined) around_.lined(line_, wish.by);
  begin_next();
  return added.view;
}

RunDesk::PlanKnown RunDesk::known_of(const recipes::Plan& plan) {
  return {plan.trials.size(), deadlines_of(plan), recipes::next_ask(plan, 0), disk_forecast(plan)};
}

void RunDesk::plan_known(Run& run, const PlanKnown& plan) {
  run.view.trials_planned = plan.trials;
  run.limits = plan.limits;
  run.view.stored.disk_bytes = plan.disk_bytes;
  // Somebody has a terminal at it: what nobody ordered takes as long as it takes.
  if (around_.one_run) run.limits.arming = run.limits.running = Deadlines::Duration::max();
  run.view.attention.reset();
  if (plan.first_ask && !run.view.stored.resume)
    run.view.attention = Attention{*plan.first_ask, {}};
}

void RunDesk::apply(Run& run, const RunStep& step, std::string_view by) {
  const bool changes = step.next.state != run.state();
  run.view.machine = step.next;
  if (step.order && run.orders) run.orders->give({*step.order, std::string(by), run.asked});
  if (changes && !run.may_need_people()) run.view.attention.reset();
  if (step.lost) doubt_rig_of(run, by);  // first: who dies in between has not a run that is over
  if (changes) {
    const bool waited = run.view.stored.state == RunState::queued;
    run.view.stored.state = step.next.state;
    if (run.is_over()) run.view.stored.rig_untaken = false;  // not before: it may die in between
    const json payload{{"state", to_string(step.next.state)}};
    keep(run);
    note(run.view.stored.id(), "state", by, payload.dump());
    RunLine line = line_;
    if (waited) std::erase(line.runs, run.view.stored.number);
    if (step.next.state == RunState::queued) line.put(run.view.stored.number, 0);
    if (line != line_) line_is(std::move(line), by);
  }
  if (step.lost) lose(run);
  tell(run, by);
}

void RunDesk::tell(Run& run, std::string_view by) {
  run.view.changed_by = by;
  if (around_.changed) around_.changed(shown(run));
}

// How it ended before it went on again is kept until it ends otherwise, and told of a run that is
// over.
RunView RunDesk::shown(const Run& run) const {
  RunView view = run.view;
  name_time(view);
  if (run.is_over()) return view;
  StoredRun& stored = view.stored;
  for (std::string* fact : {&stored.outcome, &stored.cleanup, &stored.rig_fact, &stored.error,
                            &stored.dataset_sha256, &stored.dataset_error})
    fact->clear();
  view.since.reset();
  return view;
}

Result<RunView> RunDesk::order(std::string_view id, Order order, std::string_view by) {
  Run* run = find(id);
  if (run == nullptr)
    return fail({.code = Errc::not_found,
                 .where = "/params/run",
                 .what = "no such run",
                 .got = std::string(id)});
  const auto step = on_order(run->view.machine, run->limits, order, around_.now());
  if (!step) {
    Error refused = step.error();
    if (order == Order::resume && refused.hint.empty()) refused.hint = way_on(*run);
    return pass(std::move(refused), run->view.stored.id());
  }
  apply(*run, *step, by);
  return shown(*run);
}

Result<RunView> RunDesk::get(std::string_view id) const {
  const Run* run = find(id);
  if (run == nullptr)
    return fail({.code = Errc::not_found,
                 .where = "/params/run",
                 .what = "no such run",
                 .got = std::string(id)});
  return shown(*run);
}

std::vector<RunView> RunDesk::all() const {
  std::vector<RunView> out;
  for (const auto& run : runs_) out.push_back(shown(*run));
  return out;
}

void RunDesk::when_ended(std::string_view id, std::function<void(const RunView&)> told,
                         std::weak_ptr<const void> listener) {
  Run* run = find(id);
  if (run == nullptr) return;
  if (run->is_over()) return told(run->view);
  run->waiting.push_back({std::move(told), std::move(listener)});
}

void RunDesk::hand_over_is(std::string_view id, const HandOverFact& fact) {
  Run* const run = find(id);
  if (run == nullptr) return;
  run->view.hand_over = fact;
  tell(*run, "auto:hand_over");
}

Status RunDesk::takes_more() const {
  if (!closing_) return {};
  return fail({.code = Errc::wrong_state,
               .where = "daemon",
               .what = "this weftd has been told to end, and begins nothing any more",
               .hint = "Ask again once it has been started anew"});
}

void RunDesk::close() {
  if (std::exchange(closing_, true)) return;
  for (const auto& run : runs_) run->settler.request_stop();  // one that has only read so far
  const auto id = active();
  if (!id) return;
  Run& run = *find(*id);
  run.cut = !run.orders->ends_run();  // before its thread hears of it
  run.aborted_by_end = order(*id, Order::abort, shutdown).has_value();
}

void RunDesk::tick() {
  keep_again();
  look_at_folders();
  if (std::exchange(disk_is_awaited_, false)) begin_next();
  note_repeated(repeated_stops_.over(around_.now()));
  constexpr std::chrono::seconds set_otherwise{1};
  const auto ahead = wall_ahead();
  const bool clock_was_set = std::chrono::abs(ahead - wall_ahead_) > set_otherwise;
  if (clock_was_set) wall_ahead_ = ahead;
  for (const auto& run : runs_) {
    if (clock_was_set && run->view.attention && run->view.attention->at) tell(*run, "auto:clock");
    std::erase_if(run->waiting, [](const auto& each) { return each.listener.expired(); });
    const RunStep step = on_time(run->view.machine, run->limits, around_.now());
    if (step.next.state != run->state()) apply(*run, step, "auto:deadline");
  }
}

}  // namespace weft::daemon::control
