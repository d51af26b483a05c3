#pragma once
// Records a trial and the quality of its force regulation. Passes warnings and errors of the
// drivers to the journal.

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/campaign/attempt_quality.hpp"
#include "daemon/hardware/rig/bench.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "recipes/engine/engine.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon {

/// Force error against the set point over the wrench samples of one phase.
struct ForceTally {
  std::size_t samples = 0;
  std::size_t in_band = 0;
  double sum_squares_n2 = 0;
  double worst_n = 0;
  void add(double error_n, double band_n);
  [[nodiscard]] double rms_n() const;
};

/// Normal force of a rest phase, S or E, after the initial transient.
class RestTally {
 public:
  void add(double force_n);
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] double mean_n() const { return mean_n_; }
  /// Standard deviation of the mean.
  [[nodiscard]] double error_n() const;

 private:
  std::size_t count_ = 0;
  double mean_n_ = 0, squares_n2_ = 0;  ///< of the deviations from the mean
};

struct PhaseStart {
  Phase phase = Phase::none;
  TimePoint at{};
};

/// Routes samples of the open trial into the recorder. A failed write is stored as `error()`.
class TrialRecording {
 public:
  TrialRecording(Recorder& recorder, const recipes::Plan& plan);

  void begin(std::size_t trial, TimePoint now);
  void set_phase(Phase phase, TimePoint now);
  /// `device`: the name of the sample's device.
  void sensor(const Sample& sample, std::string_view device);
  void stages(const Snapshot& snapshot, TimePoint now);
  /// `ended_early`: complete except for its stroke.
  void end(recipes::Outcome outcome, bool ended_early, TimePoint now);
  void journal(TimePoint now, std::string_view kind, std::string_view payload_json);
  /// Lets the recorder commit when its budget of wall time is used up.
  void commit_if_due();

  /// Free bytes on the campaign's disk, checked once per second of wall time.
  [[nodiscard]] std::optional<std::uint64_t> free_bytes();

  [[nodiscard]] Phase phase() const { return phase_; }
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }
  /// Why the record of the trial is bad, after its last phase. Nothing if it is good or the recipe
  /// does not check it.
  [[nodiscard]] const std::optional<Error>& trial_bad() const { return trial_bad_; }
  /// Phase M of the trial that ended last, and of all complete trials together.
  [[nodiscard]] const ForceTally& trial_force() const { return trial_force_; }
  /// Phase S or E of the newest trial.
  [[nodiscard]] const RestTally& rest(Phase phase) const {
    return phase == Phase::end ? rest_after_ : rest_before_;
  }
  [[nodiscard]] const ForceTally& campaign_force() const { return campaign_force_; }
  /// Samples lost in recorded phases before they reached the daemon [count].
  [[nodiscard]] std::uint64_t frames_lost() const { return frames_lost_; }
  /// As in Recorder [s].
  [[nodiscard]] std::optional<double> commit_lag_s();
  /// Arrival times of the recorded taxel samples of the last trial.
  [[nodiscard]] const std::vector<TimePoint>& sampled() const { return sampled_; }
  /// Arrival times of its recorded force samples.
  [[nodiscard]] const std::vector<TimePoint>& wrench_sampled() const { return wrench_sampled_; }
  /// Starts of the last trial's phases; `none` while nothing is recorded.
  [[nodiscard]] const std::vector<PhaseStart>& phases() const { return phases_; }
  /// Wall seconds spent in the recorder, estimated as in TimedLoop.
  [[nodiscard]] double seconds() const;

 private:
  template <class Write>
  void write(Write&& write);
  void tally(double force_n, TimePoint at);

  Recorder* recorder_;
  const recipes::Plan* plan_;
  Phase phase_ = Phase::none;
  std::size_t trial_ = 0;
  std::map<std::size_t, std::uint32_t> attempts_;  ///< of each trial so far
  std::uint32_t stage_sequence_ = 0;
  std::optional<AttemptQualityCheck> quality_check_;
  std::optional<Error> trial_bad_;
  TimePoint phase_began_{};
  RestTally rest_before_, rest_after_;  ///< phases S and E
  ForceTally trial_force_;
  ForceTally campaign_force_;
  std::optional<Error> error_;
  std::optional<std::uint64_t> free_bytes_;
  std::chrono::nanoseconds space_seen_{};
  std::chrono::nanoseconds wall_{};  ///< monotonic; last time that commit_if_due() read the clock
  unsigned unlooked_ = 0;            ///< remaining calls of it that do not read the clock
  std::uint64_t frames_lost_ = 0;
  unsigned writes_ = 0;
  std::chrono::nanoseconds spent_{};
  std::vector<TimePoint> sampled_, wrench_sampled_;
  std::vector<PhaseStart> phases_;
};

// Log lines of the drivers: warnings and errors, for the campaign's journal and for a person.

struct DeviceLogEntry {
  TimePoint time;  ///< on the bench's clock
  LogLevel level = LogLevel::warning;
  std::string device;
  std::string text;
};
using DeviceLogSink = std::function<void(const DeviceLogEntry&)>;

/// Receives the log of all devices of a bench, which outlives it. Passes each warning and error to
/// the sink at once, and to the journal (kind "device_log") as soon as there is one. Earlier lines
/// are kept, up to `most_stored`; the number of further ones is journalled too.
class DeviceLog {
 public:
  static constexpr std::size_t most_stored = 256;

  DeviceLog(Bench& bench, Loop& loop, DeviceLogSink sink);
  ~DeviceLog();
  DeviceLog(const DeviceLog&) = delete;
  DeviceLog& operator=(const DeviceLog&) = delete;

  /// Adds a line that belongs to no device.
  void add(DeviceLogEntry line) { take(std::move(line)); }
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
