// Lists and checks serial ports; declared in doctor.hpp.

#include "daemon/campaign/diagnostics/doctor.hpp"

#include <grp.h>
#include <libserialport.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <map>

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

constexpr int ftdi = 0x0403;
constexpr int thorlabs_product = 0xFAF0;  // docs/reference/device-facts.md, APT line
// Longest good latency timer of an FTDI chip, which delays small packets. Its default is 16 ms.
constexpr int good_latency_ms = 1;

std::string text_or_nothing(const char* text) {
  return text == nullptr ? std::string() : std::string(text);
}

SerialPortSeen describe(sp_port* port) {
  SerialPortSeen seen;
  seen.name = text_or_nothing(sp_get_port_name(port));
  seen.description = text_or_nothing(sp_get_port_description(port));
  if (sp_get_port_transport(port) != SP_TRANSPORT_USB) return seen;
  sp_get_port_usb_vid_pid(port, &seen.usb_vendor, &seen.usb_product);
  seen.usb_serial = text_or_nothing(sp_get_port_usb_serial(port));
  seen.note = usb_note(seen.usb_vendor, seen.usb_product);
  return seen;
}

std::string first_line(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

bool has_serial_port(const fs::path& usb_device) {
  std::error_code error;
  for (const auto& interface : fs::directory_iterator(usb_device, error))
    for (const auto& child : fs::directory_iterator(interface.path(), error))
      if (child.path().filename().string().rfind("ttyUSB", 0) == 0) return true;
  return false;
}

std::string ports_present(const std::vector<SerialPortSeen>& present) {
  std::string out;
  for (const SerialPortSeen& port : present)
    out +=
        (out.empty() ? "" : ", ") + port.name + (port.note.empty() ? "" : " (" + port.note + ")");
  return out.empty() ? "Connect the device and switch it on; this computer has no serial port"
                     : "Connect the device and switch it on; present ports: " + out;
}

std::string group_of(const struct stat& file) {
  const group* entry = ::getgrgid(file.st_gid);
  return entry == nullptr ? std::to_string(file.st_gid) : std::string(entry->gr_name);
}

Diagnosis no_permission(const std::string& device, const std::string& path,
                        const struct stat& file) {
  const std::string name = group_of(file);
  return {Severity::problem, device, "no permission for " + path + " of group " + name,
          name == "root" ? "Add a udev rule: SUBSYSTEM==\"tty\", GROUP=\"dialout\""
                         : "Run `sudo usermod -aG " + name + " $USER` and log in again"};
}

std::vector<std::string> holders(const fs::path& port) {
  std::vector<std::string> out;
  std::error_code error;
  for (const auto& process : fs::directory_iterator("/proc", error)) {
    const std::string pid = process.path().filename().string();
    if (pid.find_first_not_of("0123456789") != std::string::npos) continue;
    if (pid == std::to_string(::getpid())) continue;
    std::error_code hidden;
    for (const auto& open : fs::directory_iterator(process.path() / "fd", hidden)) {
      if (fs::read_symlink(open.path(), hidden) != port) continue;
      out.push_back(first_line(process.path() / "comm") + " (pid " + pid + ")");
      break;
    }
  }
  return out;
}

std::string joined(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : ", ") + word;
  return out;
}

void check_latency_timer(const std::string& device, const fs::path& port,
                         std::vector<Diagnosis>& found_problems) {
  const fs::path file = "/sys/bus/usb-serial/devices" / port.filename() / "latency_timer";
  const std::string text = first_line(file);
  int latency_ms = 0;
  std::from_chars(text.data(), text.data() + text.size(), latency_ms);
  if (latency_ms <= good_latency_ms) return;
  found_problems.push_back({Severity::warning, device,
                            "USB latency timer too long: " + text + " ms",
                            "Run `echo 1 | sudo tee " + file.string() +
                                "`; permanently with a udev rule: ATTR{latency_timer}=\"1\""});
}

}  // namespace

std::string usb_note(int vendor, int product) {
  if (vendor == ftdi && product == thorlabs_product) return "Thorlabs controller";
  if (vendor == ftdi) return "FTDI chip";
  constexpr std::array<std::pair<int, const char*>, 5> makers{{{0x2341, "Arduino"},
                                                               {0x16C0, "Teensy"},
                                                               {0x0483, "STM32"},
                                                               {0x10C4, "Silicon Labs chip"},
                                                               {0x1A86, "WCH chip"}}};
  for (const auto& [id, name] : makers)
    if (vendor == id) return name;
  return {};
}

std::vector<SerialPortSeen> serial_ports() {
  std::vector<SerialPortSeen> out;
  sp_port** list = nullptr;
  if (sp_list_ports(&list) != SP_OK) return out;
  for (sp_port** port = list; *port != nullptr; ++port) out.push_back(describe(*port));
  sp_free_port_list(list);
  std::ranges::sort(out, {}, &SerialPortSeen::name);
  return out;
}

std::vector<std::string> thorlabs_without_port(const fs::path& usb_devices) {
  std::vector<std::string> out;
  std::error_code error;
  for (const auto& device : fs::directory_iterator(usb_devices, error)) {
    const bool thorlabs = first_line(device.path() / "idVendor") == "0403" &&
                          first_line(device.path() / "idProduct") == "faf0";
    if (!thorlabs || has_serial_port(device.path())) continue;
    const std::string serial = first_line(device.path() / "serial");
    out.push_back(serial.empty() ? device.path().filename().string() : serial);
  }
  std::ranges::sort(out);
  return out;
}

std::vector<Diagnosis> check_serial(const std::string& device, const SerialSettings& settings,
                                    const std::vector<SerialPortSeen>& present) {
  std::error_code error;
  const fs::path port = fs::canonical(settings.path, error);
  struct stat file {};
  if (error || ::stat(port.c_str(), &file) != 0)
    return {{Severity::problem, device, "port " + settings.path + " not found",
             ports_present(present)}};
  if (!S_ISCHR(file.st_mode))
    return {{Severity::problem, device, settings.path + " is not a port",
             "Give a device file: /dev/ttyUSB0, or better a link in /dev/serial/by-id"}};
  if (::access(port.c_str(), R_OK | W_OK) != 0) return {no_permission(device, settings.path, file)};
  std::vector<Diagnosis> found_problems;
  if (const auto others = others_with(settings); !others.empty())
    found_problems.push_back({Severity::problem, device,
                              settings.path + " is open in " + joined(others),
                              "End that program; two programs on one port each miss replies"});
  check_latency_timer(device, port, found_problems);
  return found_problems;
}

std::vector<std::string> others_with(const SerialSettings& settings) {
  std::error_code error;
  const fs::path port = fs::canonical(settings.path, error);
  const bool is_pseudo = port.string().starts_with("/dev/pts/");
  return error || is_pseudo ? std::vector<std::string>{} : holders(port);
}

bool can_see_holders(const fs::path& processes) {
  std::error_code error;
  if (!fs::exists(processes / "1", error)) return false;  // /proc is mounted with hidepid
  for (const auto& process : fs::directory_iterator(processes, error)) {
    const std::string pid = process.path().filename().string();
    if (pid.find_first_not_of("0123456789") != std::string::npos) continue;
    std::error_code hidden;
    fs::directory_iterator(process.path() / "fd", hidden);
    if (hidden == std::errc::permission_denied) return false;
  }
  return !error;
}

std::vector<Diagnosis> shared_ports(const std::vector<DeviceEntry>& devices) {
  std::vector<Diagnosis> out;
  std::map<std::string, std::string> owners;
  for (const DeviceEntry& device : devices) {
    const auto* serial = std::get_if<SerialSettings>(&device.link);
    if (serial == nullptr) continue;
    std::error_code error;
    const fs::path port = fs::weakly_canonical(serial->path, error);
    const auto [owner, first] = owners.emplace(port.string(), device.name);
    if (!first)
      out.push_back({Severity::problem, device.name,
                     "same port as " + owner->second + ": " + serial->path,
                     "Give each device its own port in the rig file"});
  }
  return out;
}

std::string link_text(const LinkSettings& link) {
  const auto at = [](const char* kind, const Endpoint& end) {
    return std::string(kind) + " " + end.host + ":" + std::to_string(end.port);
  };
  if (const auto* serial = std::get_if<SerialSettings>(&link))
    return "serial " + serial->path + " at " + std::to_string(serial->baud) + " baud";
  if (const auto* tcp = std::get_if<TcpPort>(&link)) return at("tcp", tcp->end);
  if (const auto* udp = std::get_if<UdpPort>(&link))
    return at("udp", udp->end) +
           (udp->local_port == 0 ? "" : ", receiving at port " + std::to_string(udp->local_port));
  return "memory";
}

}  // namespace weft::daemon
