#include "daemon/service/transport/http_answer.hpp"

#include <charconv>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/service/transport/http_file.hpp"
#include "daemon/service/web/web_files.hpp"

namespace weft::daemon::server {
namespace {

using nlohmann::json;

constexpr std::string_view come_back = "Retry-After: 1\r\n";

std::string_view reason_of(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 206:
      return "Partial Content";
    case 304:
      return "Not Modified";
    case 409:
      return "Conflict";
    case 412:
      return "Precondition Failed";
    case 416:
      return "Range Not Satisfiable";
    case 204:
      return "No Content";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 408:
      return "Request Timeout";
    case 411:
      return "Length Required";
    case 413:
      return "Content Too Large";
    case 415:
      return "Unsupported Media Type";
    case 431:
      return "Request Header Fields Too Large";
    case 503:
      return "Service Unavailable";
    case 504:
      return "Gateway Timeout";
    default:
      return "Refused";
  }
}

std::string dumped(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
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

/// What is no number stays text, which the method refuses.
json number_or_text(const std::string& text) {
  double number = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool whole = read.ec == std::errc() && read.ptr == text.data() + text.size();
  return whole ? json(number) : json(text);
}

/// Of "name:port" and "[address of IPv6]:port".
std::string_view name_in(std::string_view host) {
  if (!host.starts_with('[')) return host.substr(0, host.find(':'));
  const std::size_t end = host.find(']');
  const bool ends_well =
      end != std::string_view::npos && (end + 1 == host.size() || host[end + 1] == ':');
  return ends_well ? host.substr(1, end - 1) : std::string_view();
}

/// A page of elsewhere whose name was made to mean our address has its own name as Host.
bool meant_for(std::string_view address, const HttpRequest& request) {
  const std::string_view name = name_in(request.header("Host"));
  return name == address || name == "127.0.0.1" || name == "localhost";
}

}  // namespace

std::string status_line(int status) {
  return "HTTP/1.1 " + std::to_string(status) + " " + std::string(reason_of(status)) + "\r\n";
}

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

std::string refusal_text(int status) {
  constexpr RequestBounds bounds;
  switch (status) {
    case 408:
      return refused(408, "request.slow",
                     {.code = Errc::timeout, .what = "the request did not come in time"});
    case 411:
      return refused(411, "request.length",
                     {.code = Errc::unsupported,
                      .where = "Content-Length",
                      .what = "the request's length is not known",
                      .expected = "a number of bytes",
                      .hint = "Chunked requests are not taken"});
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
                      .what = "head too long",
                      .expected = bytes(bounds.head_bytes)});
    default:
      return refused(400, "request.http",
                     {.code = Errc::parse, .what = "not a request of HTTP/1.1"});
  }
}

std::optional<std::string> refusal_of_head(const HttpRequest& request, std::string_view address) {
  const auto text = [&](std::string_view name) { return std::string(request.header(name)); };
  if (!address.empty() && !meant_for(address, request))
    return refused(403, "access.host",
                   {.code = Errc::wrong_state,
                    .where = "Host",
                    .what = "this daemon has no such name",
                    .expected = "localhost or " + std::string(address),
                    .got = text("Host")});
  const bool rpc = request.path() == "/rpc", data = request.path().starts_with(data_path);
  const bool page = web::find_web_file(request.path()) != nullptr;
  if (!rpc && !data && !page && request.path() != "/events")
    return refused(404, "request.path",
                   {.code = Errc::not_found,
                    .what = "nothing there",
                    .expected = "/, /rpc, /events or /data/..."});
  const std::string_view method = rpc ? "POST" : "GET";
  if (request.method() != method && !(page && request.method() == "HEAD"))
    return refused(
        405, "request.method",
        {.code = Errc::invalid_argument, .what = "another method", .expected = std::string(method)},
        rpc ? "Allow: POST\r\n" : "Allow: GET\r\n");
  // Other pages' forms can send text, but not this type.
  if (rpc && !request.header("Content-Type").starts_with("application/json"))
    return refused(415, "request.type",
                   {.code = Errc::invalid_argument,
                    .where = "Content-Type",
                    .what = "another content type",
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

std::string other_content_text(const std::string& sha256) {
  return refused(412, "data.other",
                 {.code = Errc::wrong_state,
                  .where = "sha256",
                  .what = "the file has another content",
                  .got = sha256});
}

std::string daemon_stops_text() {
  return refused(503, "daemon.stops", {.code = Errc::wrong_state, .what = "the daemon stops"},
                 come_back);
}

std::string no_answer_text(std::int64_t timeout_s) {
  return refused(504, "request.no_answer",
                 {.code = Errc::timeout,
                  .what = "no answer in time",
                  .expected = std::to_string(timeout_s) + " s"});
}

std::string open_line(const HttpRequest& request) {
  constexpr std::string_view scheme = "Bearer ";
  const std::string_view credentials = request.header("Authorization");
  const std::string_view token =
      credentials.starts_with(scheme) ? credentials.substr(scheme.size()) : std::string_view();
  return dumped({{"jsonrpc", "2.0"},
                 {"id", "open"},
                 {"method", "session.open"},
                 {"params", {{"client", "http"}, {"token", token}}}});
}

std::optional<std::int64_t> seen_last(const HttpRequest& request, std::string_view epoch) {
  std::string_view last = request.header("Last-Event-ID");
  if (request.parameter("mode") != "every") return std::nullopt;
  if (!last.starts_with(epoch) || !last.substr(epoch.size()).starts_with('-')) return std::nullopt;
  last.remove_prefix(epoch.size() + 1);
  std::int64_t seq = 0;
  const auto read = std::from_chars(last.data(), last.data() + last.size(), seq);
  if (read.ec != std::errc() || read.ptr != last.data() + last.size() || seq < 0)
    return std::nullopt;
  return seq;
}

std::string subscribe_line(const HttpRequest& request, std::optional<std::int64_t> from_seq) {
  json params{{"topics", parse_topics(request)},
              {"mode", request.parameter("mode").value_or("latest")}};
  if (const auto rate = request.parameter("max_hz")) params["max_hz"] = number_or_text(*rate);
  if (from_seq) params["from_seq"] = *from_seq;
  return dumped(
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

bool is_error(std::string_view line) {
  const json answer = json::parse(line, nullptr, false);
  return !answer.is_object() || answer.contains("error");
}

}  // namespace weft::daemon::server
