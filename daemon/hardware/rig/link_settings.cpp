// Reads links from the rig file and opens them; declared in rig_file.hpp.

#include "daemon/hardware/rig/rig_file.hpp"

#include <nlohmann/json.hpp>

#include "drivers/api/config.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;

constexpr NumberRange ports{1, 65535};
constexpr NumberRange bauds{50, 12e6};

Result<std::string> address(const json& link, const char* key, const std::string& where) {
  const auto found = link.find(key);
  if (found == link.end() || !found->is_string() || found->get<std::string>().empty())
    return fail(
        {.where = where + "/" + key, .what = "missing or not a string", .expected = "a string"});
  return found->get<std::string>();
}

/// The reader of drivers' configurations reads numbers, flags and choices only, so texts are
/// removed first.
Result<SerialSettings> serial(json link, const std::string& where) {
  Result<std::string> path = address(link, "path", where);
  if (!path) return pass(path.error());
  link.erase("path");
  link.erase("kind");
  ConfigReader reader(link.dump());
  SerialSettings settings{.path = *path};
  settings.baud = static_cast<std::uint32_t>(reader.integer("baud", settings.baud, bauds));
  const std::string parity = reader.choice("parity", "none", {"none", "even", "odd"});
  settings.parity = parity == "even" ? Parity::even : parity == "odd" ? Parity::odd : Parity::none;
  settings.rts_cts = reader.flag("rts_cts", false);
  settings.ftdi_start_up = reader.flag("ftdi_start_up", false);
  if (Status ok = reader.finish(); !ok) return pass(ok.error(), where);
  return settings;
}

Result<Endpoint> endpoint(json link, const std::string& where) {
  Result<std::string> host = address(link, "host", where);
  if (!host) return pass(host.error());
  if (!link.contains("port"))
    return fail({.where = where + "/port", .what = "port missing", .expected = "a port number"});
  link.erase("host");
  link.erase("kind");
  ConfigReader reader(link.dump());
  const auto port = static_cast<std::uint16_t>(reader.integer("port", 1, ports));
  if (Status ok = reader.finish(); !ok) return pass(ok.error(), where);
  return Endpoint{*host, port};
}

Result<LinkSettings> udp(json link, const std::string& where) {
  UdpPort out;
  json local = json::object();
  if (const auto given = link.find("local_port"); given != link.end()) {
    local["local_port"] = *given;
    link.erase(given);
  }
  ConfigReader reader(local.dump());
  out.local_port = static_cast<std::uint16_t>(reader.integer("local_port", 0, {0, ports.high}));
  if (Status ok = reader.finish(); !ok) return pass(ok.error(), where);
  auto end = endpoint(std::move(link), where);
  if (!end) return pass(end.error());
  out.end = std::move(*end);
  return LinkSettings(out);
}

Result<LinkSettings> memory(const json& link, const std::string& where) {
  for (const auto& [key, value] : link.items())
    if (key != "kind")
      return fail({.where = where + "/" + key,
                   .what = "setting not allowed for a memory link",
                   .expected = "only kind"});
  return LinkSettings(MemoryPort{});
}

Result<LinkSettings> of_kind(const json& link, const std::string& where) {
  const Result<std::string> kind = address(link, "kind", where);
  if (!kind) return pass(kind.error());
  if (*kind == "memory") return memory(link, where);
  if (*kind == "serial") return serial(link, where).map([](auto s) { return LinkSettings(s); });
  if (*kind == "tcp")
    return endpoint(link, where).map([](auto e) { return LinkSettings(TcpPort{e}); });
  if (*kind == "udp") return udp(link, where);
  return fail({.where = where + "/kind",
               .what = "unknown kind of link",
               .expected = "memory, serial, tcp or udp",
               .got = *kind});
}

struct Opener {
  RealLoop* loop;
  Result<std::unique_ptr<Link>> operator()(const MemoryPort&) const {
    return fail({.code = Errc::wrong_state, .what = "memory link has no port"});
  }
  Result<std::unique_ptr<Link>> operator()(const SerialSettings& s) const {
    return open_serial(*loop, s);
  }
  Result<std::unique_ptr<Link>> operator()(const TcpPort& p) const {
    return open_tcp(*loop, p.end);
  }
  Result<std::unique_ptr<Link>> operator()(const UdpPort& p) const {
    return open_udp(*loop, p.end, p.local_port);
  }
};

}  // namespace

Result<LinkSettings> parse_link(std::string_view text, std::string_view where) {
  const json link = json::parse(text, nullptr, false);
  if (link.is_null() || (link.is_object() && link.empty())) return LinkSettings(MemoryPort{});
  if (!link.is_object())
    return fail({.where = std::string(where),
                 .what = "not a link",
                 .expected = "an object",
                 .got = link.is_discarded() ? "invalid JSON" : link.type_name()});
  return of_kind(link, std::string(where));
}

Result<std::unique_ptr<Link>> open_link(RealLoop& loop, const LinkSettings& settings) {
  return std::visit(Opener{&loop}, settings);
}

Result<std::unique_ptr<Link>> open_page(RealLoop& loop, const DeviceEntry& device) {
  if (!device.http) return std::unique_ptr<Link>{};
  auto page = open_requests(loop, std::get<TcpPort>(*device.http).end);
  if (!page) return pass(page.error(), "/http");
  return page;
}

}  // namespace weft::daemon
