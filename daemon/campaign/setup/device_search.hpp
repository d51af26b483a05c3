#pragma once
// Finds the devices of a computer: at its serial ports, in its network, and at places named by a
// person.

#include <filesystem>
#include <set>
#include <vector>

#include "daemon/campaign/diagnostics/doctor.hpp"
#include "daemon/campaign/setup/box_search.hpp"
#include "daemon/campaign/setup/port_identifier.hpp"

namespace weft::daemon {

struct SearchRequest {
  std::vector<std::string> ports;  ///< "/dev/ttyUSB0" or "tcp:HOST:PORT"
  std::vector<std::string> boxes;  ///< as for parse_box_place()
  /// Places, or USB serial numbers, that are not touched, even if named above.
  std::vector<std::string> left_out;
  bool search_ports = true;    ///< also every serial port on USB
  bool search_network = true;  ///< also by broadcast
  // For tests only.
  std::filesystem::path lock_folder;  ///< of the device locks; empty: the usual one
  std::filesystem::path by_id = "/dev/serial/by-id";
};

struct SearchReport {
  std::vector<FoundDevice> devices;  ///< in the order of the request, then as they were found
  /// Reasons why a part of the search was not done, and USB controllers without a port.
  std::vector<std::string> warnings;
  std::set<std::string> left_out;  ///< places and numbers of the request that were found
};

/// Identifies all devices at once in a few seconds, each on its own thread and locked for that
/// time. Nothing moves, nothing is set, no stream is left on. A device in use is reported with its
/// holder and not opened. Errors: invalid_argument for an invalid place.
Result<SearchReport> search_devices(const SearchRequest& request);

/// Expected devices that could not be identified or did not reply. Without them, roles would go to
/// other devices than intended.
std::vector<Error> unanswered(const SearchReport& report);

/// The name of a serial port that stays the same when it is plugged in again: a link to it in
/// `by_id` (udev's /dev/serial/by-id). The port itself if there is no such link, or if the port is
/// already a link made by a person.
std::string stable_port_name(const std::string& port, const std::filesystem::path& by_id);

/// A port and the attempts to identify its device.
struct PortPlan {
  FoundDevice found;                  ///< its place; why it is not opened
  std::vector<PortAttempt> attempts;  ///< one opening after the other; empty: not opened
};
/// Plan for a serial port named by a person: all attempts, but for a Thorlabs unit only its stage.
PortPlan plan_named(const std::string& port, const std::vector<SerialPortSeen>& present,
                    const std::filesystem::path& by_id);
/// Plan for a USB port that was not named. Opens only a Thorlabs unit, and only if the holders of
/// ports can be seen: opening resets some boards, and another device may take a request for an
/// order.
PortPlan plan_unnamed(const SerialPortSeen& port, bool can_see_holders,
                      const std::filesystem::path& by_id);

}  // namespace weft::daemon
