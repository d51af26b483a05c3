#include "daemon/service/transport/http_file.hpp"

#include <algorithm>
#include <charconv>

#include "daemon/service/transport/http_answer.hpp"
#include "daemon/service/web/web_files.hpp"

namespace weft::daemon::server {
namespace {

std::optional<std::uint64_t> number_of(std::string_view text) {
  std::uint64_t number = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool whole = read.ec == std::errc() && read.ptr == text.data() + text.size();
  return whole ? std::optional(number) : std::nullopt;
}

// A page of ours in somebody's browser must not become a page of the daemon's: it is a download.
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

// Scripts, styles and answers come from here and nowhere else; nothing that is written into the
// page runs; no other page has it in a frame.
constexpr std::string_view guards =
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; "
    "img-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n";

}  // namespace

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
  const auto first = number_of(left), last = number_of(right);
  if (left.empty()) {  // the last so many
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
    return {other_content_text(file.sha256), {}};
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
