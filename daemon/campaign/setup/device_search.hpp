#pragma once
// Which devices a machine has: at its serial ports, in its network, and at places that a person
// names.

#include <filesystem>
#include <vector>

#include "daemon/campaign/setup/box_search.hpp"
#include "daemon/campaign/setup/port_identifier.hpp"

namespace weft::daemon {

struct SearchRequest {
  std::vector<std::string> ports;     ///< "/dev/ttyUSB0" or "tcp:HOST:PORT"
  std::vector<std::string> boxes;     ///< as parse_box_place() takes them
  bool search_ports = true;           ///< also every serial port on USB
  bool search_network = true;         ///< also by broadcast
  std::filesystem::path lock_folder;  ///< of the device locks; empty: the usual one
};

struct SearchReport {
  std::vector<FoundDevice> devices;  ///< in the order of the request, then as they were found
  /// What kept a part of the search from being done, and USB controllers without a port.
  std::vector<std::string> warnings;
};

/// Asks all of them at once, a few seconds; each is locked for as long. Nothing moves, nothing is
/// set, no stream is left on. A device that is in use is reported with its holder and not asked.
/// Errors: invalid_argument, for a place that is none.
Result<SearchReport> search_devices(const SearchRequest& request);

/// Expected devices that could not be asked or did not reply: without them roles would go to other
/// devices than a person means.
std::vector<Error> unanswered(const SearchReport& report);

/// The name of a serial port that stays the same when it is plugged in again: a link to it in
/// `by_id` (udev's /dev/serial/by-id); the port itself where there is none.
std::string stable_port_name(const std::string& port, const std::filesystem::path& by_id);

/// How the port with these USB numbers (-1: none, or named by a person) is opened, one way after
/// the other. What no device of ours has is only listened to.
std::vector<PortAttempt> attempts_for(const SerialSettings& port, int usb_vendor, int usb_product);

}  // namespace weft::daemon
