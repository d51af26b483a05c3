#include "daemon/campaign/setup/device_search.hpp"

#include <algorithm>
#include <charconv>
#include <set>

#include "daemon/campaign/diagnostics/doctor.hpp"
#include "daemon/hardware/rig/device_lock.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

constexpr int ftdi = 0x0403, thorlabs = 0xFAF0;
/// Lines of Weft's own sensors (READMEs of protocols/taxel, vibro and imprint) and of a Digital F/T
/// sensor (device-facts.md), which has even parity.
constexpr std::uint32_t sensor_bauds[] = {115200, 460800, 921600};
constexpr std::uint32_t digital_bauds[] = {1250000, 115200};

/// A port to be asked.
struct Candidate {
  std::string place;
  std::vector<PortAttempt> attempts;
  bool is_expected = true;
};

Result<TcpPort> parse_tcp(const std::string& text) {
  const std::size_t begin = std::string_view("tcp:").size(), colon = text.rfind(':');
  std::uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const bool good =
      colon > begin && std::from_chars(text.data() + colon + 1, end, port).ptr == end && port != 0;
  if (good) return TcpPort{{text.substr(begin, colon - begin), port}};
  return fail({.code = Errc::invalid_argument,
               .where = text,
               .what = "not the place of a device",
               .expected = "tcp:HOST:PORT"});
}

std::string real_name(const std::string& path) {
  std::error_code error;
  const fs::path real = fs::canonical(path, error);
  return error ? path : real.string();
}

Result<Candidate> named_candidate(const std::string& place) {
  if (!place.starts_with("tcp:")) return Candidate{place, attempts_for({.path = place}, -1, -1)};
  const auto port = parse_tcp(place);
  if (!port) return pass(port.error());
  return Candidate{place, {{*port, true, true}}};
}

std::vector<Candidate> usb_candidates(const std::vector<Candidate>& named) {
  std::vector<Candidate> out;
  for (const SerialPortSeen& seen : serial_ports()) {
    const auto is_same = [&](const Candidate& one) {
      return real_name(one.place) == real_name(seen.name);
    };
    if (seen.usb_vendor < 0 || std::ranges::any_of(named, is_same)) continue;
    const SerialSettings port{.path = stable_port_name(seen.name, "/dev/serial/by-id")};
    out.push_back({seen.name, attempts_for(port, seen.usb_vendor, seen.usb_product),
                   seen.usb_vendor == ftdi && seen.usb_product == thorlabs});
  }
  return out;
}

/// Locked for this program, and held by none that locks nothing.
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
               .what = "the port is open in " + others.front(),
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

/// All at once, each locked until the end.
class Search {
 public:
  explicit Search(const fs::path& lock_folder)
      : locks_(lock_folder.empty() ? DeviceLocks::default_folder() : lock_folder) {}

  void add(Candidate candidate) {
    const Status free = reserve(candidate.place, candidate.attempts.front().link, locks_);
    if (candidate.is_expected) expected_.insert(candidate.place);
    if (!free) return add_refused(candidate.place, free.error());
    ports_.push_back(
        std::make_unique<PortIdentifier>(loop_, candidate.place, std::move(candidate.attempts)));
  }
  void add(const BoxPlace& place) {
    const std::optional<LinkSettings> pages =
        place.pages.port == 0 ? std::nullopt : std::optional<LinkSettings>(TcpPort{place.pages});
    const Status free = reserve(place.place, UdpPort{place.records}, locks_, pages);
    if (place.can_stream) expected_.insert(place.place);
    if (!free) return add_refused(place.place, free.error());
    boxes_.push_back(std::make_unique<BoxIdentifier>(loop_, place));
  }
  SearchReport run() {
    for (const auto& port : ports_) port->start();
    for (const auto& box : boxes_) box->start();
    const auto is_done = [](const auto& one) { return one->done(); };
    loop_.run_until([&] {
      return std::ranges::all_of(ports_, is_done) && std::ranges::all_of(boxes_, is_done);
    });
    for (const auto& port : ports_) report_.devices.push_back(port->found());
    for (const auto& box : boxes_) report_.devices.push_back(box->found());
    for (FoundDevice& device : report_.devices)
      device.is_expected = expected_.contains(device.place);
    return std::move(report_);
  }

 private:
  void add_refused(const std::string& place, const Error& why) {
    FoundDevice refused;
    refused.place = place;
    refused.problem = why;
    report_.devices.push_back(std::move(refused));
  }

  SearchReport report_;
  std::set<std::string> expected_;  ///< places
  DeviceLocks locks_;
  RealLoop loop_;
  std::vector<std::unique_ptr<PortIdentifier>> ports_;
  std::vector<std::unique_ptr<BoxIdentifier>> boxes_;
};

}  // namespace

std::vector<Error> unanswered(const SearchReport& report) {
  std::vector<Error> out;
  for (const FoundDevice& device : report.devices) {
    if (!device.is_expected || device.kind != DeviceKind::unknown) continue;
    if (device.problem) {
      out.push_back(*device.problem);
    } else {
      out.push_back({.code = Errc::timeout,
                     .where = device.place,
                     .what = "no device that Weft knows replied",
                     .hint = "Check its power and cable, or leave it out"});
    }
  }
  return out;
}

std::string stable_port_name(const std::string& port, const fs::path& by_id) {
  std::error_code error;
  std::vector<std::string> names;
  for (const auto& link : fs::directory_iterator(by_id, error))
    if (real_name(link.path().string()) == real_name(port)) names.push_back(link.path().string());
  return names.empty() ? port : std::ranges::min(names);
}

std::vector<PortAttempt> attempts_for(const SerialSettings& port, int usb_vendor, int usb_product) {
  const bool is_named = usb_vendor < 0;
  SerialSettings stage = port;
  stage.rts_cts = stage.ftdi_start_up = true;
  // A pseudo-terminal has no speed: one opening serves all.
  if (real_name(port.path).starts_with("/dev/pts/")) return {{stage, true, true}};
  std::vector<PortAttempt> out;
  if (is_named || (usb_vendor == ftdi && usb_product == thorlabs)) out.push_back({stage, true});
  if (usb_vendor == ftdi && usb_product == thorlabs) return out;
  for (const std::uint32_t baud : sensor_bauds) {
    out.push_back({port});
    std::get<SerialSettings>(out.back().link).baud = baud;
  }
  if (!is_named && usb_vendor != ftdi) return out;
  for (const std::uint32_t baud : digital_bauds) {
    SerialSettings line = port;
    line.baud = baud;
    line.parity = Parity::even;
    out.push_back({line, false, true});
  }
  return out;
}

Result<SearchReport> search_devices(const SearchRequest& request) {
  std::vector<Candidate> candidates;
  for (const std::string& place : request.ports) {
    auto named = named_candidate(place);
    if (!named) return pass(named.error(), "--port");
    candidates.push_back(std::move(*named));
  }
  for (const std::string& box : request.boxes)
    if (const auto place = parse_box_place(box); !place) return pass(place.error(), "--netft");
  if (request.search_ports)
    std::ranges::move(usb_candidates(candidates), std::back_inserter(candidates));
  Search search(request.lock_folder);
  for (Candidate& candidate : candidates) search.add(std::move(candidate));
  std::vector<std::string> warnings;
  for (const BoxPlace& place : box_places(request, warnings)) search.add(place);
  SearchReport report = search.run();
  report.warnings = std::move(warnings);
  if (request.search_ports)
    for (const std::string& serial : thorlabs_without_port("/sys/bus/usb/devices"))
      report.warnings.push_back("a Thorlabs controller (" + serial +
                                ") is connected and has no serial port: `weft doctor` says why");
  return report;
}

}  // namespace weft::daemon
