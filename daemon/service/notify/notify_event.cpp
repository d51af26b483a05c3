#include "daemon/service/notify/notify_event.hpp"

#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/base/text/format.hpp"

namespace weft::daemon::notify {
namespace {

constexpr int usual = 3, high = 4, urgent = 5;  // priorities

/// Describes the end of a run; its three facts replace a longer text, the error is a sentence.
std::string end_text(const Event& end) {
  std::string text = std::to_string(end.trials_done) + " of " + std::to_string(end.trials_planned) +
                     " trials; clean-up " + (end.cleanup.empty() ? "unknown" : end.cleanup) +
                     ", rig " + (end.rig.empty() ? "unknown" : end.rig) + ".";
  if (!end.error.empty()) text += " " + end.error;
  return text;
}

std::string gigabytes(std::uint64_t bytes) {
  return fixed(static_cast<double>(bytes) * 1e-9, 1);
}

}  // namespace

std::string_view to_string(EventKind kind) {
  return event_names[static_cast<std::size_t>(kind)];
}

nlohmann::json to_json(const Event& event) {
  return {{"event", to_string(event.kind)},
          {"t_us", event.utc_us},
          {"time", utc_text(event.utc_us)},
          {"priority", event.priority},
          {"bench", event.bench},
          {"title", event.title},
          {"text", event.text},
          {"run", event.run},
          {"outcome", event.outcome},
          {"cleanup", event.cleanup},
          {"rig", event.rig},
          {"error", event.error},
          {"trials_done", event.trials_done},
          {"trials_planned", event.trials_planned}};
}

std::string format_event_json(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Event EventDetector::make(EventKind kind, std::int64_t utc_us, int priority, std::string title,
                          std::string text) const {
  Event event;
  event.kind = kind;
  event.utc_us = utc_us;
  event.priority = priority;
  event.bench = bench_;
  event.title = bench_ + ": " + std::move(title);
  event.text = std::move(text);
  return event;
}

Event EventDetector::end_of(const runs::RunView& run, std::int64_t utc_us) const {
  const runs::RunFacts& facts = run.stored;
  const bool interrupted = run.state() == runs::RunState::interrupted;
  const std::string outcome = interrupted || facts.outcome.empty() ? "interrupted" : facts.outcome;
  const bool failed = outcome == "failed";
  Event end = make(failed ? EventKind::run_failed : EventKind::run_ended, utc_us,
                   failed                  ? urgent
                   : outcome == "complete" ? usual
                                           : high,
                   run.stored.id() + " " + outcome, {});
  end.run = run.stored.id();
  end.outcome = outcome;
  end.cleanup = facts.cleanup;
  end.rig = facts.rig_fact;
  end.error = facts.error;
  end.trials_done = run.trials_done;
  end.trials_planned = run.trials_planned;
  end.text = end_text(end);
  return end;
}

std::vector<Event> EventDetector::on_run(const runs::RunView& run, std::int64_t utc_us) {
  if (run.is_over()) {
    const auto was = open_.extract(run.stored.number);
    if (!was || !was.mapped().has_begun) return {};  // removed from the queue: no end
    std::vector<Event> events{end_of(run, utc_us)};
    ++ended_[events.front().outcome];
    if (open_.empty())
      events.push_back(make(EventKind::queue_empty, utc_us, usual, "queue empty",
                            run.stored.id() + " was the last queued run."));
    return events;
  }
  OpenRun& open = open_[run.stored.number];
  open.has_begun = run.state() != runs::RunState::queued;
  const auto& prompt = run.operator_prompt;
  if (run.state() != runs::RunState::awaiting_operator || !prompt || prompt->step.empty() ||
      prompt->step == open.prompt)
    return {};
  open.prompt = prompt->step;
  Event event =
      make(EventKind::operator_needed, utc_us, high, "operator needed", prompt->prompt.text);
  event.run = run.stored.id();
  event.trials_done = run.trials_done;
  event.trials_planned = run.trials_planned;
  return {std::move(event)};
}

std::optional<Event> EventDetector::on_rig(const runs::RigState& rig, std::int64_t utc_us) {
  const std::optional<runs::RigState> was = std::exchange(rig_, rig);
  if (!was || !rig.is_latched()) return std::nullopt;
  if (was->is_latched() && was->is_emergency() == rig.is_emergency()) return std::nullopt;
  Event event =
      make(EventKind::rig_latched, utc_us, urgent, rig.is_emergency() ? "e-stop" : "halted",
           "Latched by " + rig.facts().latch->why + ".");
  event.rig = "latched";
  return event;
}

std::optional<Event> EventDetector::on_disk(std::uint64_t free_bytes, std::int64_t utc_us) {
  if (free_bytes >= disk_low_bytes_ + disk_low_bytes_ / 10) disk_is_low_ = false;
  if (free_bytes >= disk_low_bytes_ || std::exchange(disk_is_low_, true)) return std::nullopt;
  return make(EventKind::disk_low, utc_us, high, "disk low",
              gigabytes(free_bytes) + " GB free, limit " + gigabytes(disk_low_bytes_) + " GB.");
}

}  // namespace weft::daemon::notify
