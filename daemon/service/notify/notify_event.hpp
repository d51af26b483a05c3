#pragma once
// What people away from the bench are called for, and which state changes make such an event: pure,
// with the time as an argument. Source: docs/howto/notify.md.

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
  run_ended,        ///< whatever the outcome, except failed
  run_failed,
  rig_latched,  ///< a halt or an emergency stop
  disk_low,
  queue_empty  ///< the last run has ended and none waits
};
/// Their names in the configuration and in messages, in the order of EventKind.
inline constexpr std::array<std::string_view, 6> event_names{
    "operator.needed", "run.ended", "run.failed", "rig.latched", "disk.low", "queue.empty"};
std::string_view to_string(EventKind kind);

struct Event {
  EventKind kind = EventKind::run_ended;
  std::int64_t utc_us = 0;
  int priority = 3;  ///< 1 (least) to 5 (most urgent), as ntfy has them
  std::string bench, title, text;
  std::string run;  ///< "R-000318"; empty where the event is about none
  std::string outcome, cleanup, rig, error;
  std::size_t trials_done = 0, trials_planned = 0;
};
/// One flat object. Its keys are the placeholders of message templates.
nlohmann::json to_json(const Event& event);
/// One line; what is not UTF-8, such as bytes of a device in an error, is replaced.
std::string format_event_json(const nlohmann::json& value);

/// Compares each state with the one before. A state that is seen first is no event.
class EventDetector {
 public:
  /// `bench`: name of the rig, for titles. `disk_low_bytes`: a smaller free space is an event.
  EventDetector(std::string bench, std::uint64_t disk_low_bytes)
      : bench_(std::move(bench)), disk_low_bytes_(disk_low_bytes) {}

  std::vector<Event> on_run(const runs::RunView& run, std::int64_t utc_us);
  /// The run was under way in the daemon before this one: its end is an event.
  void add_begun(std::int64_t run) { open_[run].has_begun = true; }
  std::optional<Event> on_rig(const runs::RigState& rig, std::int64_t utc_us);
  /// The next event comes after the free space has been a tenth above the limit.
  std::optional<Event> on_disk(std::uint64_t free_bytes, std::int64_t utc_us);

  /// Runs that have ended since the daemon started, by outcome [count].
  [[nodiscard]] const std::map<std::string, std::uint64_t>& ended() const { return ended_; }

 private:
  struct OpenRun {
    bool has_begun = false;
    std::string prompt;  ///< the newest that was an event, "Q-12"
  };
  [[nodiscard]] Event make(EventKind kind, std::int64_t utc_us, int priority, std::string title,
                           std::string text) const;
  [[nodiscard]] Event end_of(const runs::RunView& run, std::int64_t utc_us) const;

  std::string bench_;
  std::uint64_t disk_low_bytes_;
  std::map<std::int64_t, OpenRun> open_;  ///< runs that are queued or under way, by number
  std::map<std::string, std::uint64_t> ended_;
  std::optional<runs::RigState> rig_;
  bool disk_is_low_ = false;
};

}  // namespace weft::daemon::notify
