#include "daemon/apps/weft_rig/served_link.hpp"

#include "daemon/apps/weft_rig/served_terminal.hpp"

namespace weft::daemon {
namespace {

struct Server {
  RealLoop* loop;
  Redirects redirects;
  WholeMessages whole;
  Result<std::unique_ptr<ServedPlace>> operator()(const MemoryPort&) const {
    return fail({.code = Errc::wrong_state,
                 .what = "a memory link cannot be served",
                 .expected = "serial, tcp or udp",
                 .got = "memory",
                 .hint = "weft-rig is for rig files whose bench is \"emulated\""});
  }
  Result<std::unique_ptr<ServedPlace>> operator()(const SerialSettings& s) const {
    auto terminal = ServedTerminal::create(*loop, s.path);
    if (!terminal) return pass(terminal.error());
    return std::unique_ptr<ServedPlace>(std::move(*terminal));
  }
  Result<std::unique_ptr<ServedPlace>> operator()(const TcpPort& p) const {
    return whole ? serve_tcp_to_many(*loop, p.end, whole) : serve_tcp(*loop, p.end);
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
  /// Where another place has spoken since, its conversation goes on.
  void on_new_host(std::function<void()> came) override {
    for (const auto& place : places_)
      place->on_new_host([this, came, from = place.get()] {
        if (spoke_last_ == from) came();
      });
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
