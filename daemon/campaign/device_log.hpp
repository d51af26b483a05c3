#pragma once
// What drivers say in words: warnings and errors, for the campaign's journal and for a person.

#include <functional>
#include <string>
#include <vector>

#include "daemon/campaign/trial_recording.hpp"
#include "daemon/hardware/rig/bench.hpp"

namespace weft::daemon {

struct DeviceLogEntry {
  TimePoint time;  ///< on the bench's clock
  LogLevel level = LogLevel::warning;
  std::string device;
  std::string text;
};
using DeviceLogSink = std::function<void(const DeviceLogEntry&)>;

/// Listens to all devices of a bench, which outlives it. Each warning and error goes to the sink at
/// once, and to the journal (kind "device_log") as soon as there is one: lines from before are
/// kept, up to `most_stored`, and how many more there were is journalled too.
class DeviceLog {
 public:
  static constexpr std::size_t most_stored = 256;

  DeviceLog(Bench& bench, Loop& loop, DeviceLogSink sink);
  ~DeviceLog();
  DeviceLog(const DeviceLog&) = delete;
  DeviceLog& operator=(const DeviceLog&) = delete;

  /// Null: lines are kept again.
  void journal_to(TrialRecording* recording);

 private:
  void take(DeviceLogEntry line);

  Bench* bench_;
  DeviceLogSink sink_;
  TrialRecording* recording_ = nullptr;
  std::vector<DeviceLogEntry> entries_;
  std::size_t dropped_ = 0;
};

}  // namespace weft::daemon
