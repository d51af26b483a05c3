#include "daemon/service/daemon/metrics.hpp"

#include <unistd.h>

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/base/version/software_version.hpp"

namespace weft::daemon::server {
namespace {

constexpr std::array<std::string_view, 5> rig_states{"safe", "holding", "moving", "unknown",
                                                     "latched"};
constexpr std::array<std::string_view, 5> outcomes{"complete", "stopped", "aborted", "failed",
                                                   "interrupted"};

template <class Number>
double number(Number value) {
  return static_cast<double>(value);
}

std::string value_text(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end.ptr};
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\n') {
      out += "\\n";
      continue;
    }
    if (c == '\\' || c == '"') out += '\\';
    out += c;
  }
  return out;
}

/// Resident memory of this process [bytes].
std::optional<double> resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t size = 0, resident = 0;
  if (!(file >> size >> resident)) return std::nullopt;
  return number(resident) * number(sysconf(_SC_PAGESIZE));
}

void add_optional(Exposition& out, const std::optional<double>& value) {
  if (value) out.sample(*value);
}

void add_daemon(const MetricsSources& sources, Exposition& out) {
  const auto& [services, shared, notifier] = sources;
  out.family("weft_build_info", MetricType::gauge, "Version of weftd; the value is 1.");
  out.sample(1, {{"version", software_version()}, {"rig", services.rig_name}});
  out.family("process_resident_memory_bytes", MetricType::gauge, "Resident memory of weftd.");
  add_optional(out, resident_bytes());
  out.family("weft_disk_free_bytes", MetricType::gauge, "Free space in the folder of runs.");
  std::error_code error;
  const auto disk = std::filesystem::space(services.data, error);
  if (!error) out.sample(number(disk.available));
  out.family("weft_sessions", MetricType::gauge,
             "Connected clients, including active HTTP requests.");
  out.sample(number(shared.sessions.size()));
  out.family("weft_event_listeners", MetricType::gauge, "Open subscriptions to events.");
  out.sample(number(services.hub->listeners()));
  out.family("weft_events_total", MetricType::counter, "Events published.");
  out.sample(number(services.hub->seq()));
}

void add_requests(const RequestCounts& counts, Exposition& out) {
  out.family("weft_requests_total", MetricType::counter, "Requests that reached a method.");
  for (const auto& [name, count] :
       {std::pair("read", counts.reads), {"change", counts.changes}, {"stop", counts.stops}})
    out.sample(number(count), {{"class", name}});
  out.family("weft_requests_refused_total", MetricType::counter,
             "Requests answered with an error.");
  out.sample(number(counts.refused));
  out.family("weft_tokens_refused_total", MetricType::counter,
             "Sessions refused for a wrong token.");
  out.sample(number(counts.wrong_tokens));
}

void add_rig(const api::Services& services, Exposition& out) {
  const std::string rig = api::rig_json(*services.run_manager).at("rig");
  out.family("weft_rig_state", MetricType::gauge, "State of the rig: 1 for the current one.");
  out.states(rig_states, rig);
  const runs::RunQueue& queue = services.run_manager->queue();
  out.family("weft_queue_length", MetricType::gauge, "Queued runs.");
  out.sample(number(queue.runs().size()));
  out.family("weft_queue_paused", MetricType::gauge, "1 while the queue is paused.");
  out.sample(queue.is_paused() ? 1 : 0);
}

/// Metrics of the active run; without one the families have no samples.
void add_run(const api::Services& services, Exposition& out) {
  const auto active = services.run_manager->active();
  std::optional<runs::RunView> run;
  if (active)
    if (auto found = services.run_manager->get(*active)) run = std::move(*found);
  out.family("weft_run_active", MetricType::gauge, "1 while a run is active.");
  out.sample(run ? 1 : 0);
  out.family("weft_run_state", MetricType::gauge,
             "State of the active run: 1 for the current one.");
  for (const runs::RunState state : runs::all_run_states)
    out.sample(run && run->state() == state ? 1 : 0, {{"state", std::string(to_string(state))}});
  const auto add = [&](std::string_view name, std::string_view help, const auto& value) {
    out.family(name, MetricType::gauge, help);
    if (run) add_optional(out, value(*run));
  };
  using Value = std::optional<double>;
  using runs::RunView;
  add("weft_run_number", "Number of the active run.",
      [](const RunView& r) -> Value { return number(r.stored.number); });
  add("weft_run_trials_done", "Trials done of the active run.",
      [](const RunView& r) -> Value { return number(r.trials_done); });
  add("weft_run_trials_planned", "Trials planned of the active run.",
      [](const RunView& r) -> Value { return number(r.trials_planned); });
  add("weft_run_attempts_rejected", "Rejected attempts of the active run.",
      [](const RunView& r) -> Value { return number(r.attempts_rejected); });
  add("weft_run_left_seconds", "Expected time until the active run ends.",
      [](const RunView& r) -> Value { return r.wall_left_s; });
  add("weft_run_force_rms_error_newtons", "RMS force error in the newest trial of the active run.",
      [](const RunView& r) { return r.force_rms_error_n; });
  add("weft_run_frames_lost", "Sensor frames lost in the active run up to its newest trial.",
      [](const RunView& r) -> Value { return number(r.frames_lost); });
  add("weft_run_recorder_lag_seconds", "Longest disk commit during the newest trial.",
      [](const RunView& r) { return r.recorder_lag_s; });
}

void add_notifications(const notify::Notifier& notifier, Exposition& out) {
  const auto& ended = notifier.runs_ended();
  out.family("weft_runs_ended_total", MetricType::counter, "Runs that have ended, by outcome.");
  for (const std::string_view outcome : outcomes) {
    const auto found = ended.find(std::string(outcome));
    out.sample(found == ended.end() ? 0 : number(found->second),
               {{"outcome", std::string(outcome)}});
  }
  const auto senders = notifier.counts();
  const auto add = [&](std::string_view name, MetricType type, std::string_view help,
                       const auto& value) {
    out.family(name, type, help);
    for (const auto& [to, counts] : senders) out.sample(number(value(counts)), {{"to", to}});
  };
  using notify::DeliveryCounts;
  add("weft_notifications_sent_total", MetricType::counter, "Events delivered.",
      [](const DeliveryCounts& c) { return c.sent; });
  add("weft_notifications_lost_total", MetricType::counter, "Events dropped without delivery.",
      [](const DeliveryCounts& c) { return c.lost; });
  add("weft_notifications_waiting", MetricType::gauge, "Events waiting for delivery.",
      [](const DeliveryCounts& c) { return c.waiting; });
}

}  // namespace

void Exposition::family(std::string_view name, MetricType type, std::string_view help) {
  name_ = name;
  // OpenMetrics names a counter without the suffix of its samples.
  constexpr std::string_view total = "_total";
  std::string family(name);
  const bool is_counter = type == MetricType::counter;
  if (is_counter && is_open_metrics_) family.resize(family.size() - total.size());
  text_ += "# TYPE " + family + (is_counter ? " counter\n" : " gauge\n");
  text_ += "# HELP " + family + " " + escaped(help) + "\n";
}

void Exposition::sample(double value, const Labels& labels) {
  text_ += name_;
  char before = '{';
  for (const auto& [label, text] : labels) {
    ((text_ += before) += label) += "=\"" + escaped(text) + "\"";
    before = ',';
  }
  text_ += (labels.empty() ? " " : "} ") + value_text(value) + "\n";
}

std::string metrics_text(const MetricsSources& sources, bool is_open_metrics) {
  Exposition out(is_open_metrics);
  add_daemon(sources, out);
  add_requests(sources.shared.counts, out);
  add_rig(sources.services, out);
  add_run(sources.services, out);
  add_notifications(sources.notifier, out);
  return out.text();
}

}  // namespace weft::daemon::server
