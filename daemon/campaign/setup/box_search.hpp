#pragma once
// Net F/T boxes: finds them by a broadcast in the network and reads their identity.

#include <memory>
#include <string>
#include <vector>

#include "daemon/campaign/setup/found_device.hpp"
#include "drivers/ati_netft/page_reader.hpp"
#include "protocols/rdt/discovery.hpp"
#include "protocols/rdt/rdt.hpp"

namespace weft::daemon {

/// Target of a search; other values are for tests only.
struct BoxSearch {
  std::string to = "255.255.255.255";  ///< sent through each network that has broadcasts
  std::uint16_t port = protocols::rdt::discovery_port;
  std::uint16_t reply_port = protocols::rdt::discovery_reply_port;
  protocols::rdt::DiscoveryRequest request = {};
};

/// Limit of a search; further replies are ignored.
inline constexpr std::size_t most_boxes = 32;

/// Sends one datagram into each network of the computer and waits 1.8 s for replies. Does not
/// disturb boxes: none is requested to send. Returns each box once, ordered by address. Ignores
/// replies that came from another address. Errors: io if the port for replies is in use or no
/// datagram could be sent. Without a network the result is empty.
Result<std::vector<protocols::rdt::DiscoveryReply>> find_boxes(const BoxSearch& search = {});

/// Address of a box.
struct BoxPlace {
  std::string place;  ///< as given by the user
  Endpoint records;   ///< RDT, UDP
  Endpoint pages;     ///< HTTP; port 0: not read
  /// A person named the box: it may be requested to send for a second if its pages do not have its
  /// rate. A box from a search may send to another computer, which would lose the stream.
  bool can_stream = false;
};

/// "HOST", "HOST:PORT" (no pages) or "HOST:PORT/PAGES". Errors: invalid_argument.
Result<BoxPlace> parse_box_place(const std::string& text);

/// Reads a box's pages. If they are not available, counts its records for a moment. Thread-bound to
/// its loop, which outlives it.
class BoxIdentifier {
 public:
  BoxIdentifier(RealLoop& loop, BoxPlace place);
  void start();
  [[nodiscard]] bool done() const { return done_; }
  /// Valid once done; the kind is unknown without a reply.
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
