#pragma once
// The daemon's journal as lines on standard output: for people, for programs that read JSON, or for
// systemd's journal. Source: sd-daemon(3), for the priorities.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "daemon/service/run_store/run_store.hpp"
#include "drivers/api/driver.hpp"

namespace weft::daemon::server {

enum class LogFormat : std::uint8_t {
  text,     ///< time, level and words
  json,     ///< an object a line: time, level and the members of a line of log.tail
  journald  ///< words behind a priority, "<4>"; systemd's journal adds the time
};
/// journald where standard output is a stream of systemd's journal (JOURNAL_STREAM), else text.
LogFormat default_log_format();

/// error: failed, unresponsive, a rig that is not known to be safe, files that cannot be used.
/// warning: aborted, cut short, halts, refused tokens, a paused queue, want of disk.
LogLevel level_of(const runs::JournalLine& line);

/// A line of the journal without its end. `is_written` false: it is not in the journal yet.
std::string format_log_line(LogFormat format, const runs::JournalLine& line, bool is_written);

/// Used by one thread, which never waits for whoever reads the output: a thread of the log writes,
/// and where it is kept waiting the oldest lines make room.
class DaemonLog {
 public:
  /// Lines that wait to be written.
  static constexpr std::size_t most_waiting = 256;

  /// Writes to `descriptor`, standard output in production.
  explicit DaemonLog(LogFormat format, int descriptor = 1);
  /// Waits half a second at most for what is not written yet.
  ~DaemonLog();
  DaemonLog(const DaemonLog&) = delete;
  DaemonLog& operator=(const DaemonLog&) = delete;

  /// Lines wait until start(): scripts read the line that says "ready" as the first.
  void write(const runs::JournalLine& line, bool is_written);
  /// Writes the first line at once: "weftd: ready on `places`".
  void start(std::string_view places);
  /// Waits, half a second at most. False: something is not written yet.
  bool drain();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace weft::daemon::server
