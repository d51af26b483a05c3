#include "daemon/service/runs/run_manager.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/base/file/sha256.hpp"
#include "recipes/schema/object_reader.hpp"

namespace weft::daemon::runs {
namespace {

/// An existing folder belongs to an older run of a daemon that lost its memory.
std::filesystem::path free_folder(const std::filesystem::path& wanted) {
  std::filesystem::path folder = wanted;
  std::error_code none;
  for (int i = 2; std::filesystem::exists(folder, none); ++i)
    folder = wanted.string() + "-" + std::to_string(i);
  return folder;
}

}  // namespace

// A user's label for a folder: one path component, not hidden, not like a command's option.
Status check_name(const std::string& name) {
  constexpr std::size_t longest = 100;
  if (name.empty() || recipes::is_name(name, longest)) return {};
  return fail(
      {.code = Errc::invalid_argument,
       .where = "/params/name",
       .what = "invalid name",
       .expected = "at most 100 letters, digits, '-', '_' and '.', not starting with - or .",
       .got = recipes::clipped(name)});
}

nlohmann::json submission_of(const StoredRun& run) {
  nlohmann::json out{{"recipe", run.recipe.stem().string()},
                     {"digest", "sha256:" + run.recipe_sha256},
                     {"trials_planned", run.trials_planned.value_or(0)},
                     {"folder", run.folder.string()}};
  if (run.seed) out["seed"] = *run.seed;
  if (!run.name.empty()) out["name"] = run.name;
  if (run.keep_going) out["keep_going"] = true;
  if (run.after != 0) out["after"] = run_id(run.after);
  if (!run.only_fabric.empty()) out["only_fabric"] = run.only_fabric;
  return out;
}

CampaignRequest request_for(const RunRequest& wanted, const std::filesystem::path& rig) {
  CampaignRequest request{wanted.recipe, rig, {}, wanted.seed};
  request.parameters_json = wanted.parameters_json;
  request.only_fabric = wanted.only_fabric;
  return request;
}

RunManager::RunManager(RunContext context, RunStore& store)
    : context_(std::move(context)), store_(store) {
  load();
  wall_ahead_ = wall_ahead();
}

void RunManager::load() {
  const auto known = store_.recent_runs(most_ended_loaded);
  const auto rig = store_.rig_state();
  if (!known || !rig) return;  // opening has just read them
  rig_ = *rig;
  // Each prompt has a journal line, so these names are new.
  if (const auto newest = store_.tail("", 1); newest && !newest->empty())
    prompts_ = OperatorPrompts(newest->front().sequence);
  RunChange change;
  std::vector<RunQueue::Run> waiting;
  for (const StoredRun& stored : *known) {
    Run& run = insert(make_run(stored));
    if (stored.state == RunState::queued) waiting.push_back(stored.number);
    if (!run.counted && count_trials(run)) change.put(run.to_store());
  }
  if (auto persisted = store_.queue()) queue_ = std::move(*persisted);
  const std::string paused_by = queue_.paused_by();
  queue_.on_restart(waiting);
  if (queue_.is_paused() && queue_.paused_by() != paused_by)
    change.journal.push_back(line("", "queue_paused", after_restart));
  change.queue = queue_;
  store_.persist(change);
  notify_queue(after_restart);
}

RunManager::~RunManager() {
  executor_.stop();
  maintenance_.stop();
  journal_repeated(repeated_stops_.take());
}

const StoredRun& RunManager::Run::to_store() {
  if (counted && trials_planned > 0) {
    stored.trials_done = static_cast<std::int64_t>(trials_done);
    stored.trials_planned = static_cast<std::int64_t>(trials_planned);
  }
  return stored;
}

void RunManager::Run::forget_folder() {
  external_resume.reset();
  certified_at.reset();
}

Result<RunManager::Run*> RunManager::find_queued(std::string_view id, std::string_view otherwise,
                                                 std::string_view hint) const {
  auto run = find(id);
  if (!run || (*run)->state() == RunState::queued) return run;
  return fail({.code = Errc::wrong_state,
               .where = "/params/run",
               .what = std::string(otherwise),
               .expected = "queued",
               .got = std::string(to_string((*run)->state())),
               .hint = std::string(hint)});
}

std::optional<std::string> RunManager::active() const {
  for (const auto& run : runs_)
    if (run->number() == executor_.run() || (run->state() != RunState::queued && !run->is_over()))
      return run->stored.id();
  return std::nullopt;
}

ManagerStatus RunManager::status() const {
  ManagerStatus out;
  const Run* const at_work = executor_.run() ? numbered(*executor_.run()) : nullptr;
  if (at_work != nullptr && at_work->is_over()) out.unresponsive = at_work->stored.id();
  if (const auto& order = maintenance_.order()) out.maintenance = to_string(order->kind);
  if (out.maintenance && context_.now() > maintenance_deadline_) out.unresponsive = out.maintenance;
  out.is_at_rest = !recovery_.is_settling() && (!out.maintenance || out.unresponsive) &&
                   (!active() || out.unresponsive);
  out.is_closing = closing_;
  if (at_work != nullptr) out.deadline = at_work->machine.deadline;
  if (out.maintenance) out.deadline = maintenance_deadline_;
  const auto next = queue_.first_allowed(rig_, [this](std::int64_t run) { return is_ready(run); });
  if (next) {
    const StoredRun& stored = numbered(*next)->stored;
    out.bytes_awaited = stored.resume ? 0 : stored.disk_bytes;
  }
  return out;
}

Status RunManager::require_accepting() const {
  if (!closing_) return {};
  return fail({.code = Errc::wrong_state,
               .where = "daemon",
               .what = "daemon is shutting down and starts nothing new",
               .hint = "Retry after weftd has been restarted"});
}

Status RunManager::can_submit(const RunRequest& wanted, const Checked& checked) const {
  if (Status more = require_accepting(); !more) return more;
  if (context_.one_run && !runs_.empty())
    return fail({.code = Errc::wrong_state,
                 .what = "daemon of a weft run accepts no further run",
                 .hint = "Start weftd --rig ... to queue more runs"});
  if (Status ok = check_name(wanted.name); !ok) return ok;
  if (!checked) return pass(checked.error());
  if (Status here = store_.in_place(); !here) return here;
  if (queue_.runs().size() + wanted.copies > most_queued)
    return fail({.code = Errc::wrong_state,
                 .where = "queue",
                 .what = "queue full",
                 .expected = "at most " + std::to_string(most_queued) + " runs",
                 .got = std::to_string(queue_.runs().size()) + " queued, " +
                        std::to_string(wanted.copies) + " new",
                 .hint = "Put repetitions into the recipe"});
  if (wanted.copies == 0 || wanted.copies > most_copies)
    return fail({.code = Errc::range,
                 .where = "/params/repeat",
                 .what = "number of copies out of range",
                 .expected = "1 to " + std::to_string(most_copies),
                 .got = std::to_string(wanted.copies)});
  if (wanted.seed && *wanted.seed > std::numeric_limits<std::uint64_t>::max() - wanted.copies)
    return fail({.code = Errc::range,
                 .where = "/params/seed",
                 .what = "seed too large for the number of copies",
                 .expected = "a seed below 2^64 minus the copies",
                 .got = std::to_string(*wanted.seed)});
  return context_.check_space(context_.data, wanted.copies * disk_forecast(checked->plan));
}

Result<RunView> RunManager::submit(const RunRequest& wanted, const Checked& checked) {
  if (Status ok = can_submit(wanted, checked); !ok) return pass(ok.error());
  const std::string sha256 = sha256_hex(checked->recipe_text);
  if (!wanted.digest.empty() && wanted.digest != "sha256:" + sha256)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/digest",
                 .what = "recipe has changed since it was checked",
                 .expected = "sha256:" + sha256,
                 .got = wanted.digest,
                 .hint = "Review the change with recipe.diff or recipe.check"});
  const auto first = store_.next_number();
  if (!first) return pass(first.error());
  const auto after = followed(*first, wanted.after);
  if (!after) return pass(after.error());
  RunQueue queue = queue_;
  RunChange change{.recipes = {{sha256, checked->recipe_text}}};
  for (std::size_t i = 0; i < wanted.copies; ++i) {
    StoredRun run = stored_run(wanted, checked, *first + static_cast<std::int64_t>(i));
    if (run.seed) *run.seed += i;
    run.after = *after;
    queue.put(run.number, wanted.place ? std::min(*wanted.place, most_queued) + i : most_queued);
    change.journal.push_back(line(run.id(), "submitted", wanted.by, submission_of(run)));
    change.journal.back().utc_us = run.created_us;
    change.runs.push_back(std::move(run));
  }
  const std::vector<StoredRun> added = change.runs;
  if (Status persisted = commit(std::move(queue), std::move(change)); !persisted)
    return pass(persisted.error());
  const PlanSummary plan = summarize(checked->plan, runs_in_real_time(context_.rig));
  for (const StoredRun& run : added) {
    Run& one = *runs_.emplace_back(std::make_unique<Run>());
    one.stored = run;
    use_plan(one, plan);
  }
  for (const StoredRun& run : added) notify(*numbered(run.number), wanted.by);
  notify_queue(wanted.by);
  begin_next();
  return shown(*numbered(*first));
}

StoredRun RunManager::stored_run(const RunRequest& wanted, const Checked& checked,
                                 std::int64_t number) const {
  StoredRun run;
  run.number = number;
  run.recipe_sha256 = sha256_hex(checked->recipe_text);
  run.recipe = wanted.recipe;
  run.rig = context_.rig;
  run.seed = wanted.seed;
  run.name = wanted.name;
  run.by = wanted.by;
  run.user = wanted.user;
  run.keep_going = wanted.keep_going;
  run.created_us = context_.utc_us();
  run.bench = to_string(load_bench_kind(context_.rig));
  run.trials_done = 0;
  run.trials_planned = static_cast<std::int64_t>(checked->plan.trials.size());
  run.folder = wanted.folder.empty() ? folder_for(run) : wanted.folder;
  run.disk_bytes = disk_forecast(checked->plan);
  run.only_fabric = wanted.only_fabric.value_or("");
  run.fabrics = run.only_fabric.empty() ? joined(checked->plan.fabrics, " ") : run.only_fabric;
  return run;
}

std::filesystem::path RunManager::folder_for(const StoredRun& run) const {
  return free_folder(context_.data / (run.id() + (run.name.empty() ? "" : "-" + run.name)));
}

void RunManager::use_plan(Run& run, const PlanSummary& plan) {
  run.trials_planned = plan.trials;
  run.limits = plan.limits;
  PlannedTime time = plan.time;
  if (run.stored.resume) time.first = std::min(run.trials_done, time.trials);
  run.forecast = RunForecast(time);
  run.stored.disk_bytes = plan.disk_bytes;
  // A person watches it in a terminal: without an order there is no deadline.
  if (context_.one_run) run.limits.arming = run.limits.running = Deadlines::Duration::max();
  prompts_.on_plan(run.number(), run.stored.resume ? std::nullopt : plan.first_prompt);
}

void RunManager::stage(Run& run, const RunStep& step, std::string_view by, RunChange& change) {
  const bool is_change = step.next.state != run.state();
  run.machine = step.next;
  if (step.order && executor_.run() == run.number())
    executor_.give({*step.order, std::string(by), prompts_.ticket(run.number())});
  if (!is_change) return;
  prompts_.on_state(run.number(), step.next.state);
  if (step.next.state >= RunState::finishing && !run.is_over()) run.end_ordered_by = by;
  if (step.lost) give_up(run, change);
  StoredRun& stored = run.stored;
  stored.state = step.next.state;
  if (run.is_over()) stored.rig_untaken = false;  // not earlier: the daemon may die before
  change.put(run.to_store());
  change.journal.push_back(state_line(stored, context_.utc_us(), by));
  if (queue_.remove(stored.number)) change.queue = queue_;
}

void RunManager::apply(Run& run, const RunStep& step, std::string_view by, RunChange change) {
  stage(run, step, by, change);
  if (!change.is_empty()) store_.persist(change);  // tick() retries a failed write
  if (change.rig) notify_rig(by);
  if (change.queue) notify_queue(by);
  if (step.lost) notify_ended(run);
  notify(run, by);
}

void RunManager::notify(Run& run, std::string_view by) {
  run.changed_by = by;
  context_.observer->on_run_changed(shown(run));
}

void RunManager::notify_queue(std::string_view by) {
  context_.observer->on_queue_changed(queue_, by);
}

void RunManager::notify_rig(std::string_view by) {
  context_.observer->on_rig_state_changed(rig_, by);
}

void RunManager::notify_ended(Run& run) {
  for (const auto& each : std::exchange(run.waiting, {}))
    if (!each.listener.expired()) each.on_ended(shown(run));
}

// The previous end of a resumed run is kept until its next end, and is shown while it is over.
// Prompt times use the machine's clock, which may have been set since they were computed.
RunView RunManager::shown(const Run& run) const {
  RunView view = run;
  const Run* const first = run.state() == RunState::queued ? run_before(run) : nullptr;
  view.is_blocked = first != nullptr && first->is_over() && !is_ready(run.number());
  if (const OperatorPrompt* const prompt = prompts_.find(run.number())) {
    view.operator_prompt = *prompt;
    using std::chrono::milliseconds;
    if (const auto at = prompt_time(run, *prompt))
      view.operator_prompt->at_us =
          std::chrono::duration_cast<milliseconds>(*at + wall_ahead()).count() * 1000;
  }
  if (view.is_over()) {
    if (context_.find_handover) view.handover = context_.find_handover(run.number());
    return view;
  }
  view.wall_left_s = left_s(run);
  const RunFacts& facts = run.stored;
  view.stored.facts() = {.bench_outcome = facts.bench_outcome, .bench_error = facts.bench_error};
  view.external_resume.reset();
  return view;
}

std::optional<double> RunManager::left_s(const Run& run) const {
  const RunState state = run.state();
  if (state == RunState::aborting || state == RunState::halting) return std::nullopt;
  return state == RunState::finishing ? run.forecast.trial_left_s(pace(), context_.now())
                                      : run.forecast.left_s(pace(), context_.now());
}

std::optional<std::chrono::nanoseconds> RunManager::prompt_time(
    const Run& run, const OperatorPrompt& prompt) const {
  if (prompt.at || run.state() != RunState::running) return prompt.at;
  const auto now = context_.now();
  const auto left_s = run.forecast.left_until_s(prompt.prompt.trial, pace(), now);
  if (!left_s) return std::nullopt;
  return now + std::chrono::nanoseconds(std::llround(*left_s * 1e9));
}

double RunManager::pace() const {
  return context_.pace == nullptr ? 0 : context_.pace->load();
}

std::chrono::nanoseconds RunManager::wall_ahead() const {
  const std::int64_t wall_us = context_.wall_us ? context_.wall_us() : context_.utc_us();
  return std::chrono::microseconds(wall_us) - context_.now();
}

JournalLine RunManager::line(std::string_view run, std::string_view kind,
                             std::string_view by) const {
  return {0, context_.utc_us(), std::string(run), std::string(kind), std::string(by)};
}

JournalLine RunManager::line(std::string_view run, std::string_view kind, std::string_view by,
                             const nlohmann::json& payload) const {
  JournalLine out = line(run, kind, by);
  out.payload_json = payload.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return out;
}

void RunManager::journal(std::string_view run, std::string_view kind, std::string_view by,
                         const nlohmann::json& payload) {
  store_.persist({.journal = {line(run, kind, by, payload)}});
}

void RunManager::when_ended(std::string_view id, std::function<void(const RunView&)> on_ended,
                            std::weak_ptr<const void> listener) {
  const auto run = find(id);
  if (!run) return;
  if ((*run)->is_over()) return on_ended(shown(**run));
  (*run)->waiting.push_back({std::move(on_ended), std::move(listener)});
}

void RunManager::notify_changed(std::string_view id, std::string_view by) {
  if (const auto run = find(id)) notify(**run, by);
}

void RunManager::close() {
  if (std::exchange(closing_, true)) return;
  recovery_.stop_settling();
  stop_maintenance(Order::abort, by_shutdown);
  const auto id = active();
  if (!id) return;
  executor_.cut();  // before its thread gets the order
  (*find(*id))->aborted_by_end = order(*id, Order::abort, by_shutdown).has_value();
}

void RunManager::tick() {
  store_.persist({});
  scan_folders();
  journal_repeated(repeated_stops_.take(context_.now()));
  constexpr std::chrono::seconds set_otherwise{1};
  const auto ahead = wall_ahead();
  const bool clock_was_set = std::chrono::abs(ahead - wall_ahead_) > set_otherwise;
  if (clock_was_set) wall_ahead_ = ahead;
  std::vector<Run*> all;  // notifications may load more runs
  for (const auto& run : runs_) all.push_back(run.get());
  for (Run* const run : all) {
    const OperatorPrompt* const prompt = prompts_.find(run->number());
    if (clock_was_set && prompt != nullptr && prompt_time(*run, *prompt))
      notify(*run, "auto:clock");
    std::erase_if(run->waiting, [](const auto& each) { return each.listener.expired(); });
    const RunStep step = on_time(run->machine, run->limits, context_.now());
    if (step.next.state != run->state()) apply(*run, step, "auto:deadline");
  }
  unload_ended();
}

}  // namespace weft::daemon::runs
