#include "daemon/campaign/device_log.hpp"

#include <nlohmann/json.hpp>

namespace weft::daemon {
namespace {

using nlohmann::json;

void journal(TrialRecording& recording, const DeviceLogEntry& line) {
  const json payload{{"device", line.device},
                     {"level", line.level == LogLevel::error ? "error" : "warning"},
                     {"text", line.text}};
  // A device's words need not be UTF-8.
  recording.journal(line.time, "device_log",
                    payload.dump(-1, ' ', false, json::error_handler_t::replace));
}

}  // namespace

DeviceLog::DeviceLog(Bench& bench, Loop& loop, DeviceLogSink sink)
    : bench_(&bench), sink_(std::move(sink)) {
  bench.on_log([this, &loop](LogLevel level, std::string_view device, std::string_view text) {
    if (level < LogLevel::warning) return;
    take({loop.now(), level, std::string(device), std::string(text)});
  });
}

DeviceLog::~DeviceLog() {
  bench_->on_log({});
}

void DeviceLog::take(DeviceLogEntry line) {
  if (sink_) sink_(line);
  if (recording_ != nullptr) return journal(*recording_, line);
  if (entries_.size() < most_stored) return entries_.push_back(std::move(line));
  ++dropped_;
}

void DeviceLog::journal_to(TrialRecording* recording) {
  recording_ = recording;
  if (recording_ == nullptr) return;
  for (const DeviceLogEntry& line : std::exchange(entries_, {})) journal(*recording_, line);
  if (const std::size_t lost = std::exchange(dropped_, 0); lost > 0)
    recording_->journal({}, "device_log_cut", json{{"lines", lost}}.dump());
}

}  // namespace weft::daemon
