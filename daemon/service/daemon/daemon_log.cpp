#include "daemon/service/daemon/daemon_log.hpp"

#include <spdlog/async_logger.h>
#include <spdlog/details/thread_pool.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <mutex>
#include <nlohmann/json.hpp>
#include <semaphore>
#include <utility>
#include <vector>

#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::server {
namespace {

using nlohmann::json;

constexpr std::chrono::milliseconds longest_wait{500};

std::string text_of(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

/// Names come from users. Quotes them where they could be confused with another field or line.
std::string quoted_where_needed(std::string_view name) {
  const bool is_plain = std::ranges::all_of(
      name, [](unsigned char c) { return c >= ' ' && c != '"' && c != '=' && c < 0x7f; });
  return is_plain ? std::string(name) : text_of(json(name));
}

/// "2026-11-27T15:28:38.123Z" from microseconds since 1970-01-01 UTC.
std::string time_text(std::int64_t utc_us) {
  std::string text = utc_text(utc_us);
  text.replace(text.find(' '), 1, "T");
  return text.replace(text.find(' '), std::string::npos, "Z");
}

json payload_of(const runs::JournalLine& line) {
  return json::parse(line.payload_json, nullptr, false);
}

std::string words_of(const runs::JournalLine& line, bool is_written) {
  std::string out = line.kind;
  if (!line.run.empty()) out += " " + quoted_where_needed(line.run);
  if (!line.by.empty()) out += " by " + quoted_where_needed(line.by);
  const json payload = payload_of(line);
  std::string_view before = ": ";
  for (const auto& [name, value] : payload.items()) {
    out.append(before).append(name).append("=").append(text_of(value));
    before = ", ";
  }
  if (!is_written) out += " (not in the journal yet)";
  return out;
}

std::string_view name_of(LogLevel level) {
  constexpr std::array<std::string_view, 4> names{"debug", "info", "warning", "error"};
  return names[static_cast<std::size_t>(level)];
}

std::string priority_of(LogLevel level) {
  constexpr std::array<std::string_view, 4> priorities{"<7>", "<6>", "<4>", "<3>"};
  return std::string(priorities[static_cast<std::size_t>(level)]);
}

spdlog::level::level_enum spdlog_level(LogLevel level) {
  using namespace spdlog::level;
  constexpr std::array levels{debug, info, warn, err};
  return levels[static_cast<std::size_t>(level)];
}

/// Ignores errors, such as a reader that has closed: the journal has the lines anyway.
void write_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(descriptor, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
}

}  // namespace

/// May wait for its reader, so only the log's own thread calls it. spdlog's own sinks write through
/// stdio: exit() would wait for the lock that a blocked one holds.
class DescriptorSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit DescriptorSink(int descriptor) : descriptor_(descriptor) {}
  void start() {
    started_ = true;
    started_.notify_all();
  }
  bool wait_until_flushed() { return flushed_.try_acquire_for(longest_wait); }

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    started_.wait(false);
    spdlog::memory_buf_t text;
    formatter_->format(message, text);
    write_all(descriptor_, {text.data(), text.size()});
  }
  void flush_() override { flushed_.release(); }

  int descriptor_;
  std::atomic<bool> started_ = false;
  std::counting_semaphore<> flushed_{0};
};

LogFormat default_log_format() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat out {};
  if (stream == nullptr || fstat(STDOUT_FILENO, &out) != 0) return LogFormat::text;
  const bool is_output =
      std::to_string(out.st_dev) + ":" + std::to_string(out.st_ino) == std::string_view(stream);
  return is_output ? LogFormat::journald : LogFormat::text;
}

LogLevel level_of(const runs::JournalLine& line) {
  static constexpr std::array<std::string_view, 11> warnings{
      "halt",        "estop", "token.refused",  "take_rejected",  "lease.broken", "queue_paused",
      "interrupted", "disk",  "recipe.not_put", "log.overflowed", "notify.failed"};
  const json payload = payload_of(line);
  const auto is = [&payload](const char* member, std::string_view value) {
    return payload.is_object() && payload.value(member, json()) == json(value);
  };
  const bool has_error = payload.is_object() && payload.contains("error");
  const bool is_file = line.kind == "daemon.reloaded" || line.kind == "tokens.unreadable";
  if (is("outcome", "failed") || is("state", "failed") || is("rig", "unknown") ||
      is("rig", "latched") || (payload.is_object() && payload.contains("unresponsive")) ||
      (is_file && has_error))
    return LogLevel::error;
  if (is("outcome", "aborted") || is("state", "interrupted") || is("outcome", "interrupted") ||
      (payload.is_object() && payload.contains("dataset_error")) ||
      std::ranges::find(warnings, line.kind) != warnings.end())
    return LogLevel::warning;
  return LogLevel::info;
}

std::string format_log_line(LogFormat format, const runs::JournalLine& line, bool is_written) {
  const LogLevel level = level_of(line);
  if (format == LogFormat::text) return words_of(line, is_written);
  if (format == LogFormat::journald) return priority_of(level) + words_of(line, is_written);
  json out{{"time", time_text(line.utc_us)},
           {"t_us", line.utc_us},
           {"level", name_of(level)},
           {"kind", line.kind},
           {"run", line.run},
           {"by", line.by},
           {"data", payload_of(line)}};
  if (!is_written) out["journalled"] = false;
  return text_of(out);
}

// Lines are few except in a flood, and the journal has them all. The oldest waiting lines are
// dropped (overrun_oldest), so that the server's thread never waits for a reader.
struct DaemonLog::Parts {
  Parts(LogFormat wanted, int out)
      : format(wanted), descriptor(out), sink(std::make_shared<DescriptorSink>(out)) {
    using spdlog::pattern_formatter, spdlog::pattern_time_type;
    const char* const pattern = format == LogFormat::text ? "%Y-%m-%dT%H:%M:%S.%eZ %l %v" : "%v";
    sink->set_formatter(std::make_unique<pattern_formatter>(pattern, pattern_time_type::utc));
  }
  void write_line(const runs::JournalLine& line, bool is_written) const {
    const spdlog::log_clock::time_point at{std::chrono::microseconds(line.utc_us)};
    logger->log(at, {}, spdlog_level(level_of(line)), format_log_line(format, line, is_written));
  }

  LogFormat format;
  int descriptor;
  std::shared_ptr<DescriptorSink> sink;
  std::shared_ptr<spdlog::details::thread_pool> pool =
      std::make_shared<spdlog::details::thread_pool>(most_waiting, 1);
  std::shared_ptr<spdlog::async_logger> logger = std::make_shared<spdlog::async_logger>(
      "weftd", sink, pool, spdlog::async_overflow_policy::overrun_oldest);
  std::size_t overrun = 0;  ///< dropped lines that were reported
};

DaemonLog::DaemonLog(LogFormat format, int descriptor)
    : parts_(std::make_unique<Parts>(format, descriptor)) {}

// A thread that is blocked by a reader cannot be joined; it ends with the process.
DaemonLog::~DaemonLog() {
  parts_->sink->start();
  if (drain()) return;
  static auto* const left_behind = new std::vector<std::shared_ptr<spdlog::details::thread_pool>>;
  left_behind->push_back(std::move(parts_->pool));
}

void DaemonLog::write(const runs::JournalLine& line, bool is_written) {
  const std::size_t overrun = parts_->pool->overrun_counter();
  const bool has_room = parts_->pool->queue_size() < most_waiting / 2;
  if (overrun > parts_->overrun && has_room) {
    const json lost{{"lines", overrun - parts_->overrun}};
    parts_->overrun = overrun;
    parts_->write_line({0, line.utc_us, {}, "log.overflowed", "auto:daemon", lost.dump()}, true);
  }
  parts_->write_line(line, is_written);
}

void DaemonLog::start(std::string_view places) {
  const std::string words = "weftd: ready" + std::string(places);
  std::string line = parts_->format == LogFormat::journald ? priority_of(LogLevel::info) : "";
  if (parts_->format == LogFormat::json)
    line = text_of({{"time", time_text(utc_now().count() / 1000)},
                    {"level", "info"},
                    {"kind", "daemon.ready"},
                    {"text", words}});
  else
    line += words;
  write_all(parts_->descriptor, line + "\n");
  parts_->sink->start();
}

bool DaemonLog::drain() {
  parts_->logger->flush();
  return parts_->sink->wait_until_flushed();
}

}  // namespace weft::daemon::server
