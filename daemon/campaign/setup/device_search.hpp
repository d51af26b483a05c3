#pragma once
// Which devices a machine has: at its serial ports, in its network, and at places that a person
// names.

#include <filesystem>
#include <set>
#include <vector>

#include "daemon/campaign/diagnostics/doctor.hpp"
#include "daemon/campaign/setup/box_search.hpp"
#include "daemon/campaign/setup/port_identifier.hpp"

namespace weft::daemon {

struct SearchRequest {
  std::vector<std::string> ports;  ///< "/dev/ttyUSB0" or "tcp:HOST:PORT"
  std::vector<std::string> boxes;  ///< as parse_box_place() takes them
  /// Places, or serial numbers of USB, that are not touched, named above or not.
  std::vector<std::string> left_out;
  bool search_ports = true;    ///< also every serial port on USB
  bool search_network = true;  ///< also by broadcast
  // Changed by tests alone.
  std::filesystem::path lock_folder;  ///< of the device locks; empty: the usual one
  std::filesystem::path by_id = "/dev/serial/by-id";
};

struct SearchReport {
  std::vector<FoundDevice> devices;  ///< in the order of the request, then as they were found
  /// What kept a part of the search from being done, and USB controllers without a port.
  std::vector<std::string> warnings;
  std::set<std::string> left_out;  ///< of the request's, what there was
};

/// Asks all of them at once, each on a thread of its own, a few seconds; each is locked for as
/// long. Nothing moves, nothing is set, no stream is left on. A device that is in use is reported
/// with its holder and not asked.
/// Errors: invalid_argument, for a place that is none.
Result<SearchReport> search_devices(const SearchRequest& request);

/// Expected devices that could not be asked or did not reply: without them roles would go to other
/// devices than a person means.
std::vector<Error> unanswered(const SearchReport& report);

/// The name of a serial port that stays the same when it is plugged in again: a link to it in
/// `by_id` (udev's /dev/serial/by-id); the port itself where there is none, or where it is a link
/// itself, which somebody made.
std::string stable_port_name(const std::string& port, const std::filesystem::path& by_id);

/// A port and how it is asked.
struct PortPlan {
  FoundDevice found;                  ///< its place; why it is not opened
  std::vector<PortAttempt> attempts;  ///< one opening after the other; empty: it is not opened
};
/// Of a serial port that a person named: asked everything, a Thorlabs unit for its stage alone.
PortPlan plan_named(const std::string& port, const std::vector<SerialPortSeen>& present,
                    const std::filesystem::path& by_id);
/// Of one on USB that nobody named. Only a Thorlabs unit is opened, and that only where the
/// programs that may have it can be seen: to be opened resets some boards, and what is sent to a
/// device of another kind it may take as an order.
PortPlan plan_unnamed(const SerialPortSeen& port, bool can_see_holders,
                      const std::filesystem::path& by_id);

}  // namespace weft::daemon
