#include "sim/devices/rdt_emulator.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>

namespace weft::sim {
namespace {

namespace rdt = protocols::rdt;

constexpr std::size_t longest_name = 32, longest_user_field = 16;

/// Decodes "%20" and "+" of a query; characters that a page cannot hold become "?".
std::string plain(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned code = 0;
    const char* const digits = text.data() + i + 1;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2) {
      out += static_cast<char>(code);
      i += 2;
    } else {
      out += text[i] == '+' ? ' ' : text[i];
    }
  }
  const auto unprintable = [](char c) { return c < ' ' || c > '~'; };
  std::replace_if(out.begin(), out.end(), unprintable, '?');
  return out;
}

template <class Number>
std::from_chars_result read_number(const std::string& text, Number& value) {
  const char* const end = text.data() + text.size();
  if constexpr (std::is_integral_v<Number>)
    if (text.starts_with("0x"))  // output codes are shown like this on the page
      return std::from_chars(text.data() + 2, end, value, 16);
  return std::from_chars(text.data(), end, value);
}

/// A number of a query; nullopt when it is absent, invalid or outside the box's range.
template <class Number>
std::optional<Number> number_in(std::string_view query, const std::string& key, Number least,
                                Number most) {
  const auto given = rdt::query_value(query, key);
  if (!given) return std::nullopt;
  const std::string text = plain(*given);
  Number value = 0;
  const auto read = read_number(text, value);
  if (read.ec != std::errc{} || read.ptr != text.data() + text.size() ||
      !(value >= least && value <= most))
    return std::nullopt;
  return value;
}

/// A whole number that is a switch, code, count or index.
template <class Whole>
void take(Whole& value, std::string_view query, const std::string& key, std::int64_t least,
          std::int64_t most) {
  if (const auto given = number_in(query, key, least, most)) value = static_cast<Whole>(*given);
}

void take(std::string& text, std::string_view query, const std::string& key, std::size_t longest) {
  if (const auto given = rdt::query_value(query, key)) text = plain(*given).substr(0, longest);
}

/// /comm.cgi: comrdtrate, rounded up to the next rate of the box; comrdtbsiz, comrdte, comrdtmsyn,
/// comeipe. Here and below, a value outside the box's range keeps the old one.
void apply_communication(NetftSettings& settings, std::string_view query) {
  if (const auto rate_hz = number_in(query, "comrdtrate", 1.0, conversions_hz))
    settings.rate_hz = conversions_hz / std::floor(conversions_hz / *rate_hz);
  take(settings.records_per_datagram, query, "comrdtbsiz", 1, rdt::max_records_per_datagram);
  take(settings.rdt_enabled, query, "comrdte", 0, 1);
  take(settings.multi_unit, query, "comrdtmsyn", 0, 1);
  take(settings.ethernet_ip, query, "comeipe", 0, 1);
}

/// /setting.cgi: setuserfilter, setpke, setcfgsel, setbias0 to setbias5.
void apply_settings(NetftSettings& settings, std::string_view query) {
  take(settings.user_filter, query, "setuserfilter", 0, 12);
  take(settings.peak_logging, query, "setpke", 0, 1);
  take(settings.active, query, "setcfgsel", 0, rdt::configurations - 1);
  using Limits = std::numeric_limits<std::int32_t>;
  for (std::size_t i = 0; i < settings.bias_counts.size(); ++i)
    take(settings.bias_counts[i], query, "setbias" + std::to_string(i), Limits::min(),
         Limits::max());
}

/// /config.cgi: cfgnam, cfgcalsel, cfgfu, cfgtu, cfgtdu, cfgtau, cfgtfx0 to cfgtfx5, cfgusra,
/// cfgusrb, for the configuration cfgid; without cfgid nothing is set.
void apply_configuration(NetftSettings& settings, std::string_view query) {
  const auto id = number_in<std::size_t>(query, "cfgid", 0, rdt::configurations - 1);
  if (!id) return;
  rdt::Configuration& own = settings.configuration[*id];
  constexpr double longest = 1e4, widest = 360;
  take(own.name, query, "cfgnam", longest_name);
  take(own.calibration, query, "cfgcalsel", 0, rdt::configurations - 1);
  take(own.force_unit, query, "cfgfu", 1, 6);
  take(own.torque_unit, query, "cfgtu", 1, 6);
  take(own.distance_unit, query, "cfgtdu", 1, 5);
  take(own.angle_unit, query, "cfgtau", 1, 2);
  for (std::size_t i = 0; i < own.tool_transform.size(); ++i) {
    const double most = i < 3 ? longest : widest;
    if (const auto given = number_in(query, "cfgtfx" + std::to_string(i), -most, most))
      own.tool_transform[i] = *given;
  }
  take(own.user_a, query, "cfgusra", longest_user_field);
  take(own.user_b, query, "cfgusrb", longest_user_field);
}

/// /moncon.cgi: setmce, and mce, mcx, mcc, mcv, mco of each threshold.
void apply_thresholds(NetftSettings& settings, std::string_view query) {
  take(settings.thresholds_enabled, query, "setmce", 0, 1);
  using Limits = std::numeric_limits<std::int32_t>;
  for (std::size_t i = 0; i < settings.threshold.size(); ++i) {
    rdt::Threshold& own = settings.threshold[i];
    const std::string n = std::to_string(i);
    take(own.enabled, query, "mce" + n, 0, 1);
    take(own.axis, query, "mcx" + n, -1, 5);
    if (const auto sign = number_in(query, "mcc" + n, -1, 1); sign && *sign != 0)
      own.comparison = *sign;
    take(own.counts, query, "mcv" + n, Limits::min(), Limits::max());
    take(own.output_code, query, "mco" + n, 0, 255);
  }
}

constexpr std::size_t largest_head = 8192;
constexpr std::string_view xml = "text/xml", html = "text/html";

using Taker = void (*)(NetftSettings&, std::string_view query);

/// Pages with settings: "/comm.cgi" redirects to "/comm.htm". Clients require the status 302 of a
/// box; the targets have no source except comm.htm [E].
constexpr std::string_view setter = ".cgi", shown = ".htm";
constexpr std::array takers = {std::pair{std::string_view("/comm"), Taker{apply_communication}},
                               std::pair{std::string_view("/setting"), Taker{apply_settings}},
                               std::pair{std::string_view("/config"), Taker{apply_configuration}},
                               std::pair{std::string_view("/moncon"), Taker{apply_thresholds}}};
constexpr std::string_view snapshot = "/rundata";

/// "/comm.htm" for "/comm.cgi"; nullopt if the box has no such form.
std::optional<std::string> find_page(std::string_view path, std::string_view ending) {
  if (!path.ends_with(ending)) return std::nullopt;
  const std::string_view name = path.substr(0, path.size() - ending.size());
  const bool known =
      name == snapshot ||
      std::any_of(takers.begin(), takers.end(), [&](const auto& t) { return t.first == name; });
  return known ? std::optional(std::string(name) + std::string(shown)) : std::nullopt;
}

/// The configuration in "index=3".
std::optional<std::size_t> configuration_in(std::string_view query) {
  const auto text = rdt::query_value(query, "index");
  std::size_t index = 0;
  if (!text || std::from_chars(text->data(), text->data() + text->size(), index).ec != std::errc{})
    return std::nullopt;
  return index < rdt::configurations ? std::optional(index) : std::nullopt;
}

struct Answerer {
  RdtEmulator* box;
  TimePoint now;
  Bytes* out;

  void operator()(const rdt::ReadFt& read) const { append(*out, box->read_ft(read, now)); }
  void operator()(const rdt::ReadCalibration&) const { append(*out, box->calibration_reply(now)); }
  void operator()(const rdt::WriteTransform& write) const {
    reply(rdt::TcpCommand::write_transform, box->set_transform(write));
  }
  void operator()(const rdt::WriteCondition& write) const {
    reply(rdt::TcpCommand::write_condition, box->set_condition(write));
  }
  void reply(rdt::TcpCommand command, const Status& taken) const {
    constexpr std::uint8_t no_error = 0, refused = 1;
    append(*out, rdt::WriteReply{command, taken ? no_error : refused});
  }
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
