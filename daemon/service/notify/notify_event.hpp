#pragma once
// The events that people are notified of, and the state changes that cause them. Pure; time is an
// argument. Source: docs/howto/notify.md.

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/runs/run_context.hpp"

namespace weft::daemon::notify {

enum class EventKind : std::uint8_t {
  operator_needed,  ///< a run waits for a person's confirmation
  run_ended,        ///< any outcome except failed
  run_failed,
  rig_latched,  ///< a halt or an e-stop
  disk_low,
  queue_empty  ///< the last run has ended and none is queued
};
/// Names in the configuration and in messages, in the order of EventKind.
inline constexpr std::array<std::string_view, 6> event_names{
    "operator.needed", "run.ended", "run.failed", "rig.latched", "disk.low", "queue.empty"};
std::string_view to_string(EventKind kind);

struct Event {
  EventKind kind = EventKind::run_ended;
  std::int64_t utc_us = 0;
  int priority = 3;  ///< 1 (least) to 5 (most urgent), as in ntfy
  std::string bench, title, text;
  std::string run;  ///< "R-000318"; empty if the event has no run
  std::string outcome, cleanup, rig, error;
  std::size_t trials_done = 0, trials_planned = 0;
};
/// One flat object; its keys are the placeholders of message templates.
nlohmann::json to_json(const Event& event);
/// One line; invalid UTF-8 is replaced, such as device bytes in an error.
std::string format_event_json(const nlohmann::json& value);

/// Compares each state with the previous one. The first state causes no event.
class EventDetector {
 public:
  /// `bench`: name of the rig, for titles. `disk_low_bytes`: less free space is an event.
  EventDetector(std::string bench, std::uint64_t disk_low_bytes)
      : bench_(std::move(bench)), disk_low_bytes_(disk_low_bytes) {}

  std::vector<Event> on_run(const runs::RunView& run, std::int64_t utc_us);
  /// Marks a run that was active in the previous daemon: its end is an event.
  void add_begun(std::int64_t run) { open_[run].has_begun = true; }
  std::optional<Event> on_rig(const runs::RigState& rig, std::int64_t utc_us);
  /// After an event, the next follows only when the free space has been 10 % above the limit.
  std::optional<Event> on_disk(std::uint64_t free_bytes, std::int64_t utc_us);

  /// Runs that have ended since the daemon started, by outcome [count].
  [[nodiscard]] const std::map<std::string, std::uint64_t>& ended() const { return ended_; }

 private:
  struct OpenRun {
    bool has_begun = false;
    std::string prompt;  ///< the newest that caused an event, "Q-12"
  };
  [[nodiscard]] Event make(EventKind kind, std::int64_t utc_us, int priority, std::string title,
                           std::string text) const;
  [[nodiscard]] Event end_of(const runs::RunView& run, std::int64_t utc_us) const;

  std::string bench_;
  std::uint64_t disk_low_bytes_;
  std::map<std::int64_t, OpenRun> open_;  ///< runs that are queued or active, by number
  std::map<std::string, std::uint64_t> ended_;
  std::optional<runs::RigState> rig_;
  bool disk_is_low_ = false;
};

}  // namespace weft::daemon::notify
