#include "daemon/apps/weft/progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ostream>

#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

constexpr std::size_t bar_width = 24;
constexpr std::size_t most_lines = 20;

std::string trial_text(const TrialProgress& p) {
  return p.fabric + " " + p.exploration + " #" + std::to_string(p.repetition);
}

std::string count_text(const TrialProgress& p) {
  return std::to_string(p.done) + "/" + std::to_string(p.planned);
}

}  // namespace

std::string bar(std::size_t done, std::size_t planned, std::size_t width) {
  const std::size_t full = planned == 0 ? width : std::min(done, planned) * width / planned;
  return "[" + std::string(full, '#') + std::string(width - full, '.') + "]";
}

void ProgressPrinter::operator()(const TrialProgress& p) {
  const std::string left = p.done == p.planned ? "done"
                           : p.wall_left_s     ? "ETA " + duration(*p.wall_left_s)
                                               : "ETA unknown";
  if (terminal_) {
    rewrite(bar(p.done, p.planned, bar_width) + " " + count_text(p) + "  " + left + "  " +
            trial_text(p));
  } else {
    step(p, count_text(p) + " trials, " + duration(p.virtual_s) + " bench time, " +
                duration(p.wall_s) + " wall time, " + left);
  }
}

void ProgressPrinter::rewrite(const std::string& whole) {
  winsize size{};  // a wrapped line cannot be rewritten
  const bool is_known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
  const std::string line = is_known ? whole.substr(0, size.ws_col - 1U) : whole;
  const std::string wipe(last_width_ > line.size() ? last_width_ - line.size() : 0, ' ');
  *out_ << '\r' << line << wipe << std::flush;
  last_width_ = line.size();
}

void ProgressPrinter::step(const TrialProgress& p, const std::string& line) {
  if (p.outcome == recipes::Outcome::rejected)
    *out_ << "trial " << p.done + 1 << " (" << trial_text(p)
          << ") is repeated: " << (p.error ? to_string(*p.error) : "") << '\n';
  else if (p.outcome != recipes::Outcome::complete)
    *out_ << "trial " << p.done + (p.outcome == recipes::Outcome::failed ? 0 : 1) << " ("
          << trial_text(p) << ") did not complete\n";
  const std::size_t due = p.planned == 0 ? most_lines : p.done * most_lines / p.planned;
  if (due <= lines_) return;
  lines_ = due;
  *out_ << line << '\n' << std::flush;
}

void ProgressPrinter::finish() {
  if (terminal_ && last_width_ > 0) *out_ << '\n' << std::flush;
  last_width_ = 0;
}

ConsolePrompt::ConsolePrompt(int terminal, std::ostream& out, RunOrders& orders)
    : terminal_(terminal), out_(&out), orders_(&orders) {
  if (terminal_ >= 0) listener_ = std::jthread([this](const std::stop_token& s) { listen(s); });
}

void ConsolePrompt::moment(const RunStatusUpdate& moment) {
  const std::lock_guard lock(mutex_);
  requested_.reset();
  if (!moment.requested) return;
  const recipes::StepPrompt& prompt = moment.requested->prompt;
  if (terminal_ < 0) return orders_->give({Order::confirm, "auto:--yes", moment.requested->ticket});
  *out_ << "\n>> " << prompt.text << "  Then press Enter (about " << duration(prompt.people_s)
        << "; Ctrl-C ends the run)." << std::endl;
  if (gone_) return orders_->give({Order::stop, "terminal closed"});
  requested_ = moment.requested->ticket;
}

void ConsolePrompt::received() {
  const std::lock_guard lock(mutex_);
  if (!requested_) return;
  orders_->give({Order::confirm, "terminal", *requested_});
  requested_.reset();
}

void ConsolePrompt::closed() {
  const std::lock_guard lock(mutex_);
  gone_ = true;
  if (requested_) orders_->give({Order::stop, "terminal closed"});
}

void ConsolePrompt::listen(const std::stop_token& stop) {
  constexpr int poll_interval_ms = 100;
  std::array<char, 256> bytes{};
  while (!stop.stop_requested()) {
    pollfd input{terminal_, POLLIN, 0};
    if (::poll(&input, 1, poll_interval_ms) <= 0) continue;
    const ssize_t count = ::read(terminal_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return closed();
    if (std::find(bytes.begin(), bytes.begin() + count, '\n') != bytes.begin() + count) received();
  }
}

}  // namespace weft::daemon::cli
