#include "daemon/service/notify/notifier.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/service/notify/mqtt_publisher.hpp"
#include "daemon/service/notify/webhook.hpp"

namespace weft::daemon::notify {
namespace {

using nlohmann::json;

constexpr std::chrono::seconds disk_period{10}, state_period{1};

std::uint64_t disk_limit(const std::optional<NotifySettings>& settings) {
  return settings ? settings->disk_low_bytes : 0;
}

bool is_due(std::optional<Clock>& last, Clock now, Clock period) {
  if (last && now - *last < period) return false;
  last = now;
  return true;
}

}  // namespace

Notifier::Notifier(NotifierContext context, const std::optional<NotifySettings>& settings)
    : context_(std::move(context)),
      detector_(context_.bench, disk_limit(settings)),
      state_(std::make_unique<json>(json{{"bench", context_.bench},
                                         {"run", nullptr},
                                         {"run_state", "idle"},
                                         {"trials_done", 0},
                                         {"trials_planned", 0},
                                         {"operator_prompt", nullptr},
                                         {"rig", "safe"},
                                         {"latched", false},
                                         {"queue_length", 0},
                                         {"queue_paused_by", nullptr},
                                         {"last_run", nullptr},
                                         {"last_outcome", nullptr},
                                         {"disk_free_bytes", nullptr}})) {
  if (!settings) return;
  wanted_ = settings->events;
  if (settings->webhook) {
    webhook_ = std::make_unique<Webhook>(*settings->webhook);
    senders_.push_back({"webhook", &webhook_->outbox()});
  }
  if (settings->mqtt) {
    mqtt_ = std::make_unique<MqttPublisher>(*settings->mqtt, context_.client);
    senders_.push_back({"mqtt", &mqtt_->outbox()});
  }
}

Notifier::~Notifier() = default;

Result<std::unique_ptr<Notifier>> Notifier::open(NotifierContext context,
                                                 const std::filesystem::path& file) {
  std::optional<NotifySettings> settings;
  if (!file.empty()) {
    auto loaded = load_notify_settings(file, context.bench);
    if (!loaded) return pass(loaded.error());
    settings = std::move(*loaded);
  }
  return std::make_unique<Notifier>(std::move(context), settings);
}

void Notifier::close() {
  publish_state(Clock::max());
  senders_.clear();
  webhook_.reset();
  mqtt_.reset();
}

void Notifier::send(const Event& event) {
  if (std::ranges::find(wanted_, event.kind) == wanted_.end()) return;
  for (const Sender& sender : senders_) sender.outbox->put(event, context_.now());
}

void Notifier::on_run(const runs::RunView& run) {
  json& state = *state_;
  const std::string id = run.stored.id();
  if (run.is_over()) {
    if (state["run"] == id) {
      state["run"] = state["operator_prompt"] = nullptr;
      state["run_state"] = "idle";
      state["last_run"] = id;
    }
  } else if (run.state() != runs::RunState::queued) {
    state["run"] = id;
    state["run_state"] = to_string(run.state());
    state["trials_done"] = run.trials_done;
    state["trials_planned"] = run.trials_planned;
    const bool awaits = run.state() == runs::RunState::awaiting_operator && run.operator_prompt;
    state["operator_prompt"] = awaits ? json(run.operator_prompt->prompt.text) : json();
  }
  state_is_new_ = true;
  for (const Event& event : detector_.on_run(run, context_.utc_us())) {
    if (!event.outcome.empty()) state["last_outcome"] = event.outcome;
    send(event);
  }
}

void Notifier::on_queue(const runs::RunQueue& queue) {
  json& state = *state_;
  state["queue_length"] = queue.runs().size();
  state["queue_paused_by"] = queue.is_paused() ? json(queue.paused_by()) : json();
  state_is_new_ = true;
}

void Notifier::on_cut_by_restart(const runs::RunView& run) {
  detector_.add_begun(run.stored.number);
  (*state_)["last_run"] = run.stored.id();
  on_run(run);
}

void Notifier::on_rig(const runs::RigState& rig, std::string_view text) {
  (*state_)["rig"] = text;
  (*state_)["latched"] = rig.is_latched();
  state_is_new_ = true;
  if (const auto event = detector_.on_rig(rig, context_.utc_us())) send(*event);
}

void Notifier::check_disk(Clock now) {
  if (senders_.empty() || !is_due(disk_checked_, now, disk_period)) return;
  std::error_code error;
  const auto disk = std::filesystem::space(context_.data, error);
  if (error) return;
  (*state_)["disk_free_bytes"] = disk.available;
  state_is_new_ = true;
  if (const auto event = detector_.on_disk(disk.available, context_.utc_us())) send(*event);
}

void Notifier::publish_state(Clock now) {
  if (!mqtt_ || !state_is_new_ || !is_due(state_sent_, now, state_period)) return;
  state_is_new_ = false;
  mqtt_->set_state(format_event_json(*state_));
}

void Notifier::report_failures() {
  for (const Sender& sender : senders_) {
    const auto report = sender.outbox->take_report(context_.now());
    if (!report) continue;
    const json payload{{"to", sender.name},
                       {"lost", report->lost},
                       {"failed_attempts", report->failed_attempts},
                       {"waiting", report->waiting},
                       {"error", report->error}};
    context_.log->persist({.journal = {{0, context_.utc_us(), "", "notify.failed", "auto:notify",
                                        format_event_json(payload)}}});
  }
}

void Notifier::tick() {
  const Clock now = context_.now();
  check_disk(now);
  publish_state(now);
  report_failures();
}

std::vector<std::pair<std::string, DeliveryCounts>> Notifier::counts() const {
  std::vector<std::pair<std::string, DeliveryCounts>> out;
  for (const Sender& sender : senders_) out.emplace_back(sender.name, sender.outbox->counts());
  return out;
}

}  // namespace weft::daemon::notify
