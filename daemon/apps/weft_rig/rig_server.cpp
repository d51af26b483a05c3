#include "daemon/apps/weft_rig/rig_server.hpp"

#include <nlohmann/json.hpp>

#include "daemon/apps/weft_rig/served_link.hpp"
#include "protocols/base/json_text.hpp"
#include "protocols/modbus/rtu.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;
constexpr std::size_t longest_order = 65536;
constexpr std::string_view net_ft = "ati_netft";
/// Period at which plugs are checked: hosts see a change of a plug within it.
constexpr Duration plug_period = std::chrono::milliseconds(10);

struct OrderReader {
  std::string operator()(const MemoryPort&) const { return "memory"; }
  std::string operator()(const SerialSettings& s) const { return "serial " + s.path; }
  std::string operator()(const TcpPort& p) const { return "tcp " + end(p.end); }
  std::string operator()(const UdpPort& p) const { return "udp " + end(p.end); }
  static std::string end(const Endpoint& e) { return e.host + ":" + std::to_string(e.port); }
};

json refused(const Error& error) {
  return {{"ok", false}, {"error", to_string(error)}};
}

json outcome(const Status& status) {
  return status ? json{{"ok", true}} : refused(status.error());
}

json truth_json(const sim::Truth& truth) {
  return {{"ok", true},
          {"bench", "simulated"},
          {"contact_force_n", truth.contact_force_n},
          {"indentation_m", truth.indentation_m},
          {"probe_z_m", truth.probe_z_m},
          {"fabric_point_m", truth.fabric_point_m},
          {"friction_n", truth.friction_n}};
}

json without_order(json order) {
  order.erase("order");
  return order;
}

/// Seeds piece, mounting and touch separately when "piece_seed" is given, else all from
/// "patch_seed".
Status mount(const json& order, sim::Rig& rig, TimePoint now) {
  const std::string fabric = order.value("fabric", "");
  const auto seed = [&](const char* key) { return order.value(key, std::uint64_t{0}); };
  if (!order.contains("piece_seed")) return rig.mount(fabric, seed("patch_seed"), now);
  return rig.mount(fabric, {seed("piece_seed"), seed("mounting_seed"), seed("touch_seed")},
                   order.value("patch", std::uint32_t{1}), now);
}

json carry_out(const json& order, sim::Rig& rig, TimePoint now) {
  const std::string what = order.value("order", "");
  if (what == "mount") return outcome(mount(order, rig, now));
  if (what == "unmount") return outcome(rig.unmount(now));
  if (what == "truth") return truth_json(rig.truth(now));
  if (what == "fault") return outcome(rig.inject(without_order(order).dump(), now));
  if (what == "clear")
    return outcome(rig.clear_faults(order.value("device", ""), order.value("fault", "")));
  return refused({.code = Errc::invalid_argument,
                  .where = "/order",
                  .what = "unknown order",
                  .expected = "mount, unmount, truth, fault or clear",
                  .got = what});
}

}  // namespace

void serve_on_tcp_too(RigFile& rig, std::uint16_t first) {
  std::uint16_t port = first;
  const auto next = [&port] { return TcpPort{{"127.0.0.1", port++}}; };
  for (DeviceEntry& device : rig.devices)
    if (device.driver != net_ft) device.also.emplace_back(next());
  for (DeviceEntry& device : rig.devices) {
    if (device.driver != net_ft) continue;  // streams datagrams only
    if (!device.http) device.http = next();
    if (!device.commands) device.commands = next();
  }
}

Result<std::unique_ptr<RigServer>> RigServer::create(RealLoop& loop, const RigFile& file,
                                                     std::string_view fabrics_json,
                                                     std::uint64_t seed) {
  if (file.mode != BenchMode::emulated)
    return fail({.code = Errc::wrong_state,
                 .where = "/bench",
                 .what = "bench is not emulated",
                 .expected = "emulated",
                 .hint = "Set \"bench\": \"emulated\" and give each device a link with a port"});
  auto rig = sim::Rig::create(file.text, fabrics_json, seed);
  if (!rig) return pass(rig.error());
  std::unique_ptr<RigServer> made(new RigServer(loop, std::move(*rig)));
  if (Status s = made->serve(file); !s) return pass(s.error());
  made->apply_plugs();
  return made;
}

RigServer::~RigServer() = default;

// The console port is opened first. If another weft-rig already serves this rig, opening fails
// here, before this one takes over the links to terminals.
Status RigServer::serve(const RigFile& file) {
  auto door = TcpDoor::open(*loop_, file.console,
                            [this](std::unique_ptr<Link> host) { welcome(std::move(host)); });
  if (!door) return pass(door.error(), "/simulation/console");
  door_ = std::move(*door);
  for (const DeviceEntry& device : file.devices)
    if (Status s = serve(device); !s) return pass(s.error(), device.name);
  lines_.push_back("orders on tcp " + OrderReader::end(file.console));
  return {};
}

Status RigServer::serve(const DeviceEntry& device) {
  std::vector<LinkSettings> places{device.link};
  places.insert(places.end(), device.also.begin(), device.also.end());
  std::vector<std::unique_ptr<ServedPlace>> ends;
  std::string where;
  const auto redirects = [rig = rig_.get(), name = device.name](ByteView datagram) {
    return rig->redirects(name, datagram);
  };
  WholeMessages whole;
  if (rig_->serves_many(device.name)) whole = protocols::modbus::whole_mbap_frames;
  for (const LinkSettings& place : places) {
    auto end = serve_link(*loop_, place, redirects, whole);
    if (!end) return pass(end.error());
    ends.push_back(std::move(*end));
    where += (where.empty() ? " on " : " and ") + std::visit(OrderReader{}, place);
  }
  devices_.push_back({device.name, join_links(std::move(ends)), {}});
  devices_.back().place->on_host_came([rig = rig_.get(), name = device.name](bool is_new) {
    rig->set_connected(name, true);
    if (is_new) rig->meet_new_host(name);
  });
  lines_.push_back(device.name + where);
  if (Status s = rig_->attach(device.name, *devices_.back().place, *loop_); !s) return s;
  if (Status s = serve_pages(device); !s) return s;
  return serve_commands(device);
}

Status RigServer::serve_pages(const DeviceEntry& device) {
  if (!device.http) return {};
  if (rig_->page(device.name) == nullptr)
    return fail(
        {.code = Errc::unsupported, .where = "/http", .what = "device has no settings page"});
  const Status served = serve_clients(
      std::get<TcpPort>(*device.http).end,
      [rig = rig_.get(), name = device.name] { return rig->page(name); },
      device.name + "'s pages on http ");
  return served ? Status{} : pass(served.error(), "/http");
}

Status RigServer::serve_commands(const DeviceEntry& device) {
  if (!device.commands) return {};
  if (rig_->command_port(device.name) == nullptr)
    return fail({.code = Errc::unsupported,
                 .where = "/commands",
                 .what = "device has no command port",
                 .expected = "a Net F/T box"});
  const Status served = serve_clients(
      std::get<TcpPort>(*device.commands).end,
      [rig = rig_.get(), name = device.name] { return rig->command_port(name); },
      device.name + "'s commands on tcp ");
  return served ? Status{} : pass(served.error(), "/commands");
}

Status RigServer::serve_clients(const Endpoint& at, ServedClients::Make make,
                                const std::string& line) {
  auto clients = ServedClients::open(*loop_, at, std::move(make));
  if (!clients) return pass(clients.error());
  devices_.back().ports.push_back(std::move(*clients));
  lines_.push_back(line + OrderReader::end(at));
  return {};
}

// Retries every period to open a place that cannot be opened yet. Some devices without a host send
// nothing: see sim::Rig::set_connected().
void RigServer::apply_plugs() {
  for (const Served& device : devices_) {
    const bool in = rig_->plugged(device.name, loop_->now());
    static_cast<void>(device.place->set_plugged(in));
    rig_->set_connected(device.name, device.place->has_host());
    for (const auto& port : device.ports) static_cast<void>(port->set_plugged(in));
  }
  rig_->keep_up(loop_->now());
  loop_->after(plug_period, [this, alive = std::weak_ptr(alive_)] {
    if (alive.lock()) apply_plugs();
  });
}

std::vector<std::string> RigServer::lines() const {
  return lines_;
}

void RigServer::welcome(std::unique_ptr<Link> host) {
  const std::size_t id = next_console_++;
  host->on_receive([this, id](ByteView bytes, TimePoint) { take(id, bytes); });
  host->on_closed(
      [this, id](const Error&) { loop_->after({}, [this, id] { consoles_.erase(id); }); });
  consoles_[id].link = std::move(host);
}

void RigServer::take(std::size_t console, ByteView bytes) {
  const auto found = consoles_.find(console);
  if (found == consoles_.end()) return;
  auto& [link, line] = found->second;
  for (const std::uint8_t byte : bytes) {
    if (byte != '\n') {
      if (line.size() < longest_order) line.push_back(static_cast<char>(byte));
      continue;
    }
    const std::string answer = execute_order(std::exchange(line, {})) + "\n";
    const auto* begin = reinterpret_cast<const std::uint8_t*>(answer.data());
    static_cast<void>(link->write({begin, answer.size()}));
  }
}

std::string RigServer::execute_order(std::string_view text) {
  const Result<json> order = parse_json(text);
  if (!order) return refused(order.error()).dump();
  if (!order->is_object())
    return refused({.code = Errc::parse,
                    .what = "order not readable",
                    .expected = "a JSON object",
                    .got = std::string(text)})
        .dump();
  try {
    return carry_out(*order, *rig_, loop_->now()).dump();
  } catch (const json::exception& e) {
    return refused({.code = Errc::invalid_argument,
                    .what = "order with a value of the wrong type",
                    .got = e.what()})
        .dump();
  }
}

}  // namespace weft::daemon
