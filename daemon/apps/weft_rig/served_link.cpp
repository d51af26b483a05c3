#include "daemon/apps/weft_rig/served_link.hpp"

#include <algorithm>

#include "daemon/apps/weft_rig/served_terminal.hpp"

namespace weft::daemon {
namespace {

/// A host that has sent more bytes than this without a whole message is disconnected.
constexpr std::size_t most_unfinished = 65536;

/// Passes on whole messages only, so that messages of several hosts never mix. A reply goes to the
/// host of the last message, also when a fault has delayed the reply.
class ManyHosts final : public TcpPlace {
 public:
  ManyHosts(RealLoop& loop, Endpoint at, WholeMessages whole)
      : TcpPlace(loop, std::move(at)), whole_(std::move(whole)) {}

  [[nodiscard]] bool has_host() const override { return !hosts_.empty(); }
  // Without a host the bytes are lost, as on a wire.
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
  // Deferred: a link must not be destroyed inside its own callback.
  void end_soon(std::size_t id) {
    loop().after({}, [this, id, alive = std::weak_ptr(alive_)] {
      if (alive.lock()) hosts_.erase(id);
    });
  }

  struct Host {
    std::unique_ptr<Link> link;
    Bytes partial;  ///< bytes before the first whole message
  };
  WholeMessages whole_;
  std::map<std::size_t, Host> hosts_;
  std::size_t last_host_ = 0;
  std::size_t polled_last_ = 0;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

struct Server {
  RealLoop* loop;
  Redirects redirects;
  WholeMessages whole;
  Result<std::unique_ptr<ServedPlace>> operator()(const MemoryPort&) const {
    return fail({.code = Errc::wrong_state,
                 .what = "memory link cannot be served",
                 .expected = "serial, tcp or udp",
                 .got = "memory",
                 .hint = "Use a rig file with \"bench\": \"emulated\""});
  }
  Result<std::unique_ptr<ServedPlace>> operator()(const SerialSettings& s) const {
    return plugged_in<ServedTerminal>(*loop, s.path);
  }
  Result<std::unique_ptr<ServedPlace>> operator()(const TcpPort& p) const {
    return whole ? plugged_in<ManyHosts>(*loop, p.end, whole) : serve_tcp(*loop, p.end);
  }
  Result<std::unique_ptr<ServedPlace>> operator()(const UdpPort& p) const {
    return serve_udp(*loop, p.end, redirects, p.local_port);
  }
};

class JoinedLinks final : public ServedPlace {
 public:
  explicit JoinedLinks(std::vector<std::unique_ptr<ServedPlace>> places)
      : places_(std::move(places)) {}

  Status write(ByteView bytes) override {
    if (asking_ != nullptr) return asking_->write(bytes);
    for (const auto& place : places_) static_cast<void>(place->write(bytes));
    return {};
  }
  void on_receive(Receiver receiver) override {
    receiver_ = std::move(receiver);
    for (const auto& place : places_)
      place->on_receive([this, from = place.get()](ByteView bytes, TimePoint at) {
        asking_ = spoke_last_ = from;
        if (receiver_) receiver_(bytes, at);
        asking_ = nullptr;
      });
  }
  void on_closed(Closed) override {}  // a device outlives its hosts
  [[nodiscard]] bool has_host() const override {
    return std::ranges::any_of(places_, [](const auto& place) { return place->has_host(); });
  }
  /// A host counts as new only at the place that received last; otherwise the device's exchange
  /// with the other place continues.
  void on_host_came(HostCame came) override {
    for (const auto& place : places_)
      place->on_host_came(
          [this, came, from = place.get()](bool is_new) { came(is_new && spoke_last_ == from); });
  }
  Status set_plugged(bool in) override {
    Status first;
    for (const auto& place : places_)
      if (Status s = place->set_plugged(in); !s && first) first = s;
    return first;
  }

 private:
  std::vector<std::unique_ptr<ServedPlace>> places_;
  Link* asking_ = nullptr;
  Link* spoke_last_ = nullptr;
  Receiver receiver_;
};

}  // namespace

std::unique_ptr<ServedPlace> join_links(std::vector<std::unique_ptr<ServedPlace>> places) {
  WEFT_ASSERT(!places.empty());
  if (places.size() == 1) return std::move(places.front());
  return std::make_unique<JoinedLinks>(std::move(places));
}

Result<std::unique_ptr<ServedPlace>> serve_link(RealLoop& loop, const LinkSettings& settings,
                                                Redirects redirects, WholeMessages whole) {
  return std::visit(Server{&loop, std::move(redirects), std::move(whole)}, settings);
}

}  // namespace weft::daemon
