#include "daemon/campaign/setup/device_search.hpp"

#include <algorithm>
#include <charconv>
#include <future>

#include "daemon/hardware/rig/device_lock.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

constexpr int ftdi = 0x0403, thorlabs = 0xFAF0;
/// Baud rates of Weft's own sensors (READMEs of protocols/taxel, vibro and imprint). Then those of
/// a Digital F/T sensor (device-facts.md), which has even parity.
constexpr std::uint32_t sensor_bauds[] = {115200, 460800, 921600};
constexpr std::uint32_t digital_bauds[] = {1250000, 115200};

Result<TcpPort> parse_tcp(const std::string& text) {
  const std::size_t begin = std::string_view("tcp:").size(), colon = text.rfind(':');
  std::uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const bool good =
      colon > begin && std::from_chars(text.data() + colon + 1, end, port).ptr == end && port != 0;
  if (good) return TcpPort{{text.substr(begin, colon - begin), port}};
  return fail({.code = Errc::invalid_argument,
               .where = text,
               .what = "invalid device address",
               .expected = "tcp:HOST:PORT"});
}

std::string real_name(const std::string& path) {
  std::error_code error;
  const fs::path real = fs::canonical(path, error);
  return error ? path : real.string();
}

PortPlan plan_at(const std::string& place, bool is_expected) {
  PortPlan out;
  out.found.place = place;
  out.found.is_expected = is_expected;
  return out;
}

bool is_thorlabs(const SerialPortSeen& port) {
  return port.usb_vendor == ftdi && port.usb_product == thorlabs;
}

bool is_pseudo(const std::string& port) {
  return real_name(port).starts_with("/dev/pts/");
}

std::vector<PortAttempt> stage_attempt(SerialSettings port) {
  port.rts_cts = port.ftdi_start_up = true;
  // A pseudo-terminal has no speed: one opening serves all.
  const bool serves_all = is_pseudo(port.path);
  return {{port, true, serves_all}};
}

Result<PortPlan> parse_port(const std::string& place, const std::vector<SerialPortSeen>& present,
                            const fs::path& by_id) {
  if (!place.starts_with("tcp:")) return plan_named(place, present, by_id);
  const auto port = parse_tcp(place);
  if (!port) return pass(port.error());
  PortPlan out = plan_at(place, true);
  out.attempts = {{*port, true, true}};
  return out;
}

/// Plans of the named ports, then of the computer's. Errors: invalid_argument.
Result<std::vector<PortPlan>> port_plans(const SearchRequest& request,
                                         std::vector<std::string>& warnings) {
  std::vector<PortPlan> out;
  const std::vector<SerialPortSeen> present = serial_ports();
  for (const std::string& place : request.ports) {
    auto named = parse_port(place, present, request.by_id);
    if (!named) return pass(named.error(), "--port");
    out.push_back(std::move(*named));
  }
  const bool sees_holders = can_see_holders("/proc");
  const auto is_real = [](const std::string& place) {
    return !place.starts_with("tcp:") && !is_pseudo(place);
  };
  if (!sees_holders && std::ranges::any_of(request.ports, is_real))
    warnings.emplace_back(
        "ports opened by other users are not visible: check that no other user's program "
        "uses a named port");
  if (!request.search_ports) return out;
  for (const SerialPortSeen& seen : present) {
    const auto is_same = [&](const std::string& place) {
      return real_name(place) == real_name(seen.name);
    };
    if (seen.usb_vendor >= 0 && std::ranges::none_of(request.ports, is_same))
      out.push_back(plan_unnamed(seen, sees_holders, request.by_id));
  }
  return out;
}

/// Locks a port for this program, and refuses it if a program without locks holds it.
Status reserve(const std::string& place, const LinkSettings& link, DeviceLocks& locks,
               const std::optional<LinkSettings>& http = {}) {
  DeviceEntry entry;
  entry.name = place;
  entry.link = link;
  entry.http = http;
  if (Status locked = locks.acquire(entry, "weft init"); !locked) return locked;
  const auto* serial = std::get_if<SerialSettings>(&link);
  const auto others = serial == nullptr ? std::vector<std::string>{} : others_with(*serial);
  if (others.empty()) return {};
  return fail({.code = Errc::busy,
               .where = place,
               .what = "port open in " + others.front(),
               .hint = "End that program first"});
}

std::vector<BoxPlace> box_places(const SearchRequest& request, std::vector<std::string>& warnings) {
  std::vector<BoxPlace> out;
  for (const std::string& box : request.boxes) out.push_back(parse_box_place(box).value());
  if (!request.search_network) return out;
  const auto replies = find_boxes();
  if (!replies) {
    warnings.push_back(to_string(replies.error()));
    return out;
  }
  if (replies->size() == most_boxes)
    warnings.push_back("only " + std::to_string(most_boxes) +
                       " boxes of the network are checked: name yours with --netft HOST");
  for (const protocols::rdt::DiscoveryReply& reply : *replies) {
    std::string host;
    for (const std::uint8_t byte : reply.address)
      host += (host.empty() ? "" : ".") + std::to_string(byte);
    if (std::ranges::find(out, host, [](const BoxPlace& b) { return b.records.host; }) != out.end())
      continue;
    out.push_back(parse_box_place(host).value());
    out.back().can_stream = false;
  }
  return out;
}

/// Runs on its own thread and loop: an unreachable host does not delay other devices.
template <class Identifier, class... What>
std::future<FoundDevice> identify(What... what) {
  return std::async(std::launch::async, [... what = std::move(what)] {
    RealLoop loop;
    Identifier one(loop, what...);
    one.start();
    loop.run_until([&] { return one.done(); });
    return one.found();
  });
}

/// Identifies all devices at once, each locked until the end.
class Search {
 public:
  explicit Search(const SearchRequest& request)
      : left_out_(request.left_out.begin(), request.left_out.end()),
        locks_(request.lock_folder.empty() ? DeviceLocks::default_folder() : request.lock_folder) {}

  void add(PortPlan plan) {
    if (is_left_out({plan.found.place, real_name(plan.found.place), plan.found.serial})) return;
    plan.found.serial.clear();  // that of the adapter
    Status free;
    if (!plan.attempts.empty())
      free = reserve(plan.found.place, plan.attempts.front().link, locks_);
    if (!free) plan.found.problem = free.error();
    std::future<FoundDevice> found;
    if (free && !plan.attempts.empty())
      found = identify<PortIdentifier>(plan.found.place, std::move(plan.attempts));
    devices_.push_back({std::move(plan.found), std::move(found)});
  }
  void add(const BoxPlace& place) {
    if (is_left_out({place.place})) return;
    const std::optional<LinkSettings> pages =
        place.pages.port == 0 ? std::nullopt : std::optional<LinkSettings>(TcpPort{place.pages});
    const Status free = reserve(place.place, UdpPort{place.records}, locks_, pages);
    PortPlan plan = plan_at(place.place, place.can_stream);
    if (!free) plan.found.problem = free.error();
    devices_.push_back({std::move(plan.found),
                        free ? identify<BoxIdentifier>(place) : std::future<FoundDevice>{}});
  }
  SearchReport run() {
    for (Device& device : devices_) {
      FoundDevice found = device.found.valid() ? device.found.get() : device.planned;
      found.is_expected = device.planned.is_expected;
      report_.devices.push_back(std::move(found));
    }
    return std::move(report_);
  }

 private:
  struct Device {
    FoundDevice planned;
    std::future<FoundDevice> found;  ///< of a device that is being identified
  };

  bool is_left_out(const std::vector<std::string>& names) {
    bool out = false;
    for (const std::string& one : left_out_) {
      if (one.empty() || (std::ranges::find(names, one) == names.end() &&
                          std::ranges::find(names, real_name(one)) == names.end()))
        continue;
      report_.left_out.insert(one);
      out = true;
    }
    return out;
  }

  SearchReport report_;
  std::set<std::string> left_out_;
  DeviceLocks locks_;
  std::vector<Device> devices_;
};

}  // namespace

std::vector<Error> unanswered(const SearchReport& report) {
  std::vector<Error> out;
  for (const FoundDevice& device : report.devices) {
    if (!device.is_expected || device.kind != DeviceKind::unknown) continue;
    Error why{.code = Errc::timeout,
              .where = device.place,
              .what = "no known device replied",
              .hint = "Check its power and cable"};
    if (device.problem) why = *device.problem;
    why.hint += (why.hint.empty() ? "Exclude it with --role " : ", or exclude it with --role ") +
                device.place + "=none";
    out.push_back(std::move(why));
  }
  return out;
}

std::string stable_port_name(const std::string& port, const fs::path& by_id) {
  std::error_code error;
  if (fs::is_symlink(port, error)) return port;
  std::vector<std::string> names;
  for (const auto& link : fs::directory_iterator(by_id, error))
    if (real_name(link.path().string()) == real_name(port)) names.push_back(link.path().string());
  return names.empty() ? port : std::ranges::min(names);
}

PortPlan plan_named(const std::string& port, const std::vector<SerialPortSeen>& present,
                    const fs::path& by_id) {
  PortPlan out = plan_at(port, true);
  const SerialSettings line{.path = stable_port_name(port, by_id)};
  out.attempts = stage_attempt(line);
  const auto seen = std::ranges::find_if(
      present, [&](const SerialPortSeen& one) { return real_name(one.name) == real_name(port); });
  if (seen != present.end()) out.found.serial = seen->usb_serial;
  if (is_pseudo(port) || (seen != present.end() && is_thorlabs(*seen))) return out;
  for (const std::uint32_t baud : sensor_bauds) {
    out.attempts.push_back({line});
    std::get<SerialSettings>(out.attempts.back().link).baud = baud;
  }
  for (const std::uint32_t baud : digital_bauds) {
    SerialSettings digital = line;
    digital.baud = baud;
    digital.parity = Parity::even;
    out.attempts.push_back({digital, false, true});
  }
  return out;
}

PortPlan plan_unnamed(const SerialPortSeen& port, bool can_see_holders, const fs::path& by_id) {
  PortPlan out = plan_at(port.name, is_thorlabs(port));
  out.found.serial = port.usb_serial;
  if (is_thorlabs(port) && can_see_holders) {
    out.attempts = stage_attempt({.path = stable_port_name(port.name, by_id)});
  } else if (is_thorlabs(port)) {
    out.found.problem = Error{.code = Errc::busy,
                              .where = port.name,
                              .what = "port not opened, because another user's program may use it",
                              .hint = "If no other program uses it, add --port " + port.name};
  } else {
    out.found.notes.push_back("not opened, because that resets some boards; " +
                              std::string(port.usb_vendor == ftdi
                                              ? "if it is a Digital F/T or another sensor of this "
                                                "bench"
                                              : "if it is a sensor of this bench") +
                              ", name it with --port " + port.name);
  }
  return out;
}

Result<SearchReport> search_devices(const SearchRequest& request) {
  for (const std::string& box : request.boxes)
    if (const auto place = parse_box_place(box); !place) return pass(place.error(), "--netft");
  std::vector<std::string> warnings;
  auto plans = port_plans(request, warnings);
  if (!plans) return pass(plans.error());
  Search search(request);
  for (PortPlan& plan : *plans) search.add(std::move(plan));
  for (const BoxPlace& place : box_places(request, warnings)) search.add(place);
  SearchReport report = search.run();
  report.warnings = std::move(warnings);
  if (request.search_ports)
    for (const std::string& serial : thorlabs_without_port("/sys/bus/usb/devices"))
      report.warnings.push_back("Thorlabs controller (" + serial +
                                ") connected, but without serial port: see `weft doctor`");
  return report;
}

}  // namespace weft::daemon
