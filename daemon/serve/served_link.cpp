#include "daemon/serve/served_link.hpp"

#include "daemon/serve/served_socket.hpp"
#include "daemon/serve/served_terminal.hpp"

namespace weft::daemon {
namespace {

struct Server {
  RealLoop* loop;
  Result<std::unique_ptr<Link>> operator()(const MemoryPort&) const {
    return fail(Errc::wrong_state, "a memory link cannot be served", {}, "serial, tcp or udp",
                "memory", "weft-rig is for rig files whose bench is \"emulated\"");
  }
  Result<std::unique_ptr<Link>> operator()(const SerialSettings& s) const {
    auto terminal = ServedTerminal::create(*loop, s.path);
    if (!terminal) return pass(terminal.error());
    return std::unique_ptr<Link>(std::move(*terminal));
  }
  Result<std::unique_ptr<Link>> operator()(const TcpPort& p) const {
    return serve_tcp(*loop, p.end);
  }
  Result<std::unique_ptr<Link>> operator()(const UdpPort& p) const {
    return serve_udp(*loop, p.end);
  }
};

}  // namespace

Result<std::unique_ptr<Link>> serve_link(RealLoop& loop, const LinkSettings& settings) {
  return std::visit(Server{&loop}, settings);
}

}  // namespace weft::daemon
