#include "sim/devices/netft_page_emulator.hpp"

#include <charconv>

namespace weft::sim {

namespace {

namespace rdt = protocols::rdt;

constexpr std::size_t largest_head = 8192;
constexpr std::string_view xml = "text/xml", html = "text/html";

/// comrdtrate of a query; nothing when it is absent or not a rate of the box.
std::optional<double> rate_in(const std::string& query) {
  constexpr std::string_view key = "comrdtrate=";
  const std::size_t at = query.find(key);
  if (at == std::string::npos) return std::nullopt;
  double rate_hz = 0;
  std::from_chars(query.data() + at + key.size(), query.data() + query.size(), rate_hz);
  if (rate_hz < 1 || rate_hz > 7000) return std::nullopt;
  return rate_hz;
}

}  // namespace

void NetftPageEmulator::receive(ByteView bytes, TimePoint now, ByteSink& out) {
  for (const std::uint8_t byte : bytes) waiting_.push_back(static_cast<char>(byte));
  constexpr std::string_view blank_line = "\r\n\r\n";
  while (!finished_) {
    const std::size_t end = waiting_.find(blank_line);
    if (end == std::string::npos && waiting_.size() <= largest_head) return;
    const std::string reply = answer(waiting_.substr(0, end), now);
    waiting_.erase(0, end == std::string::npos ? end : end + blank_line.size());
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
  return page(*request, now);
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
    if (const auto rate_hz = rate_in(request.query)) box->set_rate_hz(*rate_hz);
    return rdt::http_reply(200, html, "Communication settings taken\n", keep);
  }
  if (request.path == "/setting.cgi") return rdt::http_reply(200, html, "Settings taken\n", keep);
  if (request.path == "/") return rdt::http_reply(200, html, "Net F/T (emulated by Weft)\n", keep);
  return rdt::http_reply(404, html, "No such page\n", keep);
}

}  // namespace weft::sim
