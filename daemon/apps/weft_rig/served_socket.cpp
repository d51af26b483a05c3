#include <array>
#include <asio/ip/tcp.hpp>
#include <asio/ip/udp.hpp>

#include "daemon/apps/weft_rig/served_link.hpp"

namespace weft::daemon {
namespace {

using asio::ip::tcp;
using asio::ip::udp;

std::string words(const Endpoint& at) {
  return at.host + ":" + std::to_string(at.port);
}

Result<asio::ip::address> parse_address(const Endpoint& at) {
  asio::error_code error;
  const auto address =
      asio::ip::make_address(at.host == "localhost" ? "127.0.0.1" : at.host, error);
  if (error)
    return fail({.code = Errc::not_found,
                 .where = words(at),
                 .what = "address not usable",
                 .expected = "an address of this machine, such as 127.0.0.1",
                 .got = at.host});
  return address;
}

tl::unexpected<Error> cannot_serve(const Endpoint& at, const asio::error_code& error) {
  return fail({.code = Errc::io,
               .where = words(at),
               .what = "port not available",
               .got = error.message(),
               .hint = "End the program that uses the port, perhaps another weft-rig"});
}

/// Keeps one link for the device while hosts change.
class NewestHost final : public TcpPlace {
 public:
  using TcpPlace::TcpPlace;

  [[nodiscard]] bool has_host() const override { return host_ && !gone_; }
  // Without a host the bytes are lost, as on a wire.
  Status write(ByteView bytes) override {
    if (host_) static_cast<void>(host_->write(bytes));
    return {};
  }
  void on_host_came(HostCame came) override { came_ = std::move(came); }

 private:
  void welcome(std::unique_ptr<Link> host) override {
    host_ = std::move(host);
    gone_ = false;
    if (came_) came_(true);
    host_->on_receive([this](ByteView bytes, TimePoint at) { on_bytes(bytes, at); });
    host_->on_closed([this](const Error&) { gone_ = true; });
  }
  void part_with_hosts() override { host_.reset(); }

  HostCame came_;
  std::unique_ptr<Link> host_;
  bool gone_ = false;  ///< host_ stays until another host connects
};

class UdpPlace final : public ServedPlace {
 public:
  UdpPlace(RealLoop& loop, udp::socket socket, Redirects redirects, const udp::endpoint& first)
      : parts_(std::make_shared<Parts>(loop, std::move(socket), std::move(redirects))) {
    parts_->last = first;
    parts_->listen();
  }
  ~UdpPlace() override {
    parts_->receiver = {};
    asio::error_code ignored;
    parts_->socket.close(ignored);
  }
  [[nodiscard]] bool has_host() const override { return parts_->last.port() != 0; }
  // Errors are ignored: UDP may lose any datagram.
  Status write(ByteView bytes) override {
    asio::error_code ignored;
    if (parts_->plugged && parts_->last.port() != 0)
      parts_->socket.send_to(asio::buffer(bytes.data(), bytes.size()), parts_->last, 0, ignored);
    return {};
  }
  void on_receive(Receiver receiver) override { parts_->receiver = std::move(receiver); }
  void on_closed(Closed) override {}
  Status set_plugged(bool in) override {
    parts_->plugged = in;
    return {};
  }

 private:
  struct Parts : std::enable_shared_from_this<Parts> {
    Parts(RealLoop& on, udp::socket s, Redirects which)
        : loop(&on), socket(std::move(s)), redirects(std::move(which)) {}
    void listen() {
      socket.async_receive_from(
          asio::buffer(incoming), sender,
          [weak = weak_from_this()](const asio::error_code& error, std::size_t count) {
            const auto self = weak.lock();
            if (self && self->socket.is_open()) self->have(error, count);
          });
    }
    void have(const asio::error_code& error, std::size_t count) {
      if (!error && plugged) {
        const ByteView datagram(incoming.data(), count);
        if (redirects(datagram)) last = sender;
        if (receiver) receiver(datagram, loop->now());
      }
      if (socket.is_open()) listen();
    }
    RealLoop* loop;
    udp::socket socket;
    Redirects redirects;
    udp::endpoint sender, last;
    std::array<std::uint8_t, 65536> incoming{};
    Receiver receiver;
    bool plugged = true;
  };
  std::shared_ptr<Parts> parts_;
};

}  // namespace

struct TcpDoor::Parts : std::enable_shared_from_this<Parts> {
  Parts(RealLoop& on, Accepted then, Ends how)
      : loop(&on), accepted(std::move(then)), ends(how), acceptor(on.ports()) {}

  asio::error_code open(const tcp::endpoint& at) {
    asio::error_code error;
    acceptor.open(at.protocol(), error);
    if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor.bind(at, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    return error;
  }

  void listen() {
    acceptor.async_accept(
        [weak = weak_from_this()](const asio::error_code& error, tcp::socket socket) {
          const auto self = weak.lock();
          if (!self || !self->acceptor.is_open()) return;
          if (!error) self->welcome(std::move(socket));
          self->listen();
        });
  }

  void welcome(tcp::socket socket) {
    asio::error_code error;
    socket.set_option(tcp::no_delay(true), error);
    if (ends == Ends::reset) socket.set_option(asio::socket_base::linger(true, 0), error);
    const int descriptor = socket.release(error);
    if (!error) accepted(adopt_stream(*loop, descriptor, "host"));
  }

  RealLoop* loop;
  Accepted accepted;
  Ends ends;
  tcp::acceptor acceptor;
};

Result<std::unique_ptr<TcpDoor>> TcpDoor::open(RealLoop& loop, const Endpoint& at,
                                               Accepted accepted, Ends ends) {
  const auto address = parse_address(at);
  if (!address) return pass(address.error());
  auto parts = std::make_shared<Parts>(loop, std::move(accepted), ends);
  if (const asio::error_code error = parts->open({*address, at.port}); error)
    return cannot_serve(at, error);
  parts->listen();
  return std::unique_ptr<TcpDoor>(new TcpDoor(std::move(parts)));
}

TcpDoor::~TcpDoor() {
  asio::error_code ignored;
  parts_->acceptor.close(ignored);
}

std::uint16_t TcpDoor::port() const {
  asio::error_code ignored;
  return parts_->acceptor.local_endpoint(ignored).port();
}

Status TcpPlace::set_plugged(bool in) {
  if (in == (door_ != nullptr)) return {};
  part_with_hosts();
  door_.reset();
  if (!in) return {};
  auto door = TcpDoor::open(
      *loop_, at_, [this](std::unique_ptr<Link> host) { welcome(std::move(host)); },
      TcpDoor::Ends::reset);
  if (!door) return pass(door.error());
  door_ = std::move(*door);
  return {};
}

Result<std::unique_ptr<ServedPlace>> serve_tcp(RealLoop& loop, const Endpoint& at) {
  return plugged_in<NewestHost>(loop, at);
}

Result<std::unique_ptr<ServedPlace>> serve_udp(RealLoop& loop, const Endpoint& at,
                                               Redirects redirects, std::uint16_t unasked) {
  const auto address = parse_address(at);
  if (!address) return pass(address.error());
  udp::socket socket(loop.ports());
  const udp::endpoint place(*address, at.port);
  asio::error_code error;
  socket.open(place.protocol(), error);
  if (!error) socket.bind(place, error);
  if (error) return cannot_serve(at, error);
  return std::unique_ptr<ServedPlace>(std::make_unique<UdpPlace>(
      loop, std::move(socket), std::move(redirects), udp::endpoint(*address, unasked)));
}

Result<std::unique_ptr<ServedClients>> ServedClients::open(RealLoop& loop, const Endpoint& at,
                                                           Make make) {
  std::unique_ptr<ServedClients> made(new ServedClients(loop, at, std::move(make)));
  if (Status in = made->set_plugged(true); !in) return pass(in.error());
  return made;
}

Status ServedClients::set_plugged(bool in) {
  if (in == (door_ != nullptr)) return {};
  clients_.clear();
  door_.reset();
  if (!in) return {};
  auto door =
      TcpDoor::open(*loop_, at_, [this](std::unique_ptr<Link> host) { welcome(std::move(host)); });
  if (!door) return pass(door.error());
  door_ = std::move(*door);
  return {};
}

void ServedClients::welcome(std::unique_ptr<Link> host) {
  const std::size_t id = next_client_++;
  host->on_receive([this, id](ByteView bytes, TimePoint at) { answer(id, bytes, at); });
  host->on_closed([this, id](const Error&) { end_soon(id); });
  clients_[id] = {std::move(host), make_()};
}

void ServedClients::answer(std::size_t client, ByteView bytes, TimePoint at) {
  const auto found = clients_.find(client);
  if (found == clients_.end()) return;
  sim::ByteSink out = [&](ByteView reply) { static_cast<void>(found->second.link->write(reply)); };
  found->second.emulator->receive(bytes, at, out);
  if (found->second.emulator->finished()) end_soon(client);
}

// Deferred: a link must not be destroyed inside its own callback.
void ServedClients::end_soon(std::size_t client) {
  loop_->after({}, [this, client, alive = std::weak_ptr(alive_)] {
    if (alive.lock()) clients_.erase(client);
  });
}

}  // namespace weft::daemon
