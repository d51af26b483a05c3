#include "daemon/apps/weft/console_prompt.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ostream>

#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {

ConsolePrompt::ConsolePrompt(int terminal, std::ostream& out, RunOrders& orders)
    : terminal_(terminal), out_(&out), orders_(&orders) {
  if (terminal_ >= 0) listener_ = std::jthread([this](const std::stop_token& s) { listen(s); });
}

void ConsolePrompt::moment(const RunStatusUpdate& moment) {
  const std::lock_guard lock(mutex_);
  ticket_.reset();
  if (!moment.requested) return;
  const recipes::StepPrompt& prompt = moment.requested->prompt;
  if (terminal_ < 0) return orders_->give({Order::confirm, "auto:--yes", moment.requested->ticket});
  *out_ << "\n>> " << prompt.text << "  Then press Enter (about " << duration(prompt.people_s)
        << "; Ctrl-C ends the run)." << std::endl;
  if (gone_) return orders_->give({Order::stop, "terminal closed"});
  ticket_ = moment.requested->ticket;
}

void ConsolePrompt::on_key() {
  const std::lock_guard lock(mutex_);
  if (!ticket_) return;
  orders_->give({Order::confirm, "terminal", *ticket_});
  ticket_.reset();
}

void ConsolePrompt::closed() {
  const std::lock_guard lock(mutex_);
  gone_ = true;
  if (ticket_) orders_->give({Order::stop, "terminal closed"});
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
    if (std::find(bytes.begin(), bytes.begin() + count, '\n') != bytes.begin() + count) on_key();
  }
}

}  // namespace weft::daemon::cli
