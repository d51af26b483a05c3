#include "sim/devices/netft_page_emulator.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

namespace weft::sim {

namespace {

namespace rdt = protocols::rdt;

constexpr std::size_t largest_head = 8192;
constexpr std::string_view xml = "text/xml", html = "text/html";

using Taker = void (*)(NetftSettings&, std::string_view query);

/// The pages that set something.
constexpr std::array takers = {
    std::pair{std::string_view("/comm.cgi"), Taker{take_communication}},
    std::pair{std::string_view("/setting.cgi"), Taker{take_settings}},
    std::pair{std::string_view("/config.cgi"), Taker{take_configuration}},
    std::pair{std::string_view("/moncon.cgi"), Taker{take_thresholds}}};

/// Of "index=3".
std::optional<std::size_t> configuration_in(std::string_view query) {
  const auto text = rdt::query_value(query, "index");
  std::size_t index = 0;
  if (!text || std::from_chars(text->data(), text->data() + text->size(), index).ec != std::errc{})
    return std::nullopt;
  return index < rdt::configurations ? std::optional(index) : std::nullopt;
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
    return rdt::http_reply(200, xml, rdt::encode(box->page(now, configuration_in(request.query))),
                           keep);
  if (request.path == rdt::calibration_path)
    return rdt::http_reply(200, xml, rdt::encode(box->calibration(now)), keep);
  for (const auto& [path, take] : takers) {
    if (request.path != path) continue;
    NetftSettings changed = box->settings();
    take(changed, request.query);
    box->take(changed);
    return rdt::http_reply(200, html, "Settings taken\n", keep);
  }
  if (request.path == "/") return rdt::http_reply(200, html, "Net F/T (emulated by Weft)\n", keep);
  return rdt::http_reply(404, html, "No such page\n", keep);
}

}  // namespace weft::sim
