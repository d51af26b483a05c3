#include "sim/devices/netft_page_emulator.hpp"

#include <algorithm>
#include <charconv>
#include <optional>

namespace weft::sim {

namespace {

namespace rdt = protocols::rdt;

constexpr std::size_t largest_head = 8192;
constexpr std::string_view xml = "text/xml", html = "text/html";

/// A number of a query; nothing when it is absent or outside what the box takes.
std::optional<double> number_in(std::string_view query, std::string_view key, double least,
                                double most) {
  const auto text = rdt::query_value(query, key);
  double value = 0;
  if (!text || std::from_chars(text->data(), text->data() + text->size(), value).ec != std::errc{})
    return std::nullopt;
  return value >= least && value <= most ? std::optional(value) : std::nullopt;
}

/// Of the page "Communications".
void take_communication(RdtEmulator& box, std::string_view query) {
  if (const auto rate_hz = number_in(query, "comrdtrate", 1, 7000)) box.set_rate_hz(*rate_hz);
  if (const auto size = number_in(query, "comrdtbsiz", 1, 40))
    box.set_records_per_datagram(static_cast<std::size_t>(*size));
  if (const auto on = number_in(query, "comrdte", 0, 1)) box.enable_rdt(*on == 1);
}

/// Of the page "Settings". Six zeros take the bias away; other values of it are not taken.
void take_settings(RdtEmulator& box, std::string_view query) {
  if (const auto filter = number_in(query, "setuserfilter", 0, 12))
    box.set_user_filter(static_cast<unsigned>(*filter));
  int zeros = 0;
  for (const char* key : {"setbias0", "setbias1", "setbias2", "setbias3", "setbias4", "setbias5"})
    if (number_in(query, key, 0, 0)) ++zeros;
  if (zeros == 6) box.clear_bias();
}

}  // namespace

void NetftPageEmulator::receive(ByteView bytes, TimePoint now, ByteSink& out) {
  for (const std::uint8_t byte : bytes) waiting_.push_back(static_cast<char>(byte));
  while (!finished_) {
    // Hand-written clients end their lines with \n alone.
    constexpr std::string_view blank_line = "\r\n\r\n", bare_blank_line = "\n\n";
    const std::size_t end = waiting_.find(blank_line), bare = waiting_.find(bare_blank_line);
    const std::size_t first = std::min(end, bare);
    if (first == std::string::npos && waiting_.size() <= largest_head) return;
    const std::string reply = answer(waiting_.substr(0, first), now);
    const std::size_t blank = end < bare ? blank_line.size() : bare_blank_line.size();
    waiting_.erase(0, first == std::string::npos ? first : first + blank);
    out({reinterpret_cast<const std::uint8_t*>(reply.data()), reply.size()});
  }
}

std::string NetftPageEmulator::answer(const std::string& head, TimePoint now) {
  const auto request = rdt::decode_request_head(head);
  if (!request) {
    finished_ = true;
    return rdt::http_reply(400, html, "Not a GET request\n", false);
  }
  finished_ = !request->keep_alive;
  std::string reply = page(*request, now);
  if (request->head_only) reply.erase(reply.find("\r\n\r\n") + 4);
  return reply;
}

std::string NetftPageEmulator::page(const rdt::HttpRequest& request, TimePoint now) {
  RdtEmulator* box = box_();
  const bool keep = request.keep_alive;
  if (box == nullptr) return rdt::http_reply(404, html, "The box is off\n", keep);
  if (request.path == rdt::settings_path)
    return rdt::http_reply(200, xml, rdt::encode(box->settings(now)), keep);
  if (request.path == rdt::calibration_path)
    return rdt::http_reply(200, xml, rdt::encode(box->calibration(now)), keep);
  if (request.path == "/comm.cgi") {
    take_communication(*box, request.query);
    return rdt::http_reply(200, html, "Communication settings taken\n", keep);
  }
  if (request.path == "/setting.cgi") {
    take_settings(*box, request.query);
    return rdt::http_reply(200, html, "Settings taken\n", keep);
  }
  if (request.path == "/") return rdt::http_reply(200, html, "Net F/T (emulated by Weft)\n", keep);
  return rdt::http_reply(404, html, "No such page\n", keep);
}

}  // namespace weft::sim
