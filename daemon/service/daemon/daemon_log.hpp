#pragma once
// Writes the daemon's journal as lines to standard output: as text, as JSON, or for systemd's
// journal. Source: sd-daemon(3), for the priorities.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "daemon/service/run_store/run_store.hpp"
#include "drivers/api/driver.hpp"

namespace weft::daemon::server {

enum class LogFormat : std::uint8_t {
  text,     ///< time, level and text
  json,     ///< one object per line: time, level and the members of a line of log.tail
  journald  ///< text after a priority such as "<4>"; systemd's journal adds the time
};
/// journald if standard output is a stream of systemd's journal (JOURNAL_STREAM), else text.
LogFormat default_log_format();

/// error: failed, unresponsive, a rig not known to be safe, unusable files. warning: aborted,
/// interrupted, halts, refused tokens, a paused queue, low disk space.
LogLevel level_of(const runs::JournalLine& line);

/// One journal line without its line end. `is_written` false: it is not yet in the journal.
std::string format_log_line(LogFormat format, const runs::JournalLine& line, bool is_written);

/// Thread: one, which never waits for the reader of the output. A thread of the log writes; while
/// it is blocked, the oldest waiting lines are dropped.
class DaemonLog {
 public:
  /// Lines that may wait to be written.
  static constexpr std::size_t most_waiting = 256;

  /// Writes to `descriptor`, which is standard output in production.
  explicit DaemonLog(LogFormat format, int descriptor = 1);
  /// Waits at most half a second for unwritten lines.
  ~DaemonLog();
  DaemonLog(const DaemonLog&) = delete;
  DaemonLog& operator=(const DaemonLog&) = delete;

  /// Lines wait until start(), because scripts expect the line with "ready" first.
  void write(const runs::JournalLine& line, bool is_written);
  /// Writes the first line immediately: "weftd: ready on `places`".
  void start(std::string_view places);
  /// Waits at most half a second. False: some lines are not yet written.
  bool drain();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace weft::daemon::server
