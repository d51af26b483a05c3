// Reads the identity of a Net F/T box; declared in box_search.hpp.

#include <charconv>

#include "daemon/campaign/setup/box_search.hpp"
#include "daemon/campaign/setup/port_identifier.hpp"
#include "protocols/base/printable.hpp"

namespace weft::daemon {
namespace {

using namespace std::chrono_literals;
namespace rdt = protocols::rdt;

constexpr std::uint16_t http_port = 80;
constexpr Duration page_time = 3s, count_time = 1s;
/// Limit of requested records: the box stops by itself if this program ends early.
constexpr std::uint32_t most_records = 500;

std::optional<std::uint16_t> port_of(std::string_view text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc{} || end != text.data() + text.size() || port == 0) return std::nullopt;
  return port;
}

}  // namespace

Result<BoxPlace> parse_box_place(const std::string& text) {
  const auto refused = [&text] {
    return fail({.code = Errc::invalid_argument,
                 .where = text,
                 .what = "invalid address of a Net F/T box",
                 .expected = "HOST, HOST:PORT or HOST:PORT/HTTP_PORT"});
  };
  const std::size_t colon = text.find(':');
  const std::string host = text.substr(0, colon);
  if (host.empty() || host.find('/') != std::string::npos) return refused();
  BoxPlace place{text, {host, rdt::udp_port}, {host, http_port}, true};
  if (colon == std::string::npos) return place;
  const std::string_view ports = std::string_view(text).substr(colon + 1);
  const std::size_t slash = ports.find('/');
  const auto records = port_of(ports.substr(0, slash));
  const auto pages = slash == std::string_view::npos ? std::optional<std::uint16_t>(0)
                                                     : port_of(ports.substr(slash + 1));
  if (!records || !pages) return refused();
  place.records.port = *records;
  place.pages.port = *pages;
  return place;
}

BoxIdentifier::BoxIdentifier(RealLoop& loop, BoxPlace place)
    : loop_(&loop),
      place_(std::move(place)),
      reader_([this](const Result<drivers::BoxPages>& pages) { on_pages(pages); }),
      timer_(loop, [this] { on_time(); }) {
  found_.place = place_.place;
  found_.link = UdpPort{place_.records};
}

void BoxIdentifier::start() {
  if (place_.pages.port == 0) return count_records();
  auto page = open_requests(*loop_, place_.pages);
  if (!page) return count_records();
  page_ = std::move(*page);
  timer_.start(page_time);
  if (!reader_.read(*page_)) count_records();
}

void BoxIdentifier::on_pages(const Result<drivers::BoxPages>& pages) {
  if (!pages) return count_records();
  found_.kind = DeviceKind::net_ft;
  found_.http = TcpPort{place_.pages};
  found_.model = printable(pages->settings.product, max_text);
  found_.serial = printable(pages->calibration_serial(), max_text);
  found_.rate_hz = pages->settings.rdt_rate_hz;
  if (!pages->settings.rdt_enabled)
    found_.notes.emplace_back("its RDT interface is disabled: enable it on its web page");
  if (found_.rate_hz > 0) return finish();
  count_records();
}

void BoxIdentifier::count_records() {
  reader_.let_go();
  if (!place_.can_stream) return finish();
  auto records = open_udp(*loop_, place_.records);
  if (!records) {
    found_.problem = records.error();
    return finish();
  }
  records_ = std::move(*records);
  records_->on_receive(
      [this](ByteView datagram, TimePoint arrival) { on_datagram(datagram, arrival); });
  static_cast<void>(
      records_->write(encode(rdt::Request{rdt::RequestCommand::start_realtime, most_records})));
  timer_.start(count_time);
}

void BoxIdentifier::on_datagram(ByteView datagram, TimePoint arrival) {
  const auto records = rdt::record_count(datagram);
  if (!records) return;
  if (count_ == 0) first_ = arrival;
  last_ = arrival;
  count_ += *records;
  if (count_ >= most_records) timer_.start({});
}

void BoxIdentifier::on_time() {
  if (!records_ && reader_.reading() && reader_.go_without_calibration()) return;
  if (!records_) return count_records();
  static_cast<void>(records_->write(encode(rdt::Request{rdt::RequestCommand::stop, 0})));
  if (count_ > 0) found_.kind = DeviceKind::net_ft;
  if (count_ > 1)
    found_.rate_hz = rounded_rate_hz(static_cast<double>(count_ - 1) / to_seconds(last_ - first_));
  finish();
}

void BoxIdentifier::finish() {
  done_ = true;
  timer_.cancel();
  if (records_) records_->on_receive({});
  if (!place_.can_stream)
    found_.notes.push_back(
        (found_.kind == DeviceKind::unknown
             ? "it replied to the broadcast, but its web pages were not readable; if it is "
               "a Net F/T box of this bench"
             : "it replied to the broadcast and may belong to another computer; if it is "
               "part of this bench") +
        std::string(", name it with --netft ") + place_.place);
  if (found_.kind != DeviceKind::net_ft || found_.http) return;
  found_.notes.emplace_back(
      "its web pages were not readable: counts per newton and serial number are unknown");
}

}  // namespace weft::daemon
