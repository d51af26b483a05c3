#include "daemon/apps/weft/operator_prompt.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ostream>

#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {

OperatorPrompt::OperatorPrompt(int terminal, std::ostream& out, RunOrders& orders)
    : terminal_(terminal), out_(&out), orders_(&orders) {
  if (terminal_ >= 0) listener_ = std::jthread([this](const std::stop_token& s) { listen(s); });
}

void OperatorPrompt::moment(const RunMoment& moment) {
  const std::lock_guard lock(mutex_);
  asked_.reset();
  if (!moment.asked) return;
  const recipes::OperatorAsk& ask = moment.asked->ask;
  if (terminal_ < 0) return orders_->give({Order::confirm, "auto:--yes", moment.asked->ticket});
  *out_ << "\n>> " << ask.text << "  Then press Enter (about " << duration(ask.people_s)
        << "; Ctrl-C ends the run)." << std::endl;
  if (gone_) return orders_->give({Order::stop, "terminal closed"});
  asked_ = moment.asked->ticket;
}

void OperatorPrompt::heard() {
  const std::lock_guard lock(mutex_);
  if (!asked_) return;
  orders_->give({Order::confirm, "terminal", *asked_});
  asked_.reset();
}

void OperatorPrompt::closed() {
  const std::lock_guard lock(mutex_);
  gone_ = true;
  if (asked_) orders_->give({Order::stop, "terminal closed"});
}

void OperatorPrompt::listen(const std::stop_token& stop) {
  constexpr int between_looks_ms = 100;
  std::array<char, 256> bytes{};
  while (!stop.stop_requested()) {
    pollfd look{terminal_, POLLIN, 0};
    if (::poll(&look, 1, between_looks_ms) <= 0) continue;
    const ssize_t count = ::read(terminal_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return closed();
    if (std::find(bytes.begin(), bytes.begin() + count, '\n') != bytes.begin() + count) heard();
  }
}

}  // namespace weft::daemon::cli
