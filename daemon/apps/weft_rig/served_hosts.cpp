#include "daemon/apps/weft_rig/served_hosts.hpp"

#include <map>
#include <utility>

namespace weft::daemon {
namespace {

/// A host that has sent so much without a whole message is no host of this device.
constexpr std::size_t most_unfinished = 65536;

class ManyHosts final : public TcpPlace {
 public:
  ManyHosts(RealLoop& loop, Endpoint at, WholeMessages whole)
      : TcpPlace(loop, std::move(at)), whole_(std::move(whole)) {}

  // Nobody there: lost, as on a wire.
  Status write(ByteView bytes) override {
    const auto host = hosts_.find(polled_last_);
    if (host != hosts_.end()) static_cast<void>(host->second.link->write(bytes));
    return {};
  }

 private:
  void welcome(std::unique_ptr<Link> link) override {
    const std::size_t id = ++last_host_;
    link->on_receive([this, id](ByteView bytes, TimePoint at) { take(id, bytes, at); });
    link->on_closed([this, id](const Error&) { end_soon(id); });
    hosts_[id].link = std::move(link);
  }
  void part_with_hosts() override { hosts_.clear(); }
  void take(std::size_t id, ByteView bytes, TimePoint at) {
    const auto host = hosts_.find(id);
    if (host == hosts_.end()) return;
    Bytes& partial = host->second.partial;
    partial.insert(partial.end(), bytes.begin(), bytes.end());
    const std::size_t whole = whole_(partial);
    if (whole == 0 && partial.size() > most_unfinished) return end_soon(id);
    if (whole == 0) return;
    const auto end = partial.begin() + static_cast<std::ptrdiff_t>(whole);
    const Bytes messages(partial.begin(), end);
    partial.erase(partial.begin(), end);
    polled_last_ = id;
    on_bytes(messages, at);
  }
  // Not from inside the link's own callback.
  void end_soon(std::size_t id) {
    loop().after({}, [this, id, alive = std::weak_ptr(alive_)] {
      if (alive.lock()) hosts_.erase(id);
    });
  }

  struct Host {
    std::unique_ptr<Link> link;
    Bytes partial;  ///< no whole message yet
  };
  WholeMessages whole_;
  std::map<std::size_t, Host> hosts_;
  std::size_t last_host_ = 0;
  std::size_t polled_last_ = 0;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace

Result<std::unique_ptr<ServedPlace>> serve_tcp_to_many(RealLoop& loop, const Endpoint& at,
                                                       WholeMessages whole) {
  return plugged_in<ManyHosts>(loop, at, std::move(whole));
}

}  // namespace weft::daemon
