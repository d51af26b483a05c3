#include <utility>

#include "daemon/hardware/link/port_link.hpp"

namespace weft::daemon {
namespace {

constexpr Duration again_limit = std::chrono::seconds(1);

class RequestLink final : public Link {
 public:
  RequestLink(RealLoop& loop, Endpoint far_end, std::unique_ptr<Link> first)
      : loop_(&loop), far_end_(std::move(far_end)), connection_(std::move(first)) {
    read_next();
  }

  Status write(ByteView bytes) override {
    if (std::exchange(used_, true)) {
      auto next = open_tcp(*loop_, far_end_, again_limit);
      if (!next) return pass(next.error());
      connection_ = std::move(*next);
      read_next();
    }
    return connection_->write(bytes);
  }
  void on_receive(Receiver receiver) override { receiver_ = std::move(receiver); }
  void on_closed(Closed closed) override { closed_ = std::move(closed); }

 private:
  // What is called may write, which replaces the connection, or stop listening: nothing of this
  // is touched after it.
  void read_next() {
    connection_->on_receive([this](ByteView bytes, TimePoint at) {
      if (const Receiver now = receiver_) now(bytes, at);
    });
    connection_->on_closed([this](const Error& why) {
      used_ = true;  // a server does not wait for long
      if (const Closed callback = std::exchange(closed_, {})) callback(why);
    });
  }

  RealLoop* loop_;
  Endpoint far_end_;
  std::unique_ptr<Link> connection_;
  bool used_ = false;
  Receiver receiver_;
  Closed closed_;
};

}  // namespace

Result<std::unique_ptr<Link>> open_requests(RealLoop& loop, const Endpoint& far_end) {
  auto first = open_tcp(loop, far_end);
  if (!first) return pass(first.error());
  return std::unique_ptr<Link>(std::make_unique<RequestLink>(loop, far_end, std::move(*first)));
}

}  // namespace weft::daemon
