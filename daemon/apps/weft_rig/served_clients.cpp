#include "daemon/apps/weft_rig/served_clients.hpp"

namespace weft::daemon {

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

// Not from inside the link's own callback.
void ServedClients::end_soon(std::size_t client) {
  loop_->after({}, [this, client, alive = std::weak_ptr(alive_)] {
    if (alive.lock()) clients_.erase(client);
  });
}

}  // namespace weft::daemon
