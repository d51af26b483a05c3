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

/// The pages that set something: "/comm.cgi" sends on to "/comm.htm". That a box answers 302 is
/// what its clients demand; where it sends to is not sourced but for comm.htm [E].
constexpr std::string_view setter = ".cgi", shown = ".htm";
constexpr std::array takers = {std::pair{std::string_view("/comm"), Taker{apply_communication}},
                               std::pair{std::string_view("/setting"), Taker{apply_settings}},
                               std::pair{std::string_view("/config"), Taker{apply_configuration}},
                               std::pair{std::string_view("/moncon"), Taker{apply_thresholds}}};
constexpr std::string_view snapshot = "/rundata";

/// "/comm.htm" of "/comm.cgi"; nothing where no form of the box lies there.
std::optional<std::string> find_page(std::string_view path, std::string_view ending) {
  if (!path.ends_with(ending)) return std::nullopt;
  const std::string_view name = path.substr(0, path.size() - ending.size());
  const bool known =
      name == snapshot ||
      std::any_of(takers.begin(), takers.end(), [&](const auto& t) { return t.first == name; });
  return known ? std::optional(std::string(name) + std::string(shown)) : std::nullopt;
}

/// Of "index=3".
std::optional<std::size_t> configuration_in(std::string_view query) {
  const auto text = rdt::query_value(query, "index");
  std::size_t index = 0;
  if (!text || std::from_chars(text->data(), text->data() + text->size(), index).ec != std::errc{})
    return std::nullopt;
  return index < rdt::configurations ? std::optional(index) : std::nullopt;
}

namespace rdt = protocols::rdt;

struct Answerer {
  RdtEmulator* box;
  TimePoint now;
  Bytes* out;

  void operator()(const rdt::ReadFt& read) const { append(*out, box->read_ft(read, now)); }
  void operator()(const rdt::ReadCalibration&) const { append(*out, box->calibration_reply(now)); }
  void operator()(const rdt::WriteTransform& write) const {
    const bool taken = box->set_transform(write).has_value();
    append(*out, rdt::WriteReply{rdt::TcpCommand::write_transform, taken ? no_error : refused});
  }
  void operator()(const rdt::WriteCondition& write) const {
    const bool taken = box->set_condition(write).has_value();
    append(*out, rdt::WriteReply{rdt::TcpCommand::write_condition, taken ? no_error : refused});
  }

  static constexpr std::uint8_t no_error = 0, refused = 1;
};

}  // namespace

void NetftPageEmulator::receive(ByteView bytes, TimePoint now, ByteSink& out) {
  for (const std::uint8_t byte : bytes)
    if (!waiting_.empty() || byte > ' ') waiting_.push_back(static_cast<char>(byte));
  // Hand-written clients end their lines with \n alone.
  const std::size_t blank = std::min(waiting_.find("\r\n\r\n"), waiting_.find("\n\n"));
  if (blank == std::string::npos && waiting_.size() <= largest_head) return;
  const std::string reply = answer(waiting_.substr(0, blank), now);
  waiting_.clear();
  finished_ = true;
  out({reinterpret_cast<const std::uint8_t*>(reply.data()), reply.size()});
}

std::string NetftPageEmulator::answer(const std::string& head, TimePoint now) {
  const auto request = rdt::decode_request_head(head);
  if (!request) return rdt::http_reply(400, html, "Not a GET request\n");
  std::string reply = page(*request, now);
  if (request->head_only) reply.erase(reply.find("\r\n\r\n") + 4);
  return reply;
}

std::string NetftPageEmulator::page(const rdt::HttpRequest& request, TimePoint now) {
  RdtEmulator* box = box_();
  if (box == nullptr) return rdt::http_reply(404, html, "The box is off\n");
  if (request.path == rdt::settings_path)
    return rdt::http_reply(200, xml, rdt::encode(box->page(now, configuration_in(request.query))));
  if (request.path == rdt::calibration_path)
    return rdt::http_reply(200, xml, rdt::encode(box->calibration(now)));
  if (const auto sent_on = find_page(request.path, setter)) {
    take(*box, request, now);
    return rdt::http_reply(302, html, "Taken\n", *sent_on);
  }
  if (request.path == "/" || find_page(request.path, shown))
    return rdt::http_reply(200, html, "Net F/T (emulated by Weft)\n");
  return rdt::http_reply(404, html, "No such page\n");
}

void NetftPageEmulator::take(RdtEmulator& box, const rdt::HttpRequest& request, TimePoint now) {
  NetftSettings changed = box.settings();
  for (const auto& [name, take] : takers)
    if (request.path.starts_with(name)) take(changed, request.query);
  if (request.path.starts_with(snapshot)) {
    const auto command = rdt::query_value(request.query, "cmd");
    if (command == "bias" || command == "setuserbias") return box.bias(now);
    if (command == "clearuserbias") changed.bias_counts = {};
  }
  box.take(changed);
}

void NetftCommandEmulator::receive(ByteView bytes, TimePoint now, ByteSink& out) {
  waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
  std::size_t at = 0;
  for (; waiting_.size() - at >= rdt::command_size; at += rdt::command_size)
    answer(ByteView(waiting_).subspan(at, rdt::command_size), now, out);
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(at));
}

void NetftCommandEmulator::answer(ByteView bytes, TimePoint now, ByteSink& out) {
  RdtEmulator* box = box_();
  const auto request = rdt::decode_command(bytes);
  if (box == nullptr || !request) return;
  Bytes reply;
  std::visit(Answerer{box, now, &reply}, *request);
  out(reply);
}

}  // namespace weft::sim
