#pragma once
// Net F/T boxes: found by a broadcast in the network, and asked who they are.

#include <memory>
#include <string>
#include <vector>

#include "daemon/campaign/setup/found_device.hpp"
#include "drivers/ati_netft/page_reader.hpp"
#include "protocols/rdt/discovery.hpp"
#include "protocols/rdt/rdt.hpp"

namespace weft::daemon {

/// Where a search goes; changed by tests alone.
struct BoxSearch {
  std::string to = "255.255.255.255";  ///< through each network that has broadcasts
  std::uint16_t port = protocols::rdt::discovery_port;
  std::uint16_t reply_port = protocols::rdt::discovery_reply_port;
  protocols::rdt::DiscoveryRequest request = {};
};

/// Of a search; what replies beyond them is passed over.
inline constexpr std::size_t most_boxes = 32;

/// Sends one datagram into each network of the machine and waits for replies, 1.8 s. Boxes are not
/// disturbed by it: none is asked to send. In the order of their addresses, each once; none whose
/// reply came from another address.
/// Errors: io, where the port of the replies is taken or there is no network.
Result<std::vector<protocols::rdt::DiscoveryReply>> find_boxes(const BoxSearch& search = {});

/// Where a box is looked for.
struct BoxPlace {
  std::string place;  ///< as it was given
  Endpoint records;   ///< RDT, UDP
  Endpoint pages;     ///< HTTP; port 0: it is not asked for
  /// Named by a person: it may be made to send for a second where its pages do not tell its rate.
  /// A box that was found may send to another computer, which would lose it.
  bool can_stream = false;
};

/// "HOST", "HOST:PORT" (no pages) or "HOST:PORT/PAGES". Errors: invalid_argument.
Result<BoxPlace> parse_box_place(const std::string& text);

/// Reads a box's pages, and where they are not to be had counts its records for a moment.
/// Thread-bound to its loop, which outlives it.
class BoxIdentifier {
 public:
  BoxIdentifier(RealLoop& loop, BoxPlace place);
  void start();
  [[nodiscard]] bool done() const { return done_; }
  /// Once done: its kind is unknown where nothing replied.
  [[nodiscard]] const FoundDevice& found() const { return found_; }

 private:
  void on_pages(const Result<drivers::BoxPages>& pages);
  void count_records();
  void on_datagram(ByteView datagram, TimePoint arrival);
  void on_time();
  void finish();

  RealLoop* loop_;
  BoxPlace place_;
  FoundDevice found_;
  bool done_ = false;
  std::unique_ptr<Link> page_, records_;
  drivers::PageReader reader_;
  std::size_t count_ = 0;
  TimePoint first_{}, last_{};
  Timer timer_;
};

}  // namespace weft::daemon
