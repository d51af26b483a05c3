#include "daemon/service/handover/handover_service.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/analysis/campaign_report/campaign_report.hpp"
#include "daemon/base/loop/threads.hpp"
#include "daemon/base/loop/wall_clock.hpp"

namespace weft::daemon::handover {
namespace {

using nlohmann::json;

/// A handover that crashes the daemon each time would otherwise block the rig for good.
constexpr std::size_t most_attempts = 2;

/// Half of the processors: the next run needs the other half, whatever the scheduler does.
std::size_t threads_in_background() {
  return std::max(1U, std::thread::hardware_concurrency() / 2);
}

ReportOptions report_options(const HandoverHooks& hooks, const StopRequested& stop) {
  ReportOptions out;
  out.threads = hooks.threads;
  out.progress = hooks.progress;
  out.stop = stop;
  return out;
}

HandoverStatus status_of(HandoverState state, std::string_view by, std::size_t attempts = 0) {
  HandoverStatus fact;
  fact.state = state;
  fact.by = by;
  fact.attempts = attempts;
  return fact;
}

tl::unexpected<Error> no_handover(std::string_view run) {
  return fail(
      {.code = Errc::not_found,
       .where = "/params/run",
       .what = "run without handover",
       .got = std::string(run),
       .hint = "Put hand_over into the recipe; the handover starts when the campaign is complete"});
}

}  // namespace

Result<std::optional<HandoverStatus>> HandoverStore::find(std::int64_t run) {
  auto row = database_->prepare(
      "SELECT state, by, error, result_json, attempts FROM hand_over WHERE run = ?");
  if (!row) return pass(row.error());
  const auto found = row->bind(1, run).step();
  if (!found) return pass(found.error());
  if (!*found) return std::optional<HandoverStatus>();
  const auto state = handover_state_from(row->text(0));
  if (!state)
    return fail({.code = Errc::corrupt,
                 .where = "hand_over",
                 .what = "unknown handover state",
                 .got = row->text(0)});
  HandoverStatus fact = status_of(*state, row->text(1), static_cast<std::size_t>(row->integer(4)));
  fact.error = row->text(2);
  fact.result_json = row->text(3);
  return std::optional(std::move(fact));
}

Result<std::vector<std::int64_t>> HandoverStore::unfinished() {
  std::vector<std::int64_t> out;
  const Status read = database_->each(
      "SELECT number FROM run LEFT JOIN hand_over ON hand_over.run = number WHERE "
      "run.state = 'ended' AND (outcome = 'complete' OR trials_done = trials_planned) AND "
      "(hand_over.run IS NULL OR hand_over.state IN ('waiting', 'running')) ORDER BY number",
      [&out](const sqlite::Statement& row) { out.push_back(row.integer(0)); });
  if (!read) return pass(read.error());
  return out;
}

Status HandoverStore::persist(std::int64_t run, const HandoverStatus& fact) {
  auto change = database_->prepare_to_write(
      "INSERT OR REPLACE INTO hand_over (run, state, by, error, result_json, attempts) VALUES "
      "(?,?,?,?,?,?)");
  if (!change) return pass(change.error());
  return change->run(run, to_string(fact.state), fact.by, fact.error, fact.result_json,
                     static_cast<std::int64_t>(fact.attempts));
}

HandoverService::HandoverService(HandoverContext context, runs::RunStore& journal)
    : context_(std::move(context)), journal_(journal), store_(journal.database()) {}

HandoverService::~HandoverService() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  put_off();
}

// Ending the daemon on purpose does not count as an attempt.
void HandoverService::put_off() {
  thread_.request_stop();
  if (active_.empty()) return;
  Item& item = *find(active_);
  item.fact.state = cancelled_by_.empty() ? HandoverState::waiting : HandoverState::cancelled;
  if (!cancelled_by_.empty()) item.fact.by = cancelled_by_;
  --item.fact.attempts;
  static_cast<void>(store_.persist(item.run.number, item.fact));
}

HandoverService::Item* HandoverService::find(std::string_view run) {
  const auto found = items_.find(run);
  return found == items_.end() ? nullptr : &found->second;
}

std::optional<HandoverStatus> HandoverService::load(std::string_view run) const {
  if (const auto found = items_.find(run); found != items_.end()) return found->second.fact;
  const auto number = runs::run_number(run);
  if (!number) return std::nullopt;
  auto stored = store_.find(*number);
  return stored ? std::move(*stored) : std::nullopt;
}

std::optional<HandoverStatus> HandoverService::get(std::string_view run) const {
  auto found = load(run);
  return found && found->state != HandoverState::none ? std::move(found) : std::nullopt;
}

void HandoverService::resume() {
  const auto numbers = store_.unfinished();
  if (!numbers) return;
  for (const std::int64_t number : *numbers)
    if (const auto run = journal_.run(number); run && *run) consider(**run, {});
}

void HandoverService::consider(const runs::StoredRun& run, std::optional<bool> wanted) {
  if (run.state != runs::RunState::ended || !run.has_all() || items_.contains(run.id())) return;
  const auto known = store_.find(run.number);
  if (!known || (*known && is_over((*known)->state))) return;
  const HandoverStatus fact = *known ? **known : initial_status(run, wanted);
  Item& item = items_.emplace(run.id(), Item{run, fact}).first->second;
  if (!is_over(fact.state))
    return fact.attempts < most_attempts ? enqueue(item, fact.by) : give_up(item);
  const Status persisted = store_.persist(run.number, fact);
  if (fact.state != HandoverState::none) context_.on_changed(run.id(), fact);
  if (persisted) items_.erase(run.id());
}

/// Uses the campaign's own recipe, because the one in the recipe folder may have changed since. It
/// is read here only if the run has not reported it: a run that ended under an earlier daemon.
HandoverStatus HandoverService::initial_status(const runs::StoredRun& run,
                                               std::optional<bool> wanted) {
  HandoverStatus fact;
  fact.by = runs::by_recipe;
  if (!wanted) {
    std::error_code unseen;
    if (!std::filesystem::exists(run.folder, unseen)) return {};  // the folder was moved or removed
    const auto read = load_handover_spec(run.folder);
    if (!read) {
      fact.state = HandoverState::failed;
      fact.error = to_string(read.error());
      return fact;
    }
    wanted = read->has_value();
  }
  if (*wanted) fact.state = HandoverState::waiting;
  return fact;
}

void HandoverService::give_up(Item& item) {
  HandoverStatus fact = status_of(HandoverState::failed, runs::after_restart);
  fact.error = "the daemon ended twice during this handover; retry it with handover.start";
  enter(item, std::move(fact));
}

void HandoverService::enqueue(Item& item, std::string_view by) {
  queue_.push_back(item.run.id());
  enter(item, status_of(HandoverState::waiting, by, item.fact.attempts));
  begin_next();
}

// A finished handover is dropped from memory once it is written.
void HandoverService::enter(Item& item, HandoverStatus fact) {
  item.fact = std::move(fact);
  const Status persisted = store_.persist(item.run.number, item.fact);
  const json payload{{"state", to_string(item.fact.state)}, {"error", item.fact.error}};
  static_cast<void>(
      journal_.append_journal(context_.utc_us(), item.run.id(), "hand_over", item.fact.by,
                              payload.dump(-1, ' ', false, json::error_handler_t::replace)));
  context_.on_changed(item.run.id(), item.fact);
  if (!is_over(item.fact.state)) return;
  const auto waiting = std::exchange(item.waiting, {});
  if (persisted) items_.erase(item.run.id());
  for (const auto& each : waiting)
    if (!each.listener.expired()) each.on_over();
}

void HandoverService::begin_next() {
  if (!active_.empty() || queue_.empty()) return;
  active_ = queue_.front();
  queue_.pop_front();
  Item& item = *find(active_);
  // Recorded first, because the handover may crash the daemon.
  enter(item, status_of(HandoverState::running, item.fact.by, item.fact.attempts + 1));
  thread_ = std::jthread([this, id = active_, folder = item.run.folder](std::stop_token stop) {
    set_low_priority();
    HandoverHooks hooks;
    hooks.stop = [&stop] { return stop.stop_requested(); };
    hooks.seconds_now = steady_wall_seconds;
    hooks.threads = threads_in_background();
    hooks.progress = [this, &id](const EvaluationProgress& progress) {
      context_.post([this, id, progress] { progressed(id, progress); });
    };
    hooks.report = [&](const Dataset& data, const HandoverResult& reached,
                       std::vector<HandoverText> records, const StopRequested& over) {
      ReportOptions options = report_options(hooks, over);
      options.handover_files = std::move(records);
      return report_texts(folder, data, reached, std::move(options));
    };
    const auto result = catch_as_error([&] { return run_handover(folder, hooks); }, "hand-over");
    give_back_free_memory();
    context_.post([this, id, result] { ended(id, result); });
  });
}

void HandoverService::progressed(const std::string& id, const EvaluationProgress& progress) {
  Item& item = *find(id);
  item.fact.step = progress.step;
  item.fact.steps = progress.steps;
  item.fact.what = progress.what;
  context_.on_changed(id, item.fact);
}

void HandoverService::ended(const std::string& id, const Result<HandoverResult>& result) {
  Item& item = *find(id);
  HandoverStatus fact;
  fact.by = item.fact.by;
  const std::string cancelled_by = std::exchange(cancelled_by_, {});
  if (result) {
    fact.state = HandoverState::done;
    fact.result_json =
        handover_result_json(*result).dump(-1, ' ', false, json::error_handler_t::replace);
  } else {
    fact.state = cancelled_by.empty() ? HandoverState::failed : HandoverState::cancelled;
    if (!cancelled_by.empty()) fact.by = cancelled_by;
    fact.error = to_string(result.error());
  }
  thread_.join();  // this was its last message
  active_.clear();
  enter(item, std::move(fact));
  begin_next();
}

Status HandoverService::again(std::string_view run, std::string_view by) {
  const auto known = get(run);
  if (!known) return no_handover(run);
  if (!is_over(known->state))
    return fail({.code = Errc::wrong_state,
                 .where = "/params/run",
                 .what = "handover in progress",
                 .expected = "done, failed or cancelled",
                 .got = std::string(to_string(known->state))});
  const auto stored = journal_.run(runs::run_number(run).value_or(0));
  if (!stored) return pass(stored.error());
  if (!*stored) return no_handover(run);
  enqueue(items_.insert_or_assign(std::string(run), Item{**stored, *known}).first->second, by);
  return {};
}

Status HandoverService::cancel(std::string_view run, std::string_view by) {
  const auto known = get(run);
  if (!known) return no_handover(run);
  if (is_over(known->state))
    return fail({.code = Errc::wrong_state,
                 .where = "/params/run",
                 .what = "handover has ended",
                 .expected = "waiting or running",
                 .got = std::string(to_string(known->state))});
  Item* const item = find(run);
  if (active_ == run) {
    cancelled_by_ = by;
    thread_.request_stop();
    return {};
  }
  std::erase(queue_, run);
  if (item != nullptr) enter(*item, status_of(HandoverState::cancelled, by));
  return {};
}

void HandoverService::when_over(std::string_view run, std::function<void()> on_over,
                                std::weak_ptr<const void> listener) {
  Item* const item = find(run);
  if (item == nullptr || is_over(item->fact.state)) return on_over();
  std::erase_if(item->waiting, [](const auto& each) { return each.listener.expired(); });
  item->waiting.push_back({std::move(on_over), std::move(listener)});
}

}  // namespace weft::daemon::handover
