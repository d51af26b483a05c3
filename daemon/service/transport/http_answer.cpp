#include "daemon/service/transport/http_answer.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "daemon/service/web/web_files.hpp"

namespace weft::daemon::server {
namespace {

using nlohmann::json;

constexpr std::string_view come_back = "Retry-After: 1\r\n";

constexpr std::array<std::pair<int, std::string_view>, 20> reasons{{
    {200, "OK"},
    {204, "No Content"},
    {206, "Partial Content"},
    {304, "Not Modified"},
    {400, "Bad Request"},
    {401, "Unauthorized"},
    {403, "Forbidden"},
    {404, "Not Found"},
    {405, "Method Not Allowed"},
    {408, "Request Timeout"},
    {409, "Conflict"},
    {411, "Length Required"},
    {412, "Precondition Failed"},
    {413, "Content Too Large"},
    {415, "Unsupported Media Type"},
    {416, "Range Not Satisfiable"},
    {429, "Too Many Requests"},
    {431, "Request Header Fields Too Large"},
    {503, "Service Unavailable"},
    {504, "Gateway Timeout"},
}};

/// "HTTP/1.1 200 OK" with its line end.
std::string status_line(int status) {
  const auto* const row =
      std::ranges::find(reasons, status, &std::pair<int, std::string_view>::first);
  const std::string_view reason = row == reasons.end() ? "Refused" : row->second;
  return "HTTP/1.1 " + std::to_string(status) + " " + std::string(reason) + "\r\n";
}

/// Empty if the text is not exactly one number.
template <class Number>
std::optional<Number> number_of(std::string_view text) {
  Number number = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool whole = read.ec == std::errc() && read.ptr == text.data() + text.size();
  return whole ? std::optional(number) : std::nullopt;
}

std::string refused(int status, std::string_view kind, Error error, std::string_view more = {}) {
  return answer_text(
      status, rpc::error_line("null", rpc::rpc_error(rpc::code::access, kind, std::move(error))),
      more);
}

std::string bytes(std::size_t count) {
  return std::to_string(count) + " bytes";
}

std::vector<std::string> parse_topics(const HttpRequest& request) {
  const auto requested = request.parameter("topics");
  if (!requested) return {"run:*", "rig", "lease:*"};
  std::vector<std::string> out;
  std::istringstream text(*requested);
  for (std::string topic; std::getline(text, topic, ',');) out.push_back(topic);
  return out;
}

/// Host name in "name:port" and "[IPv6 address]:port".
std::string_view name_in(std::string_view host) {
  if (!host.starts_with('[')) return host.substr(0, host.find(':'));
  const std::size_t end = host.find(']');
  const bool ends_well =
      end != std::string_view::npos && (end + 1 == host.size() || host[end + 1] == ':');
  return ends_well ? host.substr(1, end - 1) : std::string_view();
}

/// Against DNS rebinding: a foreign page with a name that resolves to our address sends that name
/// as Host.
bool meant_for(std::string_view address, const HttpRequest& request) {
  const std::string_view name = name_in(request.header("Host"));
  return name == address || name == "127.0.0.1" || name == "localhost";
}

// A recorded file must not open in a browser as a page of the daemon, so it is a download.
std::string format_head(int status, const std::string& tag, std::uint64_t length,
                        const std::string& more = {}) {
  return status_line(status) +
         "Content-Type: application/octet-stream\r\nContent-Disposition: attachment\r\n"
         "X-Content-Type-Options: nosniff\r\nAccept-Ranges: bytes\r\nETag: " +
         tag + "\r\n" +
         (status == 304 ? std::string() : "Content-Length: " + std::to_string(length) + "\r\n") +
         more + "Cache-Control: no-cache\r\nConnection: close\r\n\r\n";
}

std::string bytes_of(const std::string& part, std::uint64_t all) {
  return "Content-Range: bytes " + part + "/" + std::to_string(all) + "\r\n";
}

// Scripts, styles and answers come only from this server, inline scripts do not run, and no other
// page can frame this one.
constexpr std::string_view guards =
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n";

}  // namespace

std::string answer_text(int status, std::string_view line, std::string_view more_headers) {
  std::string out = status_line(status);
  if (!line.empty()) out += "Content-Type: application/json\r\n";
  if (status != 204)
    out += "Content-Length: " + std::to_string(line.empty() ? 0 : line.size() + 1) + "\r\n";
  if (status == 401) out += "WWW-Authenticate: Bearer\r\n";
  out += more_headers;
  out += "Cache-Control: no-store\r\nConnection: close\r\n\r\n";
  out += line;
  if (!line.empty()) out += "\n";
  return out;
}

std::string metrics_answer(const HttpRequest& request, const Shared& shared) {
  constexpr std::string_view open_type = "application/openmetrics-text";
  const bool is_open = request.header("Accept").find(open_type) != std::string_view::npos;
  const std::string body = shared.metrics_text(is_open);
  return status_line(200) + "Content-Type: " +
         (is_open ? std::string(open_type) + "; version=1.0.0" : "text/plain; version=0.0.4") +
         "; charset=utf-8\r\nContent-Length: " + std::to_string(body.size()) +
         "\r\nX-Content-Type-Options: nosniff\r\nCache-Control: no-store\r\n"
         "Connection: close\r\n\r\n" +
         body;
}

std::string refusal_text(int status) {
  constexpr RequestBounds bounds;
  switch (status) {
    case 408:
      return refused(408, "request.slow",
                     {.code = Errc::timeout, .what = "request not received in time"});
    case 411:
      return refused(411, "request.length",
                     {.code = Errc::unsupported,
                      .where = "Content-Length",
                      .what = "request length missing",
                      .expected = "a number of bytes",
                      .hint = "Send Content-Length; chunked requests are not supported"});
    case 413:
      return refused(413, "request.too_long",
                     {.code = Errc::range,
                      .where = "body",
                      .what = "request too long",
                      .expected = bytes(bounds.body_bytes)});
    case 431:
      return refused(431, "request.too_long",
                     {.code = Errc::range,
                      .where = "headers",
                      .what = "request head too long",
                      .expected = bytes(bounds.head_bytes)});
    default:
      return refused(400, "request.http", {.code = Errc::parse, .what = "not an HTTP/1.1 request"});
  }
}

std::optional<std::string> refusal_of_head(const HttpRequest& request, std::string_view address) {
  const auto text = [&](std::string_view name) { return std::string(request.header(name)); };
  if (!address.empty() && !meant_for(address, request))
    return refused(403, "access.host",
                   {.code = Errc::wrong_state,
                    .where = "Host",
                    .what = "host name not accepted",
                    .expected = "localhost or " + std::string(address),
                    .got = text("Host")});
  const bool rpc = request.path() == "/rpc", data = request.path().starts_with(data_path);
  const bool page = web::find_web_file(request.path()) != nullptr;
  const bool other = request.path() == "/events" || request.path() == metrics_path;
  if (!rpc && !data && !page && !other)
    return refused(404, "request.path",
                   {.code = Errc::not_found,
                    .what = "unknown path",
                    .expected = "/, /rpc, /events, /metrics or /data/..."});
  const std::string_view method = rpc ? "POST" : "GET";
  if (request.method() != method && !(page && request.method() == "HEAD"))
    return refused(405, "request.method",
                   {.code = Errc::invalid_argument,
                    .what = "wrong HTTP method",
                    .expected = std::string(method)},
                   rpc ? "Allow: POST\r\n" : "Allow: GET\r\n");
  // Forms of other pages can send text, but not this type.
  if (rpc && !request.header("Content-Type").starts_with("application/json"))
    return refused(415, "request.type",
                   {.code = Errc::invalid_argument,
                    .where = "Content-Type",
                    .what = "wrong content type",
                    .expected = "application/json",
                    .got = text("Content-Type")});
  return std::nullopt;
}

std::string too_many_text(std::string_view what, std::size_t at_most, std::string_view hint) {
  return refused(503, "request.too_many",
                 {.code = Errc::wrong_state,
                  .what = "too many " + std::string(what),
                  .expected = "at most " + std::to_string(at_most),
                  .hint = std::string(hint)},
                 come_back);
}

std::string no_file_text(const Error& error, bool wants_known_content) {
  if (error.code == Errc::timeout) return refused(503, "data.busy", error, come_back);
  const bool absent = error.code == Errc::not_found;
  if (absent) return refused(404, "data.not_found", error);
  return refused(wants_known_content ? 412 : 409, "data.altered", error);
}

std::string daemon_stops_text() {
  return refused(503, "daemon.stops",
                 {.code = Errc::wrong_state, .what = "daemon is shutting down"}, come_back);
}

std::string no_answer_text(std::int64_t timeout_s) {
  return refused(504, "request.no_answer",
                 {.code = Errc::timeout,
                  .what = "no answer in time",
                  .expected = "within " + std::to_string(timeout_s) + " s"});
}

std::string open_line(const HttpRequest& request) {
  constexpr std::string_view scheme = "Bearer ";
  const std::string_view credentials = request.header("Authorization");
  const std::string_view token =
      credentials.starts_with(scheme) ? credentials.substr(scheme.size()) : std::string_view();
  return rpc::format_text({{"jsonrpc", "2.0"},
                           {"id", "open"},
                           {"method", "session.open"},
                           {"params", {{"client", "http"}, {"token", token}}}});
}

std::optional<std::int64_t> seen_last(const HttpRequest& request, std::string_view epoch) {
  std::string_view last = request.header("Last-Event-ID");
  if (request.parameter("mode") != "every") return std::nullopt;
  if (!last.starts_with(epoch) || !last.substr(epoch.size()).starts_with('-')) return std::nullopt;
  last.remove_prefix(epoch.size() + 1);
  const auto seq = number_of<std::int64_t>(last);
  return seq && *seq >= 0 ? seq : std::nullopt;
}

std::string subscribe_line(const HttpRequest& request, std::optional<std::int64_t> from_seq) {
  json params{{"topics", parse_topics(request)},
              {"mode", request.parameter("mode").value_or("latest")}};
  if (const auto rate = request.parameter("max_hz")) {
    const auto number = number_of<double>(*rate);
    // An invalid number stays text, which the method refuses.
    params["max_hz"] = number ? json(*number) : json(*rate);
  }
  if (from_seq) params["from_seq"] = *from_seq;
  return rpc::format_text(
      {{"jsonrpc", "2.0"}, {"id", "sub"}, {"method", "sub.open"}, {"params", std::move(params)}});
}

std::string stream_head() {
  return "HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\n"
         "Cache-Control: no-store\r\nConnection: close\r\n\r\n";
}

std::string event_text(std::string_view line, std::string_view epoch,
                       std::optional<std::int64_t> from_seq) {
  const json message = json::parse(line, nullptr, false);
  if (!message.is_object()) return {};
  const bool snapshot = message.contains("result");
  const json& body = message.at(snapshot ? "result" : "params");
  const std::string seq = from_seq ? std::to_string(*from_seq) : body.at("seq").dump();
  return "id: " + std::string(epoch) + "-" + seq + "\nevent: " + (snapshot ? "snapshot" : "event") +
         "\ndata: " + body.dump() + "\n\n";
}

std::string error_event_text(const rpc::RpcError& why) {
  return "event: error\ndata: " + rpc::to_json(why) + "\n\n";
}

std::string no_session_text(std::string_view line) {
  const json answer = json::parse(line, nullptr, false);
  const bool is_limited = answer.value("/error/data/kind"_json_pointer, "") == "access.limited";
  return is_limited ? answer_text(429, line, "Retry-After: 10\r\n") : answer_text(401, line);
}

bool is_error(std::string_view line) {
  const json answer = json::parse(line, nullptr, false);
  return !answer.is_object() || answer.contains("error");
}

bool names_tag(std::string_view header, std::string_view tag) {
  if (header == "*") return true;
  for (std::string_view rest = header; !rest.empty();) {
    const std::size_t comma = rest.find(',');
    std::string_view one = rest.substr(0, comma);
    rest.remove_prefix(comma == std::string_view::npos ? rest.size() : comma + 1);
    while (one.starts_with(' ')) one.remove_prefix(1);
    while (one.ends_with(' ')) one.remove_suffix(1);
    if (one.starts_with("W/")) one.remove_prefix(2);
    if (one == tag) return true;
  }
  return false;
}

std::optional<ByteRange> parse_range(std::string_view header, std::uint64_t bytes) {
  const ByteRange whole{0, bytes};
  constexpr std::string_view unit = "bytes=";
  if (!header.starts_with(unit) || header.find(',') != std::string_view::npos) return whole;
  header.remove_prefix(unit.size());
  const std::size_t dash = header.find('-');
  if (dash == std::string_view::npos) return whole;
  const std::string_view left = header.substr(0, dash), right = header.substr(dash + 1);
  const auto first = number_of<std::uint64_t>(left), last = number_of<std::uint64_t>(right);
  if (left.empty()) {  // a suffix range
    if (!last) return whole;
    if (*last == 0 || bytes == 0) return std::nullopt;
    return ByteRange{bytes - std::min(*last, bytes), bytes};
  }
  if (!first || (!right.empty() && !last) || (last && *last < *first)) return whole;
  if (*first >= bytes) return std::nullopt;
  return ByteRange{*first, last ? std::min(*last, bytes - 1) + 1 : bytes};
}

bool wants_known_content(const HttpRequest& request) {
  return request.parameter("sha256").has_value() || !request.header("If-Match").empty();
}

FileAnswer file_answer(const HttpRequest& request, const ServedFile& file) {
  const std::string tag = "\"" + file.sha256 + "\"";
  const auto requested = request.parameter("sha256");
  const std::string_view only = request.header("If-Match");
  if ((requested && *requested != file.sha256) || (!only.empty() && !names_tag(only, tag)))
    return {refused(412, "data.other",
                    {.code = Errc::wrong_state,
                     .where = "sha256",
                     .what = "file content has changed",
                     .got = file.sha256}),
            {}};
  if (const auto known = request.header("If-None-Match"); names_tag(known, tag))
    return {format_head(304, tag, 0), {}};
  const std::string_view same = request.header("If-Range");
  const std::string_view wanted =
      same.empty() || same == tag ? request.header("Range") : std::string_view();
  const auto range = parse_range(wanted, file.as_of.bytes);
  if (!range) return {format_head(416, tag, 0, bytes_of("*", file.as_of.bytes)), {}};
  const bool part = *range != ByteRange{0, file.as_of.bytes};
  const std::string place = std::to_string(range->first) + "-" +
                            std::to_string(std::max<std::uint64_t>(range->end, 1) - 1);
  return {format_head(part ? 206 : 200, tag, range->end - range->first,
                      part ? bytes_of(place, file.as_of.bytes) : std::string()),
          *range};
}

std::optional<std::string> page_answer(const HttpRequest& request) {
  const web::WebFile* const file = web::find_web_file(request.path());
  if (file == nullptr) return std::nullopt;
  const std::string tag = "\"" + std::string(file->sha256) + "\"";
  const bool known = names_tag(request.header("If-None-Match"), tag);
  std::string out = status_line(known ? 304 : 200);
  out += "ETag: " + tag + "\r\n";
  if (!known)
    out += "Content-Type: " + std::string(file->type) +
           "\r\nContent-Length: " + std::to_string(file->bytes.size()) + "\r\n";
  out += guards;
  out += "Cache-Control: no-cache\r\nConnection: close\r\n\r\n";
  if (!known && request.method() == "GET") out += file->bytes;
  return out;
}

}  // namespace weft::daemon::server
